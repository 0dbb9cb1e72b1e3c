"""What one set of parameters makes of the readings: in all that an estimate needs of them.

Pure, standardised units. Of a place and a moment, phi = [1, R(x, tag_1 .. T)] times the five shares
of `course.of_moments`: mean = phi w, variance = prior - phi Q phi', with w = B K^-1 y and
Q = B K^-1 B' by `course.of_readings`. However many readings there are, w has 5 (1 + T) numbers. Q
and the variance are float64: they are small differences.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from lupin_twin.estimate import course
from lupin_twin.estimate.kernel import JITTER, Hyper, Pairs, nearness
from lupin_twin.estimate.triangle import root_of_inverse
from lupin_twin.grid import FloatArray
from lupin_twin.idw import Abandoned, never


@dataclass(frozen=True, slots=True, eq=False)
class Member:
    """`mean_of` (1 + T,) and `known_of` (1 + T, 1 + T) are w and Q as of the estimate's moment.

    `course_mean` (1 + T, 5) and `course_known` (1 + T, 5, 1 + T, 5) are those of all later ones.
    """

    hyper: Hyper
    course_mean: FloatArray
    course_known: FloatArray
    mean_of: FloatArray
    known_of: FloatArray

    def near(self, places: FloatArray, tags: FloatArray) -> FloatArray:
        """The phi (k, 1 + T) of `places` (k, 2) beside `tags` (T, 2), m."""
        result = np.ones((len(places), 1 + len(tags)))
        result[:, 1:] = self.nearness(places, tags)
        return result

    def nearness(self, places: FloatArray, others: FloatArray) -> FloatArray:
        """R (k, m) of places (k, 2) and others (m, 2), m."""
        (x, y), (other_x, other_y), length = places.T, others.T, self.hyper.l
        return nearness(x, other_x, length) * nearness(y, other_y, length)

    def moments(self, phi: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean and variance (k,) of what is true, now, at places."""
        known = np.einsum("ki,ki->k", phi @ self.known_of, phi)
        return phi @ self.mean_of, self.hyper.prior_variance - known

    def moments_later(self, phi: FloatArray, later_h: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean and variance (k,) of readings, at places and so much after the newest reading."""
        house, place = course.of_moments(self.hyper, later_h)
        shares = phi[:, :, None] * place[:, None, :]
        shares[:, 0] = house
        flat = shares.reshape(len(phi), -1)
        size = flat.shape[1]
        known = np.einsum("ki,ki->k", flat @ self.course_known.reshape(size, size), flat)
        variance = self.hyper.prior_variance - known
        return flat @ self.course_mean.ravel(), np.maximum(variance, 0.0) + self.noise

    def shared(self, phi: FloatArray, other: FloatArray, between: FloatArray) -> FloatArray:
        """The covariance (k, m) of what is true now at places, whose R is `between` (k, m)."""
        h = self.hyper
        prior = h.prior_variance - h.local_variance + h.local_variance * between
        result: FloatArray = prior - phi @ self.known_of @ other.T
        return result

    @property
    def noise(self) -> float:
        """The variance of a reading about what is true."""
        return self.hyper.tau**2 + JITTER


def members_of(
    hypers: Sequence[Hyper],
    pairs: Pairs,
    y: FloatArray,
    later_h: float,
    should_stop: Callable[[], bool] = never,
) -> tuple[Member, ...]:
    """Of standardised readings `y`, as of `later_h` after the newest of them.

    Raises:
        numpy.linalg.LinAlgError: their covariance is singular, as far as floats can tell.
        lupin_twin.idw.Abandoned: `should_stop`, asked at each set of parameters, said so.

    """
    # Large arrays are dear to get from the system again and again.
    covariance, root = (np.zeros((len(y), len(y))) for _ in range(2))
    ages_h = pairs.hours.max() - pairs.hours
    states, tags = course.STATES, len(pairs.readings.xy)
    own = [np.flatnonzero(pairs.readings.tag == tag) for tag in range(tags)]
    rooted = np.empty((len(y), 1 + tags, states))
    result = []
    for h in hypers:
        if should_stop():
            raise Abandoned
        root_of_inverse(pairs.covariance(h, covariance), root)
        house, place = course.of_readings(h, ages_h)
        rooted[:, 0] = root @ house
        for tag, chosen in enumerate(own):
            rooted[:, 1 + tag] = root[:, chosen] @ place[chosen]
        flat = rooted.reshape(len(y), -1)
        mean = (flat.T @ (root @ y)).reshape(1 + tags, states)
        known = (flat.T @ flat).reshape(1 + tags, states, 1 + tags, states)
        of_house, of_place = course.of_moments(h, np.array([later_h]))
        now = np.repeat(of_place, 1 + tags, axis=0)
        now[0] = of_house[0]
        known_of = ((known * now).sum(axis=3) * now[:, :, None]).sum(axis=1)
        result.append(Member(h, mean, known, (mean * now).sum(axis=1), known_of))
    return tuple(result)
