"""Accepts, evicts, bounds and tears down connections; and HTTP for slow clients.

Connections are accepted as long as there are file descriptors for them. asyncio's own server has no
limit. Out of descriptors, it logs an error for each entry in its backlog, and retries all of them a
second later: 97 MB of log in half a minute.

A connection that has requested nothing yet, or does not take what it requested, is evicted before
any new one is refused. The client with the most connections loses its own first, the longest
waiting first: a flood evicts only itself.
"""

from __future__ import annotations

import asyncio
import heapq
import logging
import resource
import socket
import ssl
import struct
import sys
from asyncio.sslproto import SSLProtocol
from collections import Counter
from collections.abc import Callable, Collection
from contextlib import suppress
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path
from typing import Any, Final, Protocol, cast

import h11
import orjson
from uvicorn.protocols.http.h11_impl import H11Protocol, RequestResponseCycle

from lupin_bridge.serving.admission import client_key
from lupin_twin.core.drops import Throttle

log = logging.getLogger(__name__)

# The key of the connection in the state of a request's scope.
CONNECTION_KEY: Final = "connection"

# Unsent bytes that the kernel may buffer, apart from those in flight. Its default is 4 MB
# (tcp_wmem): for a slow reader, minutes of old states.
UNSENT_BYTES: Final = 128 * 1024

# How long a client may read the reason for a close before its socket is torn down. If closed at
# once while the client is still sending, the socket would be reset, and the reason lost.
CLOSE_GRACE_S: Final = 1.0


def bound_unsent(transport: asyncio.BaseTransport) -> None:
    """Let a connection's socket take no more than `UNSENT_BYTES` ahead of the network."""
    connection: socket.socket = transport.get_extra_info("socket")
    if connection.family != socket.AF_UNIX:  # which holds 0.2 MB
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NOTSENT_LOWAT, UNSENT_BYTES)


# How asyncio fails on a TLS transport that uvicorn closed twice, and that ends by itself.
_UNLESS_FORGOTTEN: Final = suppress(AttributeError)


def tear_down(transport: asyncio.WriteTransport) -> None:
    """End a connection now; one whose other side does not read is reset.

    If only closed, its socket would keep the unread data for another four minutes.
    """
    with _UNLESS_FORGOTTEN:
        if transport.get_write_buffer_size() > 0:
            reset(transport)
        else:
            transport.abort()


def reset(transport: asyncio.WriteTransport) -> None:
    """End a connection now with a TCP reset, so that the other side sees that it was cut off."""
    no_lingering = struct.pack("ii", 1, 0)
    with _UNLESS_FORGOTTEN:
        connection: socket.socket | None = transport.get_extra_info("socket")
        if connection is not None and connection.fileno() >= 0:  # else it has ended already
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, no_lingering)
        transport.abort()


# Bytes read from a connection at once: clients send little, and all others wait while it is parsed,
# 3 ms for the smallest WebSocket frames.
READ_BYTES: Final = 8_192
_READ_BUFFER: Final = memoryview(bytearray(READ_BYTES))


class SmallReads(asyncio.BufferedProtocol):
    """Reads each client in small parts, in turn."""

    def data_received(self, data: bytes) -> None:
        """Take bytes; see `asyncio.Protocol`."""
        raise NotImplementedError

    def get_buffer(self, sizehint: int) -> memoryview:  # noqa: ARG002  # asyncio's suggestion
        """The buffer for the next bytes; all connections share it, as they are read at once."""
        return _READ_BUFFER

    def buffer_updated(self, nbytes: int) -> None:
        """Take the bytes that have come."""
        self.data_received(bytes(_READ_BUFFER[:nbytes]))


class Evictable(Protocol):
    """A connection, or a handshake of TLS."""

    @property
    def client(self) -> tuple[str, int] | None:
        """Address and port, as in an ASGI scope."""

    @property
    def waiting_since_s(self) -> float | None:
        """Since when it has only waited, s; None: it is being served."""

    def abort(self) -> None:
        """End it now."""


# Files that stay free for the rest of the process: DDS, the page's files.
SPARE_FILES: Final = 64
# Even if there are fewer files: with fewer connections, the bridge would serve nobody.
MIN_CONNECTIONS: Final = 8
# Connections accepted in one turn of the event loop.
AT_ONCE: Final = 64
# Share of connections evicted at once when full: each choice looks at all of them.
EVICTED_SHARE: Final = 1 / 16
# asyncio's buffer for each TLS connection, allocated at once. Its default is 256 kB, which a
# stranger could have allocated thousands of times. A TLS record has 16 kB at most.
TLS_BUFFER_BYTES: Final = 32 * 1024
RETRY_S: Final = 0.25
WARNING_PERIOD_S: Final = 30.0


