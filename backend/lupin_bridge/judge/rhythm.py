"""How long a tag's readings hold: learnt from how often it is scanned. Pure; ns of ROS time.

A patrol that comes every two minutes and stays away for ten has stopped; one that comes twice a day
has not. What holds is three times the median of a tag's own last intervals.
"""

from __future__ import annotations

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


def interval_ns(scans_ns: Sequence[int]) -> int | None:
    """The median of the intervals between scans, the oldest first; None before two are known."""
    if len(scans_ns) < 2:
        return None
    return int(median(after - before for before, after in pairwise(scans_ns)))


def holds_ns(interval_ns: int | None) -> int:
    """How long readings hold at such an interval.

    Scanned once, a tag has none: nobody knows when it should be again, and it has the longest time.
    """
    if interval_ns is None:
        return LONGEST_NS
    return min(LONGEST_NS, max(SHORTEST_NS, TIMES_MEDIAN * interval_ns))
