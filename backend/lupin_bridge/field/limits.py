"""How many field requests may be in flight, and how often each client may ask. Pure.

Nothing waits for a turn: a request past a bound is refused at once, so that nothing piles up. A
client's own requests count until it has taken the answer, all requests together until the answer
is written: a client that does not read holds up nobody but itself.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

from lupin_bridge.serving.rate_limit import RateLimit

# A page that opens asks for several fields at once; seconds' worth of field_rate_hz.
BURST_S: Final = 2.0


class FieldLimitError(RuntimeError):
    """One request too many; the message names the limit and its setting."""

    def __init__(self, message: str, retry_after_s: float) -> None:
        super().__init__(message)
        self.retry_after_s = retry_after_s

    @property
    def headers(self) -> dict[str, str]:
        """Retry-After in whole seconds, as RFC 9110 has it."""
        return {"Retry-After": str(max(1, math.ceil(self.retry_after_s)))}


class ClientLimitError(FieldLimitError):
    """One client asks too much."""


class BusyError(FieldLimitError):
    """All clients together ask too much."""


class FieldLimits:
    """The requests in flight. Belongs to the event loop."""

    def __init__(self, rate_hz: float, concurrency: int, total_concurrency: int) -> None:
        self._rate_hz = rate_hz
        self._concurrency = concurrency
        self._total_concurrency = total_concurrency
        self._rate = RateLimit(rate_hz, rate_hz * BURST_S)
        self._in_flight: Counter[str] = Counter()
        self._computing = 0

    @property
    def being_computed(self) -> int:
        """How many requests keep the twin and the encoders busy now."""
        return self._computing

    @contextmanager
    def request(self, client: str, now_s: float) -> Iterator[None]:
        """A client's request, from its arrival until its answer is taken.

        Raises:
            ClientLimitError: one more than the client may have at once, or too soon.

        """
        if self._in_flight[client] >= self._concurrency:
            raise ClientLimitError(
                f"{client} has {self._concurrency} field requests in flight, the limit "
                "(field_concurrency)",
                1.0,
            )
        wait_s = self._rate.take(client, now_s)
        if wait_s > 0.0:
            raise ClientLimitError(
                f"{client} asks for more than {self._rate_hz:g} fields a second, the limit "
                "(field_rate_hz)",
                wait_s,
            )
        self._in_flight[client] += 1
        try:
            yield
        finally:
            self._in_flight[client] -= 1
            if not self._in_flight[client]:
                del self._in_flight[client]

    @contextmanager
    def computing(self) -> Iterator[None]:
        """The part of a request that keeps the twin and the encoders busy.

        Raises:
            BusyError: one more than there may be at once.

        """
        if self._computing >= self._total_concurrency:
            raise BusyError(
                f"{self._total_concurrency} fields are being computed, the limit "
                "(field_total_concurrency)",
                1.0,
            )
        self._computing += 1
        try:
            yield
        finally:
            self._computing -= 1
