"""The command `lupin-twin`: its options, one-line errors about them, and the bridge's log.

The log has lines for people, or a JSON object on each line for a log collector.
"""

from __future__ import annotations

import argparse
import json
import logging
import os
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Hashable, Sequence
from datetime import UTC, datetime
from itertools import pairwise
from typing import Final, NoReturn

from lupin_bridge import __version__
from lupin_bridge.cli import administration, import_csv, journal
from lupin_bridge.console import add_role
from lupin_bridge.serving.admission import RateLimit
from lupin_bridge.settings import (
    CONFIG_VARIABLE,
    SettingError,
    Settings,
    limits_of,
    option,
    settings_from,
    strange_variables,
    table,
    take_secrets,
)
from lupin_twin.adapt import cli as adapt
from lupin_twin.runtime.process import (
    exit_after,
    limit_blas_threads,
    refuse,
    return_large_blocks,
    split_ros_args,
)

# How many messages of a level one logger may write at once, and the period of each further one.
AT_ONCE: Final = 50
PERIOD_S: Final = 1.0

# uvicorn's message, whose trace is of no use: a client sent the bytes.
_NO_TEXT: Final = "Invalid UTF-8 sequence received from client."


class JsonFormatter(logging.Formatter):
    """One JSON object per record: time (UTC), level, logger, message, and the error if any."""

    def format(self, record: logging.LogRecord) -> str:
        """The record as one line."""
        fields = {
            "time": datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds"),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": record.getMessage(),
        }
        if record.exc_info:
            fields["error"] = self.formatException(record.exc_info)
        return json.dumps(fields, ensure_ascii=False)


class OnceInAWhile(logging.Filter):
    """Limits the rate of records of one logger and level.

    Any client can cause some of them as often as it likes, which would soon fill a disk.
    """

    def __init__(self) -> None:
        super().__init__()
        self._rate = RateLimit(1.0 / PERIOD_S, AT_ONCE)
        self._held_back: Counter[Hashable] = Counter()

    def filter(self, record: logging.LogRecord) -> bool:
        """Whether to write the record; adds to it how many were held back before."""
        kind = record.name, record.levelno
        if self._rate.take(kind, time.monotonic()):
            self._held_back[kind] += 1
            return False
        held_back = self._held_back.pop(kind, 0)
        if record.msg == _NO_TEXT:
            record.exc_info = record.exc_text = None
        if held_back:
            record.msg = f"{record.msg} ({held_back} more since the last time)"
        return True


def set_up_log(log_format: str, level: str = "info") -> None:
    """Send the log to standard error in this format, from this level on."""
    least = logging.getLevelNamesMapping()[level.upper()]
    handler = logging.StreamHandler(sys.stderr)
    # Records of the ROS nodes bypass our loggers' levels, but not this handler's.
    handler.setLevel(least)
    # Here, not at the root logger: records of other loggers do not pass its filters.
    handler.addFilter(OnceInAWhile())
    if log_format == "json":
        handler.setFormatter(JsonFormatter())
    else:
        handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(name)s: %(message)s"))
    logging.root.addHandler(handler)
    # No debugging of libraries: some log a line for each byte.
    logging.root.setLevel(max(least, logging.INFO))
    for ours in ("lupin_bridge", "lupin_twin"):
        logging.getLogger(ours).setLevel(least)
    # Without uvicorn's news (started, waiting, connection open).
    logging.getLogger("uvicorn").setLevel(max(least, logging.WARNING))


# --- the command ----------------------------------------------------------------------------------

log = logging.getLogger(__name__)


_WITHOUT_ROS = {
    "journal": journal.run,
    "import": import_csv.run,
    "archive": administration.run_archive,
    "forward": administration.run_archive,
    "user": administration.run_people,
    "token": administration.run_people,
    "audit": administration.run_people,
}


def main(argv: Sequence[str] | None = None) -> int:
    """Run a role; returns the process's exit code."""
    limit_blas_threads()
    return_large_blocks()
    own, ros_args = split_ros_args(sys.argv[1:] if argv is None else argv)
    for flag, rule in pairwise(ros_args):
        if flag in _RULES and ":=" not in rule:
            _fail(f"{flag} is {rule!r}, expected NAME:=VALUE")
    options, unknown = parser().parse_known_args(own)
    if unknown:
        name = unknown[0].partition("=")[0]
        is_of_ros = name in {*_RULES, "--params-file"}
        remedy = ": put it after --ros-args" if is_of_ros else ""
        _fail(f"{name} is not an option of {options.role}{remedy}")
    if options.role == "adapt":
        return adapt.run(options, ros_args)
    if options.role in _WITHOUT_ROS:
        if ros_args:
            which = ": choose its file with --journal or --namespace"
            of_a_file = which if options.role in {"journal", "import"} else ""
            _fail(f"{options.role} takes no ROS arguments{of_a_file}")
        return _WITHOUT_ROS[options.role](options, os.environ)
    feed_args = _feed_args(options)
    try:
        settings = _settings_from(options)
        # Before any slow import, and before the first thread. Ctrl-C and SIGTERM wait until the
        # server unblocks them, so that neither can end in a traceback.
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
        _prepare_process()
        set_up_log(settings.log_format, settings.log_level)
        for warning in strange_variables(os.environ):
            log.warning("%s", warning)
        secrets = take_secrets(settings, os.environ)
        from lupin_bridge.cli import roles  # noqa: PLC0415  # see above

        if options.role == "fleet":
            roles.run_fleet(settings, secrets, ros_args)
            return 0
        roles.run(
            options.role,
            settings,
            secrets,
            ros_args,
            feed_args,
            recording=getattr(options, "recording", None),
        )
    except SettingError as error:
        _fail(str(error))
    return 0


