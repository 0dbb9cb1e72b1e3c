"""`lupin-twin replay`: its options, and what it runs."""

from __future__ import annotations

import argparse
import math
import signal
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Final

from lupin_bridge.telling import say
from lupin_twin import stop_signals

SPEEDS: Final = (0.1, 100.0)
FAILED: Final = 1
_TEXT: Final = "publish a recording's inputs, its map and its time, as they were recorded"


def add_parser(roles: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add `replay` to the command's options."""
    parser = roles.add_parser(
        "replay",
        help=_TEXT,
        description=f"{_TEXT}. It starts no twin: lupin-twin demo --from FILE.mcap does. Space, or "
        "Enter, pauses it and lets it go on.",
        allow_abbrev=False,
    )
    parser.add_argument(
        "files", metavar="FILE.mcap", type=Path, nargs="+",
        help="what `lupin-twin record`, or `ros2 bag record -s mcap`, has written: a file, or all "
        "of a recording, or the folder that they are in",
    )  # fmt: skip
    add_options(parser)
    parser.add_argument(
        "--speed",
        type=_speed,
        default=1.0,
        metavar="S",
        help="recorded seconds a second, from 0.1 to 100 (default: 1)",
    )
    parser.add_argument("--pause", action="store_true", help="begin paused")
    parser.add_argument(
        "--hold",
        action="store_true",
        help="stand still at the end, with /clock published, until Ctrl-C",
    )
    parser.add_argument(
        "--state-as",
        type=_topic,
        metavar="TOPIC",
        help="publish the recorded states too, under this name, to be held against the twin's",
    )
    parser.add_argument(
        "--into-live",
        action="store_true",
        help="feed twins that keep a journal too: it will hold what is replayed, for good",
    )
    for hidden in ("--own-journal", "--end-with-parent"):
        # Of the demo, which has started a twin for it.
        action = "store_true" if hidden == "--end-with-parent" else "store"
        parser.add_argument(hidden, action=action, help=argparse.SUPPRESS)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add those options that `demo --from` has too."""
    parser.add_argument(
        "--start", type=_seconds, metavar="SECONDS",
        help="begin so long after the recording's first message; what was observed before is "
        "published at once (default: 0)",
    )  # fmt: skip
    parser.add_argument("--loop", action="store_true", help="begin again at the end")
    parser.add_argument(
        "--skip-gaps", type=_seconds, default=math.inf, metavar="SECONDS",
        help="where nothing is to be published for longer than so many recorded seconds, go on at "
        "once with what comes next (default: wait, and say how long)",
    )  # fmt: skip


def parsed(words: Sequence[str]) -> argparse.Namespace:
    """The options that these words are behind `lupin-twin replay`."""
    parser = argparse.ArgumentParser()
    add_parser(parser.add_subparsers())
    return parser.parse_args(["replay", *words])


def run(options: argparse.Namespace, ros_args: Sequence[str]) -> int:
    """Replay until the end, or until a signal comes; returns the process's exit code."""
    if options.end_with_parent:
        stop_signals.end_with_parent()
    stop_asked = _stop_asked()  # what follows is slow, and ends as quietly
    from lupin_bridge.bags.recording import RecordingError  # noqa: PLC0415  # slow

    try:
        from lupin_bridge.bags.replaying import Refused, replay  # noqa: PLC0415
    except ImportError as error:
        say(f"cannot publish what is recorded: {error}")
        return FAILED
    try:
        replay(options, ros_args, stop_asked)
    except (RecordingError, Refused) as error:
        say(str(error))
        return FAILED
    return 0


def _stop_asked() -> Callable[[], bool]:
    """Whether a stop signal has come, once or often; from the first on the process has to end.

    By handlers that only note it: threads of numpy's, from before anything could be blocked, may
    be those that get it. A demo holds both signals back, and who it starts inherits that.
    """
    asked: list[int] = []

    def note(number: int, _frame: object) -> None:
        if not asked:
            stop_signals.must_end()
        asked.append(number)

    for number in stop_signals.STOP_SIGNALS:
        signal.signal(number, note)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, stop_signals.STOP_SIGNALS)
    return lambda: bool(asked)


def _topic(text: str) -> str:
    if not text:  # what is no name otherwise, ROS says
        raise argparse.ArgumentTypeError("'' must be the name of a topic")
    return text


def _speed(text: str) -> float:
    return _number(text, *SPEEDS)


def _seconds(text: str) -> float:
    return _number(text, 0.0, 1e9)


def _number(text: str, low: float, high: float) -> float:
    value = float("nan")
    with suppress(ValueError):
        value = float(text)
    if not low <= value <= high:
        raise argparse.ArgumentTypeError(
            f"{text!r} must be a number from {low:.15g} to {high:.15g}"
        )
    return value
