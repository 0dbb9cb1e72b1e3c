"""The web server: uvicorn, its signals and TLS certificate, and notifications to systemd."""

from __future__ import annotations

import asyncio
import gc
import logging
import math
import os
import resource
import signal
import socket
import ssl
from collections.abc import Callable, Iterator, MutableMapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType
from typing import Any, Final, NoReturn

import uvicorn
from fastapi import FastAPI
from uvicorn.server import HANDLED_SIGNALS

from lupin_bridge.serving.admission import Limits
from lupin_bridge.serving.connections import (
    MAX_INCOMPLETE_BYTES,
    Acceptor,
    HttpConnection,
    room_for_connections,
    tear_down,
)
from lupin_bridge.serving.ws_protocol import Connection
from lupin_bridge.settings import UNIX, SettingError, Settings, unix_path
from lupin_twin.runtime import process

log = logging.getLogger(__name__)

# Interval of checking the certificate's files. Certificates are renewed weeks before they expire.
WATCH_PERIOD_S: Final = 2.0


def check_pair(cert_file: str, key_file: str) -> None:
    """Load a certificate chain and its private key, both PEM, and forget them again.

    Raises:
        SettingError: a file cannot be read or is invalid, or the two are no pair.

    """
    for option, path in (("--tls-cert", cert_file), ("--tls-key", key_file)):
        try:
            with open(path, "rb"):  # noqa: PTH123  # read rights, whatever kind of file it is
                pass
        except OSError as error:
            raise SettingError(f"{option} {path}: {error.strerror}") from None

    def no_password() -> NoReturn:
        # Without this, OpenSSL would ask the terminal.
        raise SettingError(f"--tls-key {key_file} is encrypted: give a key without a passphrase")

    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    try:
        context.load_verify_locations(cert_file)
    except ssl.SSLError:
        raise SettingError(f"--tls-cert {cert_file} holds no PEM certificate") from None
    try:
        context.load_cert_chain(cert_file, key_file, no_password)
    except ssl.SSLError as error:
        if error.reason == "KEY_VALUES_MISMATCH":
            raise SettingError(f"--tls-key {key_file} is not the key of {cert_file}") from None
        reason = error.reason or "not PEM"
        raise SettingError(f"--tls-key {key_file} is not a usable private key ({reason})") from None


class Certificates:
    """The certificate and key that are served, reloaded for new connections when the files change.

    Open connections keep theirs. A new pair that is invalid is logged once, and the old one stays
    in use until the files hold a valid one.
    """

    def __init__(self, cert_file: str, key_file: str, context: ssl.SSLContext) -> None:
        self._files = (cert_file, key_file)
        self._context = context
        self._served = self._version()
        self._warned = ""

    async def watch(self) -> NoReturn:
        """Check the files periodically, for ever."""
        while True:
            await asyncio.sleep(WATCH_PERIOD_S)
            self.look()

    def look(self) -> None:
        """Serve what the files hold, if that has changed and is valid."""
        version = self._version()
        if version == self._served:
            return
        try:
            # Checked apart from the live context, which a wrong pair would leave without any.
            check_pair(*self._files)
            self._context.load_cert_chain(*self._files)
        except (SettingError, OSError) as error:  # ssl.SSLError is an OSError
            if str(error) != self._warned:
                log.warning("the new TLS certificate is refused, the old one stays: %s", error)
            self._warned = str(error)
            return
        self._served, self._warned = version, ""
        log.info("new connections use the renewed TLS certificate of %s", self._files[0])

    def _version(self) -> list[tuple[int, ...] | None]:
        return [_stamp(path) for path in self._files]


def _stamp(path: str) -> tuple[int, ...] | None:
    try:
        status = os.stat(path)  # noqa: PTH116  # through links, as renewals are made
    except OSError:
        return None
    return status.st_mtime_ns, status.st_ino, status.st_size


