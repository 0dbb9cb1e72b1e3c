"""Of many tags, those near a place: few enough to be reckoned with exactly.

Pure. What a neighbourhood knows: the last readings of the nearest tags, and the newest ones of the
whole house, whose course they tell.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from lupin_twin.estimate.readings import IntArray, Readings
from lupin_twin.grid import FloatArray

# Tags that are judged together at most; how many near them count; how many readings of each of
# these, and the newest of the whole house. Together at most 352 readings.
TOGETHER: Final = 12
_NEAR: Final = 24
LAST: Final = 8
_NEWEST: Final = 64


@dataclass(frozen=True, slots=True, eq=False)
class Neighbourhood:
    """Some of the `readings`, their `xy` those of `tags` alone; `judged` are rows of these."""

    readings: Readings
    tags: IntArray
    judged: IntArray


class Nearby:
    """Readings of many tags, ready to be looked up by place."""

    def __init__(self, readings: Readings) -> None:
        self._readings = readings
        # By tag, the newest first; of equal stamps the later in order counts as the newer.
        rows = np.arange(len(readings))
        self._order = np.lexsort((-rows, -readings.time_s, readings.tag))
        self._present, self._starts, self._counts = np.unique(
            readings.tag[self._order], return_index=True, return_counts=True
        )
        self._xy = readings.xy[self._present]
        self._newest = np.argsort(readings.time_s, kind="stable")[-_NEWEST:]

    def all(self) -> Iterator[Neighbourhood]:
        """Every tag with readings is judged once, with some that are near it."""
        for some in self._clusters(np.arange(len(self._present))):
            yield self._around(self._xy[some].mean(axis=0), some)

    def some(self, count: int) -> Readings:
        """About so many of the readings, of whole groups of tags that lie all over the house."""
        groups = list(self._clusters(np.arange(len(self._present))))
        rows = [np.concatenate([self._last(tag) for tag in some]) for some in groups]
        wanted = max(int(count / np.mean([len(some) for some in rows])), 1)
        chosen = np.unique(np.linspace(0, len(rows) - 1, wanted).astype(int))
        return self._readings.take(np.concatenate([rows[one] for one in chosen])).of_present()

    def at(self, place: FloatArray) -> Neighbourhood:
        """About a place (2,), m; no tag is judged."""
        return self._around(place, np.empty(0, dtype=np.int64))

    def _clusters(self, some: IntArray) -> Iterator[IntArray]:
        """Halved across their longer side until they are few."""
        if len(some) <= TOGETHER:
            yield some
            return
        axis = int(np.argmax(np.ptp(self._xy[some], axis=0)))
        by_place = some[np.argsort(self._xy[some, axis], kind="stable")]
        half = len(some) // 2
        yield from self._clusters(by_place[:half])
        yield from self._clusters(by_place[half:])

    def _last(self, tag: int) -> IntArray:
        """The last readings of the tag with this number among those present."""
        start = self._starts[tag]
        return self._order[start : start + min(self._counts[tag], LAST)]

    def _around(self, place: FloatArray, judged: IntArray) -> Neighbourhood:
        far = np.square(self._xy - place).sum(axis=1)
        count = min(_NEAR, len(far))
        near = np.union1d(np.argpartition(far, count - 1)[:count], judged)
        rows = [self._last(tag) for tag in near]
        chosen = np.union1d(np.concatenate(rows), self._newest)
        of = self._readings
        tags, row = np.unique(of.tag[chosen], return_inverse=True)
        return Neighbourhood(
            Readings(of.time_s[chosen], row.ravel(), of.value[chosen], of.xy[tags]),
            tags,
            np.searchsorted(tags, self._present[judged]),
        )
