"""Messages that a full queue has lost, told by the gaps in their writers' numbers. Pure.

Fast DDS says nothing when a queue overruns: its event for lost messages stays silent. But each
writer numbers what it writes. Which writer a message is from is not told, so numbers are matched to
writers by where each of them left off.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

# Writers followed at once; with more, the one that was heard longest ago is forgotten.
MAX_WRITERS: Final = 16


class Gaps:
    """Follows the numbers on one topic; `lost` counts what is known to be lost, never too much."""

    def __init__(self) -> None:
        self.lost = 0
        self._next: list[int] = []  # of each writer, the one heard last at the end

    def see(self, number: int, writers: Callable[[], int]) -> int:
        """Note a message's number; returns how many were lost before it.

        `writers` tells how many there are now; asked only where the number is not one expected. A
        number that may be the first of a new writer is taken for that.
        """
        if number in self._next:
            self._next.remove(number)
            self._next.append(number + 1)
            return 0
        lost = 0
        before = [expected for expected in self._next if expected < number]
        if before and len(self._next) >= writers():
            nearest = max(before)
            lost = number - nearest
            self._next.remove(nearest)
        self._next.append(number + 1)
        del self._next[:-MAX_WRITERS]
        self.lost += lost
        return lost

    def settle(self, writers: int) -> None:
        """Note that of so many writers those that were not heard by now have said nothing yet."""
        self._next[:0] = [1] * (writers - len(self._next))

    def unsettle(self) -> None:
        """Note that other writers are there than before: whoever is new may begin anywhere."""
        self._next = [expected for expected in self._next if expected != 1]