# Largest WebSocket message from a client: clients send little.
MAX_INBOUND_BYTES = 65_536
PING_PERIOD_S = 20.0
# Files open besides the clients' sockets: DDS, plain HTTP requests, clients that are refused.
SPARE_FILES = 512
# Ctrl-C ends within 2 s: clients have this long to take the last messages and what they are being
# sent; the rest is for the ROS thread (`ros_thread.STOP_TIMEOUT_S`). If a request outlives even its
# connection, uvicorn cancels it.
CLOSE_AFTER_S = 0.5
GRACEFUL_SHUTDOWN_S = 1
# Connections that may wait in the kernel while the loop is busy; others try again a second later.
# When a bridge is restarted, all clients come at once.
BACKLOG = 2_048


class BridgeServer(uvicorn.Server):
    """uvicorn's server, which announces a shutdown to its clients, and raises no signal again."""

    def __init__(
        self,
        app: FastAPI,
        settings: Settings,
        announcements: Sequence[Callable[[], None]],
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
                h11_max_incomplete_event_size=MAX_INCOMPLETE_BYTES,
                timeout_keep_alive=math.ceil(limits.client_timeout_s),
                access_log=False,
                log_config=None,
                server_header=False,
                ssl_certfile=settings.tls_cert or None,
                ssl_keyfile=settings.tls_key or None,
                proxy_headers=False,  # `BehindProxies` decides which headers count
                timeout_graceful_shutdown=GRACEFUL_SHUTDOWN_S,
            )
        )
        # Called first at the shutdown.
        self._announcements = announcements

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """As uvicorn, but an `Acceptor` of our own accepts the connections of each socket."""
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

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Stop on SIGINT and SIGTERM without raising them again, which would kill the clean-up.

        The command blocks both from its start on; only here are they unblocked.
        """
        with super().capture_signals():
            held_back = signal.pthread_sigmask(signal.SIG_UNBLOCK, HANDLED_SIGNALS)
            try:
                yield
            finally:
                signal.pthread_sigmask(signal.SIG_SETMASK, held_back)
                self._captured_signals.clear()

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:  # noqa: ARG002
        """Begin the shutdown; the process then ends soon, even if the event loop is stuck."""
        process.set_exit_deadline()
        # At a second SIGINT uvicorn would cancel all requests, each with a trace in the log.
        super().handle_exit(signal.SIGTERM, frame)

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Notify the clients, and cut off after `CLOSE_AFTER_S` those that are still there.

        uvicorn would cancel their requests instead, each with a trace in the log and a bare 500.
        """
        for announce in self._announcements:
            announce()
        asyncio.get_running_loop().call_later(CLOSE_AFTER_S, self._cut_off_clients)
        await super().shutdown(sockets)

    def _cut_off_clients(self) -> None:
        for connection in list(self.server_state.connections):
            tear_down(connection.transport)


def listen(host: str, port: int) -> socket.socket:
    """A listening socket, so that an address in use is known before anything else starts.

    It listens from here on, not from when the server takes over: a client in between waits
    for a moment instead of being refused. A Unix socket is for its owner and group alone.

    Raises:
        OSError: the address cannot be bound.

    """
    path = unix_path(host)
    if path is not None:
        listener = socket.socket(socket.AF_UNIX)
    else:
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        # asyncio turns Nagle's algorithm off only where it knows that this is TCP. With it, the
        # second write to a client (a body after its headers, a state after the status) waits 40 ms.
        listener = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        if path is not None:
            _remove_left(path)
            listener.bind(str(path))
            path.chmod(0o660)  # nobody can connect before it listens
        else:
            listener.bind((host, port))
        listener.listen(BACKLOG)
    except OSError:
        listener.close()
        raise
    listener.setblocking(False)
    return listener


def _remove_left(path: Path) -> None:
    """Remove the socket of a process that has ended, which would block the address."""
    with socket.socket(socket.AF_UNIX) as probe, suppress(OSError):
        probe.settimeout(1.0)
        try:
            probe.connect(str(path))
        except ConnectionRefusedError:
            if path.is_socket():  # a file refuses, too
                path.unlink()


