"""Query strings: parsed by a dataclass, moments exact to the nanosecond, periods, fields."""

import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta, timezone
from fractions import Fraction
from typing import Annotated, Any, Literal
from urllib.parse import unquote

import pytest
from annotated_types import Interval
from hypothesis import example, given
from hypothesis import strategies as st

from lupin_bridge import field as field_query
from lupin_bridge import query_string
from lupin_bridge.field import JSON, NPY, PNG, FieldFormat, FieldQuery
from lupin_bridge.query_string import (
    MAX_SECONDS,
    Name,
    compact,
    iso,
    moment,
    needed,
    parameter,
    read,
)
from lupin_bridge.routes.state import ListenQuery
from lupin_twin.core.drops import MAX_TEXT_LENGTH
from lupin_twin.core.past import DEFAULT_POINTS, NotRemembered, PastRefused, seconds
from lupin_twin.field.engine import FieldRequest


@dataclass(frozen=True, slots=True)
class Some:
    a: Name = needed("one")
    from_: Annotated[int, Interval(ge=1, le=5)] = parameter("another", 2)
    c: Literal["x", "y"] | None = parameter("a third")


def refusal(*pairs: tuple[str, str]) -> str:
    with pytest.raises(PastRefused) as refused:
        read(Some, pairs)
    return str(refused.value)


@pytest.mark.parametrize(
    ("parameters", "why"),
    [
        ([("d", "1")], "parameter 'd' is unknown, expected a, from, c"),
        ([("from_", "1")], "parameter 'from_' is unknown, expected a, from, c"),
        ([("x" * 65, "1")], f"parameter '{'x' * 64}' is unknown, expected a, from, c"),
        ([("a", "1"), ("a", "1")], "a is given more than once, expected one value"),
        ([], "a: field required"),
        ([("a", "")], "a is '': string should have at least 1 character"),
        ([("a", "1"), ("from", "6")], "from is '6': input should be less than or equal to 5"),
        ([("a", "1"), ("from", "two")], "from is 'two': input should be a valid integer"),
        ([("a", "1"), ("from", "9" * 5_000)], f"from is '{'9' * 64}': "),
        ([("a", "1\0")], "a is '1\\x00', which has a NUL character"),
        ([("a", "1"), ("c", "z")], "c is 'z': input should be 'x' or 'y'"),
    ],
)
def test_an_invalid_value_is_refused_by_name_in_the_callers_way(
    parameters: list[tuple[str, str]], why: str
) -> None:
    assert refusal(*parameters).startswith(why)


@given(st.lists(st.tuples(st.sampled_from(["a", "from", "c"]) | st.text(), st.text()), max_size=3))
def test_any_query_string_is_parsed_or_refused(pairs: list[tuple[str, str]]) -> None:
    with suppress(PastRefused):
        read(Some, pairs)


def test_the_lowest_rate_is_one_and_anything_lower_is_refused() -> None:
    requested = read(ListenQuery, [("delta", "1"), ("max_rate_hz", "0.01")])
    assert (requested.delta, requested.min_interval_s) == (True, 100.0)
    for value in ("0.0099", "0", "-1", "nan", "fast", ""):
        with pytest.raises(ValueError, match=f"max_rate_hz is '{value}': input should be"):
            read(ListenQuery, [("max_rate_hz", value)])


NS = 10**9
LAST_NS = MAX_SECONDS * NS + NS - 1


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("0", 0),
        ("12", 12 * NS),
        ("0012.5", 12 * NS + NS // 2),
        ("1763734500.000000001", 1_763_734_500 * NS + 1),
        # A float would make ...499.123456717 of it.
        ("1763734499.123456789", 1_763_734_499 * NS + 123_456_789),
        ("0.0000000019", 1),
        (" 7 ", 7 * NS),
        (str(MAX_SECONDS), MAX_SECONDS * NS),
        ("1970-01-01T00:00:00Z", 0),
        ("1970-01-02T01:02:03.000000004z", (86_400 + 3_723) * NS + 4),
        ("2026-11-21T14:15Z", 1_795_270_500 * NS),
        ("2026-11-21T15:15:00+01:00", 1_795_270_500 * NS),
        ("2026-11-21T15:15:00 01:00", 1_795_270_500 * NS),  # a bare + in a query string
        ("2026-11-21t08:45:00-0530", 1_795_270_500 * NS),
    ],
)
def test_seconds_and_iso_8601_are_moments(text: str, expected: int) -> None:
    assert moment("at", text) == expected


