"""The command `twin_node`: runs the twin alone, until a signal ends it."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from typing import NoReturn

from lupin_twin.runtime import process
from lupin_twin.runtime.process import limit_blas_threads


def main(args: Sequence[str] | None = None) -> int:
    """Run the twin until a signal ends it; returns the exit code, 1 if its thread has died."""
    own, _ = process.split_ros_args(sys.argv[1:] if args is None else args)
    argparse.ArgumentParser(
        prog="twin_node",
        description="Run the twin alone, until a signal ends it.",
        epilog="Everything after --ros-args goes to ROS: --ros-args -p idw_power:=3.0.",
    ).parse_args(own)
    limit_blas_threads()
    process.return_large_blocks()
    process.block()  # before anything slow is imported
    from lupin_twin.core.parameters import ParameterError  # noqa: PLC0415  # see above
    from lupin_twin.ros.base_node import run_until_signal, running_ros  # noqa: PLC0415
    from lupin_twin.ros.node import TwinNode  # noqa: PLC0415

    try:
        with running_ros(args):
            return run_until_signal(TwinNode())
    except ParameterError as error:
        return process.refuse("lupin_twin", str(error))


def command() -> NoReturn:
    """Run `main` as the whole process, and exit with its code."""
    process.exit_after(main)


if __name__ == "__main__":
    command()
