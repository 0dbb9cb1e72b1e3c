"""Events over time, in buckets: the same from every source."""

from collections import Counter
from typing import Any

import orjson
from hypothesis import given
from hypothesis import strategies as st

from lupin_bridge.past.bodies import COUNTED, timeline_body, timeline_period
from lupin_bridge.stream import routes_schema
from lupin_twin.core.past import HOUR_NS, Event, Grid, SeriesPast, grid

NS = 10**9
# The runs, the period, the events, the silences.
Parts = tuple[SeriesPast, Grid, dict[Event, SeriesPast], SeriesPast]


def one_by_one(stamps_ns: list[int], start_ns: int, end_ns: int) -> SeriesPast:
    """The events one by one."""
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


def written(given_: Parts) -> dict[str, Any]:
    """The body as a client parses it, validated by the contract."""
    text = orjson.dumps(timeline_body(*given_))
    routes_schema.Timeline.model_validate_json(text)
    found: dict[str, Any] = orjson.loads(text)
    return found


def at(seconds: int) -> dict[str, int]:
    return {"sec": seconds, "nanosec": 0}


def test_an_empty_past_is_a_valid_answer() -> None:
    found = written(parts(5 * NS, 5 * NS))
    assert (found["from"], found["to"], found["reach"]) == (at(5), at(5), None)
    assert (found["buckets"], found["silences"], found["runs"]) == ([], [], [])


def test_silences_are_intervals_and_of_too_many_the_longest_of_each_bucket_is_sent() -> None:
    silences = SeriesPast(0, 100 * NS, None, (NS,), (1,), (2.5,), (2.5,), (2.5,))
    assert written(parts(silences=silences))["silences"] == [
        {"from": at(1), "to": {"sec": 3, "nanosec": 500_000_000}}
    ]
    silences = SeriesPast(0, 100 * NS, 10 * NS, (20 * NS,), (7,), (1.0,), (0.5,), (4.0,))
    assert written(parts(silences=silences))["silences"] == [{"from": at(20), "to": at(24)}]


def test_runs_that_overlap_the_period_are_sent_with_the_extent_of_all() -> None:
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
    found = written(parts(50 * NS, 100 * NS, runs=runs))
    assert found["reach"] == {"from": at(2), "to": at(100)}
    assert found["runs"] == [
        {"from": at(10), "to": at(50), "is_simulated": True},
        {"from": at(80), "to": at(180), "is_simulated": False},
        # Until now, which is after the period.
        {"from": at(90), "to": at(100), "is_simulated": False},
    ]


def test_a_run_of_years_ends_with_the_period_however_its_length_is_rounded() -> None:
    start_ns, now_ns = 1_700_000_000 * NS, 1_795_920_785_417_813_153
    length_s = (now_ns - start_ns) / NS
    assert start_ns + round(length_s * NS) < now_ns
    runs = SeriesPast(start_ns, now_ns, None, (start_ns,), (1,), (length_s,), (0.0,), (0.0,))
    end_ns = start_ns + 100 * NS
    assert written(parts(start_ns, end_ns, runs=runs))["runs"] == [
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
