"""What is sent of the past: histories, gaps, timelines, rows, and how complete they are."""

import csv
import io
import math
from collections import Counter
from dataclasses import replace
from fractions import Fraction
from statistics import median_low
from typing import Any

import orjson
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lupin_bridge.judge.judging import own_sensors
from lupin_bridge.past import bodies
from lupin_bridge.past.bodies import COUNTED, gaps, history_body, timeline_body, timeline_period
from lupin_bridge.query_string import OfExport
from lupin_bridge.stream import routes_schema
from lupin_twin.core.diagnostics import UNKNOWN_JOURNAL, Condition, JournalState
from lupin_twin.core.past import HOUR_NS, Event, Grid, PastRow, SeriesPast, SeriesRequest, grid

NS = 10**9
SENSORS = own_sensors()
REQUESTED = SeriesRequest("7", "co2", 0, 100 * NS)


def readings(*stamps_ns: int, values: list[float] | None = None, end_ns: int = 100) -> SeriesPast:
    """Readings at these times of a period from 0 to `end_ns`."""
    given_ = tuple(values or [400.0] * len(stamps_ns))
    return SeriesPast(0, end_ns, None, stamps_ns, (1,) * len(stamps_ns), given_, given_, given_)


def buckets(width_ns: int, counts: dict[int, int], end_ns: int = 100) -> SeriesPast:
    """That many readings in the buckets of these numbers."""
    ones = (1.0,) * len(counts)
    starts = tuple(number * width_ns for number in counts)
    return SeriesPast(0, end_ns, width_ns, starts, tuple(counts.values()), ones, ones, ones)


def history(past: SeriesPast, requested: SeriesRequest = REQUESTED) -> dict[str, Any]:
    """The body as a client parses it, validated by the contract."""
    text = orjson.dumps(history_body(requested, past, None, SENSORS))
    routes_schema.History.model_validate_json(text)
    found: dict[str, Any] = orjson.loads(text)
    return found


def test_each_value_has_its_unit_and_events_have_no_gaps() -> None:
    for sensor_type, unit in (("co2", "ppm"), ("x", ""), ("~silences", "s"), ("~looks", "")):
        assert history(readings(), SeriesRequest("7", sensor_type))["unit"] == unit
    past = readings(1, 2, 3, 90)
    assert history(past, SeriesRequest("7", "~failures"))["gaps"] == []
    assert len(history(past)["gaps"]) == 2


@pytest.mark.parametrize(
    ("counts", "expected"),
    [
        # Many readings in each bucket make every absent one a gap.
        (dict.fromkeys((0, 1, 2, 4, 5, 6, 7), 5), [(30, 40), (80, 100)]),
        # With at most one in each, absent ones are usual.
        (dict.fromkeys((0, 2, 4, 6, 8), 1), []),
        (dict.fromkeys((0, 1, 2, 6, 7, 8, 9), 1), []),
        (dict.fromkeys((0, 1, 2, 7, 8, 9), 1), [(30, 70)]),
        # A single bucket shows the usual spacing by its count.
        ({3: 1}, []),
        ({3: 10}, [(0, 30), (40, 100)]),
    ],
)
def test_gaps_between_buckets(counts: dict[int, int], expected: list[tuple[int, int]]) -> None:
    assert gaps(buckets(10, counts), None) == expected
    assert gaps(SeriesPast(5, 5), None) == [], "an empty period has none"


def plain_gaps(stamps: list[int], end: int) -> list[tuple[int, int]]:
    """The rule in its simplest form, for readings with a value."""
    if not stamps:
        return [(0, end)] if end > 0 else []
    if len(stamps) == 1:
        return []
    usual = 3 * median_low(stamps[i + 1] - stamps[i] for i in range(len(stamps) - 1))
    edges = [0, *stamps, end]
    pairs = [(edges[i], edges[i + 1]) for i in range(len(edges) - 1)]
    return [(since, until) for since, until in pairs if until - since > usual]


TIMES = st.lists(st.tuples(st.integers(0, 1_000), st.sampled_from([400.0, math.nan])))


