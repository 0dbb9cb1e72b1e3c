"""How many twins publish the state, told apart from one twin and its predecessor's shadow. Pure.

A twin that was killed stays in the DDS graph until its lease ends, 20 s by Fast DDS's default: two
publishers in the graph are no two twins yet. But a shadow says nothing. DDS numbers the messages of
each publisher one by one: where an older row of numbers goes on after a newer one has begun, there
are two who speak.
"""

from __future__ import annotations

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
