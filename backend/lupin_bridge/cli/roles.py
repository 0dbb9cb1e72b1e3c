"""Runs `serve`, `demo`, `web` and `fleet`: a source, a bridge and a server on one event loop.

A demo also needs what feeds its twin, a journal of its own, and a past.
"""

from __future__ import annotations

import asyncio
import errno
import json
import logging
import os
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from lupin_bridge.access.middleware import Access
from lupin_bridge.access.policy import Proxies, exposure
from lupin_bridge.app import create_app, has_page
from lupin_bridge.archive import forwarding as archive
from lupin_bridge.archive.database import check_url
from lupin_bridge.bags.recording import INPUTS, Recording, RecordingError
from lupin_bridge.bridge import Bridge
from lupin_bridge.feed.source import TwinSource, ailment
from lupin_bridge.judge.judging import Criteria
from lupin_bridge.notify.channels import Channels
from lupin_bridge.notify.destinations import Targets
from lupin_bridge.notify.push import Push
from lupin_bridge.routes.pages import HOW_TO_BUILD
from lupin_bridge.serving.admission import Limits
from lupin_bridge.serving.server import (
    BridgeServer,
    Supervisor,
    allow_connections,
    check_pair,
    listen,
    serve,
)
from lupin_bridge.settings import Secrets, SettingError, Settings, option, unix_path, variable
from lupin_bridge.stream.frames import STALE_AFTER_S
from lupin_twin.core.diagnostics import Origin
from lupin_twin.core.parameters import ParameterError
from lupin_twin.journal.appending import is_empty, simulated
from lupin_twin.journal.paths import demo_journal_path
from lupin_twin.journal.schema import FILE_ERRORS, Foreign, open_reader

log = logging.getLogger(__name__)

# How long the patrol's day takes at its usual speed, s: the sun goes 60 times as fast.
DAY_S: Final = 86_400.0 / 60.0
# Time to fill in a past, which usually takes two seconds, and many more on a busy machine.
_TIMEOUT_S: Final = 30.0


@dataclass(frozen=True, slots=True)
class Feed:
    """What feeds a demo's twin: a module and its arguments, run in a process of its own.

    `twin_args` are arguments of ROS for the twin alone; `origin` is that of its observations.
    `journal` is the file to fill with a past of this patrol; None: there is none to fill.
    """

    what: str
    command: list[str]
    twin_args: list[str]
    origin: Origin
    journal: Path | None = None
    patrol_args: Sequence[str] = ()


def patrolled(
    environ: Mapping[str, str], patrol_args: Sequence[str], ros_args: Sequence[str]
) -> Feed:
    """Feed the twin by the simulated patrol.

    Each seed has a journal of its own, apart from a real twin's. The operator's arguments of ROS
    come after ours, and take precedence. A past is filled only into that journal: a parameter file
    may name another one, and is not read here.
    """
    try:
        path = demo_journal_path(environ, int(_option("seed", patrol_args, 0.0)))
    except RuntimeError:
        path = None
    is_another = {"--params-file", "use_sim_time:=true"} & {*ros_args} or any(
        word.startswith("journal:=") for word in ros_args
    )
    return Feed(
        "patrol",
        ["lupin_patrol", "--end-with-parent", *patrol_args, *ros_args],
        _parameters(
            # The robot maps the floor: fields end at its walls.
            clip_to_explored=True,
            day_length_s=float(DAY_S / _option("speed", patrol_args, 1.0)),
            **({} if path is None else {"journal": str(path)}),
        ),
        "simulated",
        None if is_another else path,
        patrol_args,
    )


def recorded(path: str, play_args: Sequence[str], ros_args: Sequence[str], folder: Path) -> Feed:
    """Feed the twin by a recording, which `lupin_bridge.bags.player` plays with these options.

    Its journal is in `folder`, for this recording alone. The twin subscribes to the topics as they
    were recorded. At the end, time stands still.

    Raises:
        lupin_bridge.bags.recording.RecordingError: it cannot be played.

    """
    with Recording(Path(path)) as recording:
        inputs = recording.inputs
    journal = folder / "journal.sqlite"
    topics = {INPUTS[kind].parameter: name for name, kind in inputs.items()}
    return Feed(
        "player",
        ["lupin_bridge.bags.player", path, *play_args, *ros_args],
        _parameters(**topics, journal=str(journal), use_sim_time=True),
        "recorded",
    )


def _parameters(**values: object) -> list[str]:
    """Arguments of ROS that set parameters."""
    words = (("-p", f"{name}:={json.dumps(value)}") for name, value in values.items())
    return ["--ros-args", *(word for pair in words for word in pair), "--"]


