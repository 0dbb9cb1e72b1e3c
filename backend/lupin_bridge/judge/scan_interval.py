"""How often tags are scanned, and when nothing was. Pure; ns of ROS time.

A patrol that comes every two minutes and stays away for ten has stopped; one that comes twice a day
has not. So a tag's readings hold for three times the median of its own last intervals.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise, takewhile
from statistics import median
from typing import Final

_S: Final = 1_000_000_000
SHORTEST_NS: Final = 600 * _S
LONGEST_NS: Final = 24 * 3600 * _S
TIMES_MEDIAN: Final = 3
# Intervals that count: a patrol may change its pace.
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


# Intervals that count: about a lap of a greenhouse, so that the way back to its beginning does too.
LAP_INTERVALS: Final = 30


@dataclass(frozen=True, slots=True)
class Patrol:
    """`interval_ns` is the median of the last intervals between scans, whatever tag they were of.

    None: fewer than two scans are known, or none. `overdue` are the tags none of whose readings
    holds any more, those that never had one included.
    """

    interval_ns: int | None = None
    last_scan_ns: int | None = None
    overdue: int = 0


NO_PATROL: Final = Patrol()


class Scans:
    """When tags were scanned of late; several at one time are one."""

    __slots__ = ("_scans_ns",)

    def __init__(self) -> None:
        self._scans_ns: deque[int] = deque(maxlen=LAP_INTERVALS + 1)

    def heard(self, stamps_ns: Iterable[int], now_ns: int | None) -> None:
        """Count what is later than the last one known; what nobody can have seen yet is no scan."""
        for stamp_ns in sorted(set(stamps_ns)):
            is_later = not self._scans_ns or stamp_ns > self._scans_ns[-1]
            if is_later and (now_ns is None or stamp_ns <= now_ns):
                self._scans_ns.append(stamp_ns)

    def forget(self) -> None:
        """The clock has gone back: what was before is no part of any interval."""
        self._scans_ns.clear()

    def patrol(self, overdue: int) -> Patrol:
        """As it is now."""
        scans = list(self._scans_ns)
        if not scans:
            return Patrol(overdue=overdue)
        intervals = [after - before for before, after in pairwise(scans)]
        return Patrol(int(median(intervals)) if intervals else None, scans[-1], overdue)


# That are kept: of some months, at least.
MAX_PAUSES: Final = 10_000


class Stretches:
    """Stretches of time without a pause: attempts no farther apart than readings hold at least.

    In whatever order attempts are added, and however often: the stretches are the same.
    """

    def __init__(self) -> None:
        self._first: list[int] = []
        self._last: list[int] = []

    def add(self, stamp_ns: int) -> bool:
        """Count an attempt at this moment; returns whether it lies in no stretch that was known."""
        first, last = self._first, self._last
        after = bisect_right(first, stamp_ns)
        before = after - 1
        if before >= 0 and stamp_ns <= last[before]:
            return False
        joins_before = before >= 0 and stamp_ns - last[before] <= SHORTEST_NS
        joins_after = after < len(first) and first[after] - stamp_ns <= SHORTEST_NS
        if joins_before and joins_after:
            last[before] = last[after]
            del first[after], last[after]
        elif joins_before:
            last[before] = stamp_ns
        elif joins_after:
            first[after] = stamp_ns
        else:
            first.insert(after, stamp_ns)
            last.insert(after, stamp_ns)
        return True

    def forget(self, before_ns: int) -> int:
        """Drop the pauses that ended before; returns from when on nothing is missing.

        Of more than `MAX_PAUSES`, the oldest are dropped too.
        """
        old = max(bisect_left(self._first, before_ns) - 1, 0)
        many = max(len(self._first) - MAX_PAUSES - 1, 0)
        del self._first[: max(old, many)], self._last[: max(old, many)]
        return self._first[0] if many > old else before_ns

    @property
    def newest_ns(self) -> int | None:
        """The last attempt of all; None: there was none."""
        return self._last[-1] if self._last else None

    def pauses(self, since_ns: int = 0) -> Iterator[tuple[int, int]]:
        """(last attempt before, first attempt after) of each pause that ends after `since_ns`."""
        at = bisect_right(self._first, since_ns)
        for index in range(max(at, 1), len(self._first)):
            yield self._last[index - 1], self._first[index]

    def has_pause_within(self, start_ns: int, end_ns: int) -> bool:
        """Whether a pause lies between two moments."""
        begun = takewhile(lambda pause: pause[0] <= end_ns, self.pauses(start_ns))
        return any(start_ns <= first and last <= end_ns for first, last in begun)

    def overdue_ns(self, since_ns: int, holds_ns: int) -> int:
        """When what was scanned at `since_ns` has not been for `holds_ns`; pauses do not count.

        What runs out as a pause begins does so as it ends: it is overdue a moment later, and in a
        pause no moment is later.
        """
        due_ns = since_ns + holds_ns
        for first, last in self.pauses(since_ns):
            if first > due_ns:
                break
            due_ns += last - max(first, since_ns)
        return due_ns
