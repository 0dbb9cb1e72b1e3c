"""A service's answers that are sent later than rclpy would: made elsewhere, or not delivered yet.

Answers that DDS cannot deliver yet are sent again, until it can.

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
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final


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


# How rclpy's warning begins (7.1.6), that the middleware has dropped an answer.
UNSENT: Final = "failed to send response (timeout)"
# How often it is looked at whether something is to be tried again, s.
TRY_EVERY_S: Final = 0.5
# A try that fails keeps the node's thread: for the 0.1 s, and for what it takes to make a large
# answer a message of C. So many times as long nothing is tried then: a fifth of its time, at most.
_REST: Final = 4.0
# Discovery that lost a message makes up for it within some 3 s, more on a busy machine.
PATIENCE_S: Final = 30.0
# Answers kept, and what a try of each took, s, all together: that grows with the memory they need
# (60 MB took 0.5 s, 300 MB 2.6 s). One is kept however long it took.
MAX_UNSENT: Final = 16
MAX_UNSENT_S: Final = 2.0

Send = Callable[[Any, Any], None]


@dataclass(slots=True, eq=False)
class _Unsent:
    name: str
    send: Send
    response: Any
    header: Any
    since_s: float
    took_s: float
    tries: int = 0


class Resending:
    """Keeps what the middleware did not send; belongs to the node's thread.

    `warn(key, text)` tells of an answer that was given up; `drain()` takes what came meanwhile,
    behind each try that failed: observations must not be lost for a client that is never found.
    """

    def __init__(
        self, warn: Callable[[tuple[str, object], str], None], drain: Callable[[], None]
    ) -> None:
        self._warn = warn
        self._drain = drain
        self._unsent: list[_Unsent] = []  # the oldest first
        self._rests_until_s = 0.0
        warnings.filterwarnings("error", re.escape(UNSENT), RuntimeWarning)

    def __len__(self) -> int:
        """How many answers wait to be sent again."""
        return len(self._unsent)

    def watch(self, service: Any) -> Any:
        """Have the answers of an rclpy Service sent again where that is needed; returns it."""
        send: Send = service.send_response

        def send_response(response: Any, header: Any) -> None:
            began_s = time.monotonic()
            if not _was_sent(send, response, header):
                now_s = time.monotonic()
                name = str(service.service_name)
                self._keep(_Unsent(name, send, response, header, now_s, now_s - began_s))
                self._drain()

        service.send_response = send_response
        return service

    def go_on(self) -> None:
        """Try again until one fails; to be called every `TRY_EVERY_S`.

        Those first that were tried least, and of them the newest: one that can be sent does not
        wait behind many that never will be.
        """
        began_s = time.monotonic()
        for late in [one for one in self._unsent if began_s - one.since_s >= PATIENCE_S]:
            self._give_up(late, f"for {PATIENCE_S:g} s DDS has found no reader for it")
        if began_s < self._rests_until_s:
            return
        for one in sorted(self._unsent, key=lambda one: (one.tries, -one.since_s)):
            one.tries += 1
            began_s = time.monotonic()
            if not _was_sent(one.send, one.response, one.header):
                now_s = time.monotonic()
                self._rests_until_s = now_s + _REST * (now_s - began_s)
                self._drain()
                return
            self._unsent.remove(one)

    def _keep(self, new: _Unsent) -> None:
        self._unsent.append(new)
        while len(self._unsent) > 1 and (
            len(self._unsent) > MAX_UNSENT
            or sum(one.took_s for one in self._unsent) > max(MAX_UNSENT_S, new.took_s)
        ):
            self._give_up(self._unsent[0], "too much else waits to be sent again")

    def _give_up(self, unsent: _Unsent, why: str) -> None:
        self._unsent.remove(unsent)
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
