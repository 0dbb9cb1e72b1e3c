"""Sessions that were ended before their time, and what is to be closed at the end of one. Pure.

A cookie is good wherever the token is known, and nothing is kept of a session that goes its way.
One that was signed out is remembered by this process until it would have ended anyway.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final

from lupin_bridge.access.credentials import BrowserSession

# An entry is two hundred bytes, and takes the token to be made.
MAX_SIGNED_OUT: Final = 10_000


class Sessions:
    """Belongs to the event loop."""

    def __init__(self, max_signed_out: int = MAX_SIGNED_OUT) -> None:
        self._max_signed_out = max_signed_out
        self._signed_out: dict[str, int] = {}
        self._held: dict[str, set[Callable[[], None]]] = {}

    def __len__(self) -> int:
        """How many are remembered as signed out."""
        return len(self._signed_out)

    def has_ended(self, session: BrowserSession) -> bool:
        """Whether it was signed out."""
        return session.name in self._signed_out

    def sign_out(self, session: BrowserSession, now_s: float) -> None:
        """End a session and close what it holds; `now_s` is in s since the epoch."""
        if len(self._signed_out) >= self._max_signed_out:
            self._forget(now_s)
        self._signed_out[session.name] = session.ends_s
        for close in list(self._held.get(session.name, ())):
            close()

    @contextmanager
    def holds(self, session: BrowserSession, close: Callable[[], None]) -> Iterator[None]:
        """Have `close` called if the session is signed out meanwhile."""
        held = self._held.setdefault(session.name, set())
        held.add(close)
        try:
            yield
        finally:
            held.discard(close)
            if not held:
                self._held.pop(session.name, None)

    def _forget(self, now_s: float) -> None:
        """Forget the ended ones; were there none, the one that ends first."""
        kept = {name: ends_s for name, ends_s in self._signed_out.items() if ends_s > now_s}
        if len(kept) >= self._max_signed_out:
            del kept[min(kept, key=kept.__getitem__)]
        self._signed_out = kept
