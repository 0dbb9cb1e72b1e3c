"""The covariance and its gradient, held against the plainest code and finite differences."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given

from lupin_twin.estimate import Readings
from lupin_twin.estimate.kernel import UNKNOWN_MEAN, Hyper, pairs_of
from tests.support import textbook_gp
from tests.support.estimates import DAY_S, a_day, hypers, some_readings, spots_of


@given(some_readings(), hypers)
def test_the_covariance_is_the_formula_pair_by_pair(readings: Readings, h: Hyper) -> None:
    expected = textbook_gp.of_readings(spots_of(readings), h)
    pairs = pairs_of(readings, DAY_S)
    assert np.tril(pairs.covariance(h)) == pytest.approx(np.tril(expected), rel=1e-12)
    place = np.empty((len(readings), len(readings)))
    assert pairs.covariance(h, place) is place


def test_many_rows_are_made_some_at_a_time() -> None:
    day = a_day(tags=5, passes=23)
    h = Hyper(1.0, 5.0, 1.0, 1.0, 0.5, 8.0, 0.4, 2.5, 0.15)
    expected = textbook_gp.of_readings(spots_of(day), h)
    pairs = pairs_of(day, DAY_S)
    assert np.tril(pairs.covariance(h)) == pytest.approx(np.tril(expected), rel=1e-12)
    weights = np.full((len(day), len(day)), 2.0)
    by_sg = (
        h.sg**2
        * 2.0
        * sum(textbook_gp.matern(one - other, h.lg) for one in pairs.hours for other in pairs.hours)
    )
    assert pairs.gradient(h, weights)[0] == pytest.approx(by_sg, rel=1e-9)


def test_hours_are_those_of_the_day_whatever_its_length() -> None:
    slow = a_day()
    fast = Readings(slow.time_s / 60.0, slow.tag, slow.value, slow.xy)
    h = Hyper(1.0, 5.0, 1.0, 1.0, 0.5, 8.0, 0.4, 2.5, 0.15)
    same = np.tril(pairs_of(slow, DAY_S).covariance(h))
    assert np.tril(pairs_of(fast, DAY_S / 60.0).covariance(h)) == pytest.approx(same, rel=1e-12)


def test_before_any_reading_the_variance_is_the_sum_of_all() -> None:
    h = Hyper(1.0, 5.0, 2.0, 3.0, 4.0, 8.0, 5.0, 2.5, 0.15)
    assert h.local_variance == 9.0 + 16.0 + 25.0
    assert h.prior_variance == UNKNOWN_MEAN + 1.0 + 4.0 + h.local_variance


@given(some_readings(), hypers)
def test_the_gradient_is_that_of_finite_differences(readings: Readings, h: Hyper) -> None:
    pairs = pairs_of(readings, DAY_S)
    weights = np.random.default_rng(0).standard_normal((len(readings), len(readings)))
    weights += weights.T
    logs = np.log(np.array(h))

    def half_sum(at: np.ndarray[tuple[int], np.dtype[np.float64]]) -> float:
        lower = np.tril(pairs.covariance(Hyper(*np.exp(at).tolist())) - UNKNOWN_MEAN)
        covariance = lower + np.tril(lower, -1).T
        return 0.5 * float(np.vdot(weights, covariance))

    step = 1e-5
    expected = [
        (half_sum(logs + step * axis) - half_sum(logs - step * axis)) / (2.0 * step)
        for axis in np.eye(len(logs))
    ]
    found = pairs.gradient(h, weights)
    assert found == pytest.approx(expected, rel=1e-5, abs=1e-6 * (1.0 + np.abs(found).max()))
