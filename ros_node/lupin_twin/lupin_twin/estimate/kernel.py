"""How much two readings have in common: the covariance in space and time, and its gradient.

Pure. Standardised units; times are hours of a day of 24, whatever the day's length; metres.

A product-sum kernel (De Iaco, Myers, Posa, "Space-time analysis using a general product-sum
model", 2001): what the whole house does, and what differs by place, always, now, and daily::

    k = 100 + sg^2 M(dt; lg) + sp^2 cos(2 pi dt / 24)
      + R [ sa^2 + sh^2 M(dt; lh) + sq^2 cos(2 pi dt / 24) ]
      + (tau^2 + 0.02^2) if it is the same reading
    M(d; l) = (1 + sqrt3 d / l) exp(-sqrt3 d / l)          (Matern 3/2)
    R = M(|dx|; l) M(|dy|; l)

The 100 makes it ordinary kriging: the mean is not known.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from lupin_twin.estimate.readings import IntArray, Readings
from lupin_twin.grid import FloatArray

HOURS: Final = 24.0
UNKNOWN_MEAN: Final = 100.0
JITTER: Final = 0.02**2
_SQRT3: Final = 3.0**0.5
# As good as infinitely far; and 0 times infinity is no number.
_FAR: Final = 700.0
# Rows of pairs at a time: some ten arrays of so many stay near.
_ROWS: Final = 48


class Hyper(NamedTuple):
    """The kernel's parameters; all are > 0. `sg` .. `tau` are sds, `lg`, `lh` h, `l` m."""

    sg: float
    lg: float
    sp: float
    sa: float
    sh: float
    lh: float
    sq: float
    l: float  # noqa: E741  # the formula's own name
    tau: float

    @property
    def prior_variance(self) -> float:
        """Of the field anywhere, before any reading."""
        return UNKNOWN_MEAN + self.sg**2 + self.sp**2 + self.local_variance

    @property
    def local_variance(self) -> float:
        """Of what differs by place."""
        return self.sa**2 + self.sh**2 + self.sq**2


# Log-normal: these are the medians, and the sds of the logarithms. What moves beside the day, the
# house as a whole (sg) or one place (sh, sq), may be next to nothing: its sds are wide. It passes
# in hours (lg): what lasts for half a day cannot be told from the day itself, and would make
# outages seem worse than they are.
PRIOR_MEDIAN: Final = Hyper(0.3, 3.0, 1.0, 1.0, 0.25, 8.0, 0.25, 2.5, 0.15)
PRIOR_LOG_SD: Final = Hyper(1.5, 0.6, 0.7, 0.6, 1.3, 0.5, 1.3, 0.5, 1.0)


def matern(distance: FloatArray, length: float) -> FloatArray:
    """Matern 3/2 of distances >= 0, 1 at 0."""
    far = scaled(distance, length)
    result: FloatArray = (1.0 + far) * np.exp(-far)
    return result


def scaled(distance: FloatArray, length: float) -> FloatArray:
    """sqrt3 distance / length, as far as it matters."""
    with np.errstate(over="ignore"):
        result: FloatArray = np.minimum(distance * (_SQRT3 / length), _FAR)
    return result


def _matern_by_log_length(distance: FloatArray, length: float) -> tuple[FloatArray, FloatArray]:
    """The same, and its derivative by the logarithm of the length."""
    far = scaled(distance, length)
    decay = np.exp(-far)
    return (1.0 + far) * decay, far * far * decay


def nearness(ax: FloatArray, bx: FloatArray, length: float) -> FloatArray:
    """Along one axis, M(|a - b|; length): (len(ax), len(bx))."""
    return matern(_apart(ax, bx), length)


def _apart(ax: FloatArray, bx: FloatArray) -> FloatArray:
    with np.errstate(over="ignore"):
        result: FloatArray = np.abs(ax[:, None] - bx[None, :])
    return result


def daily(hours: FloatArray) -> FloatArray:
    """cos(2 pi dt / 24)."""
    result: FloatArray = np.cos(hours * (2.0 * np.pi / HOURS))
    return result


