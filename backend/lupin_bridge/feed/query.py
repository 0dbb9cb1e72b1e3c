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
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from functools import partial
from typing import IO, Any, Final, TypeVar

from lupin_twin.core.diagnostics import UNKNOWN_JOURNAL, Condition
from lupin_twin.core.history import LatestRequest
from lupin_twin.core.notes import NotesRequest
from lupin_twin.core.past import (
    PastRow,
    PeriodRequest,
    RecentRequest,
    ScansRequest,
    SeriesRequest,
    WritesRequest,
    check_moment,
)
from lupin_twin.journal.fold import state_at
from lupin_twin.journal.queries import series
from lupin_twin.journal.rows import latest
from lupin_twin.journal.writes import Export, lots, notes, observed, recent, scans, writes
from lupin_twin.runtime.journal_queries import Recall
from lupin_twin.runtime.workers import ShouldStop

ResultT = TypeVar("ResultT")

# What a query needs of the log, and the type of the result. A moment, ns of ROS time: `Snapshot`; a
# series: `SeriesPast`; what was recent at a moment, or scanned up to it: a tuple of `PastWrite`;
# what was received, or observed in a period: `PastWrites`; notes: `PastNotes`; a tag's last scans:
# `History`; or a function that reads the log by itself, such as an export's step.
Need = (
    int
    | SeriesRequest
    | RecentRequest
    | ScansRequest
    | WritesRequest
    | PeriodRequest
    | NotesRequest
    | LatestRequest
    | Callable[[sqlite3.Connection], Any]
)
# Looks up a need in the log; all needs of a query see the same state of the log.
Find = Callable[[Need], Any]
# Makes an answer of what is found. It ends early if `should_stop` says that nobody waits for it.
# Queries and answers can be pickled.
PastQuery = Callable[[Find, ShouldStop], ResultT]


@dataclass(frozen=True, slots=True)
class Now:
    """What a query refers to: ROS time, ns; the frame of poses; and the journal's condition."""

    stamp_ns: int
    frame_id: str
    condition: Condition


def as_found(need: Need, find: Find, _should_stop: ShouldStop) -> Any:
    """A `PastQuery` that answers with what was found, unchanged."""
    return find(need)


def export_step(
    export: Export,
    write: Callable[[Sequence[PastRow]], ResultT],
    find: Find,
    _should_stop: ShouldStop,
) -> tuple[Export | None, list[ResultT]]:
    """A `PastQuery`: the rest of the export (None: complete), and the next lots by `write`."""
    rows: list[PastRow] | None = find(export.step)
    return (None, []) if rows is None else (export, [write(lot) for lot in lots(rows)])


# --- the process that reads the past --------------------------------------------------------------

# The header of each answer: its number, and the length of its pickle, bytes.
HEAD: Final = struct.Struct(">QQ")
# nice(2): beside a busy twin it gets a quarter of the core that they share.
NICENESS: Final = 5

Search = Callable[[Any, ShouldStop], Any]


class Child:
    """Answers queries until its input ends; `recall` runs them on the log.

    The input is pairs of a number and a query, pickled with its `Now` and its cost; or None, which
    cancels the query of that number.
    """

    def __init__(self, recall: type[Recall] = Recall) -> None:
        self._condition = UNKNOWN_JOURNAL
        self._recall = recall(lambda: self._condition)
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
            search = self._search(query, now)
        except Exception as error:  # noqa: BLE001  # goes to the caller
            self._send(number, True, error)
            return
        self._condition = now.condition
        running = self._recall.query(search, cost_s)
        self._running[number] = running
        running.add_done_callback(partial(self._reply, number))

    def _search(self, query: PastQuery[Any], now: Now) -> Search:
        def search(log: sqlite3.Connection, should_stop: ShouldStop) -> Any:
            def find(need: Any) -> Any:
                if should_stop():  # as SQLite ends an interrupted statement
                    raise sqlite3.OperationalError("interrupted")
                return found_in(need, now, log)

            return query(find, should_stop)

        return search

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


_OF_LOG: Final[dict[Any, Callable[[sqlite3.Connection, Any], Any]]] = {
    WritesRequest: writes,
    PeriodRequest: observed,
    NotesRequest: notes,
    LatestRequest: latest,
}


def found_in(need: Any, now: Now, log: sqlite3.Connection) -> Any:
    """What a query needs, looked up in a log."""
    match need:
        case SeriesRequest():
            return series(log, need, now.stamp_ns)
        case RecentRequest() | ScansRequest():
            check_moment(need.at_ns, now.stamp_ns)
            return recent(log, need) if isinstance(need, RecentRequest) else scans(log, need)
        case int():
            check_moment(need, now.stamp_ns)
            return state_at(log, need, now.frame_id)
        case _:
            look = _OF_LOG.get(type(need))
            return need(log) if look is None else look(log, need)


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


def main(child: Callable[[], Child] = Child) -> None:
    """Answer the parent until it ends, for whatever reason."""
    # Only the parent acts on Ctrl-C and on a service manager's signal to all processes.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    os.nice(NICENESS)
    gc.freeze()
    # Standard output carries answers only: what is printed goes to standard error.
    with os.fdopen(os.dup(1), "wb") as answers:
        os.dup2(2, 1)
        try:
            child().run(sys.stdin.buffer, answers)
        finally:
            # At once: nobody waits for queries under way, and there is nothing to clean up.
            os._exit(0)