def room_for_connections() -> int:
    """How many connections this process's limit on open files leaves room for."""
    limit, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    if limit == resource.RLIM_INFINITY:
        return 1 << 20
    return max(MIN_CONNECTIONS, limit - len(list(Path("/proc/self/fd").iterdir())) - SPARE_FILES)


@dataclass(eq=False, slots=True)
class _Handshake:
    """A connection that has no protocol yet: TLS is being agreed on."""

    client: tuple[str, int] | None
    waiting_since_s: float | None
    task: asyncio.Task[None] | None = None

    def abort(self) -> None:
        if self.task is not None:
            self.task.cancel()


class Acceptor:
    """Accepts and evicts connections; uvicorn closes it as it would an `asyncio.Server`.

    `connections` are all that have a protocol. A handshake of TLS may take `timeout_s`.
    """

    def __init__(
        self,
        listener: socket.socket,
        make_protocol: Callable[[], asyncio.BaseProtocol],
        connections: Collection[Evictable],
        *,
        room: int,
        tls: ssl.SSLContext | None,
        timeout_s: float,
    ) -> None:
        self._listener = listener
        self._make_protocol = make_protocol
        self._connections = connections
        self._room = room
        self._options: dict[str, Any] = {}
        if tls is not None:
            SSLProtocol.max_size = TLS_BUFFER_BYTES
            self._options = {"ssl": tls, "ssl_handshake_timeout": timeout_s}
        self._handshakes: set[_Handshake] = set()
        self._warnings = Throttle(WARNING_PERIOD_S)
        self._retry: asyncio.TimerHandle | None = None
        self._loop = asyncio.get_running_loop()
        self._resume()

    def close(self) -> None:
        """Accept no more, and end the handshakes."""
        if self._retry is not None:
            self._retry.cancel()
        self._loop.remove_reader(self._listener)
        for handshake in self._handshakes:
            handshake.abort()

    async def wait_closed(self) -> None:
        """Wait until the handshakes have ended."""
        tasks = [handshake.task for handshake in self._handshakes if handshake.task is not None]
        await asyncio.gather(*tasks, return_exceptions=True)

    def _resume(self) -> None:
        self._retry = None
        self._loop.add_reader(self._listener, self._take)

    def _pause(self) -> None:
        self._loop.remove_reader(self._listener)
        self._retry = self._loop.call_later(RETRY_S, self._resume)

    def _take(self) -> None:
        """Accept what waits in the backlog."""
        if self._is_full():
            # Evicted connections are gone by the next turn of the event loop.
            if not self._make_room():
                self._pause()
            return
        for _ in range(AT_ONCE):
            try:
                connection, peer = self._listener.accept()
            except (BlockingIOError, InterruptedError, ConnectionAbortedError):
                return
            except OSError as error:
                self._warn("no new connections for now: %s", error.strerror)
                self._make_room()
                self._pause()
                return
            connection.setblocking(False)
            self._admit(connection, peer)
            if self._is_full():
                return  # evict only when another connection is known to wait

    def _is_full(self) -> bool:
        return len(self._connections) + len(self._handshakes) >= self._room

    def _admit(self, connection: socket.socket, peer: Any) -> None:
        # A Unix socket's peer is a text.
        handshake = _Handshake(peer[:2] if isinstance(peer, tuple) else None, self._loop.time())
        self._handshakes.add(handshake)
        handshake.task = self._loop.create_task(self._handshake(connection))
        handshake.task.add_done_callback(lambda _: self._handshakes.discard(handshake))

    async def _handshake(self, connection: socket.socket) -> None:
        with suppress(OSError):  # no TLS, none in time, or closed: asyncio has closed it
            await self._loop.connect_accepted_socket(
                self._make_protocol, connection, **self._options
            )

    def _make_room(self) -> bool:
        all_open: list[Evictable] = [*self._connections, *self._handshakes]
        clients = [client_key(it.client[0]) if it.client else "" for it in all_open]
        sizes = Counter(clients)
        waiting = [
            (-sizes[client], it.waiting_since_s, it)
            for client, it in zip(clients, all_open, strict=True)
            if it.waiting_since_s is not None
        ]
        most = max(1, int(self._room * EVICTED_SHARE))
        chosen = heapq.nsmallest(most, waiting, key=itemgetter(0, 1))
        for *_, connection in chosen:
            connection.abort()
        self._warn(
            "%d connections are open, and there are files for %d: evicted the %d longest waiting "
            "of the largest clients",
            len(all_open),
            self._room,
            len(chosen),
        )
        return bool(chosen)

    def _warn(self, text: str, *values: object) -> None:
        if self._warnings.allow(text, self._loop.time()) is not None:
            log.warning(text, *values)


