"""The command `lupin-twin` and its roles: `serve`, `demo` and `web`."""

from __future__ import annotations

import argparse
import asyncio
import logging
import os
import socket
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import fields
from typing import Any, NoReturn

from lupin_bridge import logs
from lupin_bridge.access import exposure
from lupin_bridge.access_middleware import Access
from lupin_bridge.app import create_app
from lupin_bridge.bridge import Bridge
from lupin_bridge.local_twin import LocalTwin
from lupin_bridge.ros_thread import RosStartError
from lupin_bridge.server import BridgeServer, address_of, allow_connections, listen
from lupin_bridge.settings import SettingError, Settings, option
from lupin_bridge.tls import check_pair
from lupin_bridge.web_twin import WebTwin
from lupin_twin.parameters import ParameterError

log = logging.getLogger("lupin_bridge")

USAGE_ERROR = 2
PATROL_STOP_S = 1.5


def main(argv: Sequence[str] | None = None) -> int:
    """Run a role; returns the process's exit code."""
    own, ros_args = split_ros_args(sys.argv[1:] if argv is None else argv)
    options = _parser().parse_args(own)
    try:
        settings = _settings_from(options)
        # Taken out of the environment: the processes that we start have no use for it.
        access = Access.of(settings, os.environ.pop("LUPIN_TOKEN", None))
        if settings.tls_cert:
            check_pair(settings.tls_cert, settings.tls_key)
    except SettingError as error:
        _fail(str(error))
    _prepare_process()
    logs.set_up(settings.log_format)
    try:
        return asyncio.run(_run(options.role, settings, access, ros_args))
    except (ParameterError, RosStartError) as error:
        _fail(str(error))
    except KeyboardInterrupt:
        return 0


def split_ros_args(argv: Sequence[str]) -> tuple[list[str], list[str]]:
    """Our own arguments, and ROS's: from `--ros-args` to `--` or the end, as ROS defines it."""
    own: list[str] = []
    ros: list[str] = []
    in_ros = False
    for argument in argv:
        if argument == "--ros-args":
            in_ros = True
        elif in_ros and argument == "--":
            ros.append(argument)
            in_ros = False
            continue
        (ros if in_ros else own).append(argument)
    return own, ros


ROLES = {
    "serve": "the twin and the bridge in one process",
    "demo": "serve, plus a simulated patrol in a second process",
    "web": "the bridge alone, for a twin elsewhere; as many of these as needed",
}


async def _run(role: str, settings: Settings, access: Access, ros_args: Sequence[str]) -> int:
    try:
        listener = listen(settings.host, settings.port)
    except OSError as error:
        _fail(f"cannot listen on {settings.host} port {settings.port}: {error.strerror}")
    _warn_of_exposure(listener, access)
    allow_connections(settings.max_clients)
    make_source = WebTwin if role == "web" else LocalTwin
    source = make_source(ros_args=ros_args, timeout_s=settings.field_timeout_s)
    bridge = Bridge(source, settings)
    server = BridgeServer(create_app(bridge, access=access), bridge)
    await bridge.start()
    patrol = _start_patrol() if role == "demo" else None
    url = address_of(listener, "https" if access.secure else "http")
    print(f"lupin-twin: {url}", flush=True)  # noqa: T201  # for people and scripts
    try:
        await server.serve(sockets=[listener])
    finally:
        if patrol is not None:
            patrol.terminate()
        await bridge.stop()
        if patrol is not None:
            await asyncio.to_thread(_wait_or_kill, patrol)
    return 0


def _settings_from(options: argparse.Namespace) -> Settings:
    values: dict[str, Any] = {}
    for spec in fields(Settings):
        value = getattr(options, spec.name)
        # What may be given more than once comes as a list.
        values[spec.name] = tuple(value) if isinstance(value, list) else value
    return Settings(**values)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="lupin-twin",
        description="Digital twin of a greenhouse: ROS 2 node, web bridge and browser HMI.",
        epilog="Everything from --ros-args on goes to ROS: --ros-args -p idw_power:=3.0",
    )
    roles = parser.add_subparsers(dest="role", required=True, metavar="ROLE")
    common = argparse.ArgumentParser(add_help=False)
    for spec in fields(Settings):
        default: Any = spec.default
        repeatable = isinstance(default, tuple)
        common.add_argument(
            option(spec.name),
            type=str if repeatable else type(default),
            action="append" if repeatable else "store",
            default=list(default) if repeatable else default,
            metavar=spec.name.rpartition("_")[2].upper(),
            help=f"{spec.metadata['help']} (default: {default or 'none'})",
        )
    for role, text in ROLES.items():
        # No abbreviations: what one means would change with the next setting.
        roles.add_parser(role, parents=[common], help=text, description=text, allow_abbrev=False)
    return parser


def _prepare_process() -> None:
    # rcl wants a place for its logs; without a home directory it would refuse to start.
    if not (os.environ.get("ROS_LOG_DIR") or os.environ.get("HOME")):
        os.environ["ROS_LOG_DIR"] = tempfile.mkdtemp(prefix="lupin-twin-log-")


def _warn_of_exposure(listener: socket.socket, access: Access) -> None:
    for warning in exposure(
        listener.getsockname()[0],
        has_token=access.credentials is not None,
        has_tls=access.secure,
    ):
        log.warning("%s", warning)


def _start_patrol() -> subprocess.Popen[bytes]:
    # The environment goes along whole: the ROS wheels' own variables only work together.
    return subprocess.Popen([sys.executable, "-m", "lupin_patrol", "--end-with-parent"])


def _wait_or_kill(patrol: subprocess.Popen[bytes]) -> None:
    try:
        patrol.wait(PATROL_STOP_S)
    except subprocess.TimeoutExpired:
        patrol.kill()
        patrol.wait()


def _fail(message: str) -> NoReturn:
    print(f"lupin-twin: {message}", file=sys.stderr)  # noqa: T201  # there is no logger yet
    raise SystemExit(USAGE_ERROR)


if __name__ == "__main__":
    sys.exit(main())
