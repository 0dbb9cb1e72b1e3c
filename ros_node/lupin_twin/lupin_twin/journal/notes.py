"""Notes in the log, one number each as every write, so that whoever follows the log has them."""

from __future__ import annotations

import re
import secrets
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from dataclasses import asdict, replace
from typing import Any, Final

from lupin_twin.core.notes import MAX_NOTES, Note, NotesRequest, NotesUnwritable, PastNotes
from lupin_twin.journal.schema import SiteLog

# An id is the number of the write, in hexadecimal digits that sort as it does, and digits of
# chance: an archive has the notes of several journals of one site, whose numbers are the same.
_DIGITS: Final = 16
_OURS: Final = re.compile(rf"[0-9a-f]{{{_DIGITS}}}", re.ASCII)
# No log counts so far; SQLite counts to twice that.
_MOST: Final = 2**62
_COUNT: Final = "SELECT count(*) FROM note WHERE site = :site"
_NEWEST: Final = (
    "SELECT id, made_at_ns, made_by, kind, subject, text, until_ns FROM note WHERE site = :site"
    " ORDER BY made_at_ns DESC, id DESC LIMIT :most"
)
# What looking for notes takes, about, s of one core.
NOTES_S: Final = 0.02


def id_behind(number: int) -> str:
    """A text that sorts behind every id up to that number, and before those past it."""
    return f"{number + 1:0{_DIGITS}x}"


def number_of(note_id: str) -> int:
    """The number of the write; 0: somebody else has given the id."""
    if _OURS.match(note_id) is None:
        return 0
    number = int(note_id[:_DIGITS], 16)
    return number if number < _MOST else 0


def last_number(log: SiteLog) -> int:
    """The number of the log's last note; 0: there is none."""
    # Downwards, past those of somebody else.
    found = log.execute("SELECT id FROM note WHERE site = :site ORDER BY id DESC")
    return next((number for (text,) in found if (number := number_of(text))), 0)


def put_note(log: SiteLog, number: int, note: Note) -> Note:
    """Write a note under a number; returns it with its id."""
    note = replace(note, id=f"{number:0{_DIGITS}x}{secrets.token_hex(4)}")
    log.execute(
        "INSERT INTO note VALUES (:site, :id, :made_at_ns, :by, :kind, :subject, :text, :until_ns)",
        asdict(note),
    )
    return note


def notes(connection: Any, request: NotesRequest) -> PastNotes:
    """What a log has of notes."""
    log = SiteLog(connection)
    journal = log.journal_id
    (count,) = log.execute(_COUNT).fetchone()
    if (journal, count) == (request.journal, request.count):
        return PastNotes(journal, count, None)
    rows = log.execute(_NEWEST, {"most": MAX_NOTES}).fetchall()
    found = sorted((Note(*row) for row in rows), key=lambda note: note.id)
    return PastNotes(journal, count, tuple(found))


# People write none faster than a disk.
_MAX_WAITING: Final = 100


class NoteQueue:
    """Notes on their way from whoever says them to the thread that writes; for any thread.

    Whoever gives up waiting cancels the future, and the note is not written.
    """

    def __init__(self) -> None:
        self._waiting: deque[tuple[Note, Future[Note]]] = deque()

    def put(self, note: Note) -> Future[Note]:
        """Hand a note over; the future gets it with its id."""
        written: Future[Note] = Future()
        if len(self._waiting) >= _MAX_WAITING:
            written.set_exception(NotesUnwritable(f"{_MAX_WAITING} notes wait for the disk"))
        else:
            self._waiting.append((note, written))
        return written

    def write(self, put: Callable[[Note], Note]) -> None:
        """Have all that wait written.

        Raises:
            Exception: what `put` raised, once the note's future has it.

        """
        for note, written in self._taken():
            try:
                written.set_result(put(note))
            except BaseException as error:
                written.set_exception(NotesUnwritable(f"the note was not written: {error}"))
                raise

    def refuse(self, why: str) -> None:
        """Let none wait any longer."""
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
