"""What every role that serves a page does: listen, warn, say where, serve until a signal.

And what the service manager is told, and what `lupin-twin fleet` runs: without ROS.
"""

from __future__ import annotations

import asyncio
import gc
import logging
import os
import signal
import socket
from collections.abc import Callable, MutableMapping, Sequence
from contextlib import closing
from dataclasses import replace
from typing import Final

from lupin_bridge.access.middleware import Access
from lupin_bridge.access.policy import Proxies, exposure
from lupin_bridge.archive.database import ArchiveError, UsageError, check_url, open_archive
from lupin_bridge.judge.options import Criteria
from lupin_bridge.serving.admission import Limits
from lupin_bridge.serving.server import (
    BridgeServer,
    Certificates,
    address_of,
    allow_connections,
    check_pair,
    listen,
)
from lupin_bridge.settings import Secrets, SettingError, Settings, option, unix_path, variable

log = logging.getLogger("lupin_bridge")

# The manager acts when nothing has come for the whole time: two messages may be lost.
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
        if address.startswith(("/", "@")):
            self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC)
            self._socket.setblocking(False)
        elif address:
            log.warning("NOTIFY_SOCKET is %r, expected a path or @name: no notifications", address)
        is_ours = process in ("", str(os.getpid()))
        self.watchdog_s: Final = (
            int(timeout_us) / 1e6 if is_ours and timeout_us.isdecimal() else 0.0
        )
        self._has_failed = False

    def ready(self, status: str) -> None:
        """It serves from now on; `status` is a line for people."""
        self._notify(f"READY=1\nSTATUS={status}")

    def stopping(self) -> None:
        """It is about to end."""
        self._notify("STOPPING=1")

    async def send_watchdog(self, ailment: Callable[[], str | None]) -> None:
        """Notify that all is well, as long as `ailment` finds nothing."""
        while self.watchdog_s > 0.0:
            wrong = ailment()
            self._notify("WATCHDOG=1" if wrong is None else f"STATUS={wrong}")
            await asyncio.sleep(self.watchdog_s / _MESSAGES_A_TIMEOUT)

    def close(self) -> None:
        """Notify no more."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

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


# --- listen, warn, say where, serve until a signal ------------------------------------------------


def open_listener(settings: Settings, access: Access) -> socket.socket:
    """Listen, and warn of who may read.

    Raises:
        SettingError: it cannot listen there, or the certificate cannot be.

    """
    if settings.tls_cert:
        check_pair(settings.tls_cert, settings.tls_key)
    path = unix_path(settings.host)
    try:
        listener = listen(settings.host, settings.port)
    except OSError as error:
        where = "" if path else f" port {settings.port}"
        raise SettingError(
            f"cannot listen on {settings.host}{where}: {error.strerror or error}"
        ) from error
    if path:  # none but its owner and group reach it
        return listener
    for warning in exposure(
        listener.getsockname()[0], has_token=access.is_closed, has_tls=bool(settings.tls_cert)
    ):
        log.warning("%s", warning)
    return listener


async def serve(
    server: BridgeServer,
    listener: socket.socket,
    settings: Settings,
    supervisor: Supervisor,
    ailment: Callable[[], str | None],
) -> None:
    """Serve until a signal ends it; `ailment` tells the supervisor what only a restart helps."""
    # The 100,000 objects of all modules are here to stay. Each full collection would walk through
    # them, 30 to 50 ms during which nobody is served.
    gc.collect()
    gc.freeze()
    url = address_of(listener, "https" if settings.tls_cert else "http")
    print(f"lupin-twin: {url}", flush=True)  # noqa: T201  # for people and scripts
    supervisor.ready(f"serving {url}")
    tasks = [asyncio.create_task(supervisor.send_watchdog(ailment), name="watchdog")]
    if (renewal := _follow_certificates(settings, server)) is not None:
        tasks.append(renewal)
    try:
        await server.serve(sockets=[listener])
    finally:
        for task in tasks:
            task.cancel()


def _follow_certificates(settings: Settings, server: BridgeServer) -> asyncio.Task[None] | None:
    """Renew the certificate when its files change, and at once at SIGHUP."""
    server.config.load()
    if server.config.ssl is None:
        return None
    certificates = Certificates(settings.tls_cert, settings.tls_key, server.config.ssl)
    asyncio.get_running_loop().add_signal_handler(signal.SIGHUP, certificates.look)
    return asyncio.create_task(certificates.watch(), name="certificates")


# --- the page over all greenhouses, until a signal ends it ----------------------------------------

# Of the twin's own: a fleet has none.
_NOT_HERE = ("site", "journal", "mqtt_url", "webhook_url", "http_observations")


def run_fleet(settings: Settings, secrets: Secrets, ros_args: Sequence[str]) -> None:
    """Serve until a signal ends it.

    Raises:
        SettingError: a setting with which it cannot run.

    """
    # What is wrong is said once, here.
    logging.getLogger("psycopg").setLevel(logging.CRITICAL)
    if ros_args:
        raise SettingError("fleet takes no arguments of ROS")
    if not settings.archive_url:
        raise SettingError(f"{option('archive_url')} is missing, or {variable('archive_url')}")
    for name in _NOT_HERE:
        if getattr(settings, name) not in ("", "off"):
            raise SettingError(f"{settings.called(name)} is for a twin, not for lupin-twin fleet")
    try:
        check_url(settings.archive_url)
    except UsageError as error:
        raise SettingError(str(error)) from None
    access = Access.of(settings, secrets.token, is_fleet=True)
    proxies = Proxies.of(settings)
    criteria = Criteria.of(settings)
    asyncio.run(_run_fleet(settings, access, proxies, criteria))


async def _run_fleet(
    settings: Settings, access: Access, proxies: Proxies, criteria: Criteria
) -> None:
    from lupin_bridge.fleet.app import Fleet, create_fleet_app  # noqa: PLC0415  # not for a twin

    listener = open_listener(settings, access)
    await asyncio.to_thread(_report_error, settings.archive_url)
    settings = replace(settings, max_clients=allow_connections(settings.max_clients))
    # For the process that reads; not on its command line, which others can read.
    os.environ[variable("archive_url")] = settings.archive_url
    supervisor = Supervisor(os.environ)
    limits = Limits()
    fleet = Fleet(settings, criteria, access, limits)
    app = create_fleet_app(fleet, access, proxies)

    def announce_shutdown() -> None:
        supervisor.stopping()
        fleet.announce_shutdown()

    server = BridgeServer(app, settings, announce_shutdown, limits)
    await fleet.start()
    try:
        await serve(server, listener, settings, supervisor, lambda: None)
    finally:
        await fleet.stop()


def _report_error(url: str) -> None:
    """At once, in one line; it may pass, so the page is served all the same, and says so."""
    try:
        with closing(open_archive(url, "lupin-twin fleet")):
            pass
    except ArchiveError as error:
        log.error("%s; it will be retried", error)  # noqa: TRY400  # one line
