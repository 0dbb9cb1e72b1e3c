"""The process that looks back: reads the journal, makes answers, and ends with its parent.

Only questions come in, and only their answers go out, finished: whatever they take, they take no
turn of the parent's interpreter. It loads no ROS.
"""

from __future__ import annotations

import gc
import os
import pickle
import signal
import socket
import sqlite3
import struct
import sys
import threading
import traceback
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, Final

from lupin_bridge.feed.query import WRITE_ROW_S, Question, Work
from lupin_twin.core.journal_condition import UNKNOWN, Condition
from lupin_twin.core.notes import NotesRequest
from lupin_twin.core.past import NotRemembered, PastRow, SeriesRequest, check_moment
from lupin_twin.core.writes import RecentRequest, WritesRequest
from lupin_twin.journal.fold import state_at
from lupin_twin.journal.follow import recent, writes
from lupin_twin.journal.notes import notes
from lupin_twin.journal.queries import Export, lots, series
from lupin_twin.runtime.journal_queries import Recall
from lupin_twin.runtime.workers import SMALL_S, ShouldStop, Workers

# Before each message: how long its pickle is, and what of it comes behind that as it is.
HEAD: Final = struct.Struct(">IQ")


@dataclass(frozen=True, slots=True)
class Now:
    """What a question is about: ROS time, ns; the frame of poses; and how the journal is."""

    stamp_ns: int
    frame_id: str
    condition: Condition


@dataclass(frozen=True, slots=True)
class Ask:
    """A question, pickled by itself: one that cannot be read is answered too."""

    number: int
    now: Now
    question: bytes
    cost_s: float


@dataclass(frozen=True, slots=True)
class Cancel:
    """Nobody waits for the answer any more."""

    number: int


@dataclass(frozen=True, slots=True)
class Share:
    """What the questions from here on mean by the one large value that they name."""

    value: bytes


@dataclass(frozen=True, slots=True)
class Step:
    """The next `Lot` of an export, through `write`; the first step begins it."""

    export: int
    is_first: bool
    start_ns: int
    end_ns: int
    tag_id: str | None
    sensor_type: str | None
    write: Callable[[Sequence[PastRow]], Any]


@dataclass(frozen=True, slots=True)
class Lot:
    """A lot as it was written; None: of that stretch of time there is none, or it is the end."""

    lot: Any
    is_end: bool = False


@dataclass(frozen=True, slots=True)
class EndExport:
    """Nobody takes this export any further."""

    export: int


@dataclass(frozen=True, slots=True)
class Reply:
    """An answer, or the error that it met."""

    number: int
    is_error: bool
    value: Any


class _Shared:
    """Where the value is that questions name only."""

    value: object = None


def shared() -> object:
    """What a pickled question has in place of the shared value, see `past_process`."""
    return _Shared.value


@dataclass(slots=True, eq=False)
class _Running:
    """A question on its way: what is being done for it now."""

    number: int
    doing: Future[Any] | None = None
    is_cancelled: bool = False

    def cancel(self) -> None:
        """Whatever is being done for it ends soon."""
        self.is_cancelled = True
        if self.doing is not None:
            self.doing.cancel()


@dataclass(slots=True, eq=False)
class _Exporting:
    """An export, and the rows that were read and not taken."""

    export: Export
    read: deque[list[PastRow]] = field(default_factory=deque)


