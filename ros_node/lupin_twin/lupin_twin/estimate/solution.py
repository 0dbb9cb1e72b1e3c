"""Solves the Gaussian process, checks readings by leaving them out, and finds places for tags.

Pure, standardised units. For a place, phi = [1, R(x, tag_1 .. T)]: mean = phi w, variance = prior -
phi Q phi', with w = B K^-1 y, Q = B K^-1 B'. B is the covariance of the readings with now, summed
by tag. The cost of a place depends on the number T of tags, not on that of readings. Q and the
variance are float64, because they are small differences.

More readings than `MAX_EXACT` need a nearest-neighbour Gaussian process (Vecchia, "Estimation and
model identification for continuous spatial processes", 1988). Each place is estimated from the
readings of its nearest tags, and from some of the whole greenhouse, which show the course in time.
Places between the same few tags share their neighbours.

Readings are left out in blocks (Rasmussen and Williams, 2006, 5.12). With A the inverse of all
readings' covariance and a = A y, the residuals of a block are A_bb^-1 a_b, with the covariance
A_bb^-1. The block's common offset is their least-squares estimate. The benefit of another reading
does not depend on its value. At a place p it reduces the variance at t by
c(t, p)^2 / (c(p, p) + noise), where c is the posterior covariance of the true values now.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from lupin_twin.estimate.kernel import HOURS, Hyper, IntArray, Pairs, Readings, correlation, in_time
from lupin_twin.field.grid import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Solved:
    """Posterior of the true values now, by tags at `xy` (T, 2): `mean_of` (1 + T,) is w.

    `known_of` (1 + T, 1 + T) is Q.
    """

    hyper: Hyper
    xy: FloatArray
    mean_of: FloatArray
    known_of: FloatArray

    def near(self, places: FloatArray) -> FloatArray:
        """The phi (k, 1 + T) of places (k, 2), m."""
        result = np.ones((len(places), 1 + len(self.xy)))
        result[:, 1:] = self.correlation(places, self.xy)
        return result

    def near_grid(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """The phi of a grid's places, row by row: a product of R along x and R along y."""
        along_x = correlation(x, self.xy[:, 0], self.hyper.l)
        along_y = correlation(y, self.xy[:, 1], self.hyper.l)
        result = np.ones((len(y), len(x), 1 + len(self.xy)))
        np.multiply(along_y[:, None, :], along_x[None, :, :], out=result[:, :, 1:])
        return result.reshape(len(y) * len(x), -1)

    def correlation(self, places: FloatArray, others: FloatArray) -> FloatArray:
        """R (k, m) of places (k, 2) and others (m, 2), m."""
        (x, y), (other_x, other_y), length = places.T, others.T, self.hyper.l
        return correlation(x, other_x, length) * correlation(y, other_y, length)

    def moments(self, phi: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean and variance (k,) of the true values now, at places given by `phi`."""
        known = np.einsum("ki,ki->k", phi @ self.known_of, phi)
        prior = self.hyper.common_variance + self.hyper.local_variance
        return phi @ self.mean_of, np.maximum(prior - known, 0.0)

    def shared(self, phi: FloatArray, other: FloatArray, between: FloatArray) -> FloatArray:
        """Covariance (k, m) of the true values now, between places whose R is `between` (k, m)."""
        h = self.hyper
        result: FloatArray = h.common_variance + h.local_variance * between
        result -= phi @ self.known_of @ other.T
        return result


@dataclass(frozen=True, slots=True, eq=False)
class Factor:
    """Readings sorted by tag, and their inverse covariance root' root; `root` is (n, n)."""

    readings: Readings
    root: FloatArray
    alpha: FloatArray

    @classmethod
    def of(cls, h: Hyper, readings: Readings, y: FloatArray, day_length_s: float) -> Factor:
        """Factorise readings with standardised values `y`; sorted by tag, and each tag has some.

        Raises:
            numpy.linalg.LinAlgError: their covariance is numerically singular.

        """
        covariance = Pairs(readings, day_length_s).covariance(h)
        root = np.linalg.inv(np.linalg.cholesky(covariance))
        return cls(readings, root, root.T @ (root @ y))

    def solved(self, h: Hyper, at_s: float, day_length_s: float) -> Solved:
        """Return the posterior as of the moment `at_s`, s."""
        ages_h = (at_s - self.readings.time_s) * (HOURS / day_length_s)
        common, place = in_time(h, ages_h)
        tag = self.readings.tag
        starts = np.flatnonzero(np.r_[True, tag[1:] != tag[:-1]])
        rooted = np.empty((len(tag), 1 + len(starts)))
        rooted[:, 0] = self.root @ common
        rooted[:, 1:] = np.add.reduceat(self.root * place, starts, axis=1)
        w = np.r_[common @ self.alpha, np.add.reduceat(place * self.alpha, starts)]
        return Solved(h, self.readings.xy, w, rooted.T @ rooted)


# Up to this many readings are solved at once.
MAX_EXACT: Final = 1_024
# If there are too many tags for that, this many readings of each tag count.
PER_TAG: Final = 6
# Neighbours of a place: its nearest tags, and readings of the whole greenhouse.
NEAREST: Final = 32
EVERYWHERE: Final = 64
# Places between this many tags share their neighbours.
_TOGETHER: Final = 12


def shared_out(xy: FloatArray, places: FloatArray) -> Iterator[tuple[IntArray, IntArray]]:
    """Halve tags (T, 2) and places (k, 2) across the tags' longer side until the tags are few.

    Yields the rows of a group of tags, and of the places that lie between them.
    """

    def halved(tags: IntArray, those: IntArray) -> Iterator[tuple[IntArray, IntArray]]:
        if len(tags) <= _TOGETHER:
            yield tags, those
            return
        axis = int(np.argmax(np.ptp(xy[tags], axis=0)))
        tags = tags[np.argsort(xy[tags, axis], kind="stable")]
        half = len(tags) // 2
        is_low = places[those, axis] < (xy[tags[half - 1], axis] + xy[tags[half], axis]) / 2.0
        yield from halved(tags[:half], those[is_low])
        yield from halved(tags[half:], those[~is_low])

    yield from halved(np.arange(len(xy)), np.arange(len(places)))


class Neighbours:
    """Finds the readings near a place. Readings are sorted by tag, and each tag has some."""

    def __init__(self, readings: Readings) -> None:
        self._readings = readings
        tags = len(readings.xy)
        self._ends = np.searchsorted(readings.tag, np.arange(tags + 1))
        # Whole tags: all readings of one tag show the course in time, wherever the tag is.
        wanted = max(EVERYWHERE * tags // len(readings), 1)
        self._everywhere = self._of(np.linspace(0, tags - 1, wanted).astype(int))[:EVERYWHERE]

    def around(self, tags: IntArray) -> tuple[Readings, IntArray]:
        """Return the readings of a few tags, of those nearest to them, and some from everywhere.

        Also returns which tags the rows of their `xy` are.
        """
        of = self._readings
        far = np.square(of.xy - of.xy[tags].mean(axis=0)).sum(axis=1)
        count = min(NEAREST, len(far))
        near = np.union1d(np.argpartition(far, count - 1)[:count], tags)
        rows = np.union1d(self._of(near), self._everywhere)
        return of.take(rows).of_present(), np.unique(of.tag[rows])

    def _of(self, tags: IntArray) -> IntArray:
        rows = [np.arange(self._ends[tag], self._ends[tag + 1]) for tag in tags]
        return np.concatenate(rows)


# Factor on all sds: the most probable parameters ignore their own uncertainty. Chosen on
# `tests/bench/other_worlds.CHOOSING`.
INFLATION: Final = 1.3
# A tag has changed if its readings since some moment are together off by `CHANGE_Z` sds, and by
# that multiple of what is typical for other tags. The latest alone must be off by `NEWEST_Z` sds.
LEAST_READINGS: Final = 2
CHANGE_Z: Final = 3.0
NEWEST_Z: Final = 2.0
# Readings of an unchanged tag that are left out to predict its latest one.
_LAST: Final = 4
# sd of a normal distribution, as a multiple of its median absolute deviation.
_SD_OF_MEDIAN: Final = 1.4826


@dataclass(frozen=True, slots=True)
class Change:
    """How far a tag's last readings are off what all the other readings predict.

    `z` is in sds; `offset`, and `expected` and `expected_sd` of its latest reading, are in the
    sensor's unit. `since_s` is the time of the first reading after a change; None: no change.
    """

    z: float
    offset: float
    expected: float
    expected_sd: float
    since_s: float | None


@dataclass(frozen=True, slots=True, eq=False)
class LeftOut:
    """Predicts any of the readings, sorted by tag, from the others.

    `precision` (n, n) and `alpha` (n,) are A and a.
    """

    readings: Readings
    precision: FloatArray
    alpha: FloatArray

    @classmethod
    def of(cls, factor: Factor) -> LeftOut:
        """Prepare readings that were factorised."""
        return cls(factor.readings, factor.root.T @ factor.root, factor.alpha)

    def changed(self) -> dict[int, tuple[float, float, float | None]]:
        """Map each tag to z, offset, and the time since when it has changed, s; None: unchanged.

        The clearest change comes first; the other tags are judged without its readings since then.
        If most tags are off, none has changed, because of the median: the model does not fit.
        """
        result: dict[int, tuple[float, float, float | None]] = {}
        rest, left = self, np.unique(self.readings.tag).tolist()
        while left:
            found = {tag: rest._onset(tag) for tag in left}
            worst = max(left, key=lambda tag: abs(found[tag][0]))
            others = [abs(found[tag][0]) for tag in left if tag != worst]
            limit = CHANGE_Z * max(1.0, _SD_OF_MEDIAN * float(np.median(others or [0.0])))
            z, offset, first = found[worst]
            if first is None or abs(z) <= limit:
                return result | {tag: (*found[tag][:2], None) for tag in left}
            own = rest._own(worst)[first:]
            result[worst] = z, offset, float(rest.readings.time_s[own[0]])
            rest = rest._without(own)
            left.remove(worst)
        return result

    def last(self, tag: int, since_s: float | None) -> tuple[float, float]:
        """How far a tag's latest reading is off, and the variance of that, with noise.

        The tag's last four readings, or those since its change, are left out.
        """
        own = self._own(tag)
        if since_s is None:
            return self._off(own[-_LAST:], own[-1])
        return self._off(own[self.readings.time_s[own] >= since_s], own[-1])

    def _own(self, tag: int) -> IntArray:
        return np.flatnonzero(self.readings.tag == tag)

    def _off(self, block: IntArray, row: int) -> tuple[float, float]:
        covariance = np.linalg.inv(self.precision[np.ix_(block, block)])
        at = int(np.searchsorted(block, row))
        return float(covariance[at] @ self.alpha[block]), float(covariance[at, at])

    def _onset(self, tag: int) -> tuple[float, float, int | None]:
        """z, offset and first index of the last readings of a tag that are farthest off, in sds."""
        own = self._own(tag)
        # Sums over the last reading, the last two, ..: the candidates for readings that are off.
        a = self.alpha[own][::-1].cumsum()
        weight = np.diagonal(self.precision[np.ix_(own, own)][::-1, ::-1].cumsum(0).cumsum(1))
        z = a / np.sqrt(weight) / INFLATION
        # A change needs a reading before it, so never all of them are off.
        best = 1 + int(np.argmax(np.abs(z[: max(len(own) - 1, 1)])))
        first: int | None = len(own) - best
        off, variance = self._off(own[first:], own[-1])
        is_still = off * z[best - 1] > NEWEST_Z * abs(z[best - 1]) * variance**0.5
        if best < LEAST_READINGS or not is_still:
            first = None
        return float(z[best - 1]), float(a[best - 1] / weight[best - 1]), first

    def _without(self, block: IntArray) -> LeftOut:
        """The other readings, as if those of `block` had never been made."""
        rest = np.setdiff1d(np.arange(len(self.readings)), block)
        across = self.precision[np.ix_(rest, block)]
        lost = np.linalg.solve(self.precision[np.ix_(block, block)], across.T)
        return LeftOut(
            self.readings.take(rest),
            self.precision[np.ix_(rest, rest)] - across @ lost,
            self.alpha[rest] - lost.T @ self.alpha[block],
        )


def gap_of(xy: FloatArray) -> float:
    """Median distance from the floor between tags (T, 2) to the nearest tag, m."""
    low, high = xy.min(axis=0), xy.max(axis=0)
    x, y = (np.linspace(*ends, 12) for ends in zip(low, high, strict=True))
    floor = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    some = xy[np.linspace(0, len(xy) - 1, min(len(xy), 1_024)).astype(int)]
    apart = np.sqrt(((floor[:, None] - some[None]) ** 2).sum(axis=2)).min(axis=1)
    return float(np.median(apart) * (len(some) / len(xy)) ** 0.5)


@dataclass(frozen=True, slots=True)
class Place:
    """A position where another tag helps: m, map frame.

    `error_ratio` is the error with it and with those before it, divided by that without any.
    """

    x: float
    y: float
    error_ratio: float


class Gain:
    """The benefit of readings at candidates (k, 2) for the variance at targets (m, 2), m."""

    def __init__(self, solved: Solved, candidates: FloatArray, targets: FloatArray) -> None:
        near, near_targets = solved.near(candidates), solved.near(targets)
        self.candidates = candidates
        self._noise = solved.hyper.noise
        self._own = solved.shared(near, near, solved.correlation(candidates, candidates))
        self._reach = solved.shared(near, near_targets, solved.correlation(candidates, targets))
        # The sum of the variances at the targets.
        self.error = float(solved.moments(near_targets)[1].sum())

    def helps(self) -> FloatArray:
        """(k,): by how much a reading at each candidate reduces `error`."""
        spread = np.maximum(np.diagonal(self._own), 0.0) + self._noise
        result: FloatArray = np.square(self._reach).sum(axis=1) / spread
        return result

    def take(self, chosen: int) -> None:
        """Add a reading at a candidate."""
        self.error = max(self.error - float(self.helps()[chosen]), 0.0)
        own, reach = self._own[chosen].copy(), self._reach[chosen].copy()
        spread = max(float(own[chosen]), 0.0) + self._noise
        self._own -= np.outer(own, own / spread)
        self._reach -= np.outer(own, reach / spread)


def best_places(gains: Sequence[Gain], count: int) -> list[Place]:
    """Choose `count` candidates that leave the least error at all targets, the best first.

    Greedy: each is chosen given those before it. The error is the root of the mean variance.
    """
    at_first = sum(gain.error for gain in gains)
    free = [np.ones(len(gain.candidates), dtype=bool) for gain in gains]
    result: list[Place] = []
    for _ in range(min(count, sum(map(len, free)))):
        helps = [
            np.where(is_free, gain.helps(), -1.0) for gain, is_free in zip(gains, free, strict=True)
        ]
        of = max(range(len(gains)), key=lambda one: helps[one].max(initial=-1.0))
        best = int(np.argmax(helps[of]))
        free[of][best] = False
        gains[of].take(best)
        ratio = (sum(gain.error for gain in gains) / at_first) ** 0.5 if at_first else 1.0
        x, y = gains[of].candidates[best]
        result.append(Place(float(x), float(y), ratio))
    return result
