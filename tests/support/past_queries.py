"""Queries that a test sends to the past process: they are pickled by name."""

import os
import sys
import threading
import time
from dataclasses import dataclass
from typing import Any

from lupin_bridge.feed.query import Find
from lupin_bridge.past.plans import Answered
from lupin_bridge.serving.admission import Answer
from lupin_twin.core.past import PastRefused
from lupin_twin.core.state import Snapshot
from lupin_twin.runtime.workers import ShouldStop


@dataclass(frozen=True, slots=True)
class Count:
    """The number of tags."""

    at_ns: int

    def __call__(self, find: Find, should_stop: ShouldStop) -> int:
        """See `PastQuery`."""
        snapshot: Snapshot = find(self.at_ns)
        return len(snapshot.tags)


@dataclass(frozen=True, slots=True)
class Endless:
    """Work that ends when it is cancelled, and not before."""

    def __call__(self, find: Find, should_stop: ShouldStop) -> None:
        """See `PastQuery`."""
        _until_reported(should_stop)


def _until_reported(should_stop: ShouldStop) -> None:
    while not should_stop():
        time.sleep(0.001)


@dataclass(frozen=True, slots=True)
class Running:
    """How many `Endless` run in that process, and its nice value."""

    def __call__(self, find: Find, should_stop: ShouldStop) -> tuple[int, int]:
        """See `PastQuery`."""
        return (_endless(), os.getpriority(os.PRIO_PROCESS, 0))


def _endless() -> int:
    frames = [sys._current_frames().get(thread.ident or 0) for thread in threading.enumerate()]
    return sum(frame is not None and frame.f_code is _until_reported.__code__ for frame in frames)


@dataclass(frozen=True, slots=True)
class Body:
    """An answer with that many bytes."""

    count: int

    def __call__(self, find: Find, should_stop: ShouldStop) -> Answered:
        """See `PastQuery`."""
        return Answered("x", Answer(b"7" * self.count, "text/plain", {}))


@dataclass(frozen=True, slots=True)
class Failing:
    """A query that fails: refused, by its own fault, or with an error that cannot be pickled."""

    how: str

    def __call__(self, find: Find, should_stop: ShouldStop) -> Any:
        """See `PastQuery`."""
        return self._fail()

    def _fail(self) -> Any:
        if self.how == "refused":
            raise PastRefused("x is 7, the limit is 6")
        if self.how == "fault":
            raise ZeroDivisionError("a fault")
        raise _local_error()


def _local_error() -> Exception:
    class LocalError(Exception):
        pass

    return LocalError("of nobody's knowledge")
