"""All known alarms, in order; and the notes of people, with their effect on alarms.

A hundred thousand alarms do not block the event loop: a worker sorts them, and the loop takes over
the result. `AlarmBoard` and `NoteBoard` belong to the event loop; the rest is pure.

Every process looks for notes in its log once a second, even the one that writes them. So all
browsers and replicas get the same notes, and no process has to notify another.
"""

from __future__ import annotations

import contextlib
import heapq
import logging
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final, Literal

from lupin_bridge.feed.source import TwinSource, TwinUnavailableError
from lupin_bridge.feed.tasks import Periodic
from lupin_bridge.judge.episodes import MAX_EPISODES, Alarm
from lupin_bridge.judge.verdict import ORDER, Verdict
from lupin_bridge.serving.admission import RateLimit
from lupin_twin.core.notes import ACKNOWLEDGE, SHELVE, Note, NotesRequest, PastNotes, standing
from lupin_twin.core.past import NotRemembered, PastRefused

log = logging.getLogger(__name__)

# Active alarms sent to receivers with little room: Home Assistant keeps no attributes past 16 kB.
MAX_WORST: Final = 20


@dataclass(frozen=True, slots=True)
class Change:
    """What has changed: alarms that are new, worse or cleared, in the order of these events.

    An observation that is received late may withdraw an alarm. `is_past`: these were found when the
    past was read at the start, so receivers may have known them, by their ids, for long.
    """

    changed: tuple[Alarm, ...]
    withdrawn: tuple[Alarm, ...] = ()
    is_past: bool = False


# What the alarms are derived from: nothing yet, a journal, or what was received since the start.
AlarmSource = Literal["starting", "journal", "heard"]


@dataclass(frozen=True, slots=True)
class Board:
    """All alarms, and the active ones, newest first; the worst active ones; the active ones by tag.

    `number` grows with every change. `since_ns` is the moment of ROS time from which on alarms are
    known; None: not yet.
    """

    alarms: tuple[Alarm, ...] = ()
    active: tuple[Alarm, ...] = ()
    worst: tuple[Alarm, ...] = ()
    by_tag: Mapping[str, tuple[Alarm, ...]] = field(default_factory=dict)
    source: AlarmSource = "starting"
    since_ns: int | None = None
    number: int = 0


def board_of(alarms: Iterable[Alarm], since_ns: int = 0) -> Board:
    """The board of these alarms, without those cleared before `since_ns`."""
    kept = (alarm for alarm in alarms if not _is_over(alarm, since_ns))
    known = sorted(kept, key=lambda alarm: (-alarm.raised_at_ns, alarm.id))
    active = tuple(alarm for alarm in known if alarm.is_active)
    tags: dict[str, list[Alarm]] = {}
    for alarm in active:
        tags.setdefault(alarm.tag_id, []).append(alarm)
    return Board(
        tuple(known),
        active,
        tuple(heapq.nsmallest(MAX_WORST, active, key=worst_first)),
        {tag_id: tuple(mine) for tag_id, mine in tags.items()},
    )


def change_between(before: Board, now: Board, since_ns: int = 0) -> Change:
    """The change from one board to the next; alarms dropped for their age are not part of it."""
    gone = {alarm.id: alarm for alarm in before.alarms}
    changed = [alarm for alarm in now.alarms if gone.pop(alarm.id, None) != alarm]
    withdrawn = [
        alarm
        for alarm in gone.values()
        if not _is_over(alarm, since_ns) and not _is_dropped(alarm, now)
    ]
    return Change(tuple(sorted(changed, key=happened_ns)), tuple(withdrawn))


def _is_dropped(alarm: Alarm, now: Board) -> bool:
    """Whether the alarm was dropped because its tag has had too many since."""
    if alarm.cleared_at_ns is None:
        return False
    over = [it.cleared_at_ns for it in now.alarms if it.tag_id == alarm.tag_id]
    cleared = [cleared_ns for cleared_ns in over if cleared_ns is not None]
    return len(cleared) >= MAX_EPISODES and alarm.cleared_at_ns <= min(cleared)


def happened_ns(alarm: Alarm) -> int:
    """When the alarm last changed: when it was cleared or, if it is active, raised."""
    return alarm.raised_at_ns if alarm.cleared_at_ns is None else alarm.cleared_at_ns


def _is_over(alarm: Alarm, since_ns: int) -> bool:
    return alarm.cleared_at_ns is not None and alarm.cleared_at_ns < since_ns


def worst_first(alarm: Alarm) -> tuple[int, int, str]:
    """Sort key: the worst verdict first, then the newest alarm."""
    return ORDER[alarm.reason.verdict], -alarm.raised_at_ns, alarm.id


def active_first(alarm: Alarm) -> tuple[bool, tuple[int, int, str]]:
    """Sort key: active alarms, which need action, before cleared ones; each worst first."""
    return not alarm.is_active, worst_first(alarm)


