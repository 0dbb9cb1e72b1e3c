"""What people said, as the log has it, and what of it stands of each alarm. On the event loop.

Every process looks for notes in its log once a second, the one that writes them too: so all
browsers and replicas are told the same, and nobody has to tell anybody.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

from lupin_bridge.feed.shared_work import Periodic
from lupin_bridge.feed.source import TwinSource, TwinUnavailableError
from lupin_bridge.judge.episodes import Alarm
from lupin_bridge.judge.verdict import Verdict
from lupin_bridge.rate_limit import RateLimit
from lupin_twin.core.notes import ACKNOWLEDGE, SHELVE, Note, NotesRequest, PastNotes, standing
from lupin_twin.core.past import NotRemembered, PastRefused

POLL_S: Final = 1.0
OF_ALARM: Final = "alarm:"
# Notes that one name may write at once, and a minute from then on.
NOTE_BURST: Final = 300
NOTES_PER_MINUTE: Final = 60
_ORDER: Final = {verdict: index for index, verdict in enumerate(Verdict)}


@dataclass(frozen=True, slots=True)
class AlarmNotes:
    """What stands of an alarm; None: nobody has said so. Times are ns of ROS time."""

    acknowledged: Note | None = None
    shelved: Note | None = None


NOTHING_SAID: Final = AlarmNotes()


def notes_of_alarms(
    alarms: Iterable[Alarm], notes: Iterable[Note], now_ns: int | None
) -> Mapping[str, AlarmNotes]:
    """By the id of each alarm that anybody has said something of."""
    if now_ns is None:
        return {}
    alarms = tuple(alarms)
    worse_ns = {alarm.id: alarm.worse_at_ns or 0 for alarm in alarms}
    found: dict[str, AlarmNotes] = {}
    shelves: dict[str, Note] = {}
    for (subject, kind), note in standing(notes, now_ns).items():
        name = subject.removeprefix(OF_ALARM)
        # Nobody has acknowledged what an alarm became later.
        if kind == ACKNOWLEDGE and note.made_at_ns >= worse_ns.get(name, 0):
            found[name] = AlarmNotes(acknowledged=note)
        elif kind == SHELVE and (note.until_ns or 0) > now_ns:
            shelves[name] = note
    for name, note in _shelved(alarms, shelves).items() if shelves else ():
        found[name] = replace(found.get(name, NOTHING_SAID), shelved=note)
    return found


def _shelved(alarms: Sequence[Alarm], shelves: Mapping[str, Note]) -> Mapping[str, Note]:
    """A shelf holds also for an alarm that returns meanwhile. It ends when the alarm gets worse.

    What comes back is an alarm of the same tag, kind, sensor and side.
    """
    held: dict[tuple[object, ...], tuple[Note, int]] = {}
    for alarm in alarms:
        note = shelves.get(alarm.id)
        known = held.get(_what(alarm))
        if note is not None and (known is None or known[0].id < note.id):
            held[_what(alarm)] = note, _ORDER[_verdict_at(alarm, note.made_at_ns)]
    return {
        alarm.id: shelf[0]
        for alarm in alarms
        if (shelf := held.get(_what(alarm))) and _ORDER[alarm.reason.verdict] >= shelf[1]
    }


def _verdict_at(alarm: Alarm, at_ns: int) -> Verdict:
    """How bad it was at a moment."""
    was_better = alarm.worse_at_ns is not None and at_ns < alarm.worse_at_ns
    return alarm.raised_as if was_better and alarm.raised_as else alarm.reason.verdict


def _what(alarm: Alarm) -> tuple[object, ...]:
    reason = alarm.reason
    value, limit = reason.value, reason.limit
    is_low = value is not None and limit is not None and value < limit
    return alarm.tag_id, reason.kind, reason.sensor, is_low


class NoteBoard(Periodic):
    """The notes of the log; `on_change` is called when there are others. `number` counts that.

    `pace` is how fast each name may write. It looks from `start` on: the source knows its log then.
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
        """All that are known, in the order in which they were written; None: not looked yet."""
        return None if self._found is None else self._found.notes

    @property
    def count(self) -> int:
        """How many the log has."""
        return 0 if self._found is None else self._found.count

    async def look(self) -> None:
        """See whether there are others.

        Raises:
            NotRemembered, PastRefused, TwinUnavailableError: the log cannot be read now.

        """
        known = self._found
        request = NotesRequest() if known is None else NotesRequest(known.journal, known.count)
        found = await self._source.notes(request)
        newest = self._found
        # Another look may have been quicker, and has seen more.
        is_older = newest and newest.journal == found.journal and newest.count >= found.count
        if found.notes is not None and not is_older:
            self._found = found
            self.number += 1
            self._on_change()

    async def _look_quietly(self) -> None:
        # They are as they were; whoever asks the log for more is told why.
        with contextlib.suppress(NotRemembered, PastRefused, TwinUnavailableError):
            await self.look()
