"""One sensor's past: what is sent, and its gaps, compared with the simplest rule."""

import math
from statistics import median_low
from typing import Any

import orjson
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lupin_bridge.judge.judging import own_sensors
from lupin_bridge.past.bodies import gaps, history_body
from lupin_bridge.stream import routes_schema
from lupin_twin.core.past import SeriesPast, SeriesRequest

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


def written(past: SeriesPast, requested: SeriesRequest = REQUESTED) -> dict[str, Any]:
    """The body as a client parses it, validated by the contract."""
    text = orjson.dumps(history_body(requested, past, None, SENSORS))
    routes_schema.History.model_validate_json(text)
    found: dict[str, Any] = orjson.loads(text)
    return found


# --- the body -------------------------------------------------------------------------------------


def test_buckets_are_sent_with_their_length() -> None:
    past = SeriesPast(
        0, 9 * NS, 5 * NS // 2, (0, 5 * NS), (3, 1), (2.0, 5.0), (1.0, 5.0), (4.0, 5.0)
    )
    found = written(past)
    assert (found["is_bucketed"], found["bucket_s"], found["readings"]) == (True, 2.5, [])
    assert found["buckets"] == [
        {"start": {"sec": 0, "nanosec": 0}, "n": 3, "mean": 2.0, "min": 1.0, "max": 4.0},
        {"start": {"sec": 5, "nanosec": 0}, "n": 1, "mean": 5.0, "min": 5.0, "max": 5.0},
    ]


@pytest.mark.parametrize(
    ("sensor_type", "unit"), [("co2", "ppm"), ("x", ""), ("~silences", "s"), ("~looks", "")]
)
def test_each_value_has_its_unit(sensor_type: str, unit: str) -> None:
    assert written(readings(), SeriesRequest("7", sensor_type))["unit"] == unit


def test_events_have_no_gaps() -> None:
    past = readings(1, 2, 3, 90)
    assert written(past, SeriesRequest("7", "~failures"))["gaps"] == []
    assert len(written(past)["gaps"]) == 2


# --- gaps -----------------------------------------------------------------------------------------


def test_an_empty_period_has_no_gap() -> None:
    assert gaps(SeriesPast(5, 5), None) == []


def test_many_readings_in_each_bucket_make_every_absent_one_a_gap() -> None:
    assert gaps(buckets(10, dict.fromkeys((0, 1, 2, 4, 5, 6, 7), 5)), None) == [(30, 40), (80, 100)]


def test_with_at_most_one_reading_per_bucket_absent_ones_are_usual() -> None:
    assert gaps(buckets(10, dict.fromkeys((0, 2, 4, 6, 8), 1)), None) == []
    assert gaps(buckets(10, dict.fromkeys((0, 1, 2, 6, 7, 8, 9), 1)), None) == []
    assert gaps(buckets(10, dict.fromkeys((0, 1, 2, 7, 8, 9), 1)), None) == [(30, 70)]


def test_a_single_bucket_shows_the_usual_spacing_by_its_count() -> None:
    assert gaps(buckets(10, {3: 1}), None) == []
    assert gaps(buckets(10, {3: 10}), None) == [(0, 30), (40, 100)]


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


READINGS = st.lists(st.tuples(st.integers(0, 1_000), st.sampled_from([400.0, math.nan])))


@given(READINGS, st.integers(1_001, 1_500), st.none() | st.integers(1_001, 2_000))
def test_gaps_equal_the_simplest_rule(
    unsorted: list[tuple[int, float]], end_ns: int, now_ns: int | None
) -> None:
    """A reading without a value fills no gap, and the future is none."""
    found = sorted(unsorted, key=lambda reading: reading[0])
    past = readings(*(at for at, _ in found), values=[it for _, it in found], end_ns=end_ns)
    known = [at for at, value in found if math.isfinite(value)]
    assert gaps(past, now_ns) == plain_gaps(known, min(end_ns, now_ns or end_ns))


@given(st.lists(st.integers(0, 999)), st.integers(1, 200))
def test_a_gap_between_buckets_holds_no_reading_and_is_at_least_a_bucket_long(
    stamps: list[int], width_ns: int
) -> None:
    counts: dict[int, int] = {}
    for stamp in sorted(stamps):
        counts[stamp // width_ns] = counts.get(stamp // width_ns, 0) + 1
    found = gaps(buckets(width_ns, counts, end_ns=1_000), None)
    for since, until in found:
        assert not [stamp for stamp in stamps if since <= stamp < until]
        assert until - since >= width_ns or not stamps
    assert found == sorted(found)
