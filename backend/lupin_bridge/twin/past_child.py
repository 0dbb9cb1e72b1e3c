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
from concurrent.futures import CancelledError, Future
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, Final

from lupin_bridge.twin.looking import WRITE_ROW_S, Question, Work
from lupin_twin.journal.condition import UNKNOWN, Condition
from lupin_twin.journal.export import Export, lots
from lupin_twin.journal.fold import state_at
from lupin_twin.journal.queries import series
from lupin_twin.journal.writes import recent, writes
from lupin_twin.past import NotRemembered, PastRow, SeriesRequest, check_moment
from lupin_twin.past_writes import RecentRequest, WritesRequest
from lupin_twin.recall import Recall
from lupin_twin.state import Snapshot
from lupin_twin.workers import SMALL_S, ShouldStop, Workers

# Before each message: how long its pickle is, and what of it comes behind that as it is.
HEAD: Final = struct.Struct(">IQ")


@dataclass(frozen=True, slots=True)
class Now:
    """What a question is asked at: ROS time, ns; the frame of poses; and how the journal is.

    `number` is another with each state that was told: of one number and moment is one answer.
    """

    stamp_ns: int
    frame_id: str
    condition: Condition
    number: int


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
class Preload:
    """What questions will be of, pickled: to read it is to import what the first one needs.

    With `now`, a state is read that nobody asked for: the first who asks finds places and names.
    """

    what: bytes
    now: Now | None


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
class Told:
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


