"""The method that the aim of `bench_estimate` was set by, in the plainest code, as a yardstick.

The same kernel without the day's second harmonic, other priors, one fit on 150 readings drawn at
random, one solution of all readings (up to 1,000), and standard deviations 1.2 times as large.
"""

from typing import Final

import numpy as np

from lupin_twin.estimate.kernel import Readings
from lupin_twin.estimate.model import minimise
from tests.bench.other_worlds import HOUR_S, Floats

# Of sg, lg (h), sp, sa, sh, lh (h), sq, l (m), tau: as in `lupin_twin.estimate.kernel.Hyper`.
_LOG_MEDIAN: Final = np.log(np.array([1.0, 5.0, 1.0, 1.0, 0.5, 8.0, 0.4, 2.5, 0.15]))
_LOG_SD: Final = np.array([0.7, 0.6, 0.7, 0.6, 0.7, 0.5, 0.7, 0.5, 1.0])
_FITTED, _SOLVED, _INFLATION, _JITTER = 150, 1_000, 1.2, 0.02**2


def estimate(readings: Readings, places: Floats, at_s: float) -> tuple[Floats, Floats]:
    """Mean and standard deviation at places (k, 2), m, as of `at_s`: both (k,)."""
    number = len(readings.value)
    spots = np.column_stack((readings.xy[readings.tag], readings.time_s / HOUR_S))
    centre, weight = np.median(readings.value), min(number, 20)
    spread = np.mean((readings.value - centre) ** 2)
    scale = ((4.0 * readings.value.var() + weight * spread) / (4.0 + weight)) ** 0.5
    y = (readings.value - centre) / scale

    drawn = np.sort(np.random.default_rng(0).choice(number, min(number, _FITTED), replace=False))
    p = np.exp(_LOG_MEDIAN + _LOG_SD * _fit(spots[drawn], y[drawn]))

    solved = np.unique(np.linspace(0, number - 1, min(number, _SOLVED)).astype(int))
    shared = _kernel(
        np.column_stack((places, np.full(len(places), at_s / HOUR_S))), spots[solved], p
    )
    weights = np.linalg.solve(_of_readings(spots[solved], p), shared.T)
    sg, _, sp, sa, sh, _, sq, _, _ = p
    prior = 100.0 + sg**2 + sp**2 + sa**2 + sh**2 + sq**2
    variance = np.maximum(prior - (shared * weights.T).sum(axis=1), 1e-12)
    return centre + scale * (weights.T @ y[solved]), _INFLATION * scale * np.sqrt(variance)


def _fit(spots: Floats, y: Floats) -> Floats:
    """The most probable parameters, as steps of the prior's sd from its median."""

    def surprise(steps: Floats) -> float:
        covariance = _of_readings(spots, np.exp(_LOG_MEDIAN + _LOG_SD * steps))
        try:
            root = np.linalg.cholesky(covariance)
        except np.linalg.LinAlgError:
            return float("inf")
        white = np.linalg.solve(root, y)
        return float(0.5 * (white @ white + steps @ steps) + np.log(np.diagonal(root)).sum())

    def with_slope(steps: Floats) -> tuple[float, Floats]:
        each = np.eye(len(steps)) * 1e-4
        return surprise(steps), np.array(
            [(surprise(steps + one) - surprise(steps - one)) / 2e-4 for one in each]
        )

    return minimise(with_slope, np.zeros(len(_LOG_SD)))


def _of_readings(spots: Floats, p: Floats) -> Floats:
    result: Floats = _kernel(spots, spots, p) + np.eye(len(spots)) * (p[8] ** 2 + _JITTER)
    return result


def _kernel(a: Floats, b: Floats, p: Floats) -> Floats:
    """Covariance of what is true at spots (n, 3) and (m, 3): x, y in m, time in h."""
    sg, lg, sp, sa, sh, lh, sq, length, _ = p
    x, y, hours = np.abs(a[:, np.newaxis] - b[np.newaxis]).transpose(2, 0, 1)
    day = np.cos(2.0 * np.pi * hours / 24.0)
    near = _matern(x, length) * _matern(y, length)
    place = sa**2 + sh**2 * _matern(hours, lh) + sq**2 * day
    result: Floats = 100.0 + sg**2 * _matern(hours, lg) + sp**2 * day + near * place
    return result


def _matern(distance: Floats, length: float) -> Floats:
    scaled = 3.0**0.5 * distance / length
    result: Floats = (1.0 + scaled) * np.exp(-scaled)
    return result
