"""The readings of one sensor, and the covariance of any two in space and time, with its gradient.

Pure. Readings are in s of ROS time, m in the map frame, and the sensor's own unit. The kernel is in
standardised units, m, and hours: a day has 24 of them, whatever its length in seconds.

A product-sum kernel (De Iaco, Myers, Posa, "Space-time analysis using a general product-sum
model", 2001). One part is common to the whole greenhouse, and one differs by place. Each has a
constant, a passing and a daily term::

    k = 100 + sg^2 M(dt; lg) + sp^2 D(dt)
      + R [ sa^2 + sh^2 M(dt; lh) + sq^2 D(dt) ]
      + (tau^2 + 0.02^2) if it is the same reading
    M(d; l) = (1 + sqrt3 d / l) exp(-sqrt3 d / l)          (Matern 3/2)
    D(dt) = cos(2 pi dt / 24) + half^2 cos(4 pi dt / 24)   (a day is no pure sinusoid)
    R = M(|dx|; l) M(|dy|; l)

The 100 makes it ordinary kriging: the mean is unknown.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from lupin_twin.field.grid import FloatArray

IntArray = npt.NDArray[np.int64]

# At most this many readings of a tag count; more would add little.
MAX_PER_TAG: Final = 32
# In the spread of values, the prior weighs as much as this many readings. The readings themselves
# weigh at most `_MAX_WEIGHT`.
_PRIOR_WEIGHT: Final = 4.0
_MAX_WEIGHT: Final = 20.0


@dataclass(frozen=True, slots=True, eq=False)
class Readings:
    """Finite readings of one sensor, in any order.

    `time_s` and `value` are (n,), `tag` (n,) is the row of `xy` (T, 2) at which each was taken.
    Two may be of the same tag and time.
    """

    time_s: FloatArray
    tag: IntArray
    value: FloatArray
    xy: FloatArray

    def __len__(self) -> int:
        """How many readings there are."""
        return len(self.time_s)

    def recent(
        self, at_s: float, *, day_length_s: float = 86_400.0, per_tag: int = MAX_PER_TAG
    ) -> Readings:
        """Select readings up to `at_s` that are at most a day old, at most `per_tag` of each tag.

        If a tag has more, a quarter of them are its latest. The rest are the latest ones of equal
        parts of the time before. For the next hours, yesterday's readings predict better than many
        readings of the last hour.
        """
        age_s = at_s - self.time_s
        chosen = np.flatnonzero((age_s >= 0.0) & (age_s <= day_length_s))
        # By tag, the latest first; of equal stamps, the later in order counts as the later.
        order = chosen[np.lexsort((-chosen, age_s[chosen], self.tag[chosen]))]
        tag = self.tag[order]
        _, starts, counts = np.unique(tag, return_index=True, return_counts=True)
        rank = np.arange(len(tag)) - np.repeat(starts, counts)
        newest = -(-per_tag // 4)
        parts = max(per_tag - newest, 1)
        reach_s = max(float(age_s[chosen].max(initial=0.0)), 1.0)
        part = np.minimum((age_s[order] * (parts / reach_s)).astype(int), parts - 1)
        is_older = rank >= newest
        is_first = np.ones(len(tag), dtype=bool)
        is_first[1:] = (tag[1:] != tag[:-1]) | (part[1:] != part[:-1]) | ~is_older[:-1]
        taken = (np.repeat(counts, counts) <= per_tag) | ~is_older
        if per_tag > newest:
            taken |= is_first
        return self.take(np.sort(order[taken]))

    def take(self, chosen: npt.NDArray[np.int64] | npt.NDArray[np.bool_]) -> Readings:
        """Return the chosen readings, with the same `xy`."""
        return Readings(self.time_s[chosen], self.tag[chosen], self.value[chosen], self.xy)

    def of_present(self) -> Readings:
        """Sort by tag and time, and remove tags without readings from `xy`."""
        order = np.lexsort((self.time_s, self.tag))
        present, row = np.unique(self.tag[order], return_inverse=True)
        return Readings(self.time_s[order], row.ravel(), self.value[order], self.xy[present])


@dataclass(frozen=True, slots=True)
class Scale:
    """Standardised is (value - `centre`) / `spread`, both in the sensor's unit; `spread` > 0."""

    centre: float
    spread: float

    def standardised(self, values: FloatArray) -> FloatArray:
        """The values in standardised units."""
        result: FloatArray = (values - self.centre) / self.spread
        return result


