"""What the readings say of the kernel's parameters: their most probable values, and how unsure.

Pure. Maximum a posteriori by BFGS with the analytic gradient (Rasmussen and Williams, "Gaussian
Processes for Machine Learning", 2006, 5.9), then draws from the Laplace approximation about it,
which is never taken to be wider than the prior. Coordinates are those in which the prior is a
standard normal: (log parameter - log median) / sd of the log.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np

from lupin_twin.estimate.kernel import PRIOR_LOG_SD, PRIOR_MEDIAN, Hyper, Pairs
from lupin_twin.estimate.triangle import root_of_inverse
from lupin_twin.grid import FloatArray
from lupin_twin.idw import Abandoned, never

DRAWS: Final = 8
_MAX_STEPS: Final = 60
# Half a thousandth of a unit of log probability is nothing to anybody.
_GOOD_ENOUGH: Final = 5e-4
_SHORTEST: Final = 1e-3
# Beyond, exp() is past what floats can multiply.
_FARTHEST: Final = 12.0
# A draw where the density is too low is moved so much nearer, again and again until so near.
_NEARER: Final = 0.8
_NEAREST: Final = 0.3
_PROBE: Final = 0.02
_SEED: Final = 20_260_101
_LOG_MEDIAN: Final = np.log(np.array(PRIOR_MEDIAN))
_LOG_SD: Final = np.array(PRIOR_LOG_SD)

Objective = Callable[[FloatArray], tuple[float, FloatArray]]


class FitFailed(RuntimeError):
    """No parameters were found; the message says why."""


def hyper_of(coordinates: FloatArray) -> Hyper:
    """The parameters at a place."""
    return Hyper(*np.exp(_LOG_MEDIAN + _LOG_SD * coordinates).tolist())


def surprise(pairs: Pairs, y: FloatArray, should_stop: Callable[[], bool] = never) -> Objective:
    """Minus the log of the posterior density, but for a constant, and its gradient.

    The density of covariances that cannot be factorised, or whose numbers are past what floats
    hold, is taken to be 0. When `should_stop` says so, it raises `Abandoned`.
    """
    # Large arrays are dear to get from the system again and again.
    covariance, root, inverse = (np.zeros((len(y), len(y))) for _ in range(3))

    def at(coordinates: FloatArray) -> tuple[float, FloatArray]:
        if should_stop():
            raise Abandoned
        h = hyper_of(coordinates)
        try:
            root_of_inverse(pairs.covariance(h, covariance), root)
        except np.linalg.LinAlgError:
            return np.inf, coordinates
        alpha = root.T @ (root @ y)
        value = 0.5 * (y @ alpha + coordinates @ coordinates) - np.log(np.diagonal(root)).sum()
        np.matmul(root.T, root, out=inverse)
        np.subtract(inverse, np.outer(alpha, alpha), out=inverse)
        slope = _LOG_SD * pairs.gradient(h, inverse) + coordinates
        if not (np.isfinite(value) and np.isfinite(slope).all()):
            return np.inf, coordinates
        return float(value), slope

    return at


def minimise(objective: Objective, start: FloatArray, max_steps: int = _MAX_STEPS) -> FloatArray:
    """BFGS (Nocedal and Wright, "Numerical Optimization", 2006, 6.1) with halved steps.

    Raises:
        FitFailed: not even the start has a density.

    """
    place = start
    value, slope = objective(place)
    if not np.isfinite(value):
        raise FitFailed("the readings' covariance is singular at the prior's own median")
    curvature = np.eye(len(place))  # the inverse Hessian, as far as it is known
    for _ in range(max_steps):
        step = -curvature @ slope
        gain = float(slope @ step)
        if -gain < _GOOD_ENOUGH:
            break
        step *= min(1.0, 2.0 / float(np.abs(step).max()))  # a prior's two sds at a time
        share, there = 1.0, place
        while True:
            there = np.clip(place + share * step, -_FARTHEST, _FARTHEST)
            new_value, new_slope = objective(there)
            if new_value <= value + 1e-4 * share * gain or share < _SHORTEST:
                break
            share /= 2.0
        if not new_value < value:
            break
        moved, turned = there - place, new_slope - slope
        along = float(moved @ turned)
        if along > 1e-10:
            left = np.eye(len(place)) - np.outer(moved, turned) / along
            curvature = left @ curvature @ left.T + np.outer(moved, moved) / along
        place, value, slope = there, new_value, new_slope
    return place


def draws(objective: Objective, place: FloatArray, count: int = DRAWS) -> list[FloatArray]:
    """Antithetic draws about the most probable place, the same ones for the same curvature."""
    size = len(place)
    hessian = np.eye(size)  # what the prior says, where there is nothing better
    value, slope = objective(place)
    for axis in range(size):
        probe = np.zeros(size)
        probe[axis] = _PROBE
        ahead, slope_ahead = objective(place + probe)
        if np.isfinite(value) and np.isfinite(ahead):
            hessian[axis] = (slope_ahead - slope) / _PROBE
    values, vectors = np.linalg.eigh((hessian + hessian.T) / 2.0)
    # In these coordinates the prior's curvature is 1. The symmetric root is the one that does not
    # depend on which of equal axes comes first.
    narrow = (vectors / np.sqrt(np.maximum(values, 1.0))) @ vectors.T
    chance = np.random.default_rng(_SEED).standard_normal((count // 2, size))
    result = []
    for one in chance:
        for step in (narrow @ one, -(narrow @ one)):
            # As far as the density is not lower than so many sds away from a normal's middle.
            lowest, share = value + 0.5 * float(one @ one), 1.0
            there = np.clip(place + step, -_FARTHEST, _FARTHEST)
            while share > _NEAREST and not objective(there)[0] <= lowest:
                share *= _NEARER
                there = np.clip(place + share * step, -_FARTHEST, _FARTHEST)
            result.append(there)
    return result
