"""Answers that DDS cannot deliver yet are sent again, until it can.

A service may hear a request before its middleware has found the reader of the answer: where a
machine is busy that takes seconds. The middleware waits 0.1 s, then drops the answer; rclpy says so
in a Python warning, once in the life of a process, and the client waits for ever. Known as
ros2/rmw_fastrtps issue 842; of a client that came to a twin beside four busy processes, the first
request met it once in 162.
"""

from __future__ import annotations

import re
import time
import warnings
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

# How rclpy's warning begins (7.1.6), that the middleware has dropped an answer.
UNSENT: Final = "failed to send response (timeout)"
# Each try that fails keeps the node's thread for 0.1 s: a fifth of its time, at most.
TRY_EVERY_S: Final = 0.5
# Discovery that lost a message makes up for it within some 3 s, more on a busy machine.
PATIENCE_S: Final = 30.0
# Answers kept; one may be a field of 16 MB.
MAX_UNSENT: Final = 16

Send = Callable[[Any, Any], None]


@dataclass(frozen=True, slots=True)
class _Unsent:
    name: str
    send: Send
    response: Any
    header: Any
    since_s: float


class Resending:
    """Keeps what the middleware did not send; belongs to the node's thread.

    `warn(key, text)` tells of an answer that was given up.
    """

    def __init__(self, warn: Callable[[tuple[str, object], str], None]) -> None:
        self._warn = warn
        self._unsent: deque[_Unsent] = deque()
        warnings.filterwarnings("error", re.escape(UNSENT), RuntimeWarning)

    def __len__(self) -> int:
        """How many answers wait to be sent again."""
        return len(self._unsent)

    def watch(self, service: Any) -> Any:
        """Have the answers of an rclpy Service sent again where that is needed; returns it."""
        send: Send = service.send_response

        def send_response(response: Any, header: Any) -> None:
            if _was_sent(send, response, header):
                return
            if len(self._unsent) == MAX_UNSENT:
                self._give_up(self._unsent.popleft(), f"{MAX_UNSENT} others wait for theirs")
            self._unsent.append(
                _Unsent(service.service_name, send, response, header, time.monotonic())
            )

        service.send_response = send_response
        return service

    def go_on(self) -> None:
        """Try again, every `TRY_EVERY_S`, until one fails: that one comes last the next time."""
        for _ in range(len(self._unsent)):
            first = self._unsent.popleft()
            if _was_sent(first.send, first.response, first.header):
                continue
            waited_s = time.monotonic() - first.since_s
            if waited_s < PATIENCE_S:
                self._unsent.append(first)
            else:
                self._give_up(first, f"for {PATIENCE_S:g} s DDS has found no reader for it")
            return

    def _give_up(self, unsent: _Unsent, why: str) -> None:
        self._warn(
            ("unsent", unsent.name),
            f"gave up an answer of {unsent.name}: {why}; is the QoS of a client another than the "
            "default of services?",
        )


def _was_sent(send: Send, response: Any, header: Any) -> bool:
    try:
        send(response, header)
    except (RuntimeWarning, SystemError) as error:
        # Of a warning that is an error, Python makes the cause of a SystemError where it comes out
        # of C++ that does not look for one.
        for each in (error, error.__cause__):
            if isinstance(each, RuntimeWarning) and str(each).startswith(UNSENT):
                return False
        raise
    return True
