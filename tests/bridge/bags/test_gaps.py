"""How long nothing happens in a recording, in words."""

from __future__ import annotations

import pytest

from lupin_bridge.bags.gaps import Gap, lasting

HOUR_NS = 3_600 * 10**9


@pytest.mark.parametrize(
    ("seconds", "told"),
    [
        (0.4, "0 s"),
        (61.0, "1 min 1 s"),
        (3_600.0, "1 h"),
        (3.2 * 3_600, "3 h 12 min"),
        (86_399.6, "1 d"),
        (86_400.0 * 20_049 + 60.0, "20,049 d"),
    ],
)
def test_a_time_is_told_by_its_two_largest_units(seconds: float, told: str) -> None:
    assert lasting(seconds) == told


def test_a_gap_is_told_with_its_end_and_how_long_it_is_waited_for() -> None:
    gap = Gap(5 * HOUR_NS, 15 * HOUR_NS)
    until = "until 1970-01-01 15:00:00 UTC"
    assert gap.told(1.0).startswith(f"nothing is to be published for 10 h, {until}: --skip-gaps")
    assert f"for 10 h, {until}, waited for 1 h: --skip-gaps" in gap.told(10.0)
    skipped = Gap(0, 2**64 - 1, is_skipped=True).told(1.0)
    assert skipped.startswith("skipped 213,503 d 23 h in which nothing is to be published, until ")
