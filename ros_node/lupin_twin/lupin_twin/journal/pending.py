"""What is handed over and not written yet: bounded, and never in the way of who hands over."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Sequence
from typing import Final, NamedTuple

from lupin_twin.journal.rows import Row, weight

# Readings, flowers and rows together: some 60 MB, twenty minutes of the largest greenhouse.
MAX_WEIGHT: Final = 200_000


class Entry(NamedTuple):
    """A row, the clock it was heard by (1 is the first), and when it came, by the steady clock."""

    era: int
    row: Row
    handed_over_s: float


class Pending:
    """A queue between two threads. When it is full the oldest are lost, and counted.

    What is newest is what a twin that starts again needs.
    """

    def __init__(self, max_weight: int = MAX_WEIGHT) -> None:
        self.arrived = threading.Event()
        self._max_weight = max_weight
        self._lock = threading.Lock()
        self._entries: deque[Entry] = deque()
        self._weight = 0
        self._lost = 0
        self._taken = 0

    def put(self, entry: Entry) -> None:
        """Hand over; takes microseconds, whatever the disk does."""
        with self._lock:
            self._entries.append(entry)
            self._weight += weight(entry.row)
            if self._weight > self._max_weight:
                self._shed()
        if not self.arrived.is_set():
            self.arrived.set()

    def take(self, count: int) -> list[Entry]:
        """At most so many of the oldest; they wait still, until something is put back."""
        self.arrived.clear()
        with self._lock:
            taken = [self._entries.popleft() for _ in range(min(count, len(self._entries)))]
            self._weight -= sum(weight(entry.row) for entry in taken)
            self._taken = len(taken)
            if self._entries:
                self.arrived.set()
        return taken

    def put_back(self, entries: Sequence[Entry]) -> None:
        """What was taken and could not be written is the oldest again; the rest is done with."""
        with self._lock:
            self._taken = 0
            self._entries.extendleft(reversed(entries))
            self._weight += sum(weight(entry.row) for entry in entries)
            if self._weight > self._max_weight:
                self._shed()

    def _shed(self) -> None:
        while self._weight > self._max_weight and len(self._entries) > 1:
            self._weight -= weight(self._entries.popleft().row)
            self._lost += 1

    def counts(self) -> tuple[int, int, float | None]:
        """(waiting, lost, when the oldest that waits was handed over)."""
        with self._lock:
            oldest = self._entries[0].handed_over_s if self._entries else None
            return len(self._entries) + self._taken, self._lost, oldest
