"""What clients may cost: limits, rates, admission of computed answers, and their cache. Pure.

A cached answer needs no admission. Nothing is queued: a request past a limit is refused at once. A
client's own requests count until it has received the answer. Computations count until the answer is
written, so a client that does not read blocks only itself. Large computations leave a quarter of
the slots to small ones: a flood of expensive fields does not block cheap answers. No client takes
more slots than it leaves free.
"""

from __future__ import annotations

import math
from collections import Counter, OrderedDict
from collections.abc import Callable, Hashable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from hashlib import blake2b
from ipaddress import IPv6Address, ip_address
from typing import Any, Final

# One entry is a key and a number: some hundred kilobytes when the table is full.
MAX_KEYS: Final = 4_096
# Rounding errors of sums of intervals are smaller than this.
_NOISE_S: Final = 1e-9


class RateLimit:
    """At most `rate_hz` in the long run and `burst` at once, for each key by itself.

    Generic cell rate algorithm (ITU-T I.371): of each key, only the moment is kept at which its
    bucket will be full again. After that moment, a key is as good as never seen. A full table drops
    the least recently active key.
    """

    def __init__(self, rate_hz: float, burst: float, max_keys: int = MAX_KEYS) -> None:
        self._interval_s = 1.0 / rate_hz
        self._slack_s = (max(1.0, burst) - 1.0) / rate_hz
        self._max_keys = max_keys
        self._full_at_s: OrderedDict[Hashable, float] = OrderedDict()

    def wait_s(self, key: Hashable, now_s: float, count: int = 1) -> float:
        """How long until the key may take `count` turns, s; 0: now."""
        full_at = max(self._full_at_s.get(key, now_s), now_s) + (count - 1) * self._interval_s
        wait = full_at - self._slack_s - now_s
        return wait if wait > _NOISE_S else 0.0

    def take(self, key: Hashable, now_s: float, count: int = 1) -> float:
        """Take turns if there are any; returns `wait_s`: more than 0 means that none was taken."""
        wait = self.wait_s(key, now_s, count)
        if wait == 0.0:
            full_at = max(self._full_at_s.get(key, now_s), now_s)
            self._full_at_s[key] = full_at + count * self._interval_s
            self._full_at_s.move_to_end(key)
            if len(self._full_at_s) > self._max_keys:
                self._full_at_s.popitem(last=False)
        return wait

    def charge(self, name: str, now_s: float, most: str) -> None:
        """Take a turn; raises `ClientLimitError` if there is none: the name has `most`."""
        if (wait_s := self.take(name, now_s)) > 0.0:
            raise ClientLimitError(f"{name} has {most}", wait_s)


# --- what clients may cost ------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Limits:
    """What clients may cost. Times in seconds.

    `client_timeout_s`: a client that requests, or takes, nothing for this long is cut off.
    `answer_timeout_s`: a computed answer that takes longer ends in 504, and its work is cancelled.
    `answers_per_s` may be computed for one client, and two seconds' worth at once. A page that is
    dragged through the past requests ten moments a second, each with a state and a field or two.
    Two such pages may share an address. `concurrency` of them may be under way for one client
    (a browser has six at once), `total_concurrency` for all clients; large ones may take three
    quarters of that. `frames_per_s` is the mean rate of state frames at most. One token may post
    `observations_per_s`, and `observation_burst` at once: DDS keeps 50 for a busy twin. Alarms are
    derived from `alarm_days` before the start on. The fleet's page has at most `open_sites` open at
    once, of some megabytes each. `rejoin_after_s`: `web` joins ROS anew after its twin has been
    silent for this long.
    """

    client_timeout_s: float = 30.0
    answer_timeout_s: float = 10.0
    answers_per_s: float = 50.0
    concurrency: int = 8
    total_concurrency: int = 32
    frames_per_s: float = 10.0
    observations_per_s: float = 10.0
    observation_burst: int = 30
    alarm_days: float = 7.0
    open_sites: int = 50
    rejoin_after_s: float = 30.0