@pytest.mark.parametrize(
    "text",
    [
        *("", "now", "nan", "-1", "1e9", "1_0", "٣", "1.", ".5", "9" * 5_000 + "x"),
        "2026-11-21",
        "2026-11-21T14:15:00",  # without an offset
        "2026-11-21 14:15:00Z",
        "26-11-21T14:15:00Z",
        "2026-11-21T14:15:00+01",
    ],
)
def test_anything_else_is_refused_with_its_name_and_value(text: str) -> None:
    with pytest.raises(PastRefused, match=r"^from is .*, expected ROS seconds") as refused:
        moment("from", text)
    assert repr(text[:64]) in str(refused.value)
    assert len(str(refused.value)) < 200


@pytest.mark.parametrize(
    "text",
    [
        "2026-02-29T00:00:00Z",
        "0000-01-01T00:00:00Z",
        "2026-11-21T24:00:00Z",
        "2026-11-21T00:00:60Z",
        "2026-11-21T00:00:00+24:00",
        "2026-11-21T00:00:00+00:60",
    ],
)
def test_a_date_that_no_calendar_or_clock_shows_is_refused(text: str) -> None:
    with pytest.raises(PastRefused, match=f"at is '{text}'".replace("+", r"\+")):
        moment("at", text)


def test_the_ends_of_ros_time_are_included_and_anything_past_them_is_refused() -> None:
    assert moment("at", f"{MAX_SECONDS}.999999999") == LAST_NS
    for text in (str(MAX_SECONDS + 1), "9" * 5_000, "2038-01-19T03:14:08Z", "9999-12-31T00:00:00Z"):
        with pytest.raises(PastRefused, match=f"the limit is {MAX_SECONDS} s of ROS time"):
            moment("at", text)
    assert moment("at", "1970-01-01T01:00:00+01:00") == 0
    for text in ("1970-01-01T00:59:59+01:00", "1969-12-31T23:59:59Z", "0001-01-01T00:00:00Z"):
        with pytest.raises(PastRefused, match="before 0 s"):
            moment("at", text)


@given(st.integers(0, LAST_NS))
def test_a_written_moment_is_read_back_to_the_nanosecond(stamp_ns: int) -> None:
    assert moment("at", seconds(stamp_ns)) == moment("at", iso(stamp_ns)) == stamp_ns
    assert Fraction(seconds(stamp_ns)) == Fraction(stamp_ns, NS)
    assert moment("at", compact_as_iso(compact(stamp_ns))) == stamp_ns // NS * NS


def compact_as_iso(text: str) -> str:
    return f"{text[:4]}-{text[4:6]}-{text[6:11]}:{text[11:13]}:{text[13:]}"


@given(
    st.datetimes(datetime(1970, 1, 2), datetime(2038, 1, 18)),  # noqa: DTZ001  # the zone is below
    st.integers(-23 * 60 - 59, 23 * 60 + 59),
)
def test_iso_8601_is_read_as_the_standard_library_reads_it(when: datetime, offset: int) -> None:
    text = when.replace(tzinfo=timezone(timedelta(minutes=offset))).isoformat()
    since = datetime.fromisoformat(text) - datetime(1970, 1, 1, tzinfo=UTC)
    assert moment("at", text) == since // timedelta(microseconds=1) * 1_000


@given(st.text(max_size=40))
def test_any_text_is_a_moment_or_refused(text: str) -> None:
    with suppress(PastRefused):
        assert 0 <= moment("at", text) <= LAST_NS


NOW_NS = 1_000 * NS
HISTORY, TIMELINE, EXPORT = query_string.OfHistory, query_string.OfTimeline, query_string.OfExport
NEEDED: dict[Any, dict[str, str]] = {HISTORY: {"tag_id": "7", "sensor_type": "co2"}}


def query(kind: type[query_string.OfPeriod], **given: str) -> Any:
    values = NEEDED.get(kind, {}) | {name.rstrip("_"): value for name, value in given.items()}
    return read(kind, list(values.items()))


def span(kind: type[query_string.OfPeriod], **given: str) -> tuple[int, int]:
    start_ns, end_ns = query(kind, **given).span(NOW_NS)
    return start_ns, end_ns


def test_the_default_period_is_all_that_is_stored_and_none_may_be_inverted() -> None:
    assert query_string.at([], NOW_NS) is None
    for kind in (HISTORY, TIMELINE, EXPORT):
        assert span(kind) == (0, 0)
    assert query(HISTORY).points == query(TIMELINE).points == DEFAULT_POINTS
    assert query(TIMELINE).tag_id is query(EXPORT).tag_id is query(EXPORT).sensor_type is None
    assert span(EXPORT, from_="2000", to="2001") == (2_000 * NS, 2_001 * NS)
    assert span(EXPORT, from_="5", to="5") == (5 * NS, 5 * NS)
    with pytest.raises(PastRefused, match=r"^to is 4\.999999999 s, before from, 5\.000000000 s"):
        span(EXPORT, from_="5", to="4.999999999")


