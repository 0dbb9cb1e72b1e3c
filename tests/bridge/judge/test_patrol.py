from lupin_bridge.judge.scans import LAP_INTERVALS, Patrol, Scans

S = 1_000_000_000


def heard(*stamps_s: float) -> Patrol:
    scans = Scans()
    scans.heard([int(stamp * S) for stamp in stamps_s], None)
    return scans.patrol(0)


def test_a_way_back_or_a_pause_does_not_change_the_rhythm() -> None:
    assert heard(0, 40, 80, 120, 700, 740).interval_ns == 40 * S


def test_only_the_last_intervals_count() -> None:
    slow = [i * 600 for i in range(5)]
    fast = [slow[-1] + 5 * (i + 1) for i in range(LAP_INTERVALS)]
    assert heard(*slow, *fast).interval_ns == 5 * S
