from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lupin_bridge.judge import scans
from lupin_bridge.judge.scans import SHORTEST_NS, Stretches

STAMPS = st.lists(st.integers(0, 60).map(lambda n: n * SHORTEST_NS // 4), min_size=1, max_size=30)


@given(STAMPS)
def test_pauses_are_what_lies_between_tries_in_any_order(stamps: list[int]) -> None:
    stretches = Stretches()
    news = [stretches.add(stamp_ns) for stamp_ns in stamps]
    plain = [(a, b) for a, b in pairwise(sorted(set(stamps))) if b - a > SHORTEST_NS]
    assert list(stretches.pauses()) == plain
    assert stretches.newest_ns == max(stamps)
    assert news[0]
    assert not any(stretches.add(stamp_ns) for stamp_ns in stamps)


def test_a_pause_does_not_count_for_what_is_overdue() -> None:
    stretches = Stretches()
    assert stretches.newest_ns is None
    for quarter in (0, 2, 4, 20, 22):
        stretches.add(quarter * SHORTEST_NS // 4)
    assert stretches.overdue_ns(0, SHORTEST_NS - 1) == SHORTEST_NS - 1
    # What runs out as the pause begins does so as it ends.
    assert stretches.overdue_ns(0, SHORTEST_NS) == 5 * SHORTEST_NS
    assert stretches.overdue_ns(0, SHORTEST_NS + 1) == 5 * SHORTEST_NS + 1
    assert stretches.has_pause_within(SHORTEST_NS, 5 * SHORTEST_NS)
    assert not stretches.has_pause_within(SHORTEST_NS, 5 * SHORTEST_NS - 1)


def test_what_is_old_is_forgotten_and_so_many_pauses_are_kept(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    stretches = Stretches()
    for number in range(8):
        stretches.add(2 * number * SHORTEST_NS)
    # The pause that ends at the moment itself is kept.
    assert stretches.forget(4 * SHORTEST_NS) == 4 * SHORTEST_NS
    assert next(stretches.pauses()) == (2 * SHORTEST_NS, 4 * SHORTEST_NS)
    assert stretches.forget(4 * SHORTEST_NS + 1) == 4 * SHORTEST_NS + 1
    assert next(stretches.pauses()) == (4 * SHORTEST_NS, 6 * SHORTEST_NS)
    monkeypatch.setattr(scans, "MAX_PAUSES", 5)
    assert stretches.forget(0) == 0
    monkeypatch.setattr(scans, "MAX_PAUSES", 4)
    assert stretches.forget(0) == 6 * SHORTEST_NS
    assert len([*stretches.pauses()]) == 4
