import pytest

from lupin_bridge.judge import scans
from lupin_bridge.judge.scans import SHORTEST_NS, Stretches


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
    monkeypatch.setattr(scans, "MAX_PAUSES", 5)
    assert stretches.forget(0) == 0
    monkeypatch.setattr(scans, "MAX_PAUSES", 4)
    assert stretches.forget(0) == 6 * SHORTEST_NS
    assert len([*stretches.pauses()]) == 4
