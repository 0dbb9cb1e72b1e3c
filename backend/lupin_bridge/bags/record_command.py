"""`lupin-twin record`: what the twin hears and says, into a file that ROS's own tools read."""

from __future__ import annotations

import argparse
import os
import signal
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Final

from lupin_bridge.bags.bag_writer import BagWriter
from lupin_bridge.bags.rotation import Limits, Recording
from lupin_bridge.bags.topics import SUFFIX, Topic
from lupin_bridge.telling import say, tell
from lupin_twin import stop_signals
from lupin_twin.half_made import remove_half_made
from lupin_twin.parameters import ParameterError

FAILED: Final = 1
USAGE_ERROR: Final = 2
# In less, MB, there would be little beside the definitions that each file has; and sooner, s, no
# next file is begun (`rotation`).
MIN_MB: Final = 0.1
MIN_SECONDS: Final = 1.0
# What is kept of a file's index while it is written is some 80 MB a day.
MAX_SECONDS: Final = 86_400.0


class RecordError(Exception):
    """It cannot begin; the message is the one line that says why."""


def add_parser(roles: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add `record` to the command's options."""
    text = "what the twin hears and says, with map and clock, into a file for ROS's own tools"
    parser = roles.add_parser("record", help=text, description=text, allow_abbrev=False)
    parser.add_argument("file", metavar="FILE.mcap", type=Path, help="made anew, never overwritten")
    parser.add_argument(
        "--namespace", default="", help="record the twin in this namespace (default: none)"
    )
    parser.add_argument(
        "--max-size",
        metavar="MB",
        type=partial(_number, at_least=MIN_MB),
        default=0.0,
        help="begin the next file, FILE_1.mcap, when this one has so many MB (default: never)",
    )
    parser.add_argument(
        "--max-seconds",
        metavar="S",
        type=partial(_number, at_least=MIN_SECONDS),
        default=MAX_SECONDS,
        help="begin the next file when this one is so old (default: %(default)g)",
    )


def _number(text: str, *, at_least: float) -> float:
    value = float("nan")
    with suppress(ValueError):
        value = float(text)
    if not at_least <= value <= 1e9:
        raise argparse.ArgumentTypeError(f"{text!r} must be a number from {at_least:g} to 1e9")
    return value


def run(options: argparse.Namespace, ros_args: Sequence[str]) -> int:
    """Record until a signal ends it; returns the process's exit code."""
    path: Path = options.file
    if path.suffix != SUFFIX:
        say(f"{path} does not end in {SUFFIX}: that is how its form is known")
        return USAGE_ERROR
    if why := _taken(path):
        say(why)
        return USAGE_ERROR
    stop_signals.block(stop_signals.with_hang_up())  # before ROS, whose threads inherit it
    import rclpy  # noqa: PLC0415  # see above
    from rclpy.signals import SignalHandlerOptions  # noqa: PLC0415

    try:
        namespace = options.namespace.strip("/")
        own = ["--ros-args", "-r", f"__ns:=/{namespace}", "--"] if namespace else []
        try:
            rclpy.init(args=[*own, *ros_args], signal_handler_options=SignalHandlerOptions.NO)
        except RuntimeError as error:  # the parent of all that rclpy raises for bad arguments
            raise RecordError(f"cannot start ROS: {error}") from error
        return _record(path, Limits(int(options.max_size * 1e6), options.max_seconds))
    except (RecordError, ParameterError, LookupError) as error:
        say(str(error))
        return USAGE_ERROR
    finally:
        rclpy.try_shutdown()


def _taken(path: Path) -> str:
    """Why no file can be made here, as far as that can be seen before; empty: it may be."""
    try:
        path.lstat()
    except (FileNotFoundError, NotADirectoryError):
        if path.parent.is_dir():
            return ""
        return f"cannot make {path}: there is no folder {path.parent}"
    except OSError as error:
        return f"cannot make {path}: {error.strerror}"
    if path.is_symlink() and not os.path.exists(path):  # noqa: PTH110  # which raises nothing
        return f"{path} is a link that leads nowhere, and nothing is overwritten"
    return f"{path} is there already, and nothing is overwritten"


def _record(path: Path, limits: Limits) -> int:
    import rclpy  # noqa: PLC0415  # see `run`
    from rclpy.executors import SingleThreadedExecutor  # noqa: PLC0415

    from lupin_bridge.bags.record_node import RecordNode  # noqa: PLC0415
    from lupin_twin.spinning import end_spinning, spin_until_shutdown  # noqa: PLC0415

    domain = rclpy.get_default_context().get_domain_id()
    remove_half_made(domain)
    node = RecordNode()
    try:
        recording = _begin(path, node.topics, limits)
        names = [topic.name for topic in node.topics]
        has_died = threading.Event()

        def end() -> None:
            has_died.set()
            signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGTERM)

        writer = BagWriter(recording, names, say, end)
        node.hand_to(writer.put, writer.lose)
        executor = SingleThreadedExecutor()
        executor.add_node(node)

        def spin() -> None:
            try:
                spin_until_shutdown(executor, node.habits.report)
            finally:
                end()

        thread = threading.Thread(target=spin, name="ros")
        say(f"recording {', '.join(names)} in ROS domain {domain} into {path}; Ctrl-C ends it")
        writer.start()
        thread.start()
        stop_signals.wait(signals=stop_signals.with_hang_up())
        is_well = not has_died.is_set()
        end_spinning(executor)
        thread.join()
        writer.end()
    finally:
        node.destroy_node()
    files = ", ".join(map(str, recording.paths))
    what = "recorded" if writer.is_whole else "heard, but not all of it recorded:"
    tell(f"{what} {writer.summary()} in {files}")
    return 0 if is_well and writer.is_whole and not writer.lost else FAILED


def _begin(path: Path, topics: Sequence[Topic], limits: Limits) -> Recording:
    try:
        return Recording(path, topics, limits, time.monotonic())
    except OSError as error:
        raise RecordError(f"cannot make {path}: {error.strerror}") from error
