"""A Gaussian process by the textbook, in the simplest code: the reference of the estimate.

Rasmussen and Williams, "Gaussian Processes for Machine Learning", 2006, 2.25 and 2.26; the kernel
is that of `lupin_twin.estimate.kernel`, written out again, pair by pair.
"""

from collections.abc import Sequence
from math import cos, exp, log, pi, sqrt
from typing import NamedTuple

import numpy as np

from lupin_twin.estimate.kernel import Hyper
from lupin_twin.field.grid import FloatArray


class Spot(NamedTuple):
    """Position (m) and time (h of a day of 24)."""

    x: float
    y: float
    hour: float


def matern(distance: float, length: float) -> float:
    scaled = sqrt(3.0) * abs(distance) / length
    return (1.0 + scaled) * exp(-scaled)


def common(a: Spot, b: Spot, h: Hyper) -> float:
    """The covariance of the true values at two spots."""
    apart = a.hour - b.hour
    day = cos(2.0 * pi * apart / 24.0) + h.half**2 * cos(4.0 * pi * apart / 24.0)
    near = matern(a.x - b.x, h.l) * matern(a.y - b.y, h.l)
    greenhouse = 100.0 + h.sg**2 * matern(apart, h.lg) + h.sp**2 * day
    return greenhouse + near * (h.sa**2 + h.sh**2 * matern(apart, h.lh) + h.sq**2 * day)


def of_readings(spots: Sequence[Spot], h: Hyper) -> FloatArray:
    """The covariance of readings at spots, each with its own noise."""
    return np.array(
        [
            [common(a, b, h) + (h.tau**2 + 0.02**2 if i == j else 0.0) for j, b in enumerate(spots)]
            for i, a in enumerate(spots)
        ]
    )


def predicted(spots: Sequence[Spot], y: FloatArray, spot: Spot, h: Hyper) -> tuple[float, float]:
    """Mean and variance of the true value at a spot, given standardised readings `y` at others."""
    covariance = of_readings(spots, h)
    shared = np.array([common(spot, other, h) for other in spots])
    weights = np.linalg.solve(covariance, shared)
    return float(weights @ y), float(common(spot, spot, h) - weights @ shared)


def left_out(
    spots: Sequence[Spot], y: FloatArray, block: Sequence[int], h: Hyper
) -> tuple[FloatArray, FloatArray]:
    """Mean and covariance of a block of readings, noise included, given all the others."""
    covariance = of_readings(spots, h)
    rest = [index for index in range(len(spots)) if index not in block]
    shared = covariance[np.ix_(block, rest)]
    if not rest:
        return np.zeros(len(block)), covariance[np.ix_(block, block)]
    mean = shared @ np.linalg.solve(covariance[np.ix_(rest, rest)], y[rest])
    taken = shared @ np.linalg.solve(covariance[np.ix_(rest, rest)], shared.T)
    return mean, covariance[np.ix_(block, block)] - taken


def log_likelihood(spots: Sequence[Spot], y: FloatArray, h: Hyper) -> float:
    """Of the readings, up to a constant."""
    covariance = of_readings(spots, h)
    _, determinant = np.linalg.slogdet(covariance)
    return float(-0.5 * y @ np.linalg.solve(covariance, y) - 0.5 * determinant)


def log_prior(h: Hyper, medians: Hyper, sds: Hyper) -> float:
    """Log-normal, in the logarithms, up to a constant."""
    return -0.5 * sum(
        (log(value / median) / sd) ** 2 for value, median, sd in zip(h, medians, sds, strict=True)
    )