def command() -> NoReturn:
    """`main` as a process of its own."""
    exit_after(main)


ROLES = {
    "serve": "run the twin and the bridge in one process",
    "demo": "run serve, plus a simulated patrol in a second process",
    "web": "run the bridge alone, for a twin elsewhere; run as many as needed",
    "fleet": "show every greenhouse of an archive on one page; run as many as needed",
}


# Options of ROS with a rule after them; people also give them without --ros-args.
_RULES = ("-p", "--param", "-r", "--remap")

# Limits of --speed, and of --seed: of the patrol, and of a recording's player.
PATROL_SPEEDS = (0.1, 50.0)
PLAYER_SPEEDS = (0.1, 100.0)
SEEDS = (0, 2**32 - 1)


def _feed_args(options: argparse.Namespace) -> list[str]:
    """The arguments of what feeds a demo: of the patrol, or with `--from`, of the player."""
    if options.role != "demo":
        return []
    given = []
    is_patrol = options.recording is None
    if not is_patrol and options.seed is not None:
        _fail("--seed is for the patrol, which --from FILE.mcap replaces")
    speeds = PATROL_SPEEDS if is_patrol else PLAYER_SPEEDS
    for name, (low, high) in {"speed": speeds, "seed": SEEDS}.items():
        value = getattr(options, name)
        if value is not None and not low <= value <= high:
            _fail(f"--{name} is {value!r}, it must be from {low} to {high}")
        given += [f"--{name}={value!r}"] if value is not None else []
    return given


def _settings_from(options: argparse.Namespace) -> Settings:
    given = {spec.name: getattr(options, spec.name) for spec in table()}
    return settings_from(given, os.environ, options.config)


def parser() -> argparse.ArgumentParser:
    """The options of all commands."""
    made = argparse.ArgumentParser(
        prog="lupin-twin",
        description="Digital twin of a greenhouse: ROS 2 node, web bridge and browser HMI.",
        epilog="Everything after --ros-args goes to ROS: --ros-args -p idw_power:=3.0. A setting "
        "may also be in the environment (LUPIN_PORT for --port) or in the file of --config.",
    )
    made.add_argument("--version", action="version", version=f"%(prog)s {__version__}")
    roles = made.add_subparsers(dest="role", required=True, metavar="ROLE")
    common = argparse.ArgumentParser(add_help=False)
    common.add_argument(
        "--config",
        metavar="FILE",
        help=f"TOML file with any of these settings, named with underscores "
        f"(default: {CONFIG_VARIABLE}, or none)",
    )
    for group in dict.fromkeys(spec.metadata["group"] for spec in table()):
        arguments = common.add_argument_group(group)
        for spec in table():
            if spec.metadata["group"] == group:
                limits, text = limits_of(spec.name), spec.metadata["help"]
                nothing = "empty" if "empty:" in text else "none"
                arguments.add_argument(
                    option(spec.name),
                    action="append" if spec.default == () else "store",
                    # None: not given here, so the environment or the file decides.
                    default=None,
                    metavar=spec.name.rpartition("_")[2].upper(),
                    help=f"{text}{limits and f'; {limits}'} "
                    f"(default: {nothing if spec.default in ('', ()) else spec.default})",
                )
    for role, text in ROLES.items():
        own = add_role(roles, role, text, parents=[common])
        if role == "demo":
            own.add_argument(
                "--speed",
                type=float,
                metavar="SPEED",
                help="patrol seconds, or seconds of the recording, per second (default: 1)",
            )
            own.add_argument(
                "--seed",
                type=int,
                metavar="SEED",
                help="seed of the patrol: a different seed gives a different patrol (default: 0)",
            )
            own.add_argument(
                "--from",
                dest="recording",
                metavar="FILE.mcap",
                help="play this recording instead of the patrol: one file, or the folder of its "
                "files. It feeds a twin of its own, with the time of the recording and a temporary "
                "journal",
            )
    journal.add_parser(roles)
    administration.add_archive(roles)
    import_csv.add_parser(roles)
    adapt.add_options(add_role(roles, "adapt", adapt.HELP))
    administration.add_people(roles)
    return made


def _prepare_process() -> None:
    # rcl wants a place for its logs; without a home directory it would refuse to start.
    if not (os.environ.get("ROS_LOG_DIR") or os.environ.get("HOME")):
        os.environ["ROS_LOG_DIR"] = tempfile.mkdtemp(prefix="lupin-twin-log-")


def _fail(message: str) -> NoReturn:
    raise SystemExit(refuse("lupin-twin", message))


if __name__ == "__main__":
    command()
