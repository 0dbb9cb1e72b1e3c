"""The command `adapt`: makes observations from any robot's topics, until a signal ends it."""

from __future__ import annotations

import argparse
import signal
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from lupin_twin.runtime import process
from lupin_twin.runtime.process import exit_after, refuse

if TYPE_CHECKING:
    from lupin_twin.adapt.config import Config

WRONG = 1
HELP = "turn a robot's own topics, or sensors on an MQTT broker, into observations"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's own options; those of ROS follow `--ros-args`."""
    parser.add_argument(
        "--config", type=Path, metavar="FILE", help="YAML file: topics, tags, sensors"
    )
    parser.add_argument(
        "--check",
        action="store_true",
        help="listen, report what arrives and what is missing, and exit; without --config, print "
        "a configuration to start from",
    )
    parser.add_argument(
        "--seconds", type=float, default=10.0, metavar="S", help="how long to listen (default: 10)"
    )


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point of the ROS package's executable; see `run`."""
    own, ros_args = process.split_ros_args(sys.argv[1:] if argv is None else argv)
    made = argparse.ArgumentParser(prog="adapt", description=HELP, allow_abbrev=False)
    add_options(made)
    return run(made.parse_args(own), ros_args)


def run(options: argparse.Namespace, ros_args: Sequence[str]) -> int:
    """Run the adapter until a signal ends it, or the check.

    Returns the exit code: 2 for an invalid configuration, 1 if --check found a fault.
    """
    if options.config is None and not options.check:
        return refuse("adapt", "--config FILE is missing; --check prints one to start from")
    if not 0.1 <= options.seconds <= 3600.0:
        return refuse("adapt", f"--seconds is {options.seconds:g}, must be from 0.1 to 3600")
    process.block()  # before anything slow is imported
    from lupin_twin.adapt.config import read_config  # noqa: PLC0415  # see above
    from lupin_twin.adapt.table import ConfigError  # noqa: PLC0415
    from lupin_twin.core.parameters import ParameterError  # noqa: PLC0415
    from lupin_twin.ros.base_node import running_ros  # noqa: PLC0415

    try:
        config = None if options.config is None else read_config(options.config)
        with running_ros(["adapt", *ros_args]):
            if config is None:
                return _suggest(options.seconds)
            return _check(config, options.seconds) if options.check else _run(config)
    except (ConfigError, ParameterError) as error:
        return refuse("adapt", str(error))


def command() -> NoReturn:
    """Run `main` as the whole process, and exit with its code."""
    exit_after(main)


def _run(config: Config) -> int:
    from lupin_twin.adapt.node import AdaptNode  # noqa: PLC0415  # see `run`
    from lupin_twin.ros.base_node import run_until_signal  # noqa: PLC0415

    node = AdaptNode(config)
    node.get_logger().info(
        f"adapting sensors for {len(config.tags)} tags; "
        "/diagnostics shows what arrives and what is dropped"
    )
    return run_until_signal(node)


def _check(config: Config, seconds: float) -> int:
    from lupin_twin.adapt.check import report  # noqa: PLC0415  # see `run`
    from lupin_twin.adapt.node import AdaptNode  # noqa: PLC0415

    node = AdaptNode(config, is_check=True)
    _listen(node, seconds)
    lines = list(report(node, seconds))
    node.destroy_node()
    for _, line in lines:
        sys.stdout.write(f"{line}\n")
    return 0 if all(is_right for is_right, _ in lines) else WRONG


def _suggest(seconds: float) -> int:
    from lupin_twin.adapt.check import Listener, suggestion  # noqa: PLC0415  # see `run`

    listener = Listener()
    _listen(listener, seconds)
    for why in listener.missing.values():
        sys.stderr.write(f"{why}\n")
    if not any(source.received for source in listener.sources.values()):
        topics = ", ".join(sorted(name for name, _ in listener.get_topic_names_and_types()))
        return refuse("adapt", f"no reading and no pose was received; topics: {topics or 'none'}")
    sys.stdout.write("# Fill in where each tag is: [x, y] in m.\n")
    sys.stdout.write(suggestion(listener))
    return 0


def _listen(node: Any, seconds: float) -> None:
    """Spin the node for `seconds`; a signal ends the process."""
    from rclpy.executors import SingleThreadedExecutor  # noqa: PLC0415  # see `run`

    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT, signal.SIGTERM})
    sys.stderr.write(f"listening for {seconds:g} s ...\n")
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    until_s = time.monotonic() + seconds
    while (left_s := until_s - time.monotonic()) > 0:
        executor.spin_once(timeout_sec=left_s)


if __name__ == "__main__":
    command()
