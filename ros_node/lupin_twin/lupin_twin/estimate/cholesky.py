"""Readings solved exactly, by one Cholesky factor; of too many, the neighbours of each place.

Pure, standardised units. Of a place, phi = [1, R(x, tag_1 .. T)]: mean = phi w, variance = prior -
phi Q phi', with w = B K^-1 y, Q = B K^-1 B', and B what a reading has in common with now, summed by
tag. However many readings there are, a place costs T tags. Q and the variance are float64: they are
small differences.

Of more readings, a nearest-neighbour Gaussian process (Vecchia, "Estimation and model
identification for continuous spatial processes", 1988): each place is estimated from the readings
of the tags nearest to it, and from some of the whole greenhouse, for its course in time. Places
between the same few tags share their neighbours.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from lupin_twin.estimate.kernel import HOURS, Hyper, IntArray, Pairs, Readings, in_time, nearness
from lupin_twin.field.grid import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Solved:
    """What is true now, by tags at `xy` (T, 2): `mean_of` (1 + T,) is w, `known_of` Q."""

    hyper: Hyper
    xy: FloatArray
    mean_of: FloatArray
    known_of: FloatArray

    def near(self, places: FloatArray) -> FloatArray:
        """The phi (k, 1 + T) of places (k, 2), m."""
        result = np.ones((len(places), 1 + len(self.xy)))
        result[:, 1:] = self.nearness(places, self.xy)
        return result

    def near_grid(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """The same of a grid's places, row by row: a product of one along x and one along y."""
        along_x = nearness(x, self.xy[:, 0], self.hyper.l)
        along_y = nearness(y, self.xy[:, 1], self.hyper.l)
        result = np.ones((len(y), len(x), 1 + len(self.xy)))
        np.multiply(along_y[:, None, :], along_x[None, :, :], out=result[:, :, 1:])
        return result.reshape(len(y) * len(x), -1)

    def nearness(self, places: FloatArray, others: FloatArray) -> FloatArray:
        """R (k, m) of places (k, 2) and others (m, 2), m."""
        (x, y), (other_x, other_y), length = places.T, others.T, self.hyper.l
        return nearness(x, other_x, length) * nearness(y, other_y, length)

    def moments(self, phi: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean and variance (k,) of what is true, now, at places."""
        known = np.einsum("ki,ki->k", phi @ self.known_of, phi)
        prior = self.hyper.common_variance + self.hyper.local_variance
        return phi @ self.mean_of, np.maximum(prior - known, 0.0)

    def shared(self, phi: FloatArray, other: FloatArray, between: FloatArray) -> FloatArray:
        """The covariance (k, m) of what is true now at places, whose R is `between` (k, m)."""
        h = self.hyper
        result: FloatArray = h.common_variance + h.local_variance * between
        result -= phi @ self.known_of @ other.T
        return result


@dataclass(frozen=True, slots=True, eq=False)
class Factor:
    """Readings by tag and their covariance: `root` (n, n) with root' root its inverse."""

    readings: Readings
    root: FloatArray
    alpha: FloatArray

    @classmethod
    def of(cls, h: Hyper, readings: Readings, y: FloatArray, day_length_s: float) -> Factor:
        """Of standardised readings `y`; `readings` are by tag, each tag has some.

        Raises:
            numpy.linalg.LinAlgError: their covariance is singular, as far as floats can tell.

        """
        covariance = Pairs(readings, day_length_s).covariance(h)
        root = np.linalg.inv(np.linalg.cholesky(covariance))
        return cls(readings, root, root.T @ (root @ y))

    def solved(self, h: Hyper, at_s: float, day_length_s: float) -> Solved:
        """What it says of the moment `at_s`, s."""
        ages_h = (at_s - self.readings.time_s) * (HOURS / day_length_s)
        common, place = in_time(h, ages_h)
        tag = self.readings.tag
        starts = np.flatnonzero(np.r_[True, tag[1:] != tag[:-1]])
        rooted = np.empty((len(tag), 1 + len(starts)))
        rooted[:, 0] = self.root @ common
        rooted[:, 1:] = np.add.reduceat(self.root * place, starts, axis=1)
        w = np.r_[common @ self.alpha, np.add.reduceat(place * self.alpha, starts)]
        return Solved(h, self.readings.xy, w, rooted.T @ rooted)


# All readings of so many are solved at once.
MAX_EXACT: Final = 1_024
# Of so many more tags, so many readings each count.
PER_TAG: Final = 6
# Tags nearest to a place, and readings of the whole greenhouse.
NEAREST: Final = 32
EVERYWHERE: Final = 64
# Places between so many tags share their neighbours.
_TOGETHER: Final = 12


def shared_out(xy: FloatArray, places: FloatArray) -> Iterator[tuple[IntArray, IntArray]]:
    """Tags (T, 2) and places (k, 2), halved across the tags' longer side until the tags are few.

    Rows of tags, and of the places that lie between these.
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
    """Readings by tag, each tag with some, ready to be looked up by place."""

    def __init__(self, readings: Readings) -> None:
        self._readings = readings
        tags = len(readings.xy)
        self._ends = np.searchsorted(readings.tag, np.arange(tags + 1))
        # Whole tags: what one of them reads tells the course however different its place is.
        wanted = max(EVERYWHERE * tags // len(readings), 1)
        self._everywhere = self._of(np.linspace(0, tags - 1, wanted).astype(int))[:EVERYWHERE]

    def around(self, tags: IntArray) -> tuple[Readings, IntArray]:
        """The readings of these few tags, of the nearest to them, and some of everywhere.

        And which tags the rows of their `xy` are.
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
