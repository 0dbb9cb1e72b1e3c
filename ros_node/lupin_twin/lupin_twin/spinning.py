"""Spin an executor for as long as ROS runs, whatever a callback does."""

from __future__ import annotations

from collections.abc import Callable
from time import sleep
from typing import Any, Final

from rclpy.executors import ExternalShutdownException

# Between an error and the next try: an executor that fails at once must not take a whole core.
PAUSE_S: Final = 0.05


def spin_until_shutdown(executor: Any, on_error: Callable[[str, Exception], None]) -> None:
    """Spin until the executor or its context is shut down.

    An exception that leaves a callback ends rclpy's own `spin`, and with it a thread that nobody
    watches. Here it goes to `on_error(what, exception)`, and the spinning goes on.
    """
    while True:
        try:
            executor.spin()
        except ExternalShutdownException:
            return
        except Exception as error:  # noqa: BLE001  # whatever it is
            on_error("a callback", error)
            sleep(PAUSE_S)
        else:
            return


def end_spinning(executor: Any) -> None:
    """Ask the spinning to end, once, from any thread; a callback that runs now ends first.

    rclpy's `shutdown` takes apart what a spin that is just about to wait still needs, so it has
    to run where nothing waits: in the spinning thread itself.
    """
    executor.create_task(executor.shutdown)
