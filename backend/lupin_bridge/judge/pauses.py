"""When anything was tried at all, anywhere in the house. Pure; ns of ROS time."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterator
from typing import Final

from lupin_bridge.judge.rhythm import SHORTEST_NS

# That are kept: of some months, at least.
MAX_PAUSES: Final = 10_000


class Stretches:
    """Stretches of time without a pause: tries no farther apart than readings hold at least.

    In whatever order tries are added, and however often: the stretches are the same.
    """

    def __init__(self) -> None:
        self._first: list[int] = []
        self._last: list[int] = []

    def add(self, stamp_ns: int) -> bool:
        """Count a try at this moment; returns whether it lies in no stretch that was known."""
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
        """The last try of all; None: there was none."""
        return self._last[-1] if self._last else None

    def pauses(self, since_ns: int = 0) -> Iterator[tuple[int, int]]:
        """(last try before it, first try after it) of each pause that ends after `since_ns`."""
        at = bisect_right(self._first, since_ns)
        for index in range(max(at, 1), len(self._first)):
            yield self._last[index - 1], self._first[index]

    def has_pause_within(self, start_ns: int, end_ns: int) -> bool:
        """Whether a pause lies between two moments."""
        return any(
            start_ns <= first and last <= end_ns for first, last in self._until(start_ns, end_ns)
        )

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

    def _until(self, start_ns: int, end_ns: int) -> Iterator[tuple[int, int]]:
        for pause in self.pauses(start_ns):
            if pause[0] > end_ns:
                return
            yield pause
