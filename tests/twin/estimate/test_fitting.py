"""The most probable parameters: the density, its gradient, and its maximum."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings

from lupin_twin.estimate.kernel import PRIOR_LOG_SD, PRIOR_MEDIAN, Pairs, Readings, scale_of
from lupin_twin.estimate.model import hyper_of, minimise, negative_log_posterior
from tests.support import textbook_gp
from tests.support.estimates import DAY_S, some_readings, spots_of

START = np.zeros(len(PRIOR_MEDIAN))


def objective_of(readings: Readings) -> Any:
    y = scale_of(readings.value).standardised(readings.value)
    return negative_log_posterior(Pairs(readings, DAY_S), y)


@given(some_readings())
def test_the_objective_is_minus_the_log_of_likelihood_and_prior(readings: Readings) -> None:
    y = scale_of(readings.value).standardised(readings.value)
    there = np.linspace(-0.5, 0.5, len(START))

    def plainly(coordinates: Any) -> float:
        h = hyper_of(coordinates)
        likelihood = textbook_gp.log_likelihood(spots_of(readings), y, h)
        return -likelihood - textbook_gp.log_prior(h, PRIOR_MEDIAN, PRIOR_LOG_SD)

    objective = objective_of(readings)
    found = objective(there)[0] - objective(START)[0]
    assert found == pytest.approx(plainly(there) - plainly(START), rel=1e-6, abs=1e-6)


@settings(max_examples=30)
@given(some_readings())
def test_its_gradient_equals_finite_differences(readings: Readings) -> None:
    objective = objective_of(readings)
    there = np.linspace(0.4, -0.4, len(START))
    step = 1e-5
    expected = [
        (objective(there + step * axis)[0] - objective(there - step * axis)[0]) / (2.0 * step)
        for axis in np.eye(len(there))
    ]
    scale = 1.0 + np.abs(expected).max()
    assert objective(there)[1] == pytest.approx(expected, rel=1e-4, abs=1e-5 * scale)


def test_a_matrix_that_cannot_be_factorised_has_no_density_and_ends_no_search() -> None:
    def steep(at: Any) -> tuple[float, Any]:
        if at[0] > 0.5:
            return np.inf, at
        return float((at[0] - 2.0) ** 2), np.array([2.0 * (at[0] - 2.0)])

    assert minimise(steep, np.zeros(1))[0] == pytest.approx(0.5, abs=0.1)
    with pytest.raises(np.linalg.LinAlgError, match="singular at the prior's own median"):
        minimise(lambda at: (np.inf, at), START)