@dataclass(frozen=True, slots=True)
class _Rows:
    """Rows `first` to `last` of the lower triangle of all pairs, as far as `last`."""

    first: int
    last: int
    apart_h: FloatArray
    daily: FloatArray
    tag: IntArray
    other: IntArray

    def of_tags(self, between_tags: FloatArray) -> FloatArray:
        """(T, T) of tags to these rows of their readings."""
        return between_tags[self.tag][:, self.other]


class Pairs:
    """All pairs of readings: what of the covariance does not depend on its parameters.

    Its matrices are symmetric, and only the lower triangle is made, some rows at a time: that is
    half the work, and no array is so large that it is fetched from far. Without days, nothing is
    daily: its part is the same always.
    """

    def __init__(self, hours: FloatArray, readings: Readings, *, has_days: bool = True) -> None:
        self.hours = hours
        self.readings = readings
        self._rows: list[_Rows] = []
        tag = readings.tag
        for first in range(0, len(hours), _ROWS):
            last = min(first + _ROWS, len(hours))
            apart_h = np.abs(hours[first:last, None] - hours[None, :last])
            of_day = daily(apart_h) if has_days else np.ones_like(apart_h)
            self._rows.append(_Rows(first, last, apart_h, of_day, tag[first:last], tag[:last]))
        # 1 where a reading is of a tag: sums over pairs of tags are products with it.
        self._at_tag = np.zeros((len(hours), len(readings.xy)))
        self._at_tag[np.arange(len(hours)), tag] = 1.0

    def covariance(self, h: Hyper, into: FloatArray | None = None) -> FloatArray:
        """(n, n), positive definite; only its lower triangle has a meaning.

        `into` is overwritten and returned, if given.
        """
        result = np.empty((len(self.hours),) * 2) if into is None else into
        x, y = self.readings.xy.T
        near = nearness(x, x, h.l) * nearness(y, y, h.l)
        for rows in self._rows:
            part = matern(rows.apart_h, h.lh)
            part *= h.sh**2
            part += h.sq**2 * rows.daily
            part += h.sa**2
            part *= rows.of_tags(near)
            part += h.sg**2 * matern(rows.apart_h, h.lg)
            part += h.sp**2 * rows.daily
            part += UNKNOWN_MEAN
            result[rows.first : rows.last, : rows.last] = part
        result[np.diag_indices_from(result)] += h.tau**2 + JITTER
        return result

    def gradient(self, h: Hyper, weights: FloatArray) -> FloatArray:
        """(9,): by the logarithm of each parameter, sum(`weights` * covariance) / 2.

        `weights` (n, n) are symmetric.
        """
        x, y = self.readings.xy.T
        near_x, by_x = _matern_by_log_length(_apart(x, x), h.l)
        near_y, by_y = _matern_by_log_length(_apart(y, y), h.l)
        near_tags = near_x * near_y
        result = np.zeros(len(h))
        by_tags = np.zeros_like(near_tags)
        for rows in self._rows:
            weight = weights[rows.first : rows.last, : rows.last].copy()
            weight[:, : rows.first] *= 2.0  # for the pairs above the diagonal
            house, by_lg = _matern_by_log_length(rows.apart_h, h.lg)
            place, by_lh = _matern_by_log_length(rows.apart_h, h.lh)
            near = weight * rows.of_tags(near_tags)
            result[:7] += (
                np.vdot(weight, house),
                np.vdot(weight, by_lg),
                np.vdot(weight, rows.daily),
                near.sum(),
                np.vdot(near, place),
                np.vdot(near, by_lh),
                np.vdot(near, rows.daily),
            )
            place *= h.sh**2
            place += h.sa**2
            place += h.sq**2 * rows.daily
            place *= weight
            at_tag = self._at_tag
            by_tags += at_tag[rows.first : rows.last].T @ (place @ at_tag[: rows.last])
        result[7] = np.vdot(by_tags, by_x * near_y + near_x * by_y)
        result[8] = np.trace(weights)
        result *= np.array(
            [h.sg**2, h.sg**2 / 2, h.sp**2, h.sa**2, h.sh**2, h.sh**2 / 2, h.sq**2, 0.5, h.tau**2]
        )
        return result


def pairs_of(readings: Readings, day_length_s: float, *, has_days: bool = True) -> Pairs:
    """The pairs of readings, in a day of `day_length_s`."""
    return Pairs(readings.time_s * (HOURS / day_length_s), readings, has_days=has_days)
