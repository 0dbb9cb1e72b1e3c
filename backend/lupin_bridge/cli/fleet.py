"""What `lupin-twin fleet` runs: the page over all greenhouses, until a signal ends it."""

from __future__ import annotations

import asyncio
import logging
import os
from collections.abc import Sequence
from contextlib import closing
from dataclasses import replace

from lupin_bridge.access.middleware import Access
from lupin_bridge.access.policy import Proxies
from lupin_bridge.archive.database import ArchiveError, UsageError, check_url, open_archive
from lupin_bridge.cli.serving import open_listener, serve
from lupin_bridge.cli.supervisor import Supervisor
from lupin_bridge.fleet.app import Fleet, create_fleet_app
from lupin_bridge.judge.options import Criteria
from lupin_bridge.serving.admission import Limits
from lupin_bridge.serving.server import BridgeServer, allow_connections
from lupin_bridge.settings import Secrets, SettingError, Settings, option, variable

log = logging.getLogger("lupin_bridge")

# Of the twin's own: a fleet has none.
_NOT_HERE = ("site", "journal", "mqtt_url", "webhook_url", "http_observations")


def run(settings: Settings, secrets: Secrets, ros_args: Sequence[str]) -> None:
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
    asyncio.run(_run(settings, access, proxies, criteria))


async def _run(settings: Settings, access: Access, proxies: Proxies, criteria: Criteria) -> None:
    listener = open_listener(settings, access)
    await asyncio.to_thread(_report_error, settings.archive_url)
    settings = replace(settings, max_clients=allow_connections(settings.max_clients))
    # For the process that reads; not on its command line, which others can read.
    os.environ[variable("archive_url")] = settings.archive_url
    supervisor = Supervisor(os.environ)
    limits = Limits()
    fleet = Fleet(settings, criteria, access, limits=limits)
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
