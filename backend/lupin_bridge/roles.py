"""What `serve`, `demo` and `web` run: a source, a bridge and a server around one event loop."""

from __future__ import annotations

import asyncio
import gc
import json
import logging
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace

from lupin_bridge.access.entrance import Entrance
from lupin_bridge.access.middleware import Access
from lupin_bridge.access.policy import exposure
from lupin_bridge.access.tls import Certificates, check_pair
from lupin_bridge.app import create_app, has_page
from lupin_bridge.bridge import Bridge
from lupin_bridge.routes import no_page
from lupin_bridge.serving.server import BridgeServer, address_of, allow_connections, listen
from lupin_bridge.settings import SettingError, Settings
from lupin_bridge.supervisor import Supervisor
from lupin_bridge.twin.local_twin import LocalTwin
from lupin_bridge.twin.ros_thread import RosStartError
from lupin_bridge.twin.source import ailment
from lupin_bridge.twin.web_twin import WebTwin
from lupin_twin.memory import state_folder
from lupin_twin.parameters import ParameterError

log = logging.getLogger("lupin_bridge")

PATROL_STOP_S = 0.9


def run(
    role: str,
    settings: Settings,
    token: str | None,
    ros_args: Sequence[str],
    patrol_args: Sequence[str] = (),
) -> None:
    """Run a role until a signal ends it; `token` is what clients have to know, if anything.

    `patrol_args` are the options of the patrol, in the role `demo`; it gets `ros_args` too, so that
    a namespace or a remapping holds for both.

    Raises:
        SettingError: a setting, a parameter or an argument of ROS with which it cannot run.

    """
    access = Access.of(settings, token)
    entrance = Entrance.of(settings)
    if settings.tls_cert:
        check_pair(settings.tls_cert, settings.tls_key)
    try:
        asyncio.run(
            _run(role, settings, access, entrance, ros_args=ros_args, patrol_args=patrol_args)
        )
    except (ParameterError, RosStartError) as error:
        raise SettingError(str(error)) from error


async def _run(
    role: str,
    settings: Settings,
    access: Access,
    entrance: Entrance,
    *,
    ros_args: Sequence[str],
    patrol_args: Sequence[str],
) -> None:
    try:
        listener = listen(settings.host, settings.port)
    except OSError as error:
        raise SettingError(
            f"cannot listen on {settings.host} port {settings.port}: {error.strerror}"
        ) from error
    _warn_of_exposure(listener, access)
    if not has_page():
        log.warning("the page was not built, / says so: %s", no_page.HOW)
    settings = replace(settings, max_clients=allow_connections(settings.max_clients))
    # Before a process is started that would inherit its variables.
    supervisor = Supervisor(os.environ)
    # The twin's alone: the patrol keeps nothing.
    own_args = demo_journal(os.environ, patrol_args) if role == "demo" else []
    make_source = WebTwin if role == "web" else LocalTwin
    source = make_source(ros_args=[*own_args, *ros_args], timeout_s=settings.field_timeout_s)
    bridge = Bridge(source, settings)
    app = create_app(bridge, access=access, entrance=entrance)

    def say_goodbye() -> None:
        supervisor.stopping()
        bridge.say_goodbye()

    server = BridgeServer(app, settings, say_goodbye)
    await bridge.start()
    # The 100,000 objects of all modules are here to stay. Each full collection would walk through
    # them, 30 to 50 ms during which nobody is served.
    gc.collect()
    gc.freeze()
    patrol = Patrol([*patrol_args, *ros_args]) if role == "demo" else None
    url = address_of(listener, "https" if access.secure else "http")
    print(f"lupin-twin: {url}", flush=True)  # noqa: T201  # for people and scripts
    supervisor.ready(f"serving {url}")
    living = asyncio.create_task(supervisor.keep_alive(lambda: ailment(source)), name="watchdog")
    renewal = _follow_certificates(settings, server)
    try:
        await server.serve(sockets=[listener])
    finally:
        living.cancel()
        if renewal is not None:
            renewal.cancel()
        if patrol is not None:
            patrol.terminate()
        await asyncio.gather(bridge.stop(), *([] if patrol is None else [patrol.wait()]))


def demo_journal(environ: Mapping[str, str], patrol_args: Sequence[str]) -> list[str]:
    """ROS arguments that keep a demo's journal apart from a real twin's, and seeds from each other.

    Whatever is given after them counts instead.
    """
    seeds = [word for word in patrol_args if word.startswith("--seed=")]
    seed = seeds[-1].partition("=")[2] if seeds else "0"
    try:
        path = state_folder(environ) / f"demo-seed-{seed}.sqlite"
    except RuntimeError:
        return []
    return ["--ros-args", "-p", f"journal:={json.dumps(str(path))}", "--"]


def _follow_certificates(settings: Settings, server: BridgeServer) -> asyncio.Task[None] | None:
    """Renew the certificate when its files change, and at once at SIGHUP."""
    server.config.load()
    if server.config.ssl is None:
        return None
    certificates = Certificates(settings.tls_cert, settings.tls_key, server.config.ssl)
    asyncio.get_running_loop().add_signal_handler(signal.SIGHUP, certificates.look)
    return asyncio.create_task(certificates.watch(), name="certificates")


def _warn_of_exposure(listener: socket.socket, access: Access) -> None:
    for warning in exposure(
        listener.getsockname()[0],
        has_token=access.credentials is not None,
        has_tls=access.secure,
    ):
        log.warning("%s", warning)


class Patrol:
    """The simulated robot, in a process of its own so that its data crosses DDS."""

    def __init__(self, options: Sequence[str]) -> None:
        # The environment goes along whole: the ROS wheels' own variables only work together.
        self._process = subprocess.Popen(  # noqa: S603  # the operator's own words, no shell
            [sys.executable, "-m", "lupin_patrol", "--end-with-parent", *options]
        )
        self._is_stopping = False
        self._watch = asyncio.create_task(asyncio.to_thread(self._tell_the_end))

    def terminate(self) -> None:
        """Ask it to end."""
        self._is_stopping = True
        self._process.terminate()

    async def wait(self) -> None:
        """Wait for its end; kill it if that does not come."""
        try:
            await asyncio.wait_for(asyncio.shield(self._watch), PATROL_STOP_S)
        except TimeoutError:
            self._process.kill()
            await self._watch

    def _tell_the_end(self) -> None:
        code = self._process.wait()
        if not self._is_stopping:
            log.error("the patrol has ended with code %d; the twin goes on without it", code)
