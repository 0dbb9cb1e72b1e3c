"""What the numbers tell that DDS gives to messages: which were lost, how many publishers. Pure.

Fast DDS says nothing when a queue overruns: its event for lost messages stays silent. But each
writer numbers what it writes. Which writer a message is from is not told, so numbers are matched to
writers by where each of them left off.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

# More publishers than this on one topic are told as what the graph shows, all the same.
MAX_ROWS: Final = 8


class TwinCount:
    """Believes in a second twin as soon as two have been heard by turns."""

    def __init__(self) -> None:
        self.value = 1
        # The last number of each row, in the order in which the rows began.
        self._rows: list[int] = []
        self._by_turns = False

    def hear(self, number: int) -> None:
        """Note the number that its publisher gave to a state, counted from 1."""
        # The newest first: a twin that was started anew passes the number at which the last ended.
        for index in reversed(range(len(self._rows))):
            if self._rows[index] == number - 1:
                self._rows[index] = number
                self._by_turns |= index < len(self._rows) - 1
                return
        self._rows = [*self._rows[1 - MAX_ROWS :], number]

    def see(self, publishers: int) -> bool:
        """Note how many publishers the graph shows; returns whether there are several twins.

        `value` is the count to believe in.
        """
        if publishers <= 1:
            self._rows = self._rows[-1:]
            self._by_turns = False
        is_several = publishers > 1 and self._by_turns
        self.value = publishers if is_several else 1
        return is_several


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
