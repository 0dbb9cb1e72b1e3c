"""What a query string asks of the past: what it says, and nothing that nobody said."""

from collections.abc import Callable
from functools import partial
from typing import Any

import pytest

from lupin_bridge.past import query
from lupin_bridge.past.query import PeriodQuery
from lupin_twin.core.drops import MAX_TEXT_LENGTH
from lupin_twin.core.past import DEFAULT_POINTS, PastRefused, SeriesRequest

NS = 10**9
NOW_NS = 1_000 * NS
Parse = Callable[[list[tuple[str, str]], int | None], Any]
TIMELINE = partial(query.period, query.OfTimeline)
EXPORT = partial(query.period, query.OfExport)
NEEDED: dict[Parse, dict[str, str]] = {query.history: {"tag_id": "7", "sensor_type": "co2"}}


def ask(parse: Parse, **given: str) -> Any:
    values = NEEDED.get(parse, {}) | {name.rstrip("_"): value for name, value in given.items()}
    return parse(list(values.items()), NOW_NS)


def test_what_is_left_out_is_all_that_is_kept() -> None:
    assert query.at([], NOW_NS) is None
    assert ask(query.history) == SeriesRequest("7", "co2", 0, 0, DEFAULT_POINTS)
    assert ask(TIMELINE) == PeriodQuery(0, 0)
    assert ask(EXPORT) == PeriodQuery(0, 0)


@pytest.mark.parametrize(("to", "what"), [(None, "missing"), ("100", r"100\.000000000 s")])
def test_before_the_time_is_known_the_end_of_a_report_is_refused(to: str | None, what: str) -> None:
    with pytest.raises(PastRefused, match=f"^to is {what}, and what time it is now is not known"):
        query.report(query.OfReport(to=to), None)


def test_a_report_of_the_first_hours_begins_at_0() -> None:
    assert query.report(query.OfReport(), NOW_NS) == (0, NOW_NS)


def test_what_is_given_is_what_is_asked() -> None:
    period = {"from_": "1.5", "to": "1970-01-01T00:00:09Z"}
    start_ns, end_ns = 3 * NS // 2, 9 * NS
    assert query.at([("at", "8.000000001")], NOW_NS) == 8 * NS + 1
    assert ask(query.history, **period, points="7") == SeriesRequest(
        "7", "co2", start_ns, end_ns, 7
    )
    assert ask(TIMELINE, **period, points="5000", tag_id="a/b") == PeriodQuery(
        start_ns, end_ns, 5000, "a/b"
    )
    assert ask(EXPORT, **period, tag_id="7", sensor_type="co2") == PeriodQuery(
        start_ns, end_ns, tag_id="7", sensor_type="co2"
    )


# --- moments and periods --------------------------------------------------------------------------


def test_now_can_be_asked_for_and_what_has_not_come_is_refused() -> None:
    assert query.at([("at", "1000")], NOW_NS) == NOW_NS
    assert ask(query.history, from_="1000").start_ns == NOW_NS
    later = "1000.000000001"
    with pytest.raises(PastRefused) as refused:
        query.at([("at", later)], NOW_NS)
    assert str(refused.value) == f"at is {later} s, later than now, 1000.000000000 s"
    with pytest.raises(PastRefused, match=r"^from is 1000\.000000001 s, later than now"):
        ask(query.history, from_=later)


def test_where_nobody_knows_when_now_is_nothing_is_later() -> None:
    assert query.at([("at", "2000000000")], None) == 2 * 10**9 * NS


def test_a_period_may_end_after_now_and_be_empty_but_not_be_inverted() -> None:
    assert ask(EXPORT, from_="2000", to="2001").start_ns == 2_000 * NS
    assert ask(EXPORT, from_="5", to="5").end_ns == 5 * NS
    with pytest.raises(PastRefused, match=r"^to is 4\.999999999 s, before from, 5\.000000000 s"):
        ask(EXPORT, from_="5", to="4.999999999")


@pytest.mark.parametrize("parse", [query.history, TIMELINE, EXPORT])
def test_an_end_at_0_is_not_taken_for_now(parse: Parse) -> None:
    with pytest.raises(PastRefused, match=r"^to is 0 s"):
        ask(parse, to="0")


# --- the rest -------------------------------------------------------------------------------------


@pytest.mark.parametrize("parse", [query.history, TIMELINE, EXPORT])
def test_an_empty_name_is_refused_and_so_is_one_that_nothing_can_have(parse: Parse) -> None:
    with pytest.raises(PastRefused, match=r"^tag_id is '': string should have at least 1 char"):
        ask(parse, tag_id="")
    assert ask(parse, tag_id="x" * MAX_TEXT_LENGTH).tag_id == "x" * MAX_TEXT_LENGTH
    with pytest.raises(PastRefused, match=f"at most {MAX_TEXT_LENGTH} characters"):
        ask(parse, tag_id="x" * (MAX_TEXT_LENGTH + 1))


def test_a_history_is_of_one_sensor_or_of_an_event() -> None:
    with pytest.raises(PastRefused, match="sensor_type: field required"):
        query.history([("tag_id", "7")], NOW_NS)
    with pytest.raises(PastRefused, match="'~dances' is none of ~scans"):
        ask(query.history, sensor_type="~dances")
    assert ask(query.history, sensor_type="~looks").event == "~looks"
