"""What every role that serves a page does: listen, warn, say where, serve until a signal."""

from __future__ import annotations

import asyncio
import gc
import logging
import signal
import socket
from collections.abc import Callable

from lupin_bridge.access.middleware import Access
from lupin_bridge.access.policy import exposure
from lupin_bridge.cli.supervisor import Supervisor
from lupin_bridge.serving.server import BridgeServer, Certificates, address_of, check_pair, listen
from lupin_bridge.settings import SettingError, Settings

log = logging.getLogger("lupin_bridge")


def open_listener(settings: Settings, access: Access) -> socket.socket:
    """Listen, and warn of who may read.

    Raises:
        SettingError: it cannot listen there, or the certificate cannot be.

    """
    if settings.tls_cert:
        check_pair(settings.tls_cert, settings.tls_key)
    try:
        listener = listen(settings.host, settings.port)
    except OSError as error:
        raise SettingError(
            f"cannot listen on {settings.host} port {settings.port}: {error.strerror}"
        ) from error
    for warning in exposure(
        listener.getsockname()[0], has_token=access.is_closed, has_tls=access.secure
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
