"""Readings compared with all others: leave-one-out as in the textbook, and changed sensors."""

from math import sqrt

import numpy as np
import pytest
from hypothesis import given

from lupin_twin.estimate.kernel import Hyper, Readings, Scale
from lupin_twin.estimate.model import Model, fit
from lupin_twin.estimate.posterior import INFLATION
from lupin_twin.estimate.solution import MAX_EXACT
from lupin_twin.field.grid import FloatArray
from tests.support import textbook_gp
from tests.support.estimates import DAY_S, a_day, hypers, some_readings, spots_of


def by_the_textbook(readings: Readings, block: list[int], h: Hyper) -> tuple[float, float]:
    """Mean and sd of a block's last reading, given all other blocks; in the sensor's unit."""
    y = (readings.value - 20.0) / 2.0
    mean, covariance = textbook_gp.left_out(spots_of(readings), y, block, h)
    noise = h.tau**2 + 0.02**2
    true = float(covariance[-1, -1]) - noise
    return 20.0 + 2.0 * float(mean[-1]), 2.0 * sqrt(INFLATION**2 * true + noise)


@given(some_readings(), hypers)
def test_the_prediction_is_the_textbooks_without_the_last_four_readings(
    readings: Readings, h: Hyper
) -> None:
    model = Model(Scale(20.0, 2.0), DAY_S, h)
    found = model.posterior(readings, 2 * DAY_S).changes()
    order = np.lexsort((np.arange(len(readings)), readings.time_s))
    for tag, change in enumerate(found):
        own = [int(row) for row in order if readings.tag[row] == tag]
        assert (change is None) == (not own)
        if change is None or change.since_s is not None:
            continue
        mean, sd = by_the_textbook(readings, own[-4:], h)
        assert change.expected == pytest.approx(mean, rel=1e-5, abs=1e-5)
        assert change.expected_sd == pytest.approx(sd, rel=1e-5)


def with_offset(day: Readings, tag: int, scans: int, offset: float) -> tuple[Readings, FloatArray]:
    """The last scans of a tag are off; and the time of these."""
    own = np.flatnonzero(day.tag == tag)
    late = own[np.argsort(day.time_s[own])[-scans:]]
    value = day.value.copy()
    value[late] += offset
    return Readings(day.time_s, day.tag, value, day.xy), np.sort(day.time_s[late])


@pytest.mark.parametrize("scans", [2, 4, 9])
def test_a_sensor_that_reads_three_degrees_more_has_changed_since_then(scans: int) -> None:
    day = a_day(passes=24)
    model = fit(day)
    assert not any(one.since_s is not None for one in model.posterior(day, DAY_S).changes() if one)
    off, since = with_offset(day, 3, scans, 3.0)
    found = model.posterior(off, DAY_S).changes()
    assert [tag for tag, one in enumerate(found) if one and one.since_s is not None] == [3]
    change = found[3]
    assert change is not None
    assert change.since_s == since[0]
    assert change.offset == pytest.approx(3.0, abs=0.5)
    assert off.value[off.time_s == since[-1]][0] - change.expected == pytest.approx(3.0, abs=0.5)


def test_one_odd_reading_is_no_change_nor_is_a_position_that_was_always_different() -> None:
    day = a_day(passes=24)
    model = fit(day)
    for scans in (1, 24):
        off, _ = with_offset(day, 3, scans, 3.0)
        found = model.posterior(off, DAY_S).changes()
        assert not any(one.since_s is not None for one in found if one)


def test_with_many_tags_each_is_judged_by_those_near_it() -> None:
    day = a_day(tags=200, passes=6)
    assert len(day) > MAX_EXACT
    model = fit(day)
    off, since = with_offset(day, 50, 3, 4.0)
    found = model.posterior(off, DAY_S).changes()
    assert [tag for tag, one in enumerate(found) if one and one.since_s is not None] == [50]
    change = found[50]
    assert change is not None
    assert change.since_s == since[0]
