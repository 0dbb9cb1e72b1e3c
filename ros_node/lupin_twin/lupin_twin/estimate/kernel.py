"""How much two readings have in common: the covariance in space and time, and its gradient.

Pure. Standardised units; times are hours of a day of 24, whatever the day's length; metres.

A product-sum kernel (De Iaco, Myers, Posa, "Space-time analysis using a general product-sum
model", 2001): what the whole greenhouse does, and what differs by place, always, now, and daily::

    k = 100 + sg^2 M(dt; lg) + sp^2 D(dt)
      + R [ sa^2 + sh^2 M(dt; lh) + sq^2 D(dt) ]
      + (tau^2 + 0.02^2) if it is the same reading
    M(d; l) = (1 + sqrt3 d / l) exp(-sqrt3 d / l)          (Matern 3/2)
    D(dt) = cos(2 pi dt / 24) + half^2 cos(4 pi dt / 24)   (a day is no pure sinusoid)
    R = M(|dx|; l) M(|dy|; l)

The 100 makes it ordinary kriging: the mean is not known.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from lupin_twin.estimate.readings import Readings
from lupin_twin.grid import FloatArray

HOURS: Final = 24.0
UNKNOWN_MEAN: Final = 100.0
JITTER: Final = 0.02**2
_SQRT3: Final = 3.0**0.5
# As good as infinitely far; and 0 times infinity is no number.
_FAR: Final = 700.0


class Hyper(NamedTuple):
    """The kernel's parameters, all > 0. `sg` .. `tau` are sds, `lg`, `lh` h, `l` m.

    `half` is the share of the second harmonic in what comes daily.
    """

    sg: float
    lg: float
    sp: float
    sa: float
    sh: float
    lh: float
    sq: float
    l: float  # noqa: E741  # the formula's own name
    tau: float
    half: float

    @property
    def house_variance(self) -> float:
        """Of what the whole greenhouse does, before any reading."""
        return UNKNOWN_MEAN + self.sg**2 + self.sp**2 * (1.0 + self.half**2)

    @property
    def local_variance(self) -> float:
        """Of what differs by place, before any reading."""
        return self.sa**2 + self.sh**2 + self.sq**2 * (1.0 + self.half**2)

    @property
    def noise(self) -> float:
        """The variance of a reading about what is true."""
        return self.tau**2 + JITTER


# Log-normal: these are the medians, and the sds of the logarithms. What moves beside the day, the
# greenhouse as a whole (sg) or one place (sh, sq), may be next to nothing: its sds are wide. It
# passes in hours (lg): what lasts for half a day cannot be told from the day itself, and would make
# outages seem worse than they are.
PRIOR_MEDIAN: Final = Hyper(0.3, 3.0, 1.0, 1.0, 0.25, 8.0, 0.25, 2.5, 0.15, 0.15)
PRIOR_LOG_SD: Final = Hyper(1.5, 0.6, 0.7, 0.6, 1.3, 0.5, 1.3, 0.5, 1.0, 1.0)


def matern(distance: FloatArray, length: float) -> FloatArray:
    """Matern 3/2 of distances >= 0, 1 at 0."""
    far = _scaled(distance, length)
    result: FloatArray = (1.0 + far) * np.exp(-far)
    return result


def _scaled(distance: FloatArray, length: float) -> FloatArray:
    with np.errstate(over="ignore"):
        result: FloatArray = np.minimum(distance * (_SQRT3 / length), _FAR)
    return result


def _by_log_length(distance: FloatArray, length: float) -> FloatArray:
    """The derivative of `matern` by the logarithm of the length."""
    far = _scaled(distance, length)
    result: FloatArray = far * far * np.exp(-far)
    return result


def nearness(a: FloatArray, b: FloatArray, length: float) -> FloatArray:
    """Along one axis, M(|a - b|; length): (len(a), len(b))."""
    return matern(_apart(a, b), length)


def _apart(a: FloatArray, b: FloatArray) -> FloatArray:
    with np.errstate(over="ignore"):
        result: FloatArray = np.abs(a[:, None] - b[None, :])
    return result


def in_time(h: Hyper, apart_h: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The covariance at times so far apart: of the whole greenhouse, and of one place's own."""
    day = np.cos(apart_h * (2.0 * np.pi / HOURS))
    # cos 2x = 2 cos^2 x - 1
    day += h.half**2 * (2.0 * day * day - 1.0)
    house = UNKNOWN_MEAN + h.sg**2 * matern(apart_h, h.lg) + h.sp**2 * day
    place = h.sa**2 + h.sh**2 * matern(apart_h, h.lh) + h.sq**2 * day
    return house, place


class Pairs:
    """All pairs of readings: what of the covariance does not depend on its parameters."""

    def __init__(self, readings: Readings, day_length_s: float) -> None:
        hours = readings.time_s * (HOURS / day_length_s)
        self._apart_h = _apart(hours, hours)
        self._apart_x, self._apart_y = (_apart(axis, axis) for axis in readings.xy.T)
        self._of_pairs = np.ix_(readings.tag, readings.tag)

    def covariance(self, h: Hyper) -> FloatArray:
        """(n, n), positive definite."""
        house, place = in_time(h, self._apart_h)
        near = matern(self._apart_x, h.l) * matern(self._apart_y, h.l)
        house += near[self._of_pairs] * place
        house[np.diag_indices_from(house)] += h.noise
        return house

    def gradient(self, h: Hyper, weights: FloatArray) -> FloatArray:
        """(10,): by the logarithm of each parameter, sum(`weights` * covariance) / 2.

        `weights` (n, n) are symmetric.
        """
        near_x, near_y = matern(self._apart_x, h.l), matern(self._apart_y, h.l)
        near = weights * (near_x * near_y)[self._of_pairs]
        first = np.cos(self._apart_h * (2.0 * np.pi / HOURS))
        second = h.half**2 * (2.0 * first * first - 1.0)
        day = first + second
        by_l = _by_log_length(self._apart_x, h.l) * near_y
        by_l += _by_log_length(self._apart_y, h.l) * near_x
        _, place = in_time(h, self._apart_h)
        return np.array(
            [
                h.sg**2 * np.vdot(weights, matern(self._apart_h, h.lg)),
                h.sg**2 / 2.0 * np.vdot(weights, _by_log_length(self._apart_h, h.lg)),
                h.sp**2 * np.vdot(weights, day),
                h.sa**2 * near.sum(),
                h.sh**2 * np.vdot(near, matern(self._apart_h, h.lh)),
                h.sh**2 / 2.0 * np.vdot(near, _by_log_length(self._apart_h, h.lh)),
                h.sq**2 * np.vdot(near, day),
                np.vdot(weights * by_l[self._of_pairs], place) / 2.0,
                h.tau**2 * np.trace(weights),
                np.vdot(h.sp**2 * weights + h.sq**2 * near, second),
            ]
        )