def allow_connections(number: int) -> int:
    """Raise this process's limit on open files to what `number` clients need.

    The usual limit of 1,024 is there for programs that use select(2), which this is not.

    Returns how many clients may connect: fewer than `number` if the limit cannot be raised that
    far, so that there is room for plain requests and refusals besides them.
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
    if listener.family == socket.AF_UNIX:
        return f"{UNIX}{listener.getsockname()}"
    host, port = listener.getsockname()[:2]
    return f"{scheme}://[{host}]:{port}" if ":" in host else f"{scheme}://{host}:{port}"


# --- notifications to the service manager ---------------------------------------------------------

# The manager acts when nothing has come for its whole time-out: two messages may be lost.
_MESSAGES_A_TIMEOUT: Final = 3


class Supervisor:
    """systemd's notifications (sd_notify(3)); none where NOTIFY_SOCKET is not set.

    The variables are taken out of `environment`: a child must not speak for this process.
    """

    def __init__(self, environment: MutableMapping[str, str]) -> None:
        address = environment.pop("NOTIFY_SOCKET", "")
        timeout_us = environment.pop("WATCHDOG_USEC", "")
        process = environment.pop("WATCHDOG_PID", "")
        # "@": Linux's abstract namespace, whose names begin with a zero.
        self._address = f"\0{address[1:]}" if address.startswith("@") else address
        self._socket: socket.socket | None = None
        if address:
            self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC)
            self._socket.setblocking(False)
        is_ours = process in ("", str(os.getpid()))
        self.watchdog_s: Final = (
            int(timeout_us) / 1e6 if is_ours and timeout_us.isdecimal() else 0.0
        )
        self._has_failed = False

    def ready(self, status: str) -> None:
        """Notify that the bridge serves from now on; `status` is a line for people."""
        self._notify(f"READY=1\nSTATUS={status}")

    def stopping(self) -> None:
        """Notify that the bridge is about to end."""
        self._notify("STOPPING=1")

    async def send_watchdog(self, ailment: Callable[[], str | None]) -> None:
        """Notify that all is well, as long as `ailment` finds nothing."""
        while self.watchdog_s > 0.0:
            wrong = ailment()
            self._notify("WATCHDOG=1" if wrong is None else f"STATUS={wrong}")
            await asyncio.sleep(self.watchdog_s / _MESSAGES_A_TIMEOUT)

    def _notify(self, words: str) -> None:
        if self._socket is None:
            return
        try:
            self._socket.sendto(words.encode(), self._address)
        except OSError as error:
            if not self._has_failed:
                log.warning(
                    "the service manager cannot be notified of %r: %s", words, error.strerror
                )
            self._has_failed = True


# --- serve until a signal -------------------------------------------------------------------------


async def serve(
    server: BridgeServer,
    listener: socket.socket,
    settings: Settings,
    supervisor: Supervisor,
    ailment: Callable[[], str | None],
) -> None:
    """Serve until a signal ends it; `ailment` returns a fault that only a restart mends."""
    # The 100,000 objects of all modules stay for good. Each full collection would walk through
    # them, 30 to 50 ms during which nobody is served.
    gc.collect()
    gc.freeze()
    url = address_of(listener, "https" if settings.tls_cert else "http")
    tasks = [asyncio.create_task(supervisor.send_watchdog(ailment), name="watchdog")]
    server.config.load()
    if server.config.ssl is not None:
        certificates = Certificates(settings.tls_cert, settings.tls_key, server.config.ssl)
        tasks.append(asyncio.create_task(certificates.watch(), name="certificates"))
    print(f"lupin-twin: {url}", flush=True)  # noqa: T201  # for people and scripts
    supervisor.ready(f"serving {url}")
    try:
        await server.serve(sockets=[listener])
    finally:
        for task in tasks:
            task.cancel()
