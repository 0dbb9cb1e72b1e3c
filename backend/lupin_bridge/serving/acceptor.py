"""The door: connections are taken off the listening socket as long as there are files for them.

asyncio's own server knows no limit. Out of files, it logs an error for each place in its backlog
and tries all of them again a second later, ever more at once: 97 MB of log in half a minute.
"""

from __future__ import annotations

import asyncio
import errno
import heapq
import logging
import resource
import socket
import ssl
from asyncio.sslproto import SSLProtocol
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Protocol

from lupin_bridge.serving.rate_limit import client_key
from lupin_twin.throttle import Throttle

# Whom to turn out when the house is full: who has waited longest and asked for nothing. Pure.
#
# An open connection costs a file, and there are only so many. Who holds one without having asked
# for anything yet, or without taking what it asked for, goes before anybody is kept out. And
# first of all goes who comes from the address with the most connections, so that one address,
# however many it opens, crowds out none but itself.


class Guest(Protocol):
    """One connection; `HttpConnection` is one, and a handshake of TLS."""

    @property
    def address(self) -> str:
        """The client that it comes from (`rate_limit.client_key`)."""

    @property
    def waiting_since_s(self) -> float | None:
        """Since when it has done nothing but wait, s; None: it is being served."""

    def abort(self) -> None:
        """End it now."""


def whom_to_turn_out(guests: Iterable[Guest], number: int) -> list[Guest]:
    """At most `number` guests that wait, of the largest parties, the longest waiting first.

    After each one its party is one smaller; of two of the same size the one with the longest
    waiting guest counts as larger.
    """
    sizes: Counter[str] = Counter()
    waiting: defaultdict[str, list[tuple[float, int, Guest]]] = defaultdict(list)
    for order, guest in enumerate(guests):
        sizes[guest.address] += 1
        since_s = guest.waiting_since_s
        if since_s is not None:
            waiting[guest.address].append((since_s, order, guest))
    parties: list[tuple[int, float, int, str]] = []
    for address, party in waiting.items():
        party.sort(key=lambda entry: entry[:2], reverse=True)
        parties.append((-sizes[address], *party[-1][:2], address))
    heapq.heapify(parties)
    chosen: list[Guest] = []
    while parties and len(chosen) < number:
        size, _, _, address = parties[0]
        party = waiting[address]
        chosen.append(party.pop()[2])
        if party:
            heapq.heapreplace(parties, (size + 1, *party[-1][:2], address))
        else:
            heapq.heappop(parties)
    return chosen


log = logging.getLogger(__name__)

# Files that stay free for the rest of the process: DDS, the page's files.
KEPT_FILES: Final = 64
# However few files there are: with fewer connections nobody could be served at all.
MIN_CONNECTIONS: Final = 8
# Between two turns of the event loop; the others have to be served too.
AT_ONCE: Final = 64
# Of a full house, so much is turned out at once: who is to go costs a look at everybody.
TURNED_OUT: Final = 1 / 16
# What asyncio sets aside for each connection over TLS, from its first moment on: 256 kB if nothing
# is said of it, which a stranger could have thousands of times. A record of TLS has 16 kB at most.
TLS_BUFFER_BYTES: Final = 32 * 1024
RETRY_S: Final = 0.25
COMPLAINT_PERIOD_S: Final = 30.0

_NO_FILES: Final = frozenset({errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM})


def room_for_connections() -> int:
    """How many connections this process's limit on open files leaves room for."""
    limit, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    if limit == resource.RLIM_INFINITY:
        limit = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    if limit == resource.RLIM_INFINITY:
        return 1 << 20
    return max(MIN_CONNECTIONS, limit - len(list(Path("/proc/self/fd").iterdir())) - KEPT_FILES)


@dataclass(eq=False, slots=True)
class _Arrival:
    """A connection that has no protocol yet: TLS is being agreed on."""

    address: str
    waiting_since_s: float | None
    task: asyncio.Task[None] | None = None

    def abort(self) -> None:
        if self.task is not None:
            self.task.cancel()


