"""Moments as text: exact to the nanosecond both ways, and nothing is guessed."""

from contextlib import suppress
from datetime import UTC, datetime, timedelta, timezone
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lupin_bridge.query_string import MAX_SECONDS, compact, iso, moment
from lupin_twin.core.past import PastRefused, seconds

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