def with_past(feed: Feed) -> Feed:
    """Fill the feed's journal if it is empty; else have the patrol go on at the right time of day.

    Otherwise, a demo that is started again would begin a second morning, and the daily course in
    its journal would fit no day. Errors are logged, and the demo goes on without a past.
    """
    path, past = feed.journal, None
    if path is None:
        return feed
    try:
        is_new = not path.exists() or path.stat().st_size == 0
        if not is_new:
            with closing(open_reader(path)) as connection:
                is_new, past = is_empty(connection), simulated(connection)
        if is_new:
            own = ("--fill-past", str(path), *feed.patrol_args)
            subprocess.run(  # noqa: S603  # the operator's own words, no shell
                [sys.executable, "-P", "-m", "lupin_patrol", *own],
                stdin=subprocess.DEVNULL,
                capture_output=True,
                text=True,
                timeout=_TIMEOUT_S,
                check=True,
            )
    except subprocess.CalledProcessError as error:
        why = (error.stderr.splitlines() or [str(error)])[-1]
        log.warning("the demo starts without history: %s", why.removeprefix("patrol_node: error: "))
    except (Foreign, subprocess.TimeoutExpired, OSError, *FILE_ERRORS) as error:
        log.warning("the demo starts without history: %s", error)
    if past is None:
        return feed
    _, past_ns = past
    since_s = since_morning_s(past_ns, feed.patrol_args, time.time_ns())
    module, *words = feed.command
    return replace(feed, command=[module, f"--since-morning={since_s!r}", *words])


def since_morning_s(past_ns: int, patrol_args: Sequence[str], now_ns: int) -> float:
    """Patrol seconds from the last nine o'clock to now.

    The past that was filled in ended at nine o'clock, at `past_ns`. Since then, days have gone on,
    as long as they are now.
    """
    return (now_ns - past_ns) / 1e9 * _option("speed", patrol_args, 1.0) % DAY_S


def _option(name: str, patrol_args: Sequence[str], default: float) -> float:
    given = [word for word in patrol_args if word.startswith(f"--{name}=")]
    return float(given[-1].partition("=")[2]) if given else default


# --- roles ----------------------------------------------------------------------------------------

FEEDER_STOP_S = 0.9


def run(
    role: str,
    settings: Settings,
    secrets: Secrets,
    ros_args: Sequence[str],
    feed_args: Sequence[str] = (),
    *,
    recording: str | None = None,
) -> None:
    """Run a role until a signal ends it.

    `feed_args` are the options of the patrol, in the role `demo`; it gets `ros_args` too, so that
    a namespace or a remapping holds for both. With `recording` (its path) they are those of its
    player, which takes the patrol's place.

    Raises:
        SettingError: a setting, a parameter or an argument of ROS is invalid.

    """
    with ExitStack() as ending:
        try:
            feed = None
            if recording:
                folder = ending.enter_context(tempfile.TemporaryDirectory(prefix="lupin-twin-"))
                feed = recorded(recording, feed_args, ros_args, Path(folder))
            elif role == "demo":
                feed = patrolled(os.environ, feed_args, ros_args)
            asyncio.run(_run(role, settings, secrets, ros_args, feed))
        except (ParameterError, RecordingError) as error:
            raise SettingError(str(error)) from error


_REMEDIES = {
    errno.EADDRINUSE: ", stop the program that listens there, or choose another --port",
    errno.EACCES: ", choose a --port from 1024 on",
    errno.EADDRNOTAVAIL: ", --host must be an address of this machine",
}


def _open_listener(settings: Settings, access: Access) -> socket.socket:
    """Listen, and warn of who may read.

    Raises:
        SettingError: it cannot listen there, or the certificate is invalid.

    """
    if settings.tls_cert:
        check_pair(settings.tls_cert, settings.tls_key)
    path = unix_path(settings.host)
    try:
        listener = listen(settings.host, settings.port)
    except OSError as error:
        where = "" if path else f" port {settings.port}"
        remedy = "" if path else _REMEDIES.get(error.errno or 0, "")
        raise SettingError(
            f"cannot listen on {settings.host}{where}: {error.strerror or error}{remedy}"
        ) from error
    if path:  # none but its owner and group reach it
        return listener
    for warning in exposure(
        listener.getsockname()[0], has_token=access.is_closed, has_tls=bool(settings.tls_cert)
    ):
        log.warning("%s", warning)
    return listener


async def _run(
    role: str,
    settings: Settings,
    secrets: Secrets,
    ros_args: Sequence[str],
    feed: Feed | None,
) -> None:
    access = Access.of(settings, secrets.token)
    proxies = Proxies.of(settings)
    criteria = Criteria.of(settings)
    targets = Targets.of(settings, secrets)
    archive.check(settings, role)
    if settings.journal and role != "web":
        raise settings.wrong("journal", "is for web; the parameter journal names a twin's own file")
    if "://" in settings.journal:
        raise settings.wrong(
            "journal",
            f"is {settings.journal!r}, expected a file; an archive is shown by lupin-twin fleet",
        )
    if settings.journal and not Path(settings.journal).exists():
        log.warning(
            "%s: %s does not exist; until it does, the twin's log is copied over ROS",
            *(settings.called("journal"), settings.journal),
        )
    listener = _open_listener(settings, access)
    if not has_page():
        log.warning("the page is not built, so / shows only a notice: %s", HOW_TO_BUILD)
    settings = replace(settings, max_clients=allow_connections(settings.max_clients))
    # Before a process is started that would inherit its variables.
    supervisor = Supervisor(os.environ)
    if feed is not None:
        feed = await asyncio.to_thread(with_past, feed)
    limits = Limits()
    source = _source_of(role, settings, ros_args, feed, limits)
    push = None
    if targets.push is not None and access.people is not None:
        push = Push(targets.push, access.people, settings.site)
    outward = Channels(targets, push)
    bridge = Bridge(source, settings, criteria=criteria, outward=outward, limits=limits)
    app = create_app(bridge, access=access, proxies=proxies)
    announcements = (supervisor.stopping, bridge.announce_shutdown)
    server = BridgeServer(app, settings, announcements, limits)
    await bridge.start()
    feeder = None if feed is None else Feeder(feed, lambda: server.should_exit)
    forwarding = archive.Forwarding(settings, lambda: source.journal().path, source.write_note)
    try:
        await serve(server, listener, settings, supervisor, lambda: ailment(source.thread))
    finally:
        fed = [] if feeder is None else [feeder.stop()]
        await asyncio.gather(*fed, bridge.stop(), forwarding.stop())


