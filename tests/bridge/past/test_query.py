"""Query strings for the past: what is given, and the defaults."""

from typing import Any

import pytest

from lupin_bridge import query_string
from lupin_bridge.query_string import read
from lupin_twin.core.drops import MAX_TEXT_LENGTH
from lupin_twin.core.past import DEFAULT_POINTS, PastRefused

NS = 10**9
NOW_NS = 1_000 * NS
HISTORY, TIMELINE, EXPORT = query_string.OfHistory, query_string.OfTimeline, query_string.OfExport
NEEDED: dict[Any, dict[str, str]] = {HISTORY: {"tag_id": "7", "sensor_type": "co2"}}


def query(kind: type[query_string.OfPeriod], **given: str) -> Any:
    values = NEEDED.get(kind, {}) | {name.rstrip("_"): value for name, value in given.items()}
    return read(kind, list(values.items()))


def span(kind: type[query_string.OfPeriod], **given: str) -> tuple[int, int]:
    start_ns, end_ns = query(kind, **given).span(NOW_NS)
    return start_ns, end_ns


def test_the_default_is_all_that_is_stored() -> None:
    assert query_string.at([], NOW_NS) is None
    for kind in (HISTORY, TIMELINE, EXPORT):
        assert span(kind) == (0, 0)
    assert query(HISTORY).points == query(TIMELINE).points == DEFAULT_POINTS
    assert query(TIMELINE).tag_id is query(EXPORT).tag_id is query(EXPORT).sensor_type is None


@pytest.mark.parametrize(("to", "what"), [(None, "missing"), ("100", r"100\.000000000 s")])
def test_without_a_known_time_a_report_needs_an_end(to: str | None, what: str) -> None:
    with pytest.raises(PastRefused, match=f"^to is {what}, and what time it is now is not known"):
        query_string.report(query_string.OfReport(to=to), None)


def test_a_report_of_the_first_hours_begins_at_0() -> None:
    assert query_string.report(query_string.OfReport(), NOW_NS) == (0, NOW_NS)


# --- moments and periods --------------------------------------------------------------------------


def test_now_is_valid_and_the_future_is_refused() -> None:
    assert query_string.at([("at", "1000")], NOW_NS) == NOW_NS
    assert span(HISTORY, from_="1000") == (NOW_NS, 0)
    later = "1000.000000001"
    with pytest.raises(PastRefused) as refused:
        query_string.at([("at", later)], NOW_NS)
    assert str(refused.value) == f"at is {later} s, later than now, 1000.000000000 s"
    with pytest.raises(PastRefused, match=r"^from is 1000\.000000001 s, later than now"):
        span(HISTORY, from_=later)


def test_while_now_is_unknown_nothing_is_in_the_future() -> None:
    assert query_string.at([("at", "2000000000")], None) == 2 * 10**9 * NS


def test_a_period_may_end_after_now_and_be_empty_but_not_be_inverted() -> None:
    assert span(EXPORT, from_="2000", to="2001") == (2_000 * NS, 2_001 * NS)
    assert span(EXPORT, from_="5", to="5") == (5 * NS, 5 * NS)
    with pytest.raises(PastRefused, match=r"^to is 4\.999999999 s, before from, 5\.000000000 s"):
        span(EXPORT, from_="5", to="4.999999999")


@pytest.mark.parametrize("kind", [HISTORY, TIMELINE, EXPORT])
def test_an_end_at_0_is_not_read_as_now(kind: type[query_string.OfPeriod]) -> None:
    with pytest.raises(PastRefused, match=r"^to is 0 s"):
        span(kind, to="0")


# --- the rest -------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", [HISTORY, TIMELINE, EXPORT])
def test_an_empty_or_impossible_name_is_refused(kind: type[query_string.OfPeriod]) -> None:
    with pytest.raises(PastRefused, match=r"^tag_id is '': string should have at least 1 char"):
        query(kind, tag_id="")
    assert query(kind, tag_id="x" * MAX_TEXT_LENGTH).tag_id == "x" * MAX_TEXT_LENGTH
    with pytest.raises(PastRefused, match=f"at most {MAX_TEXT_LENGTH} characters"):
        query(kind, tag_id="x" * (MAX_TEXT_LENGTH + 1))
