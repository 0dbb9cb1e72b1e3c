"""Queries for single writes (after a number, recent, of a period), exports, and notes.

An export reads a short stretch of time in each transaction. So a client that takes an hour for ten
million rows does not block checkpoints of the WAL meanwhile. A note has a number, as every write,
so that followers of the journal receive it.
"""

from __future__ import annotations

import math
import re
import secrets
import time
from collections import deque
from collections.abc import Callable, Collection, Iterator
from concurrent.futures import Future
from dataclasses import asdict, replace
from typing import Any, Final

from lupin_twin.core.notes import MAX_NOTES, Note, NotesRequest, NotesUnwritable, PastNotes
from lupin_twin.core.past import (
    MAX_SCANS,
    RECENT_COUNT,
    NotRemembered,
    PastRow,
    PastWrites,
    RunSpan,
    WritesRequest,
    recent_of,
)
from lupin_twin.core.state import Observation
from lupin_twin.journal import sql
from lupin_twin.journal.counts import deleted_ns
from lupin_twin.journal.rows import last_row, named_numbers, observations, scans_of, sensor_names
from lupin_twin.journal.runs import cut, runs, span_at, spans
from lupin_twin.journal.schema import SiteLog, one_view

# Approximate cost of a full answer of writes, s.
WRITES_S: Final = 0.05


def observed(connection: Any, start_ns: int, end_ns: int) -> PastWrites:
    """Return all writes in `start_ns <= stamp < end_ns`, by stamp and number, without copies.

    Each moment comes from the run that it belongs to. The caller has to choose a period that is not
    too much at once.
    """
    log = SiteLog(connection)
    axis = spans(runs(log.execute))
    found: list[Observation] = []
    for span in cut(axis, start_ns, end_ns):
        query = {"run": span.run, "start": span.start_ns, "end": span.end_ns}
        found += observations(log, sql.SCANS_OF_PERIOD, sql.INSPECTIONS_OF_PERIOD, query)
    found.sort(key=lambda write: (write.stamp_ns, write.number))
    return PastWrites(log.journal_id, axis, tuple(found), 0, is_all=True)


def recent(connection: Any, at_ns: int) -> tuple[Observation, ...]:
    """Return the writes that were recent at a moment, ns of ROS time: see `RECENT_COUNT`.

    They are scans with readings, and inspections that saw flowers, by stamp and number. They are of
    the run that contains the moment, without the copies that a run begins with.
    """
    log = SiteLog(connection)
    span = span_at(runs(log.execute), at_ns)
    if span is None:
        return ()
    query = {"run": span.run, "start": 0, "end": at_ns + 1, "more": RECENT_COUNT - 1}
    return recent_of(observations(log, sql.RECENT_SCANS, sql.RECENT_INSPECTIONS, query), at_ns)


def scans(
    connection: Any, since_ns: int, at_ns: int, sensors: Collection[str]
) -> tuple[Observation, ...]:
    """Return the scans with one of `sensors`, from `since_ns` to `at_ns`, both included.

    They are of the run that contains `at_ns`, without copies, by stamp and number. If there are
    more than `MAX_SCANS`, none is returned.
    """
    log = SiteLog(connection)
    span = span_at(runs(log.execute), at_ns)
    if span is None:
        return ()
    query = {"run": span.run, "start": since_ns, "end": at_ns + 1}
    select = f"{sql.SCANS_OF_PERIOD} AND kind = 0 LIMIT {MAX_SCANS + 1}"
    rows = log.execute(select, query).fetchall()
    if len(rows) > MAX_SCANS:
        return ()
    names = frozenset(sensors)
    wanted = {text: not names.isdisjoint(sensor_names(text)) for text in {row[0] for row in rows}}
    found = scans_of([row for row in rows if wanted[row[0]]])
    return tuple(sorted(found, key=lambda scan: (scan.stamp_ns, scan.number)))


def writes(connection: Any, request: WritesRequest) -> PastWrites:
    """Return the next writes, without copies."""
    log = SiteLog(connection)
    newest_seq = last_row(log)[0]
    after = request.after or _beginning(log, request, newest_seq)
    query = {"after": after, "count": request.max_count}
    found = observations(log, sql.NEXT_SCANS, sql.NEXT_INSPECTIONS, query)
    is_all = len(found) < request.max_count
    found = found[: request.max_count]
    last = max(newest_seq, after) if is_all else found[-1].number
    axis = spans(runs(log.execute))
    return PastWrites(log.journal_id, axis, tuple(found), last, is_all)