def _source_of(
    role: str,
    settings: Settings,
    ros_args: Sequence[str],
    feed: Feed | None,
    limits: Limits,
) -> TwinSource:
    timeout_s = limits.answer_timeout_s
    if role == "web":
        from lupin_bridge.feed.web import WebTwin  # noqa: PLC0415  # a fleet has no ROS

        return WebTwin(
            ros_args=ros_args,
            timeout_s=timeout_s,
            stale_after_s=STALE_AFTER_S,
            rejoin_after_s=limits.rejoin_after_s,
            journal=Path(settings.journal).absolute() if settings.journal else None,
        )
    from lupin_bridge.feed.local import LocalTwin  # noqa: PLC0415  # as above

    # The feed's arguments are for the twin alone: its feeder has no journal.
    own_args = [] if feed is None else feed.twin_args
    origin: Origin = "robot" if feed is None else feed.origin
    return LocalTwin(ros_args=[*own_args, *ros_args], timeout_s=timeout_s, origin=origin)


class Feeder:
    """The patrol, or a recording's player: a process of its own, so that its data crosses DDS."""

    def __init__(self, feed: Feed, is_stopping: Callable[[], bool]) -> None:
        self._what = feed.what
        self._is_stopping = is_stopping
        # The environment goes along whole: the ROS wheels' own variables only work together.
        self._process = subprocess.Popen(  # noqa: S603  # the operator's own words, no shell
            [sys.executable, "-P", "-m", *feed.command]
        )
        self._watch = asyncio.create_task(self._report_end())

    async def stop(self) -> None:
        """Ask the process to end, and wait; kill it if it does not end in time."""
        self._process.terminate()
        try:
            await asyncio.wait_for(asyncio.shield(self._watch), FEEDER_STOP_S)
        except TimeoutError:
            self._process.kill()
            await self._watch

    async def _report_end(self) -> None:
        code = await asyncio.to_thread(self._process.wait)
        # At Ctrl-C a terminal signals both processes: by now, the loop knows of our signal.
        if not self._is_stopping():
            log.error(
                "the %s ended with exit code %d; the twin continues without it", self._what, code
            )


# --- the page over all greenhouses, until a signal ends it ----------------------------------------

# Settings of a twin, which a fleet does not have.
_NOT_HERE = ("site", "journal", "mqtt_url", "webhook_url", "http_observations")


def run_fleet(settings: Settings, secrets: Secrets, ros_args: Sequence[str]) -> None:
    """Serve until a signal ends it.

    Raises:
        SettingError: a setting is missing or invalid.

    """
    # Errors are reported once, here.
    logging.getLogger("psycopg").setLevel(logging.CRITICAL)
    if ros_args:
        raise SettingError("fleet takes no ROS arguments")
    if not settings.archive_url:
        raise SettingError(f"{option('archive_url')} is missing, or {variable('archive_url')}")
    for name in _NOT_HERE:
        if getattr(settings, name) not in ("", "off"):
            raise settings.wrong(name, "is for a twin, not for lupin-twin fleet")
    check_url(settings.archive_url)
    access = Access.of(settings, secrets.token, is_fleet=True)
    proxies = Proxies.of(settings)
    criteria = Criteria.of(settings)
    asyncio.run(_run_fleet(settings, access, proxies, criteria))


async def _run_fleet(
    settings: Settings, access: Access, proxies: Proxies, criteria: Criteria
) -> None:
    from lupin_bridge.fleet.app import Fleet, create_fleet_app  # noqa: PLC0415  # not for a twin

    listener = _open_listener(settings, access)
    settings = replace(settings, max_clients=allow_connections(settings.max_clients))
    # For the processes that read; not on their command line, which others can read.
    os.environ[variable("archive_url")] = settings.archive_url
    supervisor = Supervisor(os.environ)
    limits = Limits()
    fleet = Fleet(settings, criteria, access, limits)
    app = create_fleet_app(fleet, access, proxies)
    announcements = (supervisor.stopping, fleet.announce_shutdown)
    server = BridgeServer(app, settings, announcements, limits)
    await fleet.start()
    try:
        await serve(server, listener, settings, supervisor, lambda: None)
    finally:
        await fleet.stop()
