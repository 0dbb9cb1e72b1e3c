"""Queries that a test sends to the past process: functions, which are pickled by name."""

import os
import sys
import time

from lupin_bridge.feed.query import LogReader
from lupin_bridge.past.plans import Answered
from lupin_bridge.serving.admission import Answer
from lupin_twin.core.past import PastRefused


def tags_at(at_ns: int, log: LogReader) -> int:
    return len(log.state(at_ns).tags)


def endless(log: LogReader) -> None:
    """Work that ends when it is cancelled, and not before."""
    while not log.should_stop():
        time.sleep(0.001)


def at_work(_: LogReader) -> tuple[int, int]:
    """How many `endless` run in that process, and its nice value."""
    # No name for them: this frame is one of them, and such a cycle would keep what they hold.
    running = sum(frame.f_code is endless.__code__ for frame in sys._current_frames().values())
    return running, os.getpriority(os.PRIO_PROCESS, 0)


def sevens(count: int, _: LogReader) -> Answered:
    return Answered("x", Answer(b"7" * count, "text/plain", {}))


def refused(_: LogReader) -> None:
    raise PastRefused("x is 7, the limit is 6")


def faulty(_: LogReader) -> None:
    raise ZeroDivisionError("a fault")


def unpicklable(_: LogReader) -> None:
    class LocalError(Exception):
        pass

    raise LocalError("of nobody's knowledge")
