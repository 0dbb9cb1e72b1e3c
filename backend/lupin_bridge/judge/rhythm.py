"""How long a tag's readings hold: learnt from how often it is scanned. Pure; ns of ROS time.

A patrol that comes every two minutes and stays away for ten has stopped; one that comes twice a day
has not. What holds is three times the median of a tag's own last intervals.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from itertools import pairwise
from statistics import median
from typing import Final

_S: Final = 1_000_000_000
SHORTEST_NS: Final = 600 * _S
LONGEST_NS: Final = 24 * 3600 * _S
TIMES_MEDIAN: Final = 3
# Intervals that count: a patrol may change its rhythm.
INTERVALS: Final = 8


class Rhythm:
    """The last scans of one tag."""

    __slots__ = ("_scans_ns",)

    def __init__(self) -> None:
        self._scans_ns: deque[int] = deque(maxlen=INTERVALS + 1)

    def scanned(self, stamp_ns: int) -> None:
        """Count a scan; one that is no later than the last one known says nothing of the rhythm."""
        if self._scans_ns and stamp_ns < self._scans_ns[-1]:
            # The clock has gone back: intervals across that are none.
            if not any(known == stamp_ns for known in self._scans_ns):
                self._scans_ns.clear()
                self._scans_ns.append(stamp_ns)
        elif not self._scans_ns or stamp_ns > self._scans_ns[-1]:
            self._scans_ns.append(stamp_ns)

    @property
    def interval_ns(self) -> int | None:
        """The median of the last intervals; None before two scans are known."""
        return interval_ns(tuple(self._scans_ns))


def interval_ns(scans_ns: Sequence[int]) -> int | None:
    """The median of the intervals between scans, the oldest first; None before two are known."""
    if len(scans_ns) < 2:
        return None
    return int(median(after - before for before, after in pairwise(scans_ns)))


def holds_ns(interval_ns: int | None) -> int:
    """How long readings hold at such an interval; without one, as short as is ever taken."""
    if interval_ns is None:
        return SHORTEST_NS
    return min(LONGEST_NS, max(SHORTEST_NS, TIMES_MEDIAN * interval_ns))
