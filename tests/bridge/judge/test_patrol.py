from hypothesis import given
from hypothesis import strategies as st

from lupin_bridge.judge.scans import LAP_INTERVALS, NO_PATROL, Patrol, Scans
from lupin_bridge.judge.verdict import Health, Kind, Reason, Verdict, is_overdue

S = 1_000_000_000


def heard(*stamps_s: float) -> Patrol:
    scans = Scans()
    scans.heard([int(stamp * S) for stamp in stamps_s], None)
    return scans.patrol(0)


def test_one_scan_makes_no_rhythm_and_none_no_last_one() -> None:
    assert heard() == NO_PATROL
    assert heard(100) == Patrol(None, 100 * S, 0)
    assert heard(100, 140) == Patrol(40 * S, 140 * S, 0)


def test_a_way_back_or_a_pause_does_not_change_the_rhythm() -> None:
    assert heard(0, 40, 80, 120, 700, 740).interval_ns == 40 * S


def test_what_is_known_already_or_is_still_to_come_is_no_scan() -> None:
    scans = Scans()
    scans.heard([100 * S, 140 * S], 150 * S)
    scans.heard([100 * S, 120 * S, 140 * S, 151 * S], 150 * S)
    assert scans.patrol(0) == Patrol(40 * S, 140 * S, 0)
    scans.heard([151 * S], 151 * S)
    assert scans.patrol(0).last_scan_ns == 151 * S


def test_a_clock_that_went_back_begins_anew() -> None:
    scans = Scans()
    scans.heard([100 * S, 140 * S], None)
    scans.forget()
    assert scans.patrol(2) == Patrol(overdue=2)
    scans.heard([10 * S], None)
    assert scans.patrol(0) == Patrol(None, 10 * S, 0)


@given(st.lists(st.integers(0, 10**6), max_size=60), st.integers(1, 10))
def test_it_does_not_matter_how_stamps_come_together(stamps: list[int], size: int) -> None:
    at_once, bit_by_bit = Scans(), Scans()
    at_once.heard(stamps, None)
    ordered = sorted(stamps)
    for begin in range(0, len(ordered), size):
        bit_by_bit.heard(reversed(ordered[begin : begin + size]), None)
    assert at_once.patrol(0) == bit_by_bit.patrol(0)


def test_only_the_last_intervals_count() -> None:
    slow = [i * 600 for i in range(5)]
    fast = [slow[-1] + 5 * (i + 1) for i in range(LAP_INTERVALS)]
    assert heard(*slow, *fast).interval_ns == 5 * S


def test_overdue_is_a_tag_of_which_no_reading_holds() -> None:
    def judged(*reasons: Reason) -> Health:
        return Health(Verdict.UNKNOWN, reasons)

    assert is_overdue(
        judged(Reason(Kind.PEST, Verdict.CRITICAL), Reason(Kind.OLD, Verdict.UNKNOWN))
    )
    assert not is_overdue(judged(Reason(Kind.OLD, Verdict.UNKNOWN, "co2")))
    assert not is_overdue(judged())