class AlarmBoard:
    """Holds the newest `Board`; `on_change` is called with each change, and must not block."""

    def __init__(self, on_change: Callable[[Change], None] = lambda _: None) -> None:
        self.now = Board()
        self.on_change = on_change

    def put(self, found: Board, change: Change, source: AlarmSource, since_ns: int | None) -> None:
        """Make this the newest board; if nothing is new, `on_change` is not called."""
        before = self.now
        is_same = found.alarms is before.alarms
        if is_same and (source, since_ns) == (before.source, before.since_ns):
            return
        number = before.number + 1
        self.now = replace(found, source=source, since_ns=since_ns, number=number)
        self.on_change(change)


# --- the notes of people on alarms ----------------------------------------------------------------

POLL_S: Final = 1.0
OF_ALARM: Final = "alarm:"
# Notes that one name may write at once, and per minute after that.
NOTE_BURST: Final = 300
NOTES_PER_MINUTE: Final = 60


@dataclass(frozen=True, slots=True)
class AlarmNotes:
    """The notes in force on an alarm; None: there is no such note."""

    acknowledged: Note | None = None
    shelved: Note | None = None


NOTHING_SAID: Final = AlarmNotes()


def notes_of_alarms(
    alarms: Iterable[Alarm], notes: Iterable[Note], now_ns: int | None
) -> Mapping[str, AlarmNotes]:
    """The notes in force, by the id of their alarm."""
    if now_ns is None:
        return {}
    alarms = tuple(alarms)
    worse_ns = {alarm.id: alarm.worse_at_ns or 0 for alarm in alarms}
    found: dict[str, AlarmNotes] = {}
    shelves: dict[str, Note] = {}
    for (subject, kind), note in standing(notes, now_ns).items():
        name = subject.removeprefix(OF_ALARM)
        # An acknowledgement ends when the alarm gets worse.
        if kind == ACKNOWLEDGE and note.made_at_ns >= worse_ns.get(name, 0):
            found[name] = AlarmNotes(acknowledged=note)
        elif kind == SHELVE:
            shelves[name] = note
    for name, note in _shelved(alarms, shelves, now_ns).items() if shelves else ():
        found[name] = replace(found.get(name, NOTHING_SAID), shelved=note)
    return found


def _shelved(
    alarms: Sequence[Alarm], shelves: Mapping[str, Note], now_ns: int
) -> Mapping[str, Note]:
    """The note that shelves each alarm, by the alarm's id. It ends when the alarm gets worse.

    It also covers an alarm that returns: one of the same tag, kind, sensor and side. So of all
    notes on these, the last one holds, even if it ends the shelf.
    """
    noted = [(note, alarm) for alarm in alarms if (note := shelves.get(alarm.id)) is not None]
    noted.sort(key=lambda it: (it[0].made_at_ns, it[0].id))
    held = {
        alarm.cause: (note, ORDER[_verdict_at(alarm, note.made_at_ns)]) for note, alarm in noted
    }
    return {
        alarm.id: shelf[0]
        for alarm in alarms
        if (shelf := held.get(alarm.cause))
        and (shelf[0].until_ns or 0) > now_ns
        and ORDER[alarm.reason.verdict] >= shelf[1]
    }


def _verdict_at(alarm: Alarm, at_ns: int) -> Verdict:
    """The verdict of an alarm at a moment."""
    was_better = alarm.worse_at_ns is not None and at_ns < alarm.worse_at_ns
    return alarm.raised_as if was_better and alarm.raised_as else alarm.reason.verdict


class NoteBoard(Periodic):
    """The notes of the log; `on_change` is called when they have changed, which `number` counts.

    `pace` limits how fast each name may write. Start it once the source knows its log.
    """

    def __init__(self, source: TwinSource, on_change: Callable[[], None]) -> None:
        super().__init__(self._look_quietly, POLL_S, "the look for notes", 0.0)
        self._source = source
        self._on_change = on_change
        self._found: PastNotes | None = None
        self.number = 0
        self.pace = RateLimit(NOTES_PER_MINUTE / 60.0, NOTE_BURST)

    @property
    def notes(self) -> tuple[Note, ...] | None:
        """All known notes, in the order in which they were written; None: not read yet."""
        return None if self._found is None else self._found.notes

    @property
    def count(self) -> int:
        """How many notes the log has."""
        return 0 if self._found is None else self._found.count

    async def look(self) -> None:
        """Read new notes from the log.

        Raises:
            NotRemembered, PastRefused, TwinUnavailableError: the log cannot be read now.

        """
        known = self._found
        request = NotesRequest() if known is None else NotesRequest(known.journal, known.count)
        found = await self._source.notes(request)
        newest = self._found
        # Another call may have been quicker, and have read more.
        is_older = newest and newest.journal == found.journal and newest.count >= found.count
        if found.notes is not None and not is_older:
            self._found = found
            self.number += 1
            self._on_change()

    async def _look_quietly(self) -> None:
        # The notes stay as they were; requests that read the log report why.
        with contextlib.suppress(NotRemembered, PastRefused, TwinUnavailableError):
            await self.look()
