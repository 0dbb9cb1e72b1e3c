"""The web server: uvicorn, set up for this application, with the signals in our hands."""

from __future__ import annotations

import asyncio
import logging
import math
import resource
import signal
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

import uvicorn
from fastapi import FastAPI
from uvicorn.server import HANDLED_SIGNALS

from lupin_bridge.serving.acceptor import Acceptor, room_for_connections
from lupin_bridge.serving.http_protocol import HttpConnection
from lupin_bridge.serving.limits import Limits
from lupin_bridge.serving.transports import tear_down
from lupin_bridge.serving.ws_protocol import Connection
from lupin_bridge.settings import Settings
from lupin_twin import process

log = logging.getLogger(__name__)

# Clients have nothing to say: what they send is read and thrown away, and bounded.
MAX_INBOUND_BYTES = 65_536
PING_PERIOD_S = 20.0
# Files open beside the clients' sockets: DDS, plain HTTP requests, those who are turned away.
SPARE_FILES = 512
# Ctrl-C ends within 2 s: so much for the clients to take what they are told and what they are being
# sent, the rest for the ROS thread (`ros_thread.STOP_TIMEOUT_S`). Should a request outlive even its
# connection, uvicorn cancels it.
GOODBYE_S = 0.5
GRACEFUL_SHUTDOWN_S = 1
# Who comes while the loop is busy waits in the kernel; whom that has no place for tries again a
# second later. All clients come at once when a bridge is started anew.
BACKLOG = 2_048
# uvicorn's main loop.
TICKS_PER_S = 10


class BridgeServer(uvicorn.Server):
    """uvicorn's server, that says good-bye first and does not raise the signal once more."""

    def __init__(
        self,
        app: FastAPI,
        settings: Settings,
        say_goodbye: Callable[[], None],
        limits: Limits = Limits(),
    ) -> None:
        super().__init__(
            uvicorn.Config(
                app,
                http=HttpConnection,
                ws=Connection,
                ws_per_message_deflate=False,  # 2 ms against 30 ms of CPU for 50 clients a frame
                ws_max_size=MAX_INBOUND_BYTES,
                ws_ping_interval=PING_PERIOD_S,
                ws_ping_timeout=PING_PERIOD_S,
                timeout_keep_alive=math.ceil(limits.client_timeout_s),
                access_log=False,
                log_config=None,
                server_header=False,
                ssl_certfile=settings.tls_cert or None,
                ssl_keyfile=settings.tls_key or None,
                proxy_headers=False,  # who asks is who is connected, whatever a header claims
                timeout_graceful_shutdown=GRACEFUL_SHUTDOWN_S,
            )
        )
        self._say_goodbye = say_goodbye
        # Connections that are being closed, and since when, s.
        self._closing_since_s: dict[Any, float] = {}

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """As uvicorn, with a door of our own in front of each socket."""
        await super().startup(sockets=[])
        state, lifespan = self.server_state, self.lifespan

        def make_protocol() -> HttpConnection:
            return HttpConnection(self.config, state, lifespan.state)

        acceptors: list[Any] = [
            Acceptor(
                listener,
                make_protocol,
                state.connections,  # type: ignore[arg-type]  # all of them are ours
                room=room_for_connections(),
                tls=self.config.ssl,
                timeout_s=self.config.timeout_keep_alive,
            )
            for listener in sockets or []
        ]
        self.servers.extend(acceptors)

    async def on_tick(self, counter: int) -> bool:
        """Ten times a second: see that what is being closed ends."""
        if counter % TICKS_PER_S == 0:
            self._end_the_closing(asyncio.get_running_loop().time())
        return await super().on_tick(counter)

    def _end_the_closing(self, now_s: float) -> None:
        """Tear down what has been closed, by whomever, and whose last bytes nobody takes."""
        since_s = self._closing_since_s
        self._closing_since_s = {
            connection: since_s.get(connection, now_s)
            for connection in self.server_state.connections
            if connection.transport.is_closing()
        }
        for connection, start_s in self._closing_since_s.items():
            if now_s - start_s >= self.config.timeout_keep_alive:
                tear_down(connection.transport)

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Stop on SIGINT and SIGTERM, and return: raised again, they would kill the clean-up.

        The command holds both back from its first moment on; here, and only here, they get in.
        """
        with super().capture_signals():
            held_back = signal.pthread_sigmask(signal.SIG_UNBLOCK, HANDLED_SIGNALS)
            try:
                yield
            finally:
                signal.pthread_sigmask(signal.SIG_SETMASK, held_back)
                self._captured_signals.clear()

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """A stop signal has come: end, soon, and whatever hangs, a stuck loop included."""
        process.must_end()
        super().handle_exit(sig, frame)

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Tell the clients, then close."""
        self._say_goodbye()
        asyncio.get_running_loop().call_later(GOODBYE_S, self._cut_off_clients)
        await super().shutdown(sockets)

    def _cut_off_clients(self) -> None:
        for connection in list(self.server_state.connections):
            tear_down(connection.transport)


def listen(host: str, port: int) -> socket.socket:
    """A listening socket, so that an address in use is known before anything else starts.

    It listens from here on, not from when the server takes over: whoever comes in between waits
    for a moment instead of being turned away.

    Raises:
        OSError: the address cannot be had.

    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    # asyncio turns Nagle's algorithm off only where it is told that this is TCP. With it, the
    # second write to a client (a body after its headers, a state after the status) waits 40 ms.
    listener = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((host, port))
        listener.listen(BACKLOG)
    except OSError:
        listener.close()
        raise
    listener.setblocking(False)
    return listener


def allow_connections(number: int) -> int:
    """Raise this process's limit on open files to what so many clients need.

    The usual limit of 1,024 is there for programs that use select(2), which this is not.

    Returns how many clients it will do for: fewer than `number` where the limit cannot be raised as
    far, so that there is room beside them for those who ask, and for those who are told that the
    house is full.
    """
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = number + SPARE_FILES
    if soft == resource.RLIM_INFINITY or soft >= wanted:
        return number
    allowed = wanted if hard == resource.RLIM_INFINITY else min(wanted, hard)
    resource.setrlimit(resource.RLIMIT_NOFILE, (allowed, hard))
    if allowed == wanted:
        return number
    fewer = max(1, min(number, max(allowed - SPARE_FILES, allowed // 4)))
    log.warning(
        "--max-clients is %d, but this process may open %d files (ulimit -Hn), of which it keeps "
        "%d for itself: serving %d clients at most; raise the limit for more",
        number,
        hard,
        allowed - fewer,
        fewer,
    )
    return fewer


def address_of(listener: socket.socket, scheme: str = "http") -> str:
    """The URL of a listening socket, for a person to open."""
    host, port = listener.getsockname()[:2]
    return f"{scheme}://[{host}]:{port}" if ":" in host else f"{scheme}://{host}:{port}"