def client_key(address: str) -> str:
    """The client that an address stands for.

    An IPv6 host has a whole /64 to itself (RFC 6177) and may change within it as it likes; an IPv4
    address has a second spelling on a socket that listens for both.
    """
    try:
        ip = ip_address(address.partition("%")[0])
    except ValueError:
        return address
    if not isinstance(ip, IPv6Address):
        return str(ip)
    if ip.ipv4_mapped is not None:
        return str(ip.ipv4_mapped)
    return f"{IPv6Address(int(ip) >> 64 << 64)}/64"


# The burst, in seconds' worth of the rate: a page that opens requests several fields at once.
BURST_S: Final = 2.0
# An export lasts as long as its reader takes: one per client, and few that share the disk. After
# this time, it goes on until another client wants the slot.
EXPORTS: Final = 4
LONG_EXPORT_S: Final = 300.0


class AdmissionError(RuntimeError):
    """One request too many; the message names the limit."""

    def __init__(self, message: str, retry_after_s: float) -> None:
        super().__init__(message)
        self.retry_after_s = retry_after_s

    @property
    def headers(self) -> dict[str, str]:
        """Retry-After in whole seconds, as RFC 9110 has it."""
        return {"Retry-After": str(max(1, math.ceil(self.retry_after_s)))}


class ClientLimitError(AdmissionError):
    """One client requests too much."""


class BusyError(AdmissionError):
    """All clients together request too much."""


class Admission:
    """The requests in flight. Belongs to the event loop."""

    def __init__(self, limits: Limits) -> None:
        # By reason, for the metrics.
        self.refused: Counter[str] = Counter()
        self._limits = limits
        self._rate = RateLimit(limits.answers_per_s, limits.answers_per_s * BURST_S)
        self.in_flight: Counter[str] = Counter()
        # The exports being sent, by client: since when, s, and what breaks it off.
        self.exports: dict[str, tuple[float, Callable[[], None]]] = {}
        self._computing: Counter[str] = Counter()

    @property
    def being_computed(self) -> int:
        """How many computations keep the twin and the workers busy now."""
        return self._computing.total()

    @contextmanager
    def request(self, client: str, now_s: float) -> Iterator[None]:
        """A client's request, from its arrival until its answer is taken.

        Raises:
            ClientLimitError: one more than the client may have at once, or too soon.

        """
        if self.in_flight[client] >= self._limits.concurrency:
            self.refused["client_in_flight"] += 1
            raise ClientLimitError(
                f"{client} has {self._limits.concurrency} requests for computed answers in "
                "flight, the limit",
                1.0,
            )
        wait_s = self._rate.take(client, now_s)
        if wait_s > 0.0:
            self.refused["client_rate"] += 1
            raise ClientLimitError(
                f"{client} requests more than {self._limits.answers_per_s:g} computed answers a "
                "second, the limit",
                wait_s,
            )
        self.in_flight[client] += 1
        try:
            yield
        finally:
            _give_back(self.in_flight, client)

    @contextmanager
    def export(self, client: str, now_s: float, end: Callable[[], None]) -> Iterator[None]:
        """A client's export, from its first row to its last; `end` breaks it off.

        If all slots are taken, the oldest export is ended, provided that it is old.

        Raises:
            ClientLimitError: the client has one already.
            BusyError: all slots are taken, and no export is old.

        """
        if client in self.exports:
            self.refused["client_exports"] += 1
            raise ClientLimitError(f"{client} has 1 export under way, the limit", 5.0)
        if len(self.exports) >= EXPORTS:
            oldest, (since_s, end_oldest) = next(iter(self.exports.items()))
            if now_s - since_s < LONG_EXPORT_S:
                self.refused["total_exports"] += 1
                raise BusyError(f"{EXPORTS} exports are under way, the limit", 5.0)
            del self.exports[oldest]
            end_oldest()
        entry = self.exports[client] = now_s, end
        try:
            yield
        finally:
            if self.exports.get(client) is entry:
                del self.exports[client]

    @contextmanager
    def computing(self, client: str, *, is_large: bool = False) -> Iterator[int]:
        """A computation, which counts once for all clients that wait for it.

        `client` was the first to request it. Yields how many the client has under way with this
        one. A large one is queued as if it cost that many times as much, so that a client that
        sends many lets those of others pass. A small one is never delayed: 1.

        Raises:
            BusyError: all slots are taken, or the client would take more than it leaves free.

        """
        taken, limit = self._computing, self._limits.total_concurrency
        if is_large:
            limit -= limit // 4
        if taken[client] >= limit - taken.total():
            self.refused["large_in_flight" if is_large else "total_in_flight"] += 1
            raise BusyError(
                f"{taken.total()} answers are being computed, {taken[client]} of them for "
                f"{client}: the limit is {limit}{' for large ones' if is_large else ''}, and no "
                "client takes more than it leaves free",
                1.0,
            )
        taken[client] += 1
        try:
            yield taken[client] if is_large else 1
        finally:
            _give_back(taken, client)


