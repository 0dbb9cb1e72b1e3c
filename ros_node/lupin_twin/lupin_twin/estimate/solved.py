"""Readings solved exactly: one Cholesky factor, and all that an estimate needs of it.

Pure, standardised units. Of a place, phi = [1, R(x, tag_1 .. T)]: mean = phi w, variance = prior -
phi Q phi', with w = B K^-1 y, Q = B K^-1 B', and B what a reading has in common with now, summed by
tag. However many readings there are, a place costs T tags. Q and the variance are float64: they are
small differences.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lupin_twin.estimate.kernel import HOURS, Hyper, Pairs, in_time, nearness
from lupin_twin.estimate.readings import Readings
from lupin_twin.grid import FloatArray


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
        prior = self.hyper.house_variance + self.hyper.local_variance
        return phi @ self.mean_of, np.maximum(prior - known, 0.0)

    def shared(self, phi: FloatArray, other: FloatArray, between: FloatArray) -> FloatArray:
        """The covariance (k, m) of what is true now at places, whose R is `between` (k, m)."""
        h = self.hyper
        result: FloatArray = h.house_variance + h.local_variance * between
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
        house, place = in_time(h, ages_h)
        tag = self.readings.tag
        starts = np.flatnonzero(np.r_[True, tag[1:] != tag[:-1]])
        rooted = np.empty((len(tag), 1 + len(starts)))
        rooted[:, 0] = self.root @ house
        rooted[:, 1:] = np.add.reduceat(self.root * place, starts, axis=1)
        w = np.r_[house @ self.alpha, np.add.reduceat(place * self.alpha, starts)]
        return Solved(h, self.readings.xy, w, rooted.T @ rooted)
