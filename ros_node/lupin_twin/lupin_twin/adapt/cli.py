"""The command `adapt`: makes observations from any robot's topics, until a signal ends it."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from lupin_twin.runtime import process
from lupin_twin.runtime.process import exit_after, refuse

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
    from lupin_twin.adapt.check import start  # noqa: PLC0415  # see above

    return start(options.config, ros_args, options.seconds if options.check else None)


def command() -> NoReturn:
    """Run `main` as the whole process, and exit with its code."""
    exit_after(main)


if __name__ == "__main__":
    command()
