"""Queries about the past as picklable values, and the child process that answers them.

The child reads the journal, and ends with its parent. It reads queries on standard input, and
writes complete answers to standard output, so they never hold the parent's interpreter lock. It
loads no ROS.
"""

from __future__ import annotations

import gc
import os
import pickle
import signal
import sqlite3
import struct
import sys
import threading
import traceback
from collections.abc import Callable, Collection, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from functools import partial
from typing import IO, TYPE_CHECKING, Any, Final, TypeVar

from lupin_twin.core.diagnostics import UNKNOWN_JOURNAL, Condition
from lupin_twin.core.notes import NotesRequest, PastNotes
from lupin_twin.core.past import (
    PastRow,
    PastWrites,
    SeriesPast,
    SeriesRequest,
    WritesRequest,
    check_moment,
)
from lupin_twin.core.state import Observation, Snapshot
from lupin_twin.journal.fold import state_at
from lupin_twin.journal.queries import series
from lupin_twin.journal.rows import latest
from lupin_twin.journal.schema import SiteLog
from lupin_twin.journal.writes import Export, lots, notes, observed, recent, scans, writes
from lupin_twin.runtime.journal_queries import Recall
from lupin_twin.runtime.process import return_large_blocks
from lupin_twin.runtime.workers import ShouldStop, Workers

if TYPE_CHECKING:
    from lupin_twin.estimate.engine import TagPast

ResultT = TypeVar("ResultT")


@dataclass(frozen=True, slots=True)
class Now:
    """What a query refers to: ROS time, ns; the frame of poses; and the journal's condition."""

    stamp_ns: int
    frame_id: str
    condition: Condition


class LogReader:
    """A log as a query sees it: unchanged while that looks things up, and up to `now`.

    If `should_stop()`, nobody waits any more, and the next lookup ends the query, as SQLite ends an
    interrupted statement.
    """

    def __init__(self, connection: Any, now: Now, should_stop: ShouldStop = lambda: False) -> None:
        self._connection = connection
        self._now = now
        self.should_stop = should_stop

    @property
    def connection(self) -> Any:
        """The log itself, for a lookup that has no method here."""
        if self.should_stop():
            raise sqlite3.OperationalError("interrupted")
        return self._connection

    def state(self, at_ns: int) -> Snapshot:
        """See `fold.state_at`; raises `PastRefused` for a moment that is yet to come."""
        check_moment(at_ns, self._now.stamp_ns)
        return state_at(self.connection, at_ns, self._now.frame_id)

    def series(self, request: SeriesRequest) -> SeriesPast:
        """See `queries.series`."""
        return series(self.connection, request, self._now.stamp_ns)

    def recent(self, at_ns: int) -> tuple[Observation, ...]:
        """See `writes.recent`; raises as `state` does."""
        check_moment(at_ns, self._now.stamp_ns)
        return recent(self.connection, at_ns)

    def scans(self, since_ns: int, at_ns: int, sensors: Collection[str]) -> tuple[Observation, ...]:
        """See `writes.scans`; raises as `state` does."""
        check_moment(at_ns, self._now.stamp_ns)
        return scans(self.connection, since_ns, at_ns, sensors)

    def writes(self, request: WritesRequest) -> PastWrites:
        """See `writes.writes`."""
        return writes(self.connection, request)

    def observed(self, start_ns: int, end_ns: int) -> PastWrites:
        """See `writes.observed`."""
        return observed(self.connection, start_ns, end_ns)

    def latest(self, tag_id: str, count: int) -> list[Observation]:
        """See `rows.latest`."""
        return latest(SiteLog(self.connection), tag_id, count)

    def readings(
        self, sensor: str, at_ns: int, day_length_s: float, days: float = 1.0
    ) -> list[TagPast]:
        """See `estimates.readings_at`."""
        from lupin_twin.runtime.estimates import readings_at  # noqa: PLC0415  # few queries need it

        return readings_at(self.connection, sensor, at_ns, day_length_s, days)

    def notes(self, request: NotesRequest) -> PastNotes:
        """See `writes.notes`."""
        return notes(self.connection, request)


# Makes an answer of what it looks up in a log. Queries and answers can be pickled.
PastQuery = Callable[[LogReader], ResultT]


