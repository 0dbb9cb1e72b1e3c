"""Readings held against what all others say of them: which sensor has changed, and who was right.

Pure. Readings are left out together (Rasmussen and Williams, 2006, 5.12): with A the inverse of all
readings' covariance and a = A y, those of a block are off by A_bb^-1 a_b, with the covariance
A_bb^-1. An offset that they have in common is estimated from that by least squares.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from lupin_twin.estimate.readings import IntArray, Readings
from lupin_twin.estimate.solved import Factor
from lupin_twin.grid import FloatArray

# A tag has changed if its readings since some moment, at least so many, are off by so many sds
# together, and in multiples of how far the other tags are; and the newest alone by as many.
LEAST_READINGS: Final = 2
CHANGE_Z: Final = 3.0
NEWEST_Z: Final = 2.0
# Left out of an unchanged tag, to say what was expected of the newest.
_LAST: Final = 4
# Of a normal distribution: its sd, as a multiple of the median of what lies off its mean.
_SD_OF_MEDIAN: Final = 1.4826


@dataclass(frozen=True, slots=True)
class Change:
    """How far a tag's last readings are off what all the others say of them.

    `z` is in sds; `offset`, and `expected` and `expected_sd` of its newest reading, are in the
    sensor's unit. `since_s` is the time of the first reading of a changed sensor; None: it has not.
    """

    z: float
    offset: float
    expected: float
    expected_sd: float
    since_s: float | None

    @property
    def has_changed(self) -> bool:
        """Whether that is more than chance brings."""
        return self.since_s is not None


@dataclass(frozen=True, slots=True)
class Off:
    """How far a reading is off (`off`), and how far it may be (`variance`, its noise included)."""

    off: float
    variance: float


@dataclass(frozen=True, slots=True, eq=False)
class LeftOut:
    """Readings by tag, for any of them to be left out.

    `wider` is the inflation of sds; `precision` (n, n) and `alpha` (n,) are A and a.
    """

    readings: Readings
    wider: float
    precision: FloatArray
    alpha: FloatArray

    @classmethod
    def of(cls, factor: Factor, wider: float) -> LeftOut:
        """Of readings that were solved."""
        return cls(factor.readings, wider, factor.root.T @ factor.root, factor.alpha)

    def changed(self) -> dict[int, tuple[float, float, float | None]]:
        """Of each tag: z, offset, and since when it has changed, s.

        The clearest first; those that are left are judged without what it has read since then.
        Where most are off, by their median none has changed: it is the model that does not fit.
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

    def newest(self, tag: int, *, without: FloatArray | IntArray) -> Off:
        """A tag's newest reading, with all readings of the tags `without` left out: its own too."""
        block = np.flatnonzero(np.isin(self.readings.tag, without))
        return self._off(block, self._own(tag)[-1])

    def last(self, tag: int, since_s: float | None) -> Off:
        """A tag's newest reading, its last ones left out: all since it has changed, or four."""
        own = self._own(tag)
        if since_s is None:
            return self._off(own[-_LAST:], own[-1])
        return self._off(own[self.readings.time_s[own] >= since_s], own[-1])

    def _own(self, tag: int) -> IntArray:
        return np.flatnonzero(self.readings.tag == tag)

    def _off(self, block: IntArray, row: int) -> Off:
        covariance = np.linalg.inv(self.precision[np.ix_(block, block)])
        at = int(np.searchsorted(block, row))
        return Off(float(covariance[at] @ self.alpha[block]), float(covariance[at, at]))

    def _onset(self, tag: int) -> tuple[float, float, int | None]:
        """z, offset and the first of a tag's last readings that are farthest off, in sds."""
        own = self._own(tag)
        # Sums over the last one, the last two, ..: those before them count, those after are off.
        a = self.alpha[own][::-1].cumsum()
        weight = np.diagonal(self.precision[np.ix_(own, own)][::-1, ::-1].cumsum(0).cumsum(1))
        z = a / np.sqrt(weight) / self.wider
        # Before a change it was another: not all of them are off.
        best = 1 + int(np.argmax(np.abs(z[: max(len(own) - 1, 1)])))
        first: int | None = len(own) - best
        newest = self._off(own[first:], own[-1])
        is_still = newest.off * z[best - 1] > NEWEST_Z * abs(z[best - 1]) * newest.variance**0.5
        if best < LEAST_READINGS or not is_still:
            first = None
        return float(z[best - 1]), float(a[best - 1] / weight[best - 1]), first

    def _without(self, block: IntArray) -> LeftOut:
        """The other readings, as if these had never been."""
        rest = np.setdiff1d(np.arange(len(self.readings)), block)
        across = self.precision[np.ix_(rest, block)]
        lost = np.linalg.solve(self.precision[np.ix_(block, block)], across.T)
        return LeftOut(
            self.readings.take(rest),
            self.wider,
            self.precision[np.ix_(rest, rest)] - across @ lost,
            self.alpha[rest] - lost.T @ self.alpha[block],
        )


def gap_of(xy: FloatArray) -> float:
    """How far from the nearest tag (T, 2) half of the floor between them lies, m."""
    low, high = xy.min(axis=0), xy.max(axis=0)
    x, y = (np.linspace(*ends, 12) for ends in zip(low, high, strict=True))
    floor = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    some = xy[np.linspace(0, len(xy) - 1, min(len(xy), 1_024)).astype(int)]
    apart = np.sqrt(((floor[:, None] - some[None]) ** 2).sum(axis=2)).min(axis=1)
    return float(np.median(apart) * (len(some) / len(xy)) ** 0.5)
