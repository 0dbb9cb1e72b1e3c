"""A single-threaded executor that survives what rclpy's own does not.

rclpy 7.1 loses an entity for ever when taking its message raises (a string that is not UTF-8 is
enough): the callback group stays occupied, and with one group the whole node falls silent. Here
such a message is dropped, reported, and the next one is taken.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.executors import (
    ExternalShutdownException,
    ShutdownException,
    SingleThreadedExecutor,
)

# How long one wait lasts at most: only a bound on how late a stop is noticed, because new work
# and `wake` end a wait at once.
WAIT_SECONDS = 0.5


class TwinExecutor(SingleThreadedExecutor):  # type: ignore[misc]  # rclpy is not typed
    """SingleThreadedExecutor that reports errors to `on_error(what, exception)` and goes on."""

    def __init__(self, on_error: Callable[[str, Exception], None], *, context: Any = None) -> None:
        super().__init__(context=context)
        self._on_error = on_error

    def _take_subscription(self, sub: Any) -> Any:
        return self._take(super()._take_subscription, sub, "message")

    def _take_service(self, srv: Any) -> Any:
        return self._take(super()._take_service, srv, "request")

    def _take(self, take: Callable[[Any], Any], entity: Any, what: str) -> Any:
        try:
            return take(entity)
        except Exception as error:  # noqa: BLE001  # whatever it is, the node lives on
            self._on_error(f"{what} that cannot be read", error)
            return None

    def spin_until_shutdown(self) -> None:
        """Spin until the context or the executor is shut down; no exception ends it."""
        while self.context.ok() and not self._is_shutdown:
            try:
                self.spin_once(timeout_sec=WAIT_SECONDS)
            except (ExternalShutdownException, ShutdownException):
                return
            except Exception as error:  # noqa: BLE001  # a callback's error must not end the thread
                self._on_error("callback", error)