class Acceptor:
    """Takes connections and turns them out; uvicorn closes it as it would an `asyncio.Server`.

    `guests` are all connections with a protocol. A handshake of TLS, and its end, may take
    `timeout_s`.
    """

    def __init__(
        self,
        listener: socket.socket,
        make_protocol: Callable[[], asyncio.BaseProtocol],
        guests: Collection[Guest],
        *,
        room: int,
        tls: ssl.SSLContext | None,
        timeout_s: float,
    ) -> None:
        self._listener = listener
        self._make_protocol = make_protocol
        self._guests = guests
        self._room = room
        self._options: dict[str, Any] = {}
        if tls is not None:
            SSLProtocol.max_size = TLS_BUFFER_BYTES
            self._options = {
                "ssl": tls,
                "ssl_handshake_timeout": timeout_s,
                "ssl_shutdown_timeout": timeout_s,
            }
        self._arrivals: set[_Arrival] = set()
        self._complaints = Throttle(COMPLAINT_PERIOD_S)
        self._retry: asyncio.TimerHandle | None = None
        self._loop = asyncio.get_running_loop()
        self._resume()

    def close(self) -> None:
        """Take no more, and give up on who has no protocol yet."""
        if self._retry is not None:
            self._retry.cancel()
        self._loop.remove_reader(self._listener)
        for arrival in self._arrivals:
            arrival.abort()

    async def wait_closed(self) -> None:
        """Until those have gone."""
        tasks = [arrival.task for arrival in self._arrivals if arrival.task is not None]
        await asyncio.gather(*tasks, return_exceptions=True)

    def _resume(self) -> None:
        self._retry = None
        self._loop.add_reader(self._listener, self._take)

    def _pause(self) -> None:
        self._loop.remove_reader(self._listener)
        self._retry = self._loop.call_later(RETRY_S, self._resume)

    def _take(self) -> None:
        """Take who waits outside: somebody does, or the socket would not be ready."""
        if self._is_full():
            # Whoever is turned out has left by the next turn of the event loop.
            if not self._make_room():
                self._pause()
            return
        for _ in range(AT_ONCE):
            try:
                connection, _ = self._listener.accept()
            except (BlockingIOError, InterruptedError, ConnectionAbortedError):
                return
            except OSError as error:
                if error.errno not in _NO_FILES:
                    raise
                self._complain("no new connections for now: %s", error.strerror)
                self._make_room()
                self._pause()
                return
            connection.setblocking(False)
            self._let_in(connection)
            if self._is_full():
                return  # nobody goes before somebody else is known to wait

    def _is_full(self) -> bool:
        return len(self._guests) + len(self._arrivals) >= self._room

    def _let_in(self, connection: socket.socket) -> None:
        arrival = _Arrival(_address_of(connection), self._loop.time())
        self._arrivals.add(arrival)
        arrival.task = self._loop.create_task(self._agree(connection))
        arrival.task.add_done_callback(lambda _: self._arrivals.discard(arrival))

    async def _agree(self, connection: socket.socket) -> None:
        with suppress(OSError):  # no TLS, none in time, or gone: asyncio has closed it
            await self._loop.connect_accepted_socket(
                self._make_protocol, connection, **self._options
            )

    def _make_room(self) -> bool:
        everybody: list[Guest] = [*self._guests, *self._arrivals]
        chosen = whom_to_turn_out(everybody, max(1, int(self._room * TURNED_OUT)))
        for guest in chosen:
            guest.abort()
        self._complain(
            "%d connections are open, and there are files for %d: turned out the %d that have "
            "waited longest",
            len(everybody),
            self._room,
            len(chosen),
        )
        return bool(chosen)

    def _complain(self, text: str, *values: object) -> None:
        if self._complaints.ask(text, self._loop.time()) is not None:
            log.warning(text, *values)


def _address_of(connection: socket.socket) -> str:
    try:
        return client_key(connection.getpeername()[0])
    except OSError:
        return ""  # it has gone already
