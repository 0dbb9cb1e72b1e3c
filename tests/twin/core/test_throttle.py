"""One message per key and period, and a count of what was held back."""

from __future__ import annotations

from lupin_twin.core.drops import Throttle


def test_the_first_goes_through_and_the_rest_of_the_period_is_held_back() -> None:
    throttle = Throttle(period_s=5.0)
    assert throttle.allow("a", 100.0) == 0
    assert throttle.allow("a", 100.1) is None
    assert throttle.allow("a", 104.9) is None
    assert throttle.allow("a", 105.0) == 2
    assert throttle.allow("a", 110.0) == 0


def test_keys_do_not_hide_each_other() -> None:
    throttle = Throttle(period_s=5.0)
    assert throttle.allow(("kind", 2), 0.0) == 0
    assert throttle.allow(("kind", 9), 0.0) == 0
    assert throttle.allow(("kind", 2), 0.0) is None
