"""Large messages that wait for sockets, of all clients together. Pure; belongs to one thread.

One that many wait for counts once: they share it. So what is counted are the messages that are
superseded already and kept alive by nobody but readers that take their time. Past the bound, who
has waited longest is to go: no other message is older.
"""

from __future__ import annotations

from collections import Counter
from typing import Final, Generic, TypeVar

MAX_BYTES: Final = 256_000_000

HolderT = TypeVar("HolderT")


class Unsent(Generic[HolderT]):
    """Who holds which messages. `bytes`: what all of them together have."""

    def __init__(self, max_bytes: int = MAX_BYTES) -> None:
        self.bytes = 0
        self._max_bytes = max_bytes
        # In the order in which they began to wait; of each the messages by their ids.
        self._holders: dict[HolderT, dict[int, bytes]] = {}
        self._shares: Counter[int] = Counter()

    def hold(self, holder: HolderT, message: bytes) -> list[HolderT]:
        """Count a message that a holder waits for; returns who is to go, and counts no more."""
        held = self._holders.setdefault(holder, {})
        key = id(message)
        if key not in held:
            held[key] = message
            self._shares[key] += 1
            if self._shares[key] == 1:
                self.bytes += len(message)
        gone = []
        while self.bytes > self._max_bytes:
            longest = next(iter(self._holders))
            self.let_go(longest)
            gone.append(longest)
        return gone

    def let_go(self, holder: HolderT) -> None:
        """A holder waits no more; harmless if it does not."""
        for key, message in self._holders.pop(holder, {}).items():
            self._shares[key] -= 1
            if not self._shares[key]:
                del self._shares[key]
                self.bytes -= len(message)