class Child:
    """Answers what comes on a socket until that ends; `recall` is where the log is asked."""

    def __init__(self, peer: socket.socket, recall: type[Recall] = Recall) -> None:
        self._peer = peer
        self._sending = threading.Lock()
        self._condition = UNKNOWN
        self._recall = recall(lambda: self._condition)
        self._workers = Workers("answer")
        self._running: dict[int, _Running] = {}
        self._exports: dict[int, _Exporting] = {}

    def run(self) -> None:
        """Take messages until the parent is gone."""
        while (message := self._receive()) is not None:
            if isinstance(message, Ask):
                self._ask(message)
            elif isinstance(message, Cancel):
                running = self._running.pop(message.number, None)
                if running is not None:
                    running.cancel()
            elif isinstance(message, Share):
                _Shared.value = pickle.loads(message.value)  # noqa: S301  # the parent's own
            elif isinstance(message, EndExport):
                self._exports.pop(message.export, None)

    def _receive(self) -> Any:
        head = self._read(HEAD.size)
        body = head and self._read(HEAD.unpack(head)[0])
        return pickle.loads(body) if body else None  # noqa: S301  # the parent's own

    def _read(self, count: int) -> bytes | None:
        """So many bytes; None: the parent has gone."""
        found = bytearray(count)
        view = memoryview(found)
        while view:
            try:
                got = self._peer.recv_into(view)
            except ConnectionError:
                return None
            if not got:
                return None
            view = view[got:]
        return bytes(found)

    def _ask(self, message: Ask) -> None:
        self._condition = message.now.condition
        running = self._running[message.number] = _Running(message.number)
        try:
            question: Question[Any] | Step = pickle.loads(message.question)  # noqa: S301
            search = self._search(question, message.now)
        except BaseException as error:  # noqa: BLE001  # goes to the caller
            self._reply(running, error=error)
            return
        running.doing = self._recall.query(search, message.cost_s)
        running.doing.add_done_callback(lambda found: self._found(running, found))

    def _search(
        self, question: Question[Any] | Step, now: Now
    ) -> Callable[[sqlite3.Connection, ShouldStop], Work[Any]]:
        if isinstance(question, Step):
            step = question
            if step.is_first:
                export = Export(step.start_ns, step.end_ns, step.tag_id, step.sensor_type)
                self._exports[step.export] = _Exporting(export)
            return lambda connection, _: self._step(step, connection)
        query = question
        return lambda connection, _: self._look(query, now, connection)

    def _look(self, question: Question[Any], now: Now, connection: sqlite3.Connection) -> Work[Any]:
        looking = question.look()
        try:
            need = next(looking)
            while True:
                if isinstance(need, SeriesRequest):
                    need = looking.send(series(connection, need, now.stamp_ns))
                    continue
                if isinstance(need, WritesRequest):
                    need = looking.send(writes(connection, need))
                    continue
                if isinstance(need, NotesRequest):
                    need = looking.send(notes(connection, need))
                    continue
                if isinstance(need, RecentRequest):
                    check_moment(need.at_ns, now.stamp_ns)
                    need = looking.send(recent(connection, need))
                    continue
                check_moment(need, now.stamp_ns)
                need = looking.send(state_at(connection, need, now.frame_id))
        except StopIteration as end:
            work: Work[Any] = end.value
            return work

    def _step(self, step: Step, connection: sqlite3.Connection) -> Work[Any]:
        exporting = self._exports.get(step.export)
        if exporting is None:
            raise NotRemembered("the export was broken off: begin it again", is_lasting=False)
        if not exporting.read:
            found = exporting.export.step(connection)
            if found is None:
                self._exports.pop(step.export, None)
                return Work(0.0, lambda _: Lot(None, is_end=True))
            exporting.read.extend(lots(found))
        if not exporting.read:
            return Work(0.0, lambda _: Lot(None))
        lot = exporting.read.popleft()
        return Work(len(lot) * WRITE_ROW_S, lambda _: Lot(step.write(lot)))

    # --- in a worker's thread -------------------------------------------------------------------

    def _found(self, running: _Running, found: Future[Work[Any]]) -> None:
        try:
            work = found.result()
            if work.cost_s > SMALL_S:
                # The journal is not held meanwhile.
                running.doing = self._workers.submit(work.do, work.cost_s)
                running.doing.add_done_callback(lambda done: self._done(running, done))
                if running.is_cancelled:
                    running.doing.cancel()
                return
            value = work.do(lambda: running.is_cancelled)
        except BaseException as error:  # noqa: BLE001  # goes to the caller
            self._reply(running, error=error)
        else:
            self._reply(running, value)

    def _done(self, running: _Running, done: Future[Any]) -> None:
        try:
            value = done.result()
        except BaseException as error:  # noqa: BLE001  # goes to the caller
            self._reply(running, error=error)
        else:
            self._reply(running, value)

    def _reply(
        self, running: _Running, value: Any = None, error: BaseException | None = None
    ) -> None:
        self._running.pop(running.number, None)
        if running.is_cancelled:
            return
        buffers: list[pickle.PickleBuffer] = []
        reply = Reply(running.number, error is not None, _portable(error) if error else value)
        try:
            text = pickle.dumps(reply, 5, buffer_callback=buffers.append)
            if len(buffers) > 1:  # there is room for one
                buffers = []
                text = pickle.dumps(reply, 5)
        except Exception as unfit:  # noqa: BLE001  # an answer of any kind may not be for pickling
            buffers = []
            text = pickle.dumps(Reply(running.number, True, _portable(unfit)))
        bodies: list[memoryview] = [buffer.raw() for buffer in buffers]
        head = HEAD.pack(len(text), sum(map(len, bodies)))
        # Whoever sends waits until the parent has taken it: so much is kept for it, and no more.
        with self._sending, suppress(OSError):
            for part in (memoryview(head + text), *bodies):
                self._peer.sendall(part)


def _portable(error: BaseException) -> BaseException:
    """An error as it can cross, with its trace as a note."""
    portable = error
    try:
        pickle.loads(pickle.dumps(error))  # noqa: S301  # our own
    except Exception:  # noqa: BLE001  # there are those that cannot be made again
        portable = RuntimeError(repr(error))
    trace = "".join(traceback.format_exception(error))
    portable.add_note(f"in the process that looks back:\n{trace}")
    return portable


def main(child: Callable[[socket.socket], Child] = Child) -> None:
    """Answer the parent on the socket that is the argument, until it ends, however that is."""
    # Ctrl-C and a service manager's signal to all are the parent's to act on.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    gc.freeze()
    child(socket.socket(fileno=int(sys.argv[1]))).run()
    # At once: nobody waits for what is under way, and nothing here is to be put away.
    os._exit(0)
