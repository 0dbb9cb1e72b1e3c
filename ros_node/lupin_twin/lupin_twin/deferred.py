"""Answers of a ROS service that are given later, while the callbacks of its group go on.

rclpy sends what a service's callback returns. An asynchronous callback would hold its mutually
exclusive group until it ends, and with it every other callback of the node; so the callback returns
at once, with a promise, and the sending is what waits.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


class Later:
    """What a callback returns in place of its response. Belongs to the executor's thread."""

    def __init__(self) -> None:
        self._send: Callable[[Any], None] | None = None
        self._response: Any = None

    def answer(self, response: Any) -> None:
        """Send the response: now, or as soon as rclpy has told whom to."""
        if self._send is None:
            self._response = response
        else:
            self._send(response)

    def goes_to(self, send: Callable[[Any], None]) -> None:
        """Have the response sent by `send(response)`."""
        self._send = send
        if self._response is not None:
            send(self._response)


def allow_later(service: Any) -> None:
    """Let the callback of an rclpy Service return a `Later`."""
    send_now = service.send_response

    def send_response(response: Any, header: Any) -> None:
        if isinstance(response, Later):
            response.goes_to(lambda answer: send_now(answer, header))
        else:
            send_now(response, header)

    service.send_response = send_response
