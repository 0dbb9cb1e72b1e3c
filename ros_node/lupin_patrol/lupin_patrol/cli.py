"""The command `patrol_node`: parses its options and runs the node; `--ros-args` goes to ROS."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path

from lupin_twin.runtime import process


def parser() -> argparse.ArgumentParser:
    """Return the parser of the options, ROS arguments excluded; it exits with 2 on a bad one."""
    made = argparse.ArgumentParser(
        prog="patrol_node",
        description="Simulate a robot on patrol in a greenhouse, and publish what it observes.",
        epilog="ROS arguments follow --ros-args.",
        allow_abbrev=False,
    )
    made.add_argument(
        "--speed",
        type=_number(float, "a number", 0.1, 50.0),
        default=1.0,
        help="patrol seconds per second (default 1: the whole greenhouse within a minute)",
    )
    made.add_argument(
        "--day-speed",
        type=_number(float, "a number", 0.0, 3600.0),
        default=60.0,
        help="simulated seconds per patrol second (default 60: a day takes 24 minutes)",
    )
    made.add_argument(
        "--seed",
        type=_number(int, "a whole number", 0, 2**32 - 1),
        default=0,
        help="the same seed gives the same patrol (default 0)",
    )
    made.add_argument(
        "--since-morning",
        type=_number(float, "a number", 0.0, 86_400.0),
        default=0.0,
        help="where the patrol starts, in patrol seconds after nine o'clock (default 0)",
    )
    made.add_argument("--once", action="store_true", help="exit after one pass and its retries")
    made.add_argument(
        "--end-with-parent",
        action="store_true",
        help="exit when the parent process ends, even by kill -9 (Linux)",
    )
    # For `lupin-twin demo`: fills a new journal before the twin starts.
    made.add_argument("--fill-past", metavar="JOURNAL", type=Path, help=argparse.SUPPRESS)
    return made


def main() -> int:
    """Run the node until it is stopped or done; returns the exit code."""
    process.block()  # before anything slow is imported
    own, _ = process.split_ros_args(sys.argv[1:])
    options = parser().parse_args(own)
    try:
        from greenhouse_sim.simulator import GreenhouseSimulator  # noqa: PLC0415  # see above
    except ModuleNotFoundError as error:
        # Neither colcon nor apt installs the simulator, so a robot usually lacks it.
        return process.refuse(
            "patrol_node: error",
            f"the simulator is missing ({error}): python3 -m pip install mdp-greenhouse, on a "
            "robot into a virtual environment made with --system-site-packages",
        )
    if options.fill_past is not None:
        return fill_past(options.fill_past, options)
    from lupin_patrol.mission import Mission  # noqa: PLC0415
    from lupin_patrol.node import play  # noqa: PLC0415
    from lupin_twin.core.parameters import ParameterError  # noqa: PLC0415

    if options.end_with_parent:
        process.end_with_parent()
    begin_s = options.since_morning
    mission = Mission(GreenhouseSimulator(), options.seed, options.day_speed, begin_s=begin_s)
    try:
        play(
            mission.events(),
            begin_s=begin_s,
            speed=options.speed,
            once=options.once,
            ros_arguments=sys.argv,
        )
    except ParameterError as error:
        return process.refuse("patrol_node: error", str(error))
    return 0


def fill_past(journal: Path, options: argparse.Namespace) -> int:
    """Fill a journal that is new or empty with the patrol's past; returns the exit code."""
    from greenhouse_sim.simulator import GreenhouseSimulator  # noqa: PLC0415  # see `main`

    from lupin_patrol.mission import past  # noqa: PLC0415
    from lupin_twin.journal.appending import prefill  # noqa: PLC0415
    from lupin_twin.journal.paths import InUse  # noqa: PLC0415
    from lupin_twin.journal.schema import FILE_ERRORS, Foreign  # noqa: PLC0415

    now_ns, of_patrol = time.time_ns(), (options.seed, options.day_speed, options.speed)
    rows = list(past(GreenhouseSimulator(), *of_patrol, now_ns))
    try:
        prefill(journal, "lupin-twin demo", rows, now_ns)
    except (InUse, Foreign, OSError, *FILE_ERRORS) as error:
        return process.refuse("patrol_node: error", str(error))
    return 0


def _number(
    convert: Callable[[str], float], kind: str, lowest: float, highest: float
) -> Callable[[str], float]:
    """Make an argparse type for numbers within closed limits; it refuses NaN."""
    limits = f"expected {kind} from {lowest:.15g} to {highest:.15g}"

    def read(text: str) -> float:
        try:
            value = convert(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"{text!r} is not a number, {limits}") from None
        if not lowest <= value <= highest:
            raise argparse.ArgumentTypeError(f"{text!r} is out of range, {limits}")
        return value

    return read
