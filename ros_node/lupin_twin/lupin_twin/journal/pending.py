"""What is handed over and not written yet: bounded, and never in the way of who hands over."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Sequence
from itertools import islice
from typing import Final, NamedTuple

from lupin_twin.journal.rows import Row, weight

# Readings, flowers and rows together: some 60 MB, twenty minutes of the largest greenhouse.
MAX_WEIGHT: Final = 200_000


class Entry(NamedTuple):
    """A row, the clock it was heard by (1 is the first), and when: steady clock, and ROS time."""

    era: int
    row: Row
    handed_over_s: float
    at_ns: int


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
        self._lost_ns: tuple[int, int] | None = None
        self._taken: list[Entry] = []

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
            self._taken = taken
            if self._entries:
                self.arrived.set()
        return taken

    def put_back(self, entries: Sequence[Entry]) -> None:
        """What was taken and could not be written is the oldest again; the rest is done with."""
        with self._lock:
            self._taken = []
            self._entries.extendleft(reversed(entries))
            self._weight += sum(weight(entry.row) for entry in entries)
            if self._weight > self._max_weight:
                self._shed()

    def _shed(self) -> None:
        while self._weight > self._max_weight and len(self._entries) > 1:
            lost = self._entries.popleft()
            self._weight -= weight(lost.row)
            self._lost += 1
            first_ns, last_ns = self._lost_ns or (lost.at_ns, lost.at_ns)
            self._lost_ns = min(first_ns, lost.at_ns), max(last_ns, lost.at_ns)

    def counts(self) -> tuple[int, int, float | None]:
        """(waiting, lost, when the oldest that waits was handed over)."""
        with self._lock:
            oldest = self._entries[0].handed_over_s if self._entries else None
            return len(self._entries) + len(self._taken), self._lost, oldest

    @property
    def complete_ns(self) -> int | None:
        """When the first was received that waits or was lost, ROS time; None: there is none."""
        with self._lock:
            found = [entry.at_ns for entry in (*self._taken[:1], *islice(self._entries, 1))]
            found += (self._lost_ns or ())[:1]
            return min(found, default=None)

    def take_lost(self) -> int | None:
        """When the last of those was received that were lost since this was asked; None: none."""
        with self._lock:
            lost_ns, self._lost_ns = self._lost_ns, None
        return None if lost_ns is None else lost_ns[1]
