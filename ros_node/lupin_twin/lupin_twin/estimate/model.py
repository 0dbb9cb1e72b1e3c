"""Fits a model to a sensor's readings, and estimates as of a moment with it. Pure, immutable.

The kernel's parameters are the most probable ones: maximum a posteriori, by BFGS with the analytic
gradient (Rasmussen and Williams, "Gaussian Processes for Machine Learning", 2006, 5.9). In their
coordinates, the prior is a standard normal: (log parameter - log median) / sd of the log.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from lupin_twin.estimate.kernel import (
    PRIOR_LOG_SD,
    PRIOR_MEDIAN,
    Hyper,
    Pairs,
    Readings,
    Scale,
    scale_of,
)
from lupin_twin.estimate.posterior import Posterior
from lupin_twin.estimate.solution import INFLATION
from lupin_twin.field.grid import FloatArray
from lupin_twin.field.idw import Abandoned, never

_MAX_STEPS: Final = 60
# A gain of log probability below this changes nothing visible.
_GOOD_ENOUGH: Final = 5e-4
_SHORTEST: Final = 1e-3
# Beyond this coordinate, products of exp() would overflow.
_FARTHEST: Final = 12.0
_LOG_MEDIAN: Final = np.log(np.array(PRIOR_MEDIAN))
_LOG_SD: Final = np.array(PRIOR_LOG_SD)

Objective = Callable[[FloatArray], tuple[float, FloatArray]]


def hyper_of(coordinates: FloatArray) -> Hyper:
    """The kernel's parameters at these coordinates."""
    return Hyper(*np.exp(_LOG_MEDIAN + _LOG_SD * coordinates).tolist())


def negative_log_posterior(
    pairs: Pairs, y: FloatArray, should_stop: Callable[[], bool] = never
) -> Objective:
    """Return the objective: minus the log posterior density, up to a constant, and its gradient.

    If the covariance cannot be factorised or overflows, the density counts as 0. The objective
    raises `Abandoned` when `should_stop` returns true.
    """

    def at(coordinates: FloatArray) -> tuple[float, FloatArray]:
        if should_stop():
            raise Abandoned
        h = hyper_of(coordinates)
        try:
            covariance = pairs.covariance(h)
            root = np.linalg.cholesky(covariance)
            inverse = np.linalg.inv(covariance)
        except np.linalg.LinAlgError:
            return np.inf, coordinates
        alpha = inverse @ y
        value = 0.5 * (y @ alpha + coordinates @ coordinates) + np.log(np.diagonal(root)).sum()
        weights = inverse - np.outer(alpha, alpha)
        slope = _LOG_SD * pairs.gradient(h, weights) + coordinates
        if not (np.isfinite(value) and np.isfinite(slope).all()):
            return np.inf, coordinates
        return float(value), slope

    return at


def minimise(objective: Objective, start: FloatArray) -> FloatArray:
    """BFGS (Nocedal and Wright, "Numerical Optimization", 2006, 6.1) with halved steps.

    Raises:
        numpy.linalg.LinAlgError: the density is 0 even at the start.

    """
    place = start
    value, slope = objective(place)
    if not np.isfinite(value):
        raise np.linalg.LinAlgError(
            "the readings' covariance is singular at the prior's own median"
        )
    curvature = np.eye(len(place))  # approximates the inverse Hessian
    for _ in range(_MAX_STEPS):
        step = -curvature @ slope
        gain = float(slope @ step)
        if -gain < _GOOD_ENOUGH:
            break
        step *= min(1.0, 2.0 / float(np.abs(step).max()))  # two sds of the prior at most
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


# Readings that are fitted at most: more do not improve the parameters.
MAX_FITTED: Final = 150
# They come from at most `_TAGS` tags. If there are more, groups of `_TOGETHER` neighbours are
# chosen, because these show over how many metres the values change.
_TAGS: Final = 30
_TOGETHER: Final = 6
# A value counts as known while its sd is below this share of the variation between places, and
# below the spread of the readings.
_KNOWN_SHARE: Final = 0.6


@dataclass(frozen=True, slots=True)
class Model:
    """Fitted covariance model of one sensor's readings."""

    scale: Scale
    day_length_s: float
    hyper: Hyper

    @property
    def sd_known(self) -> float:
        """Limit of an estimate's sd, in the sensor's unit; below it, the value counts as known."""
        local = INFLATION * math.sqrt(self.hyper.local_variance)
        return min(_KNOWN_SHARE * local, 1.0) * self.scale.spread

    def posterior(
        self, readings: Readings, at_s: float, should_stop: Callable[[], bool] = never
    ) -> Posterior:
        """Return what the readings tell about the moment `at_s` (ROS time, s), everywhere.

        There has to be a reading, and none may be later. The result's methods raise
        `numpy.linalg.LinAlgError` if the readings' covariance is numerically singular.
        """
        return Posterior(
            self.scale, self.hyper, self.sd_known, self.day_length_s, readings, at_s, should_stop
        )


def fit(
    readings: Readings,
    *,
    day_length_s: float = 86_400.0,
    should_stop: Callable[[], bool] = never,
) -> Model:
    """Fit the most probable model to the readings, given the prior.

    Of many readings, 150 are fitted, of tags all over the greenhouse and of the whole day. A day
    takes `day_length_s` of ROS time.

    Raises:
        numpy.linalg.LinAlgError: the readings cannot be fitted.
        lupin_twin.field.idw.Abandoned: `should_stop`, called at each step, was true.

    """
    scale = scale_of(readings.value)
    some = _some(readings, day_length_s)
    pairs = Pairs(some, day_length_s)
    objective = negative_log_posterior(pairs, scale.standardised(some.value), should_stop)
    best = minimise(objective, np.zeros(len(Hyper._fields)))
    return Model(scale, day_length_s, hyper_of(best))


def _some(readings: Readings, day_length_s: float) -> Readings:
    """Choose at most `MAX_FITTED` of the readings."""
    if len(readings) <= MAX_FITTED:
        return readings.of_present()
    of = of_neighbours(readings)
    per_tag = max(MAX_FITTED // len(of.xy), 1)
    at_s = float(of.time_s.max())
    return of.recent(at_s, day_length_s=day_length_s, per_tag=per_tag).of_present()


def of_neighbours(readings: Readings) -> Readings:
    """The readings, sorted by tag and time; of many tags, those of groups of neighbours."""
    of = readings.of_present()
    if len(of.xy) <= _TAGS:
        return of
    along = np.lexsort((of.xy[:, 1], of.xy[:, 0]))
    middles = along[np.linspace(0, len(along) - 1, _TAGS // _TOGETHER + 2).astype(int)[1:-1]]
    apart = np.square(of.xy[middles, None] - of.xy[None]).sum(axis=2)
    chosen = np.unique(np.argpartition(apart, _TOGETHER - 1, axis=1)[:, :_TOGETHER])
    return of.take(np.isin(of.tag, chosen)).of_present()