class _States:
    """The states that are being read: whoever asks of the same moment meanwhile waits for that."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._being_read: dict[tuple[int, int], Future[Snapshot]] = {}

    def get(self, key: tuple[int, int], read: Callable[[], Snapshot], stop: ShouldStop) -> Snapshot:
        """What `read` gives, here or where it is being read already."""
        while not stop():
            with self._lock:
                other = self._being_read.get(key)
                if other is None:
                    mine = self._being_read[key] = Future[Snapshot]()
            if other is None:
                return self._read(key, mine, read)
            with suppress(TimeoutError, CancelledError):
                found = other.result(_LOOK_S)
                if found is not None:
                    return found
        raise CancelledError

    def _read(
        self, key: tuple[int, int], mine: Future[Snapshot], read: Callable[[], Snapshot]
    ) -> Snapshot:
        try:
            found = read()
            mine.set_result(found)
            return found
        finally:
            mine.cancel()  # without a result: those who wait read for themselves
            with self._lock:
                del self._being_read[key]


# How often who waits for another's reading looks whether he is still waited for, s.
_LOOK_S: Final = 0.05


@dataclass(slots=True, eq=False)
class _Asked:
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
    """Answers what comes on a socket until that ends."""

    def __init__(self, peer: socket.socket) -> None:
        self._peer = peer
        self._sending = threading.Lock()
        self._condition = UNKNOWN
        self._recall = Recall(lambda: self._condition)
        self._workers = Workers("answer")
        self._states = _States()
        self._asked: dict[int, _Asked] = {}
        self._exports: dict[int, _Exporting] = {}

    def run(self) -> None:
        """Take messages until the parent is gone."""
        while (message := self._receive()) is not None:
            if isinstance(message, Ask):
                self._ask(message)
            elif isinstance(message, Cancel):
                asked = self._asked.pop(message.number, None)
                if asked is not None:
                    asked.cancel()
            elif isinstance(message, Share):
                _Shared.value = pickle.loads(message.value)  # noqa: S301  # the parent's own
            elif isinstance(message, EndExport):
                self._exports.pop(message.export, None)
            elif isinstance(message, Preload):
                self._preload(message)

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

    def _preload(self, message: Preload) -> None:
        def load(_: ShouldStop) -> None:
            pickle.loads(message.what)  # noqa: S301  # the parent's own
            gc.freeze()

        self._workers.submit(load)
        if message.now is not None:
            now = message.now
            self._condition = now.condition
            # Where there is no journal that can be read, who asks is told so.
            self._recall.ask(lambda connection, _: state_at(connection, now.stamp_ns, now.frame_id))

    def _ask(self, message: Ask) -> None:
        self._condition = message.now.condition
        asked = self._asked[message.number] = _Asked(message.number)
        try:
            question: Question[Any] | Step = pickle.loads(message.question)  # noqa: S301
            search = self._search(question, message.now)
        except BaseException as error:  # noqa: BLE001  # told to who asked
            self._tell(asked, error=error)
            return
        asked.doing = self._recall.ask(search, message.cost_s)
        asked.doing.add_done_callback(lambda found: self._found(asked, found))

    def _search(
        self, question: Question[Any] | Step, now: Now
    ) -> Callable[[sqlite3.Connection, ShouldStop], Work[Any]]:
        if isinstance(question, Step):
            step = question
            if step.is_first:
                export = Export(step.start_ns, step.end_ns, step.tag_id, step.sensor_type)
                self._exports[step.export] = _Exporting(export)
            return lambda connection, _: self._step(step, connection)
        asked = question
        return lambda connection, stop: self._look(asked, now, connection, stop)

    def _look(
        self, question: Question[Any], now: Now, connection: sqlite3.Connection, stop: ShouldStop
    ) -> Work[Any]:
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
                if isinstance(need, RecentRequest):
                    check_moment(need.at_ns, now.stamp_ns)
                    need = looking.send(recent(connection, need))
                    continue
                at_ns = need
                check_moment(at_ns, now.stamp_ns)
                need = looking.send(
                    self._states.get(
                        (at_ns, now.number),
                        lambda at_ns=at_ns: state_at(connection, at_ns, now.frame_id),  # type: ignore[misc]
                        stop,
                    )
                )
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

    def _found(self, asked: _Asked, found: Future[Work[Any]]) -> None:
        try:
            work = found.result()
            if work.cost_s > SMALL_S:
                # The journal is not held meanwhile.
                asked.doing = self._workers.submit(work.do, work.cost_s)
                asked.doing.add_done_callback(lambda done: self._done(asked, done))
                if asked.is_cancelled:
                    asked.doing.cancel()
                return
            value = work.do(lambda: asked.is_cancelled)
        except BaseException as error:  # noqa: BLE001  # told to who asked
            self._tell(asked, error=error)
        else:
            self._tell(asked, value)

    def _done(self, asked: _Asked, done: Future[Any]) -> None:
        try:
            value = done.result()
        except BaseException as error:  # noqa: BLE001  # told to who asked
            self._tell(asked, error=error)
        else:
            self._tell(asked, value)

    def _tell(self, asked: _Asked, value: Any = None, error: BaseException | None = None) -> None:
        self._asked.pop(asked.number, None)
        if asked.is_cancelled:
            return
        buffers: list[pickle.PickleBuffer] = []
        told = Told(asked.number, error is not None, _told_of(error) if error else value)
        try:
            text = pickle.dumps(told, 5, buffer_callback=buffers.append)
            if len(buffers) > 1:  # there is room for one
                buffers = []
                text = pickle.dumps(told, 5)
        except Exception as unfit:  # noqa: BLE001  # an answer of any kind may not be for pickling
            buffers = []
            text = pickle.dumps(Told(asked.number, True, _told_of(unfit)))
        bodies: list[memoryview] = [buffer.raw() for buffer in buffers]
        head = HEAD.pack(len(text), sum(map(len, bodies)))
        # Whoever sends waits until the parent has taken it: so much is kept for it, and no more.
        with self._sending, suppress(OSError):
            for part in (memoryview(head + text), *bodies):
                self._peer.sendall(part)


def _told_of(error: BaseException) -> BaseException:
    """An error as it can cross, with its trace as a note."""
    told = error
    try:
        pickle.loads(pickle.dumps(error))  # noqa: S301  # our own
    except Exception:  # noqa: BLE001  # there are those that cannot be made again
        told = RuntimeError(repr(error))
    trace = "".join(traceback.format_exception(error))
    told.add_note(f"in the process that looks back:\n{trace}")
    return told


def main() -> None:
    """Answer the parent on the socket that is the argument, until it ends, however that is."""
    # Ctrl-C and a service manager's signal to all are the parent's to act on.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    gc.freeze()
    Child(socket.socket(fileno=int(sys.argv[1]))).run()
    # At once: nobody waits for what is under way, and nothing here is to be put away.
    os._exit(0)
