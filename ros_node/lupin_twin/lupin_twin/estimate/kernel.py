"""The readings of one sensor, and the covariance of any two in space and time, with its gradient.

Pure. Readings: s of ROS time, m in the map frame, the sensor's own unit. The kernel: standardised
units, m, and hours of a day of 24, whatever the day's length.

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

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from lupin_twin.field.grid import FloatArray

IntArray = npt.NDArray[np.int64]

# So many readings of a tag count; more say little that these do not.
MAX_PER_TAG: Final = 32
# So many readings weigh as much as what is thought beforehand in saying how far values spread.
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
        """Those up to `at_s` that are not older than a day, at most `per_tag` of each tag.

        Of more, the newest quarter counts, and of as many equal parts of the time before as are
        left the newest of each: what the next hours bring, yesterday's readings show better than
        many of the last hour.
        """
        age_s = at_s - self.time_s
        chosen = np.flatnonzero((age_s >= 0.0) & (age_s <= day_length_s))
        # By tag, the newest first; of equal stamps the later in order counts as the newer.
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
        """Some of them, at the same places."""
        return Readings(self.time_s[chosen], self.tag[chosen], self.value[chosen], self.xy)

    def of_present(self) -> Readings:
        """The same by tag and time, at the places of tags with readings alone."""
        order = np.lexsort((self.time_s, self.tag))
        present, row = np.unique(self.tag[order], return_inverse=True)
        return Readings(self.time_s[order], row.ravel(), self.value[order], self.xy[present])


@dataclass(frozen=True, slots=True)
class Scale:
    """Standardised is (value - `centre`) / `spread`, both in the sensor's unit; `spread` > 0."""

    centre: float
    spread: float

    def standardised(self, values: FloatArray) -> FloatArray:
        """What the model reckons with."""
        result: FloatArray = (values - self.centre) / self.spread
        return result


def scale_of(values: FloatArray) -> Scale:
    """The median, and a spread between what is thought beforehand and that of the readings.

    Few readings spread by chance, so what is thought counts as much as four of them do: a tenth of
    the median.
    """
    centre = float(np.median(values))
    thought = abs(centre) / 10.0
    weight = min(float(len(values)), _MAX_WEIGHT)
    # What is to be squared is taken by its largest: it may be near the end of what floats hold.
    off = values - centre
    largest = max(float(np.abs(off).max()), thought) or 1.0
    variance = float(np.mean((off / largest) ** 2))
    whole = _PRIOR_WEIGHT * (thought / largest) ** 2 + weight * variance
    return Scale(centre, largest * (whole / (_PRIOR_WEIGHT + weight)) ** 0.5 or 1.0)


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
    def common_variance(self) -> float:
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


# Log-normal: these are the medians, and the sds of the logarithms. The day's swing (sp) is taken to
# be more than readings spread by: the first hours show a part of it. What moves beside the day, the
# greenhouse as a whole (sg) or one place (sh, sq), may be next to nothing: its sds are wide. It
# passes in hours (lg): what lasts for half a day cannot be told from the day itself, and would make
# outages seem worse than they are.
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
    common = UNKNOWN_MEAN + h.sg**2 * matern(apart_h, h.lg) + h.sp**2 * day
    place = h.sa**2 + h.sh**2 * matern(apart_h, h.lh) + h.sq**2 * day
    return common, place


class Pairs:
    """All pairs of readings: what of the covariance does not depend on its parameters."""

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
