"""What nodes of this process log goes the way of the bridge's own log, and in its format."""

from __future__ import annotations

import logging
from functools import cache
from typing import Any, Final

from rclpy.impl.implementation_singleton import rclpy_implementation

# rcl would write lines of its own to standard error, between those that a log collector reads. Its
# log file and `/rosout` stay as they are.
QUIET: Final = ("--ros-args", "--disable-stdout-logs")


@cache
def forward() -> None:
    """From now on, hand on what rclpy's loggers log: the place that all of it passes, filtered."""
    write = rclpy_implementation.rclpy_logging_rcutils_log

    def write_and_hand_on(severity: Any, name: str, message: str, *place: Any) -> None:
        write(severity, name, message, *place)
        function, file, line = place
        # ROS's severities are Python's numbers, and ROS has decided already that it is to be told.
        record = logging.LogRecord(
            name, int(severity), file, line, "%s", (message,), None, function
        )
        logging.root.handle(record)

    rclpy_implementation.rclpy_logging_rcutils_log = write_and_hand_on
