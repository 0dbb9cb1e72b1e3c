"""How a channel does, and how long it waits before it tries again. Pure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

# What the page and the log say of a failure is one short line, whatever a library has to say.
MAX_DETAIL: Final = 200


@dataclass(slots=True)
class Condition:
    """Counts since the start, and what is wrong: `detail` is empty where nothing is.

    `sent` was taken by the other side, `failed` are tries that were not, `dropped` was given up or
    gave way to something newer. `is_connected`: the last try was taken, or is about to be.
    """

    is_connected: bool = False
    detail: str = ""
    sent: int = 0
    failed: int = 0
    waiting: int = 0
    dropped: int = 0

    def taken(self, number: int = 1) -> None:
        """So many were taken by the other side."""
        self.is_connected, self.detail = True, ""
        self.sent += number

    def failing(self, why: str) -> None:
        """A try failed."""
        self.is_connected = False
        self.detail = " ".join(why.split())[:MAX_DETAIL] or "it failed without a word"
        self.failed += 1


class Backoff:
    """Twice as long after each failure, from `first_s` up to `most_s`; a half of it by chance.

    Chance keeps those that lost the same broker at the same time from coming back as one.
    """

    def __init__(self, first_s: float, most_s: float) -> None:
        self._first_s, self._most_s = first_s, most_s
        self._failures = 0

    def wait_s(self, chance: float) -> float:
        """How long to wait after one more failure; `chance` is 0 to 1."""
        # The exponent is bounded, or days of failures would make a number that no float holds.
        whole_s = min(self._most_s, self._first_s * 2.0 ** min(self._failures, 32))
        self._failures += 1
        return whole_s * (0.5 + 0.5 * chance)

    def succeeded(self) -> None:
        """The next failure is the first again."""
        self._failures = 0
