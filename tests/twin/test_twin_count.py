"""A second twin counts once it cannot be the shadow of a dead one."""

from __future__ import annotations

from lupin_twin.twin_count import TwinCount


def test_one_twin_is_one_and_none_is_no_mistake() -> None:
    count = TwinCount(shadow_s=25.0)
    assert not count.see(1, 0.0)
    assert not count.see(0, 100.0)
    assert count.value == 1


def test_a_restarted_twin_is_not_taken_for_two() -> None:
    count = TwinCount(shadow_s=25.0)
    assert not count.see(2, 0.0)
    assert not count.see(2, 24.9)
    assert not count.see(1, 25.0)
    assert not count.see(2, 26.0)
    assert count.value == 1


def test_two_that_stay_are_two_until_one_goes() -> None:
    count = TwinCount(shadow_s=25.0)
    count.see(2, 0.0)
    assert count.see(3, 25.0)
    assert count.value == 3
    assert not count.see(1, 26.0)
    assert count.value == 1
