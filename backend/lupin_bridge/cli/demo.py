"""What the demo has and no robot needs: who feeds its twin, a journal of its own, and a past."""

from __future__ import annotations

import json
import logging
import math
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from lupin_bridge.bags.recording import INPUTS, Recording
from lupin_twin.core.parameters import World
from lupin_twin.journal.appending import is_empty, simulated
from lupin_twin.journal.beside import demo_journal_path
from lupin_twin.journal.schema import FILE_ERRORS, Foreign, open_reader

log = logging.getLogger(__name__)

# How long the patrol's day takes at its usual speed, s: the sun goes 60 times as fast.
DAY_S: Final = 86_400.0 / 60.0
# Mostly it takes two, and on a busy machine many more.
_TIMEOUT_S: Final = 30.0


@dataclass(frozen=True, slots=True)
class Feed:
    """Who feeds a demo's twin: a module to run with its arguments, in a process of its own.

    `twin_args` are arguments of ROS for the twin alone, and `world` is what it then observes.
    `journal` is the file that a past is to be filled into, None where none is.
    """

    what: str
    command: list[str]
    twin_args: list[str]
    world: World
    journal: Path | None = None


def patrolled(
    environ: Mapping[str, str], patrol_args: Sequence[str], ros_args: Sequence[str]
) -> Feed:
    """Feed it by the simulated patrol."""
    return Feed(
        "patrol",
        ["lupin_patrol", "--end-with-parent", *patrol_args, *ros_args],
        own_args(environ, patrol_args),
        World("simulated", DAY_S / _speed(patrol_args)),
        journal_of(environ, patrol_args, ros_args),
    )


def recorded(
    files: Sequence[str], play_args: Sequence[str], ros_args: Sequence[str], folder: Path
) -> Feed:
    """Feed it by a recording, which `lupin_bridge.bags.player` plays with these options.

    Its journal is in `folder`, and of this recording alone. The twin subscribes to the topics as
    they were recorded, and at the end the time stands.

    Raises:
        lupin_bridge.bags.recording.RecordingError: it cannot be played.

    """
    with Recording([Path(file) for file in files]) as recording:
        inputs = recording.inputs
    journal = folder / "journal.sqlite"
    values = {INPUTS[kind]: json.dumps(name) for name, kind in inputs.items()}
    values |= {"journal": json.dumps(str(journal)), "use_sim_time": "true"}
    return Feed(
        "player",
        ["lupin_bridge.bags.player", *files, *play_args, *ros_args],
        [
            "--ros-args",
            *(word for name, value in values.items() for word in ("-p", f"{name}:={value}")),
            "--",
        ],
        World("recorded"),
    )


def own_args(environ: Mapping[str, str], patrol_args: Sequence[str]) -> list[str]:
    """ROS arguments of the demo's own; whatever is given after them counts instead.

    Its journal is apart from a real twin's, and seeds from each other.
    """
    try:
        path = demo_journal_path(environ, _seed(patrol_args))
    except RuntimeError:
        return []
    return ["--ros-args", "-p", f"journal:={json.dumps(str(path))}", "--"]


def journal_of(
    environ: Mapping[str, str], patrol_args: Sequence[str], ros_args: Sequence[str]
) -> Path | None:
    """The demo's own journal, None where another was given, or none.

    A file of parameters may name another one: what is in it is not looked at here.
    """
    if "--params-file" in ros_args or any(word.startswith("journal:=") for word in ros_args):
        return None
    if "use_sim_time:=true" in ros_args:
        return None
    try:
        return demo_journal_path(environ, _seed(patrol_args))
    except RuntimeError:
        return None


def with_past(feed: Feed, path: Path, patrol_args: Sequence[str]) -> Feed:
    """Fill a journal that is empty; of another one, have the patrol go on with the time of day.

    A demo that is started again would begin a second morning otherwise, and what comes daily in
    its journal would fit no day at all.
    """
    if fill_past(path, patrol_args):
        return feed
    since_s = since_morning_s(path, patrol_args, time.time_ns())
    if since_s is None:
        return feed
    module, *words = feed.command
    return replace(feed, command=[module, f"--since-morning={since_s!r}", *words])


def since_morning_s(path: Path, patrol_args: Sequence[str], now_ns: int) -> float | None:
    """Patrol seconds from the last nine o'clock of the past in a journal to now; None: it has none.

    The filled in past ends at nine, and days have gone on since, as long as they are now.
    """
    try:
        with closing(open_reader(path)) as connection:
            past = simulated(connection)
    except (Foreign, OSError, *FILE_ERRORS):
        return None  # the twin reports it when it opens it
    if past is None:
        return None
    return (now_ns - past.end_ns) / 1e9 * _speed(patrol_args) % DAY_S


def fill_past(path: Path, patrol_args: Sequence[str]) -> bool:
    """Fill a journal that is not there, or empty, with what the patrol would have observed.

    Returns whether it had none. Whatever hinders it is logged, and the demo goes on without.
    """
    try:
        if path.exists() and not _is_empty(path):
            return False
        subprocess.run(  # noqa: S603  # the operator's own words, no shell
            [sys.executable, "-P", "-m", "lupin_patrol.past", str(path), *patrol_args],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=_TIMEOUT_S,
            check=True,
        )
    except subprocess.CalledProcessError as error:
        why = (error.stderr.splitlines() or [str(error)])[-1]
    except (Foreign, subprocess.TimeoutExpired, OSError, *FILE_ERRORS) as error:
        why = str(error)
    else:
        return True
    log.warning("the demo starts without a past: %s", why)
    return False


def _is_empty(path: Path) -> bool:
    if path.stat().st_size == 0:
        return True
    with closing(open_reader(path)) as connection:
        return is_empty(connection)


def _seed(patrol_args: Sequence[str]) -> int:
    return int(_option("seed", patrol_args) or 0)


def _speed(patrol_args: Sequence[str]) -> float:
    speed = float(_option("speed", patrol_args) or 1.0)
    # The patrol itself refuses what is no speed.
    return speed if 0.0 < speed < math.inf else 1.0


def _option(name: str, patrol_args: Sequence[str]) -> str:
    given = [word for word in patrol_args if word.startswith(f"--{name}=")]
    return given[-1].partition("=")[2] if given else ""
