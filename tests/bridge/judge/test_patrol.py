from lupin_bridge.judge.scans import LAP_INTERVALS, Patrol, RecentScans
from lupin_twin.core.past import PastWrite
from lupin_twin.core.state import TagState
from tests.support.seen import BY_LIGHT

S = 1_000_000_000


def scanned(*stamps_s: float, tags: int = 10) -> RecentScans:
    """As many tags, scanned in turn."""
    scans = RecentScans(BY_LIGHT.day)
    for number, stamp_s in enumerate(stamps_s):
        name = str(number % tags)
        write = PastWrite(0, 0, name, int(stamp_s * S), 0, 0, ("temperature",), (22.0,))
        scans.take([write], {name: TagState(name)})
    return scans


def interval_ns(*stamps_s: float) -> int | None:
    return scanned(*stamps_s).patrol(None, 0).interval_ns


def test_a_way_back_or_a_pause_does_not_change_the_interval() -> None:
    assert interval_ns(0, 40, 80, 120, 700, 740) == 40 * S


def test_only_the_last_intervals_count() -> None:
    slow = [i * 600 for i in range(2 * LAP_INTERVALS)]
    fast = [slow[-1] + 5 * (i + 1) for i in range(LAP_INTERVALS)]
    assert interval_ns(*slow, *fast) == 5 * S


def test_scans_at_one_moment_count_once_and_those_still_to_come_do_not_count() -> None:
    scans = scanned(100, 140, 120, 140, 151)
    assert scans.patrol(150 * S, 0) == Patrol(20 * S, 140 * S, 0)
    assert scans.patrol(151 * S, 0).last_scan_ns == 151 * S