@given(TIMES, st.integers(1_001, 1_500), st.none() | st.integers(1_001, 2_000))
def test_gaps_equal_the_simplest_rule(
    unsorted: list[tuple[int, float]], end_ns: int, now_ns: int | None
) -> None:
    """A reading without a value fills no gap, and the future is none."""
    found = sorted(unsorted, key=lambda reading: reading[0])
    past = readings(*(at for at, _ in found), values=[it for _, it in found], end_ns=end_ns)
    known = [at for at, value in found if math.isfinite(value)]
    assert gaps(past, now_ns) == plain_gaps(known, min(end_ns, now_ns or end_ns))


# The runs, the period, the events, the silences.
Parts = tuple[SeriesPast, Grid, dict[Event, SeriesPast], SeriesPast]


def one_by_one(stamps_ns: list[int], start_ns: int, end_ns: int) -> SeriesPast:
    ones = (1.0,) * len(stamps_ns)
    stamps = tuple(sorted(stamps_ns))
    return SeriesPast(start_ns, end_ns, None, stamps, (1,) * len(stamps), ones, ones, ones)


def in_buckets(stamps_ns: list[int], reported: Grid) -> SeriesPast:
    """The same in buckets, without the empty ones."""
    found = Counter((stamp - reported.start_ns) // reported.bucket_ns for stamp in stamps_ns)
    starts = tuple(reported.start_ns + number * reported.bucket_ns for number in sorted(found))
    counts = tuple(found[number] for number in sorted(found))
    ones = (1.0,) * len(counts)
    return SeriesPast(
        reported.start_ns, reported.end_ns, reported.bucket_ns, starts, counts, ones, ones, ones
    )


def parts(
    start_ns: int = 0,
    end_ns: int = 100 * NS,
    silences: SeriesPast | None = None,
    runs: SeriesPast | None = None,
    points: int = 10,
    **counted: SeriesPast,
) -> Parts:
    """What a source answers; omitted parts are absent."""
    nothing = SeriesPast(start_ns, end_ns)
    return (
        runs or nothing,
        grid(start_ns, end_ns, points),
        {event: counted.get(name, nothing) for name, event in COUNTED.items()},
        silences or nothing,
    )


def timeline(given_: Parts) -> dict[str, Any]:
    """The body as a client parses it, validated by the contract."""
    text = orjson.dumps(timeline_body(*given_))
    routes_schema.Timeline.model_validate_json(text)
    found: dict[str, Any] = orjson.loads(text)
    return found


def at(seconds: int) -> dict[str, int]:
    return {"sec": seconds, "nanosec": 0}


def test_an_empty_past_is_a_valid_answer_and_silences_are_intervals() -> None:
    found = timeline(parts(5 * NS, 5 * NS))
    assert (found["from"], found["to"], found["reach"]) == (at(5), at(5), None)
    assert (found["buckets"], found["silences"], found["runs"]) == ([], [], [])
    silences = SeriesPast(0, 100 * NS, None, (NS,), (1,), (2.5,), (2.5,), (2.5,))
    assert timeline(parts(silences=silences))["silences"] == [
        {"from": at(1), "to": {"sec": 3, "nanosec": 500_000_000}}
    ]
    silences = SeriesPast(0, 100 * NS, 10 * NS, (20 * NS,), (7,), (1.0,), (0.5,), (4.0,))
    assert timeline(parts(silences=silences))["silences"] == [{"from": at(20), "to": at(24)}]


def test_runs_that_overlap_the_period_are_sent_with_the_extent_of_all_and_end_with_it() -> None:
    runs = SeriesPast(
        2 * NS,
        500 * NS,
        None,
        (2 * NS, 10 * NS, 80 * NS, 90 * NS, 200 * NS),
        (1, 1, 1, 1, 1),
        (3.0, 40.0, 100.0, 410.0, 300.0),
        (0.0, 1.0, 0.0, 0.0, 0.0),
        (0.0, 1.0, 0.0, 0.0, 0.0),
    )
    found = timeline(parts(50 * NS, 100 * NS, runs=runs))
    assert found["reach"] == {"from": at(2), "to": at(100)}
    assert found["runs"] == [
        {"from": at(10), "to": at(50), "is_simulated": True},
        {"from": at(80), "to": at(180), "is_simulated": False},
        # Until now, which is after the period.
        {"from": at(90), "to": at(100), "is_simulated": False},
    ]
    start_ns, now_ns = 1_700_000_000 * NS, 1_795_920_785_417_813_153
    length_s = (now_ns - start_ns) / NS
    assert start_ns + round(length_s * NS) < now_ns
    runs = SeriesPast(start_ns, now_ns, None, (start_ns,), (1,), (length_s,), (0.0,), (0.0,))
    end_ns = start_ns + 100 * NS
    assert timeline(parts(start_ns, end_ns, runs=runs))["runs"] == [
        {"from": at(1_700_000_000), "to": at(1_700_000_100), "is_simulated": False}
    ]


def test_the_period_is_the_given_one_or_all_that_is_stored() -> None:
    runs = SeriesPast(7 * NS, 107 * NS)
    assert timeline_period(0, 0, 100, runs) == Grid(7 * NS, 107 * NS, NS)
    assert timeline_period(57 * NS, 0, 100, runs) == Grid(57 * NS, 107 * NS, NS // 2)
    assert timeline_period(0, 57 * NS, 100, runs) == Grid(7 * NS, 57 * NS, NS // 2)
    # Now is unknown, and no earlier than the start.
    assert timeline_period(200 * NS, 0, 100, runs).end_ns == 200 * NS
    # Counted buckets begin on whole slots.
    month = timeline_period(NS, 30 * 86_400 * NS, 500, runs)
    assert (month.start_ns, month.bucket_ns % HOUR_NS) == (0, 0)


@given(st.integers(0, 2 * 10**18), st.integers(0, 10**18), st.integers(1, 5_000))
def test_counts_come_in_the_buckets_of_the_period(
    start_ns: int, length_ns: int, points: int
) -> None:
    reported = grid(start_ns, start_ns + length_ns, points)
    assert grid(reported.start_ns, reported.end_ns, points) == reported


STAMPS = st.lists(st.integers(0, 999), max_size=30)


@given(STAMPS, STAMPS, st.integers(1, 50))
def test_single_and_bucketed_events_give_the_same_counts(
    scans: list[int], looks: list[int], points: int
) -> None:
    runs, period, counted, silences = parts(
        0,
        1_000,
        points=points,
        scans=one_by_one(scans, 0, 1_000),
        looks=one_by_one(looks, 0, 1_000),
    )
    mixed = {**counted, Event.SCANS: in_buckets(scans, period)}
    plain = timeline_body(runs, period, counted, silences)
    assert timeline_body(runs, period, mixed, silences) == plain


# Two runs; a part of the first one was deleted.
JOURNAL = Condition(
    JournalState.RECORDING,
    complete_ns=100 * NS,
    kept_ns=((10 * NS, 40 * NS), (60 * NS, 1_000 * NS)),
)


@pytest.mark.parametrize(
    ("at_s", "complete_s", "kept_s"),
    [(5, 5, 10), (10, 10, 10), (39, 39, 10), (40, 40, 60), (100, 100, 60), (150, 100, 60)],
)
def test_a_moment_has_a_start_of_the_data_and_a_limit_of_completeness(
    at_s: int, complete_s: int, kept_s: int
) -> None:
    assert bodies.moment_headers(JOURNAL, at_s * NS) == {
        "X-Complete-To": f"{complete_s}.000000000",
        "X-Kept-From": f"{kept_s}.000000000",
    }


@pytest.mark.parametrize(
    ("period", "expected"),
    [
        ((20, 30), (30, 20)),
        ((0, 30), (30, 10)),
        ((0, 10), (10, 10)),
        ((20, 70), (70, 60)),
        ((20, 50), (50, 50)),
        ((70, 170), (100, 70)),
        ((150, 170), (150, 150)),
        ((70, 70), (70, 70)),
    ],
)
def test_for_a_period_both_lie_within_it(
    period: tuple[int, int], expected: tuple[int, int]
) -> None:
    start_ns, end_ns = (at_s * NS for at_s in period)
    until_ns, since_ns = (at_s * NS for at_s in expected)
    assert bodies.of_period(JOURNAL, start_ns, end_ns) == (until_ns, since_ns)


def test_unknown_limits_are_omitted_and_the_reasons_for_missing_data_are_explained() -> None:
    assert bodies.moment_headers(UNKNOWN_JOURNAL, NS) == {}
    assert bodies.period_headers(UNKNOWN_JOURNAL, 0, NS) == {}
    assert bodies.period_fields(UNKNOWN_JOURNAL, 0, NS) == {"complete_to": None, "kept_from": None}
    assert bodies.why_not(UNKNOWN_JOURNAL, NS) == ""
    assert bodies.kept_from(replace(JOURNAL, kept_ns=()), 5 * NS) == 100 * NS
    assert bodies.why_not(JOURNAL, 50 * NS) == (
        "; what was received before 60.000000000 s is not kept"
    )
    assert bodies.why_not(JOURNAL, 101 * NS) == (
        "; the journal is complete only up to 100.000000000 s"
    )
    assert bodies.why_not(JOURNAL, 70 * NS) == ""


ROW = PastRow(1_795_270_500 * NS + 5, "7", 1.5, -2.0, "co2", 412.5, 0, "robot-1")
FAILED = PastRow(1_795_270_501 * NS, "7", math.nan, math.nan, "", math.nan, 2, "robot-1")


def read(*rows: PastRow) -> list[dict[str, str]]:
    """What a CSV reader makes of the header and these rows."""
    text = (bodies.CSV_HEADER + bodies.csv_lines(rows, SENSORS)).decode()
    return list(csv.DictReader(io.StringIO(text, newline=""), strict=True))


def test_rows_have_their_own_times_and_end_as_in_rfc_4180() -> None:
    rows = read(ROW, ROW, FAILED, ROW)
    assert [row["stamp"][9:12] for row in rows] == ["0.0", "0.0", "1.0", "0.0"]
    text = bodies.CSV_HEADER + bodies.csv_lines([ROW, FAILED], SENSORS)
    assert text.count(b"\r\n") == text.count(b"\n") == 3
    assert text.endswith(b"\r\n")
    assert bodies.csv_lines([], SENSORS) == b""


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a=b", "a=b"),
        ("=1+1", "'=1+1"),
        ("@SUM(A1)", "'@SUM(A1)"),
        ("\uff1d1", "'\uff1d1"),
        ("\t=1", "\"'\t'=1\""),
        ("a;=1", '"a;\'=1"'),
        ("a,b", '"a,b"'),
        ('say "x"', '"say ""x"""'),
        ("two\r\nlines", '"two\r\'\nlines"'),
    ],
)
def test_a_name_is_never_a_formula_and_is_quoted_where_necessary(text: str, expected: str) -> None:
    assert bodies.csv_cell(text) == expected


@given(st.text(), st.text(), st.text())
def test_names_are_read_back_apart_from_the_formula_guard(
    tag_id: str, sensor: str, source: str
) -> None:
    (row,) = read(PastRow(0, tag_id, 0.0, 0.0, sensor, 1.0, 0, source))
    for name, text in (("tag_id", tag_id), ("sensor", sensor), ("source", source)):
        assert row[name].replace("'", "") == text.replace("'", "")
        assert not row[name].startswith(("=", "+", "-", "@", "\t", "\r", "\n"))


@given(st.floats())
def test_numbers_are_read_back_to_the_last_bit_and_stay_numbers(value: float) -> None:
    (row,) = read(PastRow(1, "7", value, value, "co2", value, 0, ""))
    if math.isfinite(value):
        assert Fraction(float(row["value"])) == Fraction(float(row["x_m"])) == Fraction(value)
    else:
        assert row["value"] == row["x_m"] == row["y_m"] == ""


@pytest.mark.parametrize(
    ("requested", "now_ns", "expected"),
    [
        (OfExport(), None, "lupin-twin.csv"),
        (OfExport(), 86_400 * NS, "lupin-twin_to_19700102T000000Z.csv"),
        (
            OfExport(None, "1", tag_id='"; x=\r\né'),
            5,
            "lupin-twin____x_____to_19700101T000001Z.csv",
        ),
    ],
)
def test_the_file_name_describes_the_content(
    requested: OfExport, now_ns: int | None, expected: str
) -> None:
    assert bodies.export_file_name(requested, now_ns, "csv") == expected
