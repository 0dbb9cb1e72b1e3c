"""Answers that are written already, for as long as they hold: the least recently used goes first.

Pure; belongs to one thread. What is being sent counts too and is not dropped: readers that take
their time hold what is kept, and never more than the bound.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, field
from itertools import islice
from typing import Final

MAX_BYTES: Final = 64_000_000
# What an entry takes beside its body, roughly: the least that it counts.
ENTRY_BYTES: Final = 1_000
# So many entries are looked through for the newest.
MAX_NEWEST: Final = 64


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """The body of an answer, and its headers."""

    body: bytes | memoryview
    media_type: str
    headers: Mapping[str, str] = field(default_factory=dict)


@dataclass(slots=True, eq=False)
class _Entry:
    answer: Answer
    readers: int = 0

    @property
    def bytes(self) -> int:
        return len(self.answer.body) + ENTRY_BYTES


class Kept:
    """Answers by what they answer; a key stands for everything that its answer depends on."""

    def __init__(self, max_bytes: int = MAX_BYTES) -> None:
        self.bytes = 0
        self._max_bytes = max_bytes
        self._entries: OrderedDict[Hashable, _Entry] = OrderedDict()

    def __len__(self) -> int:
        return len(self._entries)

    def put(self, key: Hashable, answer: Answer, instead_of: Hashable | None = None) -> None:
        """Keep an answer if there is room, or can be made; the one it replaces goes first."""
        for old in (key, instead_of):
            entry = self._entries.get(old)
            if entry is not None and not entry.readers:
                self._drop(old)
        if key in self._entries:
            return  # the same answer, which is being sent
        new = _Entry(answer)
        if new.bytes > self._max_bytes:
            return
        idle = (old for old, entry in list(self._entries.items()) if not entry.readers)
        while self.bytes + new.bytes > self._max_bytes:
            victim = next(idle, None)
            if victim is None:
                return
            self._drop(victim)
        self._entries[key] = new
        self.bytes += new.bytes

    def lend(self, key: Hashable) -> tuple[Answer, Callable[[], None]] | None:
        """What is kept under `key`, and what to call once it is sent; None: nothing is."""
        entry = self._entries.get(key)
        if entry is None:
            return None
        self._entries.move_to_end(key)
        entry.readers += 1

        def give_back() -> None:
            entry.readers -= 1

        return entry.answer, give_back

    def newest_tags(self) -> list[str]:
        """The ETags that were put or lent last, of those that are keys."""
        newest = islice(reversed(self._entries), MAX_NEWEST)
        return [key for key in newest if isinstance(key, str)]

    def _drop(self, key: Hashable) -> None:
        self.bytes -= self._entries.pop(key).bytes