def _beginning(log: SiteLog, request: WritesRequest, high: int) -> int:
    """The number before the first requested write; bisects, as arrivals ascend with numbers."""
    low = max(0, high - request.reach_count) if request.reach_count else 0
    if not request.reach_s:
        return low
    since_ns = time.time_ns() - int(request.reach_s * 1e9)
    while low < high:
        middle = (low + high) // 2
        row = log.execute(sql.NEXT_ARRIVAL, {"after": middle}).fetchone()
        if row is None or row[1] >= since_ns:
            high = middle
        else:
            low = row[0]
    return low


# --- an export -----------------------------------------------------------------------------------

LOT: Final = 1_000
# Approximate number of readings that are read at once, and what that costs, s.
STRETCH: Final = 40_000
STRETCH_S: Final = 0.1
_FIRST_STRETCH_NS: Final = 60 * 1_000_000_000
_NOWHERE: Final = (math.nan, math.nan)
_NO_READING: Final = (("", math.nan),)


def rows(
    connection: Any,
    start_ns: int,
    end_ns: int,
    tag_id: str | None = None,
    sensor_type: str | None = None,
) -> Iterator[list[PastRow]]:
    """Yield the rows of an export in lots of at most `LOT`, see `Export`."""
    export = Export(start_ns, end_ns, tag_id, sensor_type)
    while True:
        with one_view(connection):
            found = export.step(connection)
        if found is None:
            return
        yield from lots(found)


def lots(found: list[PastRow]) -> Iterator[list[PastRow]]:
    """Split rows into lots of `LOT`."""
    for first in range(0, len(found), LOT):
        yield found[first : first + LOT]


