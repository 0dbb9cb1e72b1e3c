"""Whether readings of many days tell that a day takes longer."""

from __future__ import annotations

import numpy as np
import pytest

from lupin_twin.estimate import NOTHING, STRONG_NATS, Readings, gains, longer_by
from lupin_twin.estimate.day_length import LEAST_DAYS
from tests.support.estimates import DAY_S, a_day


def days(count: int, swing: float = 4.0) -> Readings:
    """Of eight tags, 64 in all."""
    one = a_day(passes=8)
    time_s = one.time_s * count
    value = 21.0 + swing * np.sin(2.0 * np.pi * time_s / DAY_S) + 0.4 * one.xy[one.tag, 1]
    noise = np.random.default_rng(1).normal(0.0, 0.2, len(one))
    return Readings(time_s, one.tag, value + noise, one.xy)


@pytest.mark.parametrize("too_short", [5.0, 60.0])
def test_a_day_that_is_told_too_short_is_less_probable_than_a_longer_one(too_short: float) -> None:
    found = gains(days(1), DAY_S / too_short)
    longer = longer_by([found])
    assert max(found) > 1.5 * STRONG_NATS
    assert longer is not None
    assert 0.25 < longer / too_short < 4.0


@pytest.mark.parametrize(("swing", "most"), [(4.0, -STRONG_NATS), (0.0, STRONG_NATS)])
def test_a_day_that_is_told_right_is_more_probable_and_without_one_nothing_is_told(
    swing: float, most: float
) -> None:
    assert max(gains(days(5, swing), DAY_S)) < most


def test_of_less_than_two_days_nothing_is_told() -> None:
    readings = days(2)
    lasts_s = float(np.ptp(readings.time_s))
    assert gains(readings, lasts_s / LEAST_DAYS) != NOTHING
    assert gains(readings, 1.001 * lasts_s / LEAST_DAYS) == NOTHING
    assert gains(readings.take(np.array([0])), DAY_S) == NOTHING


def test_of_days_that_explain_about_as_much_the_shortest_is_told() -> None:
    assert longer_by([(12.0, 11.0, 12.0 + STRONG_NATS)]) == 4.0
    assert longer_by([(12.0, 11.0, 12.1 + STRONG_NATS)]) == 64.0
    assert longer_by([(STRONG_NATS - 0.1, STRONG_NATS, 2.0)]) == 16.0, "it is strong itself"
    assert longer_by([(STRONG_NATS - 0.1, 0.0, 0.0)] * 2) is None, "neither sensor is clear"
    assert longer_by([(STRONG_NATS, 0.0, 0.0), (-0.1, 0.0, 0.0)]) is None, "one is against it"
    assert longer_by([]) is None
