"""One rule of admission for every answer that has to be computed. Pure.

What is kept already passes without it. Nothing waits for a turn: a request past a bound is refused
at once, so that nothing piles up. A client's own requests count until it has taken the answer, all
computations together until the answer is written: a client that does not read holds up nobody but
itself. Large computations leave a quarter of the places to the small ones, which are soon done: a
flood of the dearest fields keeps nobody from a cheap answer.
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
# An export goes on for as long as its reader takes: one a client, and few that share the disk.
EXPORTS_A_CLIENT: Final = 1
EXPORTS: Final = 4

# Why something was refused, as it is counted.
IN_FLIGHT: Final = "client_in_flight"
RATE: Final = "client_rate"
LARGE: Final = "large_in_flight"
TOTAL: Final = "total_in_flight"
CLIENT_EXPORTS: Final = "client_exports"
ALL_EXPORTS: Final = "total_exports"
REASONS: Final = (IN_FLIGHT, RATE, LARGE, TOTAL, CLIENT_EXPORTS, ALL_EXPORTS)


class AdmissionError(RuntimeError):
    """One request too many; the message names the limit and its setting."""

    def __init__(self, message: str, retry_after_s: float) -> None:
        super().__init__(message)
        self.retry_after_s = retry_after_s

    @property
    def headers(self) -> dict[str, str]:
        """Retry-After in whole seconds, as RFC 9110 has it."""
        return {"Retry-After": str(max(1, math.ceil(self.retry_after_s)))}


class ClientLimitError(AdmissionError):
    """One client asks too much."""


class BusyError(AdmissionError):
    """All clients together ask too much."""


class Admission:
    """The requests in flight. Belongs to the event loop."""

    def __init__(self, rate_hz: float, concurrency: int, total_concurrency: int) -> None:
        self.refused: Counter[str] = Counter()
        self._rate_hz = rate_hz
        self._concurrency = concurrency
        self._total_concurrency = total_concurrency
        self._large_concurrency = total_concurrency - total_concurrency // 4
        self._rate = RateLimit(rate_hz, rate_hz * BURST_S)
        self._in_flight: Counter[str] = Counter()
        self._exporting: Counter[str] = Counter()
        self._computing = 0
        self._large = 0

    @property
    def being_computed(self) -> int:
        """How many computations keep the twin and the workers busy now."""
        return self._computing

    @contextmanager
    def request(self, client: str, now_s: float) -> Iterator[None]:
        """A client's request, from its arrival until its answer is taken.

        Raises:
            ClientLimitError: one more than the client may have at once, or too soon.

        """
        if self._in_flight[client] >= self._concurrency:
            self.refused[IN_FLIGHT] += 1
            raise ClientLimitError(
                f"{client} has {self._concurrency} requests for computed answers in flight, the "
                "limit (field_concurrency)",
                1.0,
            )
        wait_s = self._rate.take(client, now_s)
        if wait_s > 0.0:
            self.refused[RATE] += 1
            raise ClientLimitError(
                f"{client} asks for more than {self._rate_hz:g} computed answers a second, the "
                "limit (field_rate_hz)",
                wait_s,
            )
        self._in_flight[client] += 1
        try:
            yield
        finally:
            self._in_flight[client] -= 1
            if not self._in_flight[client]:
                del self._in_flight[client]

    @property
    def exporting(self) -> int:
        """How many exports are being sent now."""
        return self._exporting.total()

    @contextmanager
    def export(self, client: str) -> Iterator[None]:
        """A client's export, from its first row to its last.

        Raises:
            ClientLimitError: one more than the client may have at once.
            BusyError: one more than there may be at once.

        """
        if self._exporting[client] >= EXPORTS_A_CLIENT:
            self.refused[CLIENT_EXPORTS] += 1
            raise ClientLimitError(
                f"{client} has {EXPORTS_A_CLIENT} export under way, the limit", 5.0
            )
        if self.exporting >= EXPORTS:
            self.refused[ALL_EXPORTS] += 1
            raise BusyError(f"{EXPORTS} exports are under way, the limit", 5.0)
        self._exporting[client] += 1
        try:
            yield
        finally:
            self._exporting[client] -= 1
            if not self._exporting[client]:
                del self._exporting[client]

    @contextmanager
    def computing(self, *, is_large: bool = False) -> Iterator[None]:
        """What keeps the twin and the workers busy, once for all who wait for it.

        Raises:
            BusyError: one more than there may be at once.

        """
        if self._computing >= self._total_concurrency:
            self.refused[TOTAL] += 1
            raise BusyError(
                f"{self._total_concurrency} answers are being computed, the limit "
                "(field_total_concurrency)",
                1.0,
            )
        if is_large and self._large >= self._large_concurrency:
            self.refused[LARGE] += 1
            raise BusyError(
                f"{self._large_concurrency} large answers are being computed, the limit (three "
                "quarters of field_total_concurrency)",
                1.0,
            )
        self._computing += 1
        self._large += is_large
        try:
            yield
        finally:
            self._computing -= 1
            self._large -= is_large
