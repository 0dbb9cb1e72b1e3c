"""What `serve`, `demo` and `web` run: a source, a bridge and a server around one event loop."""

from __future__ import annotations

import asyncio
import logging
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

from lupin_bridge.access.accounts import accounts_path
from lupin_bridge.access.middleware import Access
from lupin_bridge.access.policy import Proxies
from lupin_bridge.app import create_app, has_page
from lupin_bridge.archive import forwarding as archive
from lupin_bridge.bags.recording import RecordingError
from lupin_bridge.bridge import Bridge
from lupin_bridge.cli import demo
from lupin_bridge.cli.serving import open_listener, serve
from lupin_bridge.cli.supervisor import Supervisor
from lupin_bridge.feed.local import LocalTwin
from lupin_bridge.feed.ros_thread import RosStartError
from lupin_bridge.feed.source import ailment
from lupin_bridge.feed.web import WebTwin
from lupin_bridge.judge.options import Criteria
from lupin_bridge.notify.channels import Channels
from lupin_bridge.notify.destinations import Targets
from lupin_bridge.notify.push import Push
from lupin_bridge.routes.pages import HOW_TO_BUILD
from lupin_bridge.serving.admission import Limits
from lupin_bridge.serving.server import BridgeServer, allow_connections
from lupin_bridge.settings import Secrets, SettingError, Settings
from lupin_bridge.stream.status import STALE_AFTER_S
from lupin_twin.core.parameters import ParameterError, World

log = logging.getLogger(__name__)

FEEDER_STOP_S = 0.9


def run(
    role: str,
    settings: Settings,
    secrets: Secrets,
    ros_args: Sequence[str],
    patrol_args: Sequence[str] = (),
    *,
    recording: Sequence[str] = (),
    play_args: Sequence[str] = (),
) -> None:
    """Run a role until a signal ends it.

    `patrol_args` are the options of the patrol, in the role `demo`; it gets `ros_args` too, so that
    a namespace or a remapping holds for both. With `recording`, its files, and
    `play_args`, the player's options, that takes the patrol's place.

    Raises:
        SettingError: a setting, a parameter or an argument of ROS with which it cannot run.

    """
    with ExitStack() as ending:
        try:
            feed = None
            if recording:
                folder = ending.enter_context(tempfile.TemporaryDirectory(prefix="lupin-twin-"))
                feed = demo.recorded(recording, play_args, ros_args, Path(folder))
            elif role == "demo":
                feed = demo.patrolled(os.environ, patrol_args, ros_args)
            asyncio.run(
                _run(
                    role,
                    settings,
                    secrets,
                    ros_args=ros_args,
                    feed=feed,
                    patrol_args=patrol_args,
                )
            )
        except (ParameterError, RosStartError, RecordingError) as error:
            raise SettingError(str(error)) from error


async def _run(
    role: str,
    settings: Settings,
    secrets: Secrets,
    *,
    ros_args: Sequence[str],
    feed: demo.Feed | None,
    patrol_args: Sequence[str],
) -> None:
    access = Access.of(settings, secrets.token)
    proxies = Proxies.of(settings)
    criteria = Criteria.of(settings)
    targets = Targets.of(settings, secrets)
    archive.check(settings, role)
    if settings.journal and role != "web":
        raise SettingError(
            f"{settings.called('journal')} is for web; a twin's own file is its parameter journal"
        )
    if "://" in settings.journal:
        raise SettingError(
            f"{settings.called('journal')} is {settings.journal!r}, expected a file; an archive is "
            "shown by lupin-twin fleet"
        )
    if settings.journal and not Path(settings.journal).exists():
        log.warning(
            "%s: there is no file %s; until there is, the twin's log is copied over ROS",
            *(settings.called("journal"), settings.journal),
        )
    listener = open_listener(settings, access)
    if not has_page():
        log.warning("the page was not built, / says so: %s", HOW_TO_BUILD)
    settings = replace(settings, max_clients=allow_connections(settings.max_clients))
    # Before a process is started that would inherit its variables.
    supervisor = Supervisor(os.environ)
    if feed is not None and feed.journal is not None:
        feed = await asyncio.to_thread(demo.with_past, feed, feed.journal, patrol_args)
    limits = Limits()
    source = _source_of(role, settings, ros_args, feed, limits)
    push = None
    if targets.push is not None and access.people is not None:
        push = Push(targets.push, access.people, settings.site)
    outward = Channels(targets, accounts_path(settings).parent, push)
    bridge = Bridge(source, settings, criteria=criteria, outward=outward, limits=limits)
    app = create_app(bridge, access=access, proxies=proxies)

    def announce_shutdown() -> None:
        supervisor.stopping()
        bridge.announce_shutdown()

    server = BridgeServer(app, settings, announce_shutdown, limits)
    await bridge.start()
    feeder = None if feed is None else Feeder(feed, lambda: server.should_exit)
    forwarding = archive.Forwarding(settings, lambda: source.journal().path)
    try:
        await serve(server, listener, settings, supervisor, lambda: ailment(source.thread))
    finally:
        if feeder is not None:
            feeder.terminate()
        fed = [] if feeder is None else [feeder.wait()]
        await asyncio.gather(bridge.stop(), forwarding.stop(), *fed)


def _source_of(
    role: str,
    settings: Settings,
    ros_args: Sequence[str],
    feed: demo.Feed | None,
    limits: Limits,
) -> LocalTwin | WebTwin:
    timeout_s = limits.answer_timeout_s
    if role == "web":
        return WebTwin(
            ros_args=ros_args,
            timeout_s=timeout_s,
            stale_after_s=STALE_AFTER_S,
            rejoin_after_s=limits.rejoin_after_s,
            journal=Path(settings.journal).absolute() if settings.journal else None,
        )
    # The feed's arguments are for the twin alone: its feeder has no journal.
    own_args = [] if feed is None else feed.twin_args
    world = World() if feed is None else feed.world
    return LocalTwin(ros_args=[*own_args, *ros_args], timeout_s=timeout_s, world=world)


class Feeder:
    """The patrol, or a recording's player: a process of its own, so that its data crosses DDS."""

    def __init__(self, feed: demo.Feed, is_stopping: Callable[[], bool]) -> None:
        self._what = feed.what
        self._is_stopping = is_stopping
        # The environment goes along whole: the ROS wheels' own variables only work together.
        self._process = subprocess.Popen(  # noqa: S603  # the operator's own words, no shell
            [sys.executable, "-P", "-m", *feed.command]
        )
        self._watch = asyncio.create_task(self._report_end())

    def terminate(self) -> None:
        """Ask it to end."""
        self._process.terminate()

    async def wait(self) -> None:
        """Wait for its end; kill it if that does not come."""
        try:
            await asyncio.wait_for(asyncio.shield(self._watch), FEEDER_STOP_S)
        except TimeoutError:
            self._process.kill()
            await self._watch

    async def _report_end(self) -> None:
        code = await asyncio.to_thread(self._process.wait)
        # At Ctrl-C a terminal signals both: on the loop, ours is known by now.
        if not self._is_stopping():
            log.error(
                "the %s has ended with code %d; the twin goes on without it", self._what, code
            )
