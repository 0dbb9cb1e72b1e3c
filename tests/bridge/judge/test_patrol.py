import pytest

from lupin_bridge.judge import scans
from lupin_bridge.judge.scans import LAP_INTERVALS, SHORTEST_NS, Patrol, Scans, Stretches

S = 1_000_000_000


def add_stamps(*stamps_s: float) -> Patrol:
    found = Scans()
    found.add_stamps([int(stamp * S) for stamp in stamps_s], None)
    return found.patrol(0)


def test_a_way_back_or_a_pause_does_not_change_the_interval() -> None:
    assert add_stamps(0, 40, 80, 120, 700, 740).interval_ns == 40 * S


def test_only_the_last_intervals_count() -> None:
    slow = [i * 600 for i in range(2 * LAP_INTERVALS)]
    fast = [slow[-1] + 5 * (i + 1) for i in range(LAP_INTERVALS)]
    assert add_stamps(*slow, *fast).interval_ns == 5 * S


def test_scans_already_counted_or_still_to_come_do_not_count() -> None:
    found = Scans()
    found.add_stamps([100 * S, 140 * S], 150 * S)
    found.add_stamps([151 * S, 140 * S, 100 * S, 120 * S], 150 * S)
    found.add_stamps([149 * S, 145 * S], 150 * S)
    assert found.patrol(0) == Patrol(5 * S, 149 * S, 0)
    found.add_stamps([151 * S], 151 * S)
    assert found.patrol(0).last_scan_ns == 151 * S


def test_old_pauses_are_dropped_and_the_number_stored_is_bounded(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    stretches = Stretches()
    for number in range(8):
        stretches.add(2 * number * SHORTEST_NS)
    assert not stretches.add(0), "it is no news"
    # A pause that ends exactly at the limit stays.
    assert stretches.forget(4 * SHORTEST_NS) == 4 * SHORTEST_NS
    assert next(stretches.pauses()) == (2 * SHORTEST_NS, 4 * SHORTEST_NS)
    assert stretches.forget(4 * SHORTEST_NS + 1) == 4 * SHORTEST_NS + 1
    assert next(stretches.pauses()) == (4 * SHORTEST_NS, 6 * SHORTEST_NS)
    for most, complete_ns in ((5, 0), (4, 6 * SHORTEST_NS)):
        monkeypatch.setattr(scans, "MAX_PAUSES", most)
        assert stretches.forget(0) == complete_ns
    assert len([*stretches.pauses()]) == 4