def export_step(
    export: Export, write: Callable[[Sequence[PastRow]], ResultT], log: LogReader
) -> tuple[Export | None, list[ResultT]]:
    """A `PastQuery`: the rest of the export (None: complete), and the next lots by `write`."""
    rows = export.step(log.connection)
    return (None, []) if rows is None else (export, [write(lot) for lot in lots(rows)])


# --- the process that reads the past --------------------------------------------------------------

# The header of each answer: its number, and the length of its pickle, bytes.
HEAD: Final = struct.Struct(">QQ")
# nice(2): beside a busy twin it gets a quarter of the core that they share.
NICENESS: Final = 5


# Answers a query that refers to `Now`, in a worker's thread; calls `should_stop` between its steps.
Answerer = Callable[[Any, Now, ShouldStop], Any]


class FromJournal:
    """An `Answerer`: answers from the twin's journal, wherever that is at the newest query."""

    def __init__(self) -> None:
        self._condition = UNKNOWN_JOURNAL
        self._recall = Recall(lambda: self._condition)

    def __call__(self, query: PastQuery[ResultT], now: Now, should_stop: ShouldStop) -> ResultT:
        """Answer a query."""
        self._condition = now.condition
        return self._recall.answer(
            lambda connection, stop: query(LogReader(connection, now, stop)), should_stop
        )


class Child:
    """Answers queries until its input ends, in worker threads.

    The input is pairs of a number and a query, pickled with its `Now` and its cost; or None, which
    cancels the query of that number.
    """

    def __init__(self, answer: Answerer) -> None:
        self._answer = answer
        self._workers = Workers("memory")
        self._running: dict[int, Future[Any]] = {}
        self._sending = threading.Lock()
        self._out: IO[bytes]

    def run(self, queries: IO[bytes], answers: IO[bytes]) -> None:
        """Take queries until the parent is gone."""
        self._out = answers
        while True:
            try:
                number, message = pickle.load(queries)  # noqa: S301  # the parent's own
            except EOFError:
                return
            if message is not None:
                self._ask(number, message)
            else:
                if (running := self._running.pop(number, None)) is not None:
                    running.cancel()
                self._send(number, False, None)  # the parent sees that this process reacts

    def _ask(self, number: int, message: bytes) -> None:
        try:
            query, now, cost_s = pickle.loads(message)  # noqa: S301  # as above
        except Exception as error:  # noqa: BLE001  # goes to the caller
            self._send(number, True, error)
            return
        running = self._workers.submit(partial(self._answer, query, now), cost_s)
        self._running[number] = running
        running.add_done_callback(partial(self._reply, number))

    # --- in a worker's thread -------------------------------------------------------------------

    def _reply(self, number: int, done: Future[Any]) -> None:
        if self._running.pop(number, None) is not None:  # else nobody waits
            error = done.exception()
            self._send(number, error is not None, error or done.result())

    def _send(self, number: int, is_error: bool, value: Any) -> None:
        answer = pickle.dumps((is_error, _portable(value) if is_error else value), 5)
        # A sender waits until the parent has taken its answer, which bounds the memory for answers.
        with self._sending:
            self._out.writelines((HEAD.pack(number, len(answer)), answer))
            self._out.flush()


def _portable(error: BaseException) -> BaseException:
    """The error, or a `RuntimeError` if it cannot be pickled, with its traceback as a note."""
    portable = error
    try:
        pickle.loads(pickle.dumps(error))  # noqa: S301  # our own
    except Exception:  # noqa: BLE001  # some cannot be unpickled
        portable = RuntimeError(repr(error))
    trace = "".join(traceback.format_exception(error))
    portable.add_note(f"in the process that reads the past:\n{trace}")
    return portable


def main(answerer: Callable[[], Answerer] = FromJournal) -> None:
    """Answer the parent until it ends, for whatever reason."""
    # Only the parent acts on Ctrl-C and on a service manager's signal to all processes.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    os.nice(NICENESS)
    return_large_blocks()
    gc.freeze()
    # Standard output carries answers only: what is printed goes to standard error.
    with os.fdopen(os.dup(1), "wb") as answers:
        os.dup2(2, 1)
        try:
            Child(answerer()).run(sys.stdin.buffer, answers)
        finally:
            # At once: nobody waits for queries under way, and there is nothing to clean up.
            os._exit(0)
