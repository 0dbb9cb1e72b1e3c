"""Of more readings than can be solved at once, those that say most of a place.

Pure. A nearest-neighbour Gaussian process (Vecchia, "Estimation and model identification for
continuous spatial processes", 1988): each place is estimated from the readings of the tags nearest
to it, and from some of the whole greenhouse, whose course they tell. Places between the same few
tags share their neighbours.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from lupin_twin.estimate.readings import IntArray, Readings
from lupin_twin.grid import FloatArray

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
