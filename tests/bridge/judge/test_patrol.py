from lupin_bridge.judge.scans import LAP_INTERVALS, Patrol, Scans

S = 1_000_000_000


def add_stamps(*stamps_s: float) -> Patrol:
    scans = Scans()
    scans.add_stamps([int(stamp * S) for stamp in stamps_s], None)
    return scans.patrol(0)


def test_a_way_back_or_a_pause_does_not_change_the_interval() -> None:
    assert add_stamps(0, 40, 80, 120, 700, 740).interval_ns == 40 * S


def test_only_the_last_intervals_count() -> None:
    slow = [i * 600 for i in range(2 * LAP_INTERVALS)]
    fast = [slow[-1] + 5 * (i + 1) for i in range(LAP_INTERVALS)]
    assert add_stamps(*slow, *fast).interval_ns == 5 * S


def test_scans_already_counted_or_still_to_come_do_not_count() -> None:
    scans = Scans()
    scans.add_stamps([100 * S, 140 * S], 150 * S)
    scans.add_stamps([151 * S, 140 * S, 100 * S, 120 * S], 150 * S)
    scans.add_stamps([149 * S, 145 * S], 150 * S)
    assert scans.patrol(0) == Patrol(5 * S, 149 * S, 0)
    scans.add_stamps([151 * S], 151 * S)
    assert scans.patrol(0).last_scan_ns == 151 * S
