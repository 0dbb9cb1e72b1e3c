from lupin_bridge.judge.scans import LONGEST_NS, SHORTEST_NS, holds_ns, interval_ns

MINUTE = 60_000_000_000


def of(*minutes: int) -> int | None:
    return interval_ns([minute * MINUTE for minute in minutes])


def test_an_interval_is_the_median_of_those_between_scans() -> None:
    assert of(0, 30, 60, 90) == 30 * MINUTE
    # One long pause is no rhythm.
    assert of(0, 30, 60, 600, 630) == 30 * MINUTE


def test_before_two_scans_there_is_none() -> None:
    assert of() is None
    assert of(7) is None


def test_readings_hold_for_three_intervals_within_bounds() -> None:
    assert holds_ns(30 * MINUTE) == 90 * MINUTE
    assert holds_ns(MINUTE) == SHORTEST_NS == 10 * MINUTE
    assert holds_ns(None) == LONGEST_NS
    assert holds_ns(24 * 60 * MINUTE) == LONGEST_NS == 24 * 60 * MINUTE
