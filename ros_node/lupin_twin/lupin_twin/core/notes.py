"""Notes by people on alarms, tags and the greenhouse, and which of them are in force. Pure.

A note never changes. To take one back, a person writes another of the kind `withdraw`, so that both
stay in the journal. Of two notes on one subject, the one made later is in force: they may have been
made in two places that could not reach each other. Times are ns of ROS time.
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
KINDS: Final = frozenset({ACKNOWLEDGE, SHELVE, COMMENT, WITHDRAW})
WITHDRAWN: Final = "note:"
# Longest time for which an alarm may be shelved.
SHELF_S: Final = 8 * 3_600
# At most this many notes of a journal are read: the latest.
MAX_NOTES: Final = 5_000


class NotesUnwritable(Exception):
    """A note cannot be written here, or not now; the message says why."""


@dataclass(frozen=True, slots=True)
class Note:
    """A person's note. `until_ns` of `shelve` is when it ends; None: the alarm is unshelved.

    Of `comment`, `until_ns` is the time that it is about; None: the time at which it was made.
    `id` is assigned when the note is written, and ascends in that order; empty: not written yet.
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
        """The time that the note is about."""
        is_of_then = self.kind == COMMENT and self.until_ns is not None
        return self.until_ns or 0 if is_of_then else self.made_at_ns


@dataclass(frozen=True, slots=True)
class NotesRequest:
    """Request for all notes, unless `journal` still has `count`: notes are never removed."""

    journal: str = ""
    count: int = -1


@dataclass(frozen=True, slots=True)
class PastNotes:
    """The latest `MAX_NOTES` notes in the order of their times; None: unchanged since the request.

    `journal` identifies the journal, which has `count` notes in all.
    """

    journal: str
    count: int
    notes: tuple[Note, ...] | None


def withdrawals(notes: Iterable[Note]) -> dict[str, Note]:
    """Map the id of each withdrawn note to the first note that withdrew it."""
    found: dict[str, Note] = {}
    for note in notes:
        if note.kind == WITHDRAW:
            found.setdefault(note.subject.removeprefix(WITHDRAWN), note)
    return found


def standing(notes: Iterable[Note], now_ns: int) -> dict[tuple[str, str], Note]:
    """Map subject and kind to the last note that was not withdrawn.

    Notes from after `now_ns`, which exist once a clock went back, are left out: a shelving ends
    when it should.
    """
    every = tuple(notes)
    gone = withdrawals(every)
    return {
        (note.subject, note.kind): note
        for note in every
        if note.kind != WITHDRAW and note.id not in gone and note.made_at_ns <= now_ns
    }