class Export:
    """The rows of a period; None: all tags, or all sensors and attempts without a reading.

    Each step may use another connection. If rows of the period are deleted meanwhile, the export
    fails, so that it does not look complete.
    """

    def __init__(
        self, start_ns: int, end_ns: int, tag_id: str | None, sensor_type: str | None
    ) -> None:
        self._period = (start_ns, end_ns)
        self._tag_id = tag_id
        self._sensor_type = sensor_type
        self._spans: deque[RunSpan] | None = None
        self._at_ns = 0
        self._length_ns = _FIRST_STRETCH_NS
        self._run: int | None = None
        self._places: dict[str, tuple[float, float]] = {}
        # By run, the last stamp that was already deleted when the first row was returned.
        self._deleted_ns: dict[int, int] = {}
        self._has_begun = False

    def step(self, connection: Any) -> list[PastRow] | None:
        """Return the rows of the next stretch of time, maybe none; None at the end.

        Raises:
            NotRemembered: rows that come next were deleted since the first ones were returned.

        """
        log = SiteLog(connection)
        if self._spans is None:
            self._spans = deque(cut(spans(runs(log.execute)), *self._period))
        if not self._has_begun:
            self._deleted_ns = {s.run: deleted_ns(log, s.run) for s in self._spans}
        while self._spans and self._spans[0].end_ns <= self._at_ns:
            self._spans.popleft()
        return self._stretch(log, self._spans[0]) if self._spans else None

    def _stretch(self, log: SiteLog, span: RunSpan) -> list[PastRow]:
        if self._run != span.run:
            self._run, self._places = span.run, _places(log, span.run)
        start_ns = max(self._at_ns, span.start_ns)
        horizon_ns = deleted_ns(log, span.run)
        if horizon_ns >= start_ns and horizon_ns > self._deleted_ns[span.run]:
            why = "scans that come next were deleted while others were taken: begin again"
            raise NotRemembered(why)
        while True:
            until_ns = min(start_ns + self._length_ns, span.end_ns)
            # The scans of one stamp cannot be divided.
            limit = "" if self._length_ns == 1 else f" LIMIT {STRETCH}"
            scans = self._ask(log, sql.EXPORTED + limit, start_ns, until_ns)
            read = sum(1 + scan[-1].count(",") for scan in scans)
            if self._length_ns == 1 or read < STRETCH:
                break
            self._length_ns = max(1, self._length_ns // 8)
        self._at_ns = until_ns
        if not scans:
            ((next_ns,),) = self._ask(log, sql.FIRST_STAMP, until_ns, span.end_ns)
            self._at_ns = span.end_ns if next_ns is None else next_ns
        more = STRETCH / 4 / max(read, STRETCH // 32)
        self._length_ns = max(1, int(self._length_ns * more))
        self._has_begun |= bool(scans)
        return self._read(sorted(scans))

    def _ask(self, log: SiteLog, select: str, start_ns: int, end_ns: int) -> list[tuple[Any, ...]]:
        assert self._run is not None
        query = {"run": self._run, "tag": self._tag_id, "start": start_ns, "end": end_ns}
        return list(log.execute(sql.of_tag(select, self._tag_id), query).fetchall())

    def _read(self, scans: list[tuple[Any, ...]]) -> list[PastRow]:
        found: list[PastRow] = []
        every = named_numbers((scan[3] for scan in scans), [scan[-1] for scan in scans])
        for (stamp_ns, _, tag, _, status, source, _), (names, values) in zip(
            scans, every, strict=True
        ):
            x, y = self._places.get(tag, _NOWHERE)
            readings = zip(names, values, strict=True) if values else _NO_READING
            found += [
                PastRow(stamp_ns, tag, x, y, sensor, value, status, source)
                for sensor, value in readings
                if self._sensor_type in (None, sensor)
            ]
        return found


def _places(log: SiteLog, run: int) -> dict[str, tuple[float, float]]:
    """Position of each tag: its first row in the run counts, copies included."""
    found = log.execute(sql.PLACES, {"run": run}).fetchall()
    return {row[1]: (row[5], row[6]) for row in reversed(found)}


# --- notes ----------------------------------------------------------------------------------------

# An id is the number of the write, in hexadecimal digits that sort as it does, and random digits.
# An archive may hold the notes of several journals of one site, which use the same numbers.
_DIGITS: Final = 16
_OURS: Final = re.compile(rf"[0-9a-f]{{{_DIGITS}}}", re.ASCII)
# No journal has as many; the limit of SQLite is twice that.
_MOST: Final = 2**62
# Approximate cost of a query for notes, s of one core.
NOTES_S: Final = 0.02


def id_behind(number: int) -> str:
    """A text that sorts after every id up to that number, and before all later ids."""
    return f"{number + 1:0{_DIGITS}x}"


def number_of(note_id: str) -> int:
    """The number in an id; 0 if another program made the id."""
    if _OURS.match(note_id) is None:
        return 0
    number = int(note_id[:_DIGITS], 16)
    return number if number < _MOST else 0


def last_number(log: SiteLog) -> int:
    """The number of the journal's last note; 0 if there is none."""
    # In descending order, skipping ids of other programs.
    found = log.execute(sql.NOTE_IDS)
    return next((number for (text,) in found if (number := number_of(text))), 0)


def put_note(log: SiteLog, number: int, note: Note) -> Note:
    """Write a note under a number; returns it with its id.

    One that has an id was written elsewhere: it keeps that, and is written once.
    """
    if not note.id:
        note = replace(note, id=f"{number:0{_DIGITS}x}{secrets.token_hex(4)}")
    log.execute(
        "INSERT INTO note VALUES (:site, :id, :made_at_ns, :by, :kind, :subject, :text, :until_ns)"
        " ON CONFLICT DO NOTHING",
        asdict(note),
    )
    return note


def notes(connection: Any, request: NotesRequest) -> PastNotes:
    """Return the notes of a journal."""
    log = SiteLog(connection)
    journal = log.journal_id
    (count,) = log.execute(sql.NOTE_COUNT).fetchone()
    if (journal, count) == (request.journal, request.count):
        return PastNotes(journal, count, None)
    rows = log.execute(sql.NEWEST_NOTES, {"most": MAX_NOTES}).fetchall()
    # Not by id alone: notes from elsewhere have numbers of their own.
    found = sorted((Note(*row) for row in rows), key=lambda note: (note.made_at_ns, note.id))
    return PastNotes(journal, count, tuple(found))


# Notes that may wait: more than people write while a disk is slow.
_MAX_WAITING: Final = 100


class NoteQueue:
    """A queue of notes to the thread that writes; any thread may use it.

    If the caller gives up waiting and cancels the future, the note is not written.
    """

    def __init__(self) -> None:
        self._waiting: deque[tuple[Note, Future[Note]]] = deque()

    def put(self, note: Note) -> Future[Note]:
        """Queue a note; the future's result is the note with its id."""
        written: Future[Note] = Future()
        if len(self._waiting) >= _MAX_WAITING:
            written.set_exception(NotesUnwritable(f"{_MAX_WAITING} notes wait for the disk"))
        else:
            self._waiting.append((note, written))
        return written

    def write(self, put: Callable[[Note], Note]) -> None:
        """Write all waiting notes with `put`.

        Raises:
            Exception: what `put` raised, after the note's future has failed.

        """
        for note, written in self._taken():
            try:
                written.set_result(put(note))
            except BaseException as error:
                written.set_exception(NotesUnwritable(f"the note was not written: {error}"))
                raise

    def refuse(self, why: str) -> None:
        """Fail all waiting notes, with this reason."""
        for _, written in self._taken():
            written.set_exception(NotesUnwritable(f"no note can be written now: {why}"))

    def _taken(self) -> Iterator[tuple[Note, Future[Note]]]:
        while True:
            try:
                note, written = self._waiting.popleft()
            except IndexError:
                return
            if written.set_running_or_notify_cancel():
                yield note, written
