from __future__ import annotations

from lupin_bridge.judge.rhythm import INTERVALS, LONGEST_NS, SHORTEST_NS, Rhythm, holds_ns

MINUTE = 60_000_000_000


def rhythm_of(*minutes: float) -> Rhythm:
    rhythm = Rhythm()
    for minute in minutes:
        rhythm.scanned(int(minute * MINUTE))
    return rhythm


def test_a_rhythm_is_the_median_of_the_last_intervals() -> None:
    assert rhythm_of(0, 30, 60, 90).interval_ns == 30 * MINUTE
    # One long pause is no rhythm.
    assert rhythm_of(0, 30, 60, 600, 630).interval_ns == 30 * MINUTE


def test_only_the_last_intervals_count() -> None:
    fast_after_slow = [hours * 60 for hours in range(20)]
    fast_after_slow += [fast_after_slow[-1] + 5 * i for i in range(1, INTERVALS + 1)]
    assert rhythm_of(*fast_after_slow).interval_ns == 5 * MINUTE


def test_before_two_scans_there_is_none() -> None:
    assert rhythm_of().interval_ns is None
    assert rhythm_of(7).interval_ns is None
    assert rhythm_of(7, 7).interval_ns is None


def test_what_is_told_again_is_no_scan() -> None:
    assert rhythm_of(0, 30, 30, 0, 60).interval_ns == 30 * MINUTE


def test_a_clock_that_goes_back_begins_anew() -> None:
    assert rhythm_of(1000, 1030, 1060, 3, 8, 13).interval_ns == 5 * MINUTE


def test_readings_hold_for_three_intervals_within_bounds() -> None:
    assert holds_ns(30 * MINUTE) == 90 * MINUTE
    assert holds_ns(MINUTE) == SHORTEST_NS == 10 * MINUTE
    assert holds_ns(None) == SHORTEST_NS
    assert holds_ns(24 * 60 * MINUTE) == LONGEST_NS == 24 * 60 * MINUTE
