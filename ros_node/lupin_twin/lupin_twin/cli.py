"""The command `twin_node`: the twin alone, from its first moment to a clean end."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import NoReturn

from lupin_twin.runtime import process
from lupin_twin.runtime.process import (
    exit_after,
    limit_blas_threads,
    remove_stale_shared_memory,
    return_large_blocks,
)

USAGE_ERROR = 2


def main(args: Sequence[str] | None = None) -> int:
    """Run the twin until a signal ends it; returns the exit code, 1 if its thread has died."""
    limit_blas_threads()
    return_large_blocks()
    process.block()  # before anything slow is imported
    import rclpy  # noqa: PLC0415  # see above
    from rclpy.signals import SignalHandlerOptions  # noqa: PLC0415

    from lupin_twin.core.parameters import ParameterError  # noqa: PLC0415

    try:
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    except RuntimeError as error:  # the parent of all that rclpy raises for bad arguments
        return _refuse(f"cannot start ROS: {error}")
    remove_stale_shared_memory(rclpy.get_default_context().get_domain_id())
    try:
        return _run()
    except ParameterError as error:
        return _refuse(str(error))
    finally:
        rclpy.try_shutdown()


def command() -> NoReturn:
    """`main` as a process of its own."""
    exit_after(main)


def _run() -> int:
    from lupin_twin.ros.base_node import run_until_signal  # noqa: PLC0415  # see above
    from lupin_twin.ros.node import TwinNode  # noqa: PLC0415

    return run_until_signal(TwinNode())


def _refuse(reason: str) -> int:
    sys.stderr.write(f"lupin_twin: {' '.join(reason.split())}\n")
    return USAGE_ERROR


if __name__ == "__main__":
    command()