def _give_back(taken: Counter[Any], key: Hashable) -> None:
    taken[key] -= 1
    if not taken[key]:
        del taken[key]


MAX_BYTES: Final = 64_000_000
# Rough overhead of an entry, counted in addition to its body.
ENTRY_BYTES: Final = 1_000


# Browsers and proxies cache the answer, and check each time whether it is still valid.
REVALIDATE: Final = {"Cache-Control": "no-cache"}


@dataclass(frozen=True, slots=True)
class Answer:
    """The body of an answer, and its headers."""

    body: bytes
    media_type: str
    headers: Mapping[str, str] = field(default_factory=dict)


def content_answer(
    body: bytes, media_type: str = "application/json", headers: Mapping[str, str] | None = None
) -> Answer:
    """An answer whose ETag is a digest of its body."""
    etag = f'"{blake2b(body, digest_size=12).hexdigest()}"'
    return Answer(body, media_type, {"ETag": etag, **REVALIDATE, **(headers or {})})


class AnswerCache:
    """Answers by their keys, the least recently used dropped first. Belongs to one thread.

    A key stands for everything that its answer depends on. An answer that is being sent counts, and
    is not dropped: so slow readers never hold more than the cache's limit.
    """

    def __init__(self, max_bytes: int = MAX_BYTES) -> None:
        self.bytes = 0
        self._max_bytes = max_bytes
        self._answers: OrderedDict[Hashable, Answer] = OrderedDict()
        # How many clients an answer is being sent to.
        self._readers: Counter[Hashable] = Counter()

    def __len__(self) -> int:
        return len(self._answers)

    def put(self, key: Hashable, answer: Answer, instead_of: Hashable | None = None) -> None:
        """Cache an answer if room can be made; the one under `instead_of` is dropped first."""
        for old in (key, instead_of):
            if old in self._answers and not self._readers[old]:
                self._drop(old)
        if key in self._answers:
            return  # the same answer, which is being sent
        size = len(answer.body) + ENTRY_BYTES
        if size > self._max_bytes:
            return
        idle = (old for old in list(self._answers) if not self._readers[old])
        while self.bytes + size > self._max_bytes:
            victim = next(idle, None)
            if victim is None:
                return
            self._drop(victim)
        self._answers[key] = answer
        self.bytes += size

    def lend(self, key: Hashable) -> tuple[Answer, Callable[[], None]] | None:
        """The answer under `key`, and what to call once it is sent; None: there is none."""
        answer = self._answers.get(key)
        if answer is None:
            return None
        self._answers.move_to_end(key)
        self._readers[key] += 1
        return answer, partial(_give_back, self._readers, key)

    def _drop(self, key: Hashable) -> None:
        self.bytes -= len(self._answers.pop(key).body) + ENTRY_BYTES
