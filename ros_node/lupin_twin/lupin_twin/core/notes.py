"""What people say of alarms, tags and the greenhouse: rows of the log, and what of them stands.

A note is never changed. Who takes one back writes another of the kind `withdraw`, so that both are
kept; of two words on one subject the one that was written later stands.
Times are ns of ROS time. Pure.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

ACKNOWLEDGE: Final = "acknowledge"
SHELVE: Final = "shelve"
COMMENT: Final = "comment"
# Its subject is `note:ID`.
WITHDRAW: Final = "withdraw"
WITHDRAWN: Final = "note:"
# Notes that are known of a log at most, the newest.
MAX_NOTES: Final = 5_000


class NotesUnwritable(Exception):
    """A note cannot be written here, or not now; the message says why."""


@dataclass(frozen=True, slots=True)
class Note:
    """One word. `until_ns` of `shelve` is its end, None: the alarm is not shelved any more.

    Of `comment` it is the moment that it is about, None: that at which it was made.
    `id` is given when it is written, and ascends in that order.
    """

    id: str
    made_at_ns: int
    by: str
    kind: str
    subject: str
    text: str = ""
    until_ns: int | None = None

    @property
    def about_ns(self) -> int:
        """The moment that it is about."""
        is_of_then = self.kind == COMMENT and self.until_ns is not None
        return self.until_ns or 0 if is_of_then else self.made_at_ns


@dataclass(frozen=True, slots=True)
class NotesRequest:
    """All notes, unless the log is still this one, with so many: notes only ever come."""

    journal: str = ""
    count: int = -1


@dataclass(frozen=True, slots=True)
class PastNotes:
    """The newest `MAX_NOTES` in the order in which they were written; None: as the request says.

    `journal` identifies their log, which has `count` of them in all.
    """

    journal: str
    count: int
    notes: tuple[Note, ...] | None


def withdrawals(notes: Iterable[Note]) -> dict[str, Note]:
    """By the id of each note that was taken back, the note that did so first."""
    found: dict[str, Note] = {}
    for note in notes:
        if note.kind == WITHDRAW:
            found.setdefault(note.subject.removeprefix(WITHDRAWN), note)
    return found


def standing(notes: Iterable[Note], now_ns: int) -> dict[tuple[str, str], Note]:
    """By subject and kind, the last note that nobody took back.

    What a clock that went back has not come to again is left out: a shelf ends in its time.
    """
    every = tuple(notes)
    gone = withdrawals(every)
    return {
        (note.subject, note.kind): note
        for note in every
        if note.kind != WITHDRAW and note.id not in gone and note.made_at_ns <= now_ns
    }
