"""Where another tag helps most: by how much one more reading lessens the error elsewhere.

Pure. What a reading will tell does not depend on what it says: at a place p it takes c(t, p)^2 /
(c(p, p) + noise) off the variance at t, c being the covariance of what is true now.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lupin_twin.estimate.solved import Solved
from lupin_twin.grid import FloatArray


@dataclass(frozen=True, slots=True)
class Place:
    """Where another tag helps: m, map frame.

    `error_ratio` is the error with it, and with those before it, as a share of that without any.
    """

    x: float
    y: float
    error_ratio: float


class Gain:
    """What readings that were solved together say of candidates (k, 2) and targets (m, 2), m."""

    def __init__(self, solved: Solved, candidates: FloatArray, targets: FloatArray) -> None:
        near, near_targets = solved.near(candidates), solved.near(targets)
        self.candidates = candidates
        self._noise = solved.hyper.noise
        self._own = solved.shared(near, near, solved.nearness(candidates, candidates))
        self._reach = solved.shared(near, near_targets, solved.nearness(candidates, targets))
        # The sum of the variances at the targets.
        self.error = float(solved.moments(near_targets)[1].sum())

    def helps(self) -> FloatArray:
        """(k,): by how much a reading at each candidate lessens `error`."""
        spread = np.maximum(np.diagonal(self._own), 0.0) + self._noise
        result: FloatArray = np.square(self._reach).sum(axis=1) / spread
        return result

    def take(self, chosen: int) -> None:
        """There is a reading at a candidate from now on."""
        self.error = max(self.error - float(self.helps()[chosen]), 0.0)
        own, reach = self._own[chosen].copy(), self._reach[chosen].copy()
        spread = max(float(own[chosen]), 0.0) + self._noise
        self._own -= np.outer(own, own / spread)
        self._reach -= np.outer(own, reach / spread)


def best_places(gains: Sequence[Gain], count: int) -> list[Place]:
    """The `count` candidates that leave the least error at all targets, the best first.

    One after the other, each with those before it. The error is the root of the mean variance.
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
