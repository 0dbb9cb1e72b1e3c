from __future__ import annotations

import math
from typing import Any

import pytest

from lupin_twin import recent
from lupin_twin.history import History, TagHistory
from lupin_twin.past import MAX_POINTS, Event, NotRemembered, SeriesPast, SeriesRequest
from lupin_twin.state import NO_FLOWER, Look, Reading, Scan

S = 1_000_000_000
NOW_NS = 100 * S


def histories() -> dict[str, TagHistory]:
    history = History()
    for second, value in ((10, 1.0), (20, math.nan), (30, 3.0)):
        history.add(Scan("a", second * S, (Reading("co2", value), Reading("light", 5.0))))
    history.add(Scan("a", 25 * S, status=2, status_detail="no answer"))
    history.add(Scan("b", 15 * S, (Reading("co2", 9.0),)))
    history.add(Look("b", 5 * S, None, status=1))
    history.add(Look("b", 40 * S, NO_FLOWER))
    return history.all_later()()


def ask(tag_id: str, sensor_type: str, **more: Any) -> SeriesPast:
    return recent.series(SeriesRequest(tag_id, sensor_type, **more), histories(), NOW_NS)


def seconds(past: SeriesPast) -> list[float]:
    return [stamp_ns / S for stamp_ns in past.stamps_ns]


def test_readings_are_those_of_the_scans_with_their_stamps() -> None:
    past = ask("a", "co2")
    assert seconds(past) == [10, 20, 30]
    assert str(past.means) == "(1.0, nan, 3.0)"
    assert past.means is past.minima is past.maxima
    assert past.counts == (1, 1, 1)
    # From the first reading on, and this very moment is past.
    assert (past.start_ns, past.end_ns, past.bucket_ns) == (10 * S, NOW_NS + 1, None)


def test_a_period_holds_its_start_and_not_its_end() -> None:
    past = ask("a", "co2", start_ns=10 * S, end_ns=30 * S)
    assert seconds(past) == [10, 20]
    assert (past.start_ns, past.end_ns) == (10 * S, 30 * S)
    assert seconds(ask("a", "co2", start_ns=10 * S + 1, end_ns=30 * S + 1)) == [20, 30]


@pytest.mark.parametrize(("tag_id", "sensor_type"), [("c", "co2"), ("a", "ph")])
def test_what_was_never_read_is_empty(tag_id: str, sensor_type: str) -> None:
    past = ask(tag_id, sensor_type)
    assert past.stamps_ns == ()
    assert past.start_ns == past.end_ns == NOW_NS + 1


def test_more_than_asked_for_comes_in_buckets_of_what_is_finite() -> None:
    past = ask("a", "co2", start_ns=10 * S, end_ns=40 * S, max_points=2)
    assert past.bucket_ns == 15 * S
    assert seconds(past) == [10, 25]
    assert (past.counts, past.means) == ((1, 1), (1.0, 3.0))
    assert ask("a", "co2", max_points=3).bucket_ns is None


def test_events_are_told_as_far_as_they_are_known() -> None:
    scans = ask("*", "~scans")
    assert seconds(scans) == [10, 15, 20, 30]
    assert scans.means == (2.0, 1.0, 2.0, 2.0)
    # Events begin with the first try, of whatever kind.
    assert scans.start_ns == 5 * S
    failures = ask("*", "~failures")
    assert seconds(failures) == [5, 25]
    assert failures.means == (1.0, 2.0)
    assert seconds(ask("a", "~failures")) == [25]


@pytest.mark.parametrize("event", sorted(set(Event) - {Event.SCANS, Event.FAILURES}))
def test_other_events_are_not_remembered_and_the_parameter_is_named(event: Event) -> None:
    with pytest.raises(NotRemembered, match=rf"{event} .*\(parameter journal\)") as refused:
        ask("*", event.value)
    assert refused.value.is_lasting


def test_buckets_are_never_more_than_asked_for() -> None:
    history = History(buffer_len=MAX_POINTS)
    for number in range(1_000):
        history.add(Scan("a", (1_000 + 37 * number) * S, (Reading("co2", float(number)),)))
    kept = {"a": history.of("a")}
    for points in (1, 7, 100, 999):
        past = recent.series(SeriesRequest("a", "co2", max_points=points), kept, 40_000 * S)
        assert 1 <= len(past.stamps_ns) <= points
        assert sum(past.counts) == 1_000
        assert past.bucket_ns is not None
        assert all((at - past.start_ns) % past.bucket_ns == 0 for at in past.stamps_ns)
        assert past.minima[0] == 0.0
        assert past.maxima[-1] == 999.0