def scale_of(values: FloatArray) -> Scale:
    """The median, and a spread that is weighted between a prior and that of the readings.

    The spread of few readings is accidental, so the prior, a tenth of the median, weighs as much as
    four of them. Near 0 that says nothing: 0.1 °C is no more certain than 20 °C. So the prior of a
    single reading is at least one unit, and that of twenty a twentieth.
    """
    centre = float(np.median(values))
    weight = min(float(len(values)), _MAX_WEIGHT)
    thought = max(abs(centre) / 10.0, 1.0 / weight)
    # Divided by the largest before squaring: the squares of very large floats would overflow.
    off = values - centre
    largest = max(float(np.abs(off).max()), thought)
    variance = float(np.mean((off / largest) ** 2))
    whole = _PRIOR_WEIGHT * (thought / largest) ** 2 + weight * variance
    return Scale(centre, largest * (whole / (_PRIOR_WEIGHT + weight)) ** 0.5)


HOURS: Final = 24.0
UNKNOWN_MEAN: Final = 100.0
JITTER: Final = 0.02**2
_SQRT3: Final = 3.0**0.5
# Practically infinite; with infinity itself, 0 * inf would be NaN.
_FAR: Final = 700.0


class Hyper(NamedTuple):
    """The kernel's parameters, all > 0. `sg` .. `tau` are sds, `lg`, `lh` h, `l` m.

    `half` is the share of the second harmonic in the daily terms.
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
    def common_variance(self) -> float:
        """Prior variance of the part that is common to the greenhouse."""
        return UNKNOWN_MEAN + self.sg**2 + self.sp**2 * (1.0 + self.half**2)

    @property
    def local_variance(self) -> float:
        """Prior variance of the part that differs by place."""
        return self.sa**2 + self.sh**2 + self.sq**2 * (1.0 + self.half**2)

    @property
    def noise(self) -> float:
        """Variance of a reading around the true value."""
        return self.tau**2 + JITTER


# Log-normal priors: the medians, and the sds of the logarithms. The daily swing (sp) is assumed
# larger than the spread of the readings: the first hours show only a part of it. Other variation,
# of the whole greenhouse (sg) or of one place (sh, sq), may be almost nothing, so its sds are wide.
# It passes in hours (lg). Variation over half a day cannot be told from the daily one, and would
# make outages seem worse than they are.
PRIOR_MEDIAN: Final = Hyper(0.3, 3.0, 1.5, 1.0, 0.25, 8.0, 0.25, 2.5, 0.15, 0.15)
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


def correlation(a: FloatArray, b: FloatArray, length: float) -> FloatArray:
    """Along one axis, M(|a - b|; length): (len(a), len(b))."""
    return matern(_apart(a, b), length)


def _apart(a: FloatArray, b: FloatArray) -> FloatArray:
    with np.errstate(over="ignore"):
        result: FloatArray = np.abs(a[:, None] - b[None, :])
    return result


def in_time(h: Hyper, apart_h: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Covariance at times `apart_h` (h) apart: of the common part, and of the part by place."""
    day = np.cos(apart_h * (2.0 * np.pi / HOURS))
    # cos 2x = 2 cos^2 x - 1
    day += h.half**2 * (2.0 * day * day - 1.0)
    common = UNKNOWN_MEAN + h.sg**2 * matern(apart_h, h.lg) + h.sp**2 * day
    place = h.sa**2 + h.sh**2 * matern(apart_h, h.lh) + h.sq**2 * day
    return common, place


class Pairs:
    """All pairs of readings: the part of their covariance that does not depend on parameters."""

    def __init__(self, readings: Readings, day_length_s: float) -> None:
        hours = readings.time_s * (HOURS / day_length_s)
        self._apart_h = _apart(hours, hours)
        self._apart_x, self._apart_y = (_apart(axis, axis) for axis in readings.xy.T)
        self._of_pairs = np.ix_(readings.tag, readings.tag)

    def covariance(self, h: Hyper) -> FloatArray:
        """(n, n), positive definite."""
        common, place = in_time(h, self._apart_h)
        near = matern(self._apart_x, h.l) * matern(self._apart_y, h.l)
        common += near[self._of_pairs] * place
        common[np.diag_indices_from(common)] += h.noise
        return common

    def gradient(self, h: Hyper, weights: FloatArray) -> FloatArray:
        """(10,): derivative of sum(`weights` * covariance) / 2 by the log of each parameter.

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
