"""Where another tag helps most: by how much one more reading lessens the error elsewhere.

Pure. What a reading will tell does not depend on what it says: at a place p it takes c(t, p)^2 /
(c(p, p) + noise) off the variance at t, c being the covariance of what is true now.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lupin_twin.estimate.member import Member
from lupin_twin.grid import FloatArray


@dataclass(frozen=True, slots=True)
class Place:
    """Where another tag helps: m, map frame.

    `error_ratio` is the error with it, and with those before it, as a share of that without any.
    """

    x: float
    y: float
    error_ratio: float


class _Gain:
    """What one member says of candidates (k, 2) and of targets (m, 2), m."""

    def __init__(
        self, member: Member, tags: FloatArray, candidates: FloatArray, targets: FloatArray
    ) -> None:
        near, near_targets = member.near(candidates, tags), member.near(targets, tags)
        self._noise = member.noise
        self._own = member.shared(near, near, member.nearness(candidates, candidates))
        self._reach = member.shared(near, near_targets, member.nearness(candidates, targets))
        # The mean variance over the targets.
        self.error = float(np.maximum(member.moments(near_targets)[1], 0.0).mean())

    def gains(self) -> FloatArray:
        """(k,): by how much a reading at each candidate lessens `error`, the mean variance."""
        spread = np.maximum(np.diagonal(self._own), 0.0) + self._noise
        result: FloatArray = np.mean(self._reach**2, axis=1) / spread
        return result

    def take(self, chosen: int) -> None:
        """There is a reading at a candidate from now on."""
        self.error = max(self.error - float(self.gains()[chosen]), 0.0)
        own, reach = self._own[chosen].copy(), self._reach[chosen].copy()
        spread = max(float(own[chosen]), 0.0) + self._noise
        self._own -= np.outer(own, own / spread)
        self._reach -= np.outer(own, reach / spread)


def best_places(
    members: Sequence[Member],
    tags: FloatArray,
    candidates: FloatArray,
    targets: FloatArray,
    count: int,
) -> list[Place]:
    """The `count` candidates (k, 2) that leave the least error at targets (m, 2), the best first.

    One after the other, each with those before it. The error is the root of the mean variance,
    also over the members; where they differ in the mean, no reading is taken to change that.

    Raises:
        ValueError: there are no targets.

    """
    if not len(targets):
        raise ValueError("there is nowhere that a tag is to help")
    gains = [_Gain(member, tags, candidates, targets) for member in members]
    at_first = sum(gain.error for gain in gains)
    is_free = np.ones(len(candidates), dtype=bool)
    result: list[Place] = []
    for _ in range(min(count, len(candidates))):
        helps = np.sum([gain.gains() for gain in gains], axis=0)
        best = int(np.argmax(np.where(is_free, helps, -1.0)))
        is_free[best] = False
        for gain in gains:
            gain.take(best)
        ratio = (sum(gain.error for gain in gains) / at_first) ** 0.5 if at_first else 1.0
        result.append(Place(float(candidates[best, 0]), float(candidates[best, 1]), ratio))
    return result