def test_a_report_of_the_first_hours_begins_at_0_and_without_a_known_time_it_needs_an_end() -> None:
    assert query_string.report(query_string.OfReport(), NOW_NS) == (0, NOW_NS)
    for to, what in ((None, "missing"), ("100", r"100\.000000000 s")):
        with pytest.raises(NotRemembered, match=f"^to is {what}, and what time it is now is not"):
            query_string.report(query_string.OfReport(to=to), None)


def test_now_is_valid_and_the_future_is_refused_unless_now_is_unknown() -> None:
    assert query_string.at([("at", "1000")], NOW_NS) == NOW_NS
    assert span(HISTORY, from_="1000") == (NOW_NS, 0)
    later = "1000.000000001"
    with pytest.raises(PastRefused) as refused:
        query_string.at([("at", later)], NOW_NS)
    assert str(refused.value) == f"at is {later} s, later than now, 1000.000000000 s"
    with pytest.raises(PastRefused, match=r"^from is 1000\.000000001 s, later than now"):
        span(HISTORY, from_=later)
    assert query_string.at([("at", "2000000000")], None) == 2 * 10**9 * NS


@pytest.mark.parametrize("kind", [HISTORY, TIMELINE, EXPORT])
def test_an_end_at_0_and_an_empty_or_impossible_name_are_refused(
    kind: type[query_string.OfPeriod],
) -> None:
    with pytest.raises(PastRefused, match=r"^to is 0 s"):
        span(kind, to="0")
    with pytest.raises(PastRefused, match=r"^tag_id is '': string should have at least 1 char"):
        query(kind, tag_id="")
    assert query(kind, tag_id="x" * MAX_TEXT_LENGTH).tag_id == "x" * MAX_TEXT_LENGTH
    with pytest.raises(PastRefused, match=f"at most {MAX_TEXT_LENGTH} characters"):
        query(kind, tag_id="x" * (MAX_TEXT_LENGTH + 1))


BOX = {"bbox_min_x": "-1", "bbox_min_y": "0.5", "bbox_max_x": "2e1", "bbox_max_y": "3"}


def parse(pairs: Sequence[tuple[str, str]]) -> FieldQuery:
    names = [name for name, _ in pairs]
    own = [] if "sensor_type" in names else [("sensor_type", "co2")]
    return read(FieldQuery, [*own, *pairs])


def test_omitted_values_have_defaults_and_cells_of_a_default_box_get_wide_enough() -> None:
    query, whole = parse([("sensor_type", "co2")]), (0.0, 1.0, 2.0, 3.0)
    assert query == FieldQuery("co2")
    assert query.box is None
    assert query.request(whole, 400) == FieldRequest("co2", 0.1, *whole)
    assert query.request(whole, 399) == FieldRequest("co2", 0.2, *whole)
    fixed = parse([("sensor_type", "co2"), ("resolution", "0.1")]).request(whole, 399)
    assert fixed == FieldRequest("co2", 0.1, *whole), "unless the query sets their size"


@pytest.mark.parametrize("text", ["0", "-1", "1001", "1.5", "", "²", "٣", "1e2", "9" * 5_000, "x"])
def test_a_scale_out_of_range_is_refused(text: str) -> None:
    with pytest.raises(PastRefused, match=f"^scale is '{text[:64]}': "):
        parse([("scale", text)])


@pytest.mark.parametrize(
    ("accept", "expected"),
    [
        ("", JSON),
        ("IMAGE/PNG", PNG),
        ("image/*", PNG),
        ("application/*", JSON),
        ("image/avif,image/webp,image/png,*/*;q=0.8", PNG),  # an <img> in a browser
        ("text/plain, application/x-npy;q=0.9, */*;q=0.1", NPY),
        ("application/json; charset=utf-8", JSON),
        ("text/html", JSON),
        (",;q=,/", JSON),
    ],
)
def test_accept_chooses_the_format(accept: str, expected: FieldFormat) -> None:
    assert field_query.negotiate(accept) == expected


@example("  a b ")
@example(" ")
@given(st.text(st.characters(codec="utf-8"), max_size=40))
def test_no_sensor_name_can_break_out_of_a_header_or_a_folder(name: str) -> None:
    headers = field_query.headers({"Sensor": name}, f"{name}.png")
    for value in headers.values():
        assert re.fullmatch(r"[\x20-\x7e]*", value), "a header is one line of ASCII"
        assert value == value.strip(), "or it would not be sent"
    assert unquote(headers["X-Field-Sensor"]) == name
    file_name = re.fullmatch(r'inline; filename="(.*)"', headers["Content-Disposition"])
    assert file_name is not None
    assert re.fullmatch(r"[A-Za-z0-9._-]+", file_name[1])