# --- HTTP for slow clients: answers are buffered piece by piece, and idle clients are cut off -----

# uvicorn buffers all of an answer that the socket does not take, and waits for the rest of a
# request without limit. A few hundred connections that request a large field and never read would
# fill the memory; some thousand that never finish a request would use up all sockets. The time
# limits are the connection's, and so cover all that is sent: answers of routes, and refusals by
# access control, the framework and this protocol alike. `AccessControl` refuses bodies that no
# route takes, and `CachedResponse` sends a body in pieces.

# The request's line and all header lines.
MAX_HEAD_BYTES: Final = 32 * 1024
# The parser's limit is for incomplete heads: the rest of one may come with the next read.
MAX_INCOMPLETE_BYTES: Final = MAX_HEAD_BYTES - READ_BYTES
# With more than this unsent, the next piece waits. asyncio's default, except 512 kB over TLS.
HIGH_WATER_BYTES: Final = 64 * 1024


class HttpConnection(H11Protocol, SmallReads):
    """uvicorn's protocol, with a limit on every wait.

    A client has uvicorn's `timeout_keep_alive` to send a whole request, counted from its connection
    or its last answer, however often it sends a byte. It has as long to take a piece of an answer.
    """

    _idle_since_s = 0.0
    _deadline: asyncio.TimerHandle

    @property
    def waiting_since_s(self) -> float | None:
        """Since when the client has requested, or taken, nothing; None: it is being served."""
        cycle = cast("RequestResponseCycle | None", self.cycle)
        is_at_work = cycle is not None and not (cycle.more_body or cycle.response_complete)
        is_stuck = self.flow.write_paused or self.transport.is_closing()
        return None if is_at_work and not is_stuck else self._idle_since_s

    def connection_made(self, transport: Any) -> None:
        """Start to wait for a request."""
        super().connection_made(transport)
        self.app_state = {**self.app_state, CONNECTION_KEY: self}
        bound_unsent(transport)
        transport.set_write_buffer_limits(HIGH_WATER_BYTES)
        self._idle_since_s = self.loop.time()
        self._check_later()

    def data_received(self, data: bytes) -> None:
        """Take bytes; over TLS, some may come after the end."""
        if not self.transport.is_closing():
            super().data_received(data)

    def on_response_complete(self) -> None:
        """Start to wait for the next request; perhaps it has come already."""
        self._wait()
        super().on_response_complete()

    def pause_writing(self) -> None:
        """Start to wait for the client to take a piece."""
        super().pause_writing()
        self._wait()

    def handle_websocket_upgrade(self, event: Any) -> None:
        """Hand the connection over to the WebSocket protocol."""
        self._deadline.cancel()
        super().handle_websocket_upgrade(event)

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the connection, which the timer would keep."""
        self._deadline.cancel()
        super().connection_lost(exc)

    def send_400_response(self, msg: str) -> None:
        """Refuse what the parser rejects, and close; uvicorn calls this from its `except`."""
        if self.cycle is not None:
            self.cycle.disconnected = True  # the route's own answer would come after this one
        error = sys.exception()
        status = getattr(error, "error_status_hint", 400)
        body = orjson.dumps({"detail": str(error)[:500] or msg})
        headers = [("content-type", "application/json"), ("connection", "close")]
        for event in (
            h11.Response(status_code=status, headers=headers),
            h11.Data(data=body),
            h11.EndOfMessage(),
        ):
            self.transport.write(self.conn.send(event) or b"")
        self.transport.close()

    def abort(self) -> None:
        """Tear the connection down and forget what was still to be sent."""
        tear_down(self.transport)

    def dismiss(self, _code: int = 0, _reason: str = "") -> None:
        """Abort an answer, so that its client does not take the part for the whole.

        In HTTP/1.0, where the end of the connection ends an answer, only a reset can show that.
        """
        reset(self.transport)

    def _wait(self) -> None:
        self._idle_since_s = self.loop.time()
        self._deadline.cancel()
        self._check_later()

    def _check_later(self) -> None:
        self._deadline = self.loop.call_later(self.timeout_keep_alive, self._end_if_waiting)

    def _end_if_waiting(self) -> None:
        if self.waiting_since_s is None:
            self._check_later()
            return
        if self.flow.write_paused:
            limit_s = self.timeout_keep_alive
            log.warning("disconnected a reader that accepted nothing for %g s", limit_s)
        self.abort()
