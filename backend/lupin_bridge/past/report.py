"""The shift report: what happened between two moments, as the log has it up to the second one.

It is the same at any later time, and from any process: nothing in it depends on what came later.
Observations are read in the order of time, in lots; the work can be cancelled between two lots.
"""

from __future__ import annotations

import heapq
from array import array
from collections import Counter, defaultdict, deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

import orjson

from lupin_bridge.alarms.board import active_first, notes_of_alarms
from lupin_bridge.feed.query import LogReader
from lupin_bridge.judge.alarm_fold import AlarmFold
from lupin_bridge.judge.episodes import readings_of
from lupin_bridge.judge.judging import Criteria
from lupin_bridge.judge.verdict import Verdict, derive
from lupin_bridge.past import bodies
from lupin_bridge.past.plans import Plan, of_content
from lupin_bridge.serving.admission import content_answer
from lupin_bridge.stream.state_json import alarm_json, note_json, stamp
from lupin_twin.core.diagnostics import Condition
from lupin_twin.core.notes import WITHDRAW, Note, NotesRequest, withdrawals
from lupin_twin.core.past import (
    EVERY_TAG,
    HOUR_NS,
    RECENT_COUNT,
    Event,
    PastRefused,
    PastWrites,
    RunSpan,
    SeriesRequest,
    silence_ns,
)
from lupin_twin.core.state import KIND_FLOWER, STATUS_OK, Observation

# A day at one scan a second has 86,400. Each takes some 25 us, and three times that where alarms
# are derived; an answer has ten seconds.
MAX_WRITES: Final = 100_000
ALARM_WRITES: Final = 40_000
# Cleared alarms kept per tag: more than a hundred a day for a month.
MAX_EPISODES: Final = 5_000
# How long before the period alarms are derived: one that began then may go on.
LEAD_NS: Final = 7 * 24 * HOUR_NS
_LOT: Final = 2_000
# Entries of each list; `left_out` counts the others.
MAX_LISTED: Final = 500
# Rough cost of a report, s of one core.
REPORT_S: Final = 3.0

Stretch = tuple[int, int]


@dataclass(frozen=True, slots=True)
class Report:
    """The report of `start_ns <= t < end_ns`, as JSON; see `report_page.ReportPage` for paper."""

    start_ns: int
    end_ns: int
    criteria: Criteria = field(compare=False)
    journal: Condition = field(compare=False)

    @property
    def known_ns(self) -> int:
        """Up to when the log is complete: until then, a silence in it was one."""
        return bodies.complete_to(self.journal, self.end_ns) or self.end_ns

    def cost_s(self, tags: int) -> float:  # noqa: ARG002
        """See `plans.Query`."""
        return REPORT_S

    def look(self, log: LogReader) -> Plan:
        """See `plans.Query`.

        Raises:
            PastRefused: more was observed in the period than one report may cover.

        """
        hours = self._per_hour(log)
        alarms_ns = self._alarms_from(hours)
        fold = _Fold(self, alarms_ns)
        for stretch in _stretches(hours, min(self.start_ns, alarms_ns), self.end_ns):
            fold.take(log.observed(*stretch))
        notes, snapshot = log.notes(NotesRequest()).notes or (), log.state(self.end_ns - 1)
        known = [tag.tag_id for tag in snapshot.tags]
        return self.plan(fold.body(notes, known))

    def plan(self, body: dict[str, Any]) -> Plan:
        """The plan of the answer."""
        return of_content(content_answer(orjson.dumps(body), headers=self._headers()))

    def _headers(self) -> dict[str, str]:
        return bodies.period_headers(self.journal, self.start_ns, self.end_ns)

    def _per_hour(self, log: LogReader) -> Counter[int]:
        """How much was observed in each hour, of the lead and the period; keys are ns."""
        first_ns = max(1, self.start_ns - LEAD_NS) // HOUR_NS * HOUR_NS
        end_ns = -(-self.end_ns // HOUR_NS) * HOUR_NS
        found: Counter[int] = Counter()
        for event in (Event.SCANS, Event.FAILURES, Event.INSPECTIONS):
            points = max(1, (end_ns - first_ns) // HOUR_NS)
            past = log.series(SeriesRequest(EVERY_TAG, event, first_ns, end_ns, points))
            for at_ns, n in zip(past.stamps_ns, past.counts, strict=True):
                found[at_ns // HOUR_NS * HOUR_NS] += n
        return found

    def _alarms_from(self, hours: Counter[int]) -> int:
        """From when on alarms are derived: from at most `ALARM_WRITES` before the end."""
        period = sum(n for at_ns, n in hours.items() if at_ns + HOUR_NS > self.start_ns)
        if period > MAX_WRITES:
            raise PastRefused(
                f"from and to have about {period} scans and inspections between them, the limit "
                f"is {MAX_WRITES}: ask for a shorter period"
            )
        total, from_ns = 0, self.end_ns
        for at_ns in sorted(hours, reverse=True):
            total += hours[at_ns]
            if total > ALARM_WRITES:
                return from_ns
            from_ns = min(from_ns, at_ns)
        return max(0, self.start_ns - LEAD_NS)


def _stretches(hours: Counter[int], start_ns: int, end_ns: int) -> Iterator[Stretch]:
    """Yield all of a period, in stretches with about a lot in each."""
    count, from_ns = 0, start_ns
    for at_ns in sorted(hours):
        if count and count + hours[at_ns] > _LOT and from_ns < at_ns < end_ns:
            yield from_ns, at_ns
            count, from_ns = 0, at_ns
        count += hours[at_ns]
    if from_ns < end_ns:
        yield from_ns, end_ns


@dataclass(slots=True)
class _Extremes:
    """Mean and extremes of one sensor's readings; of equal extremes, the first counts."""

    n: int = 0
    failed: int = 0
    mean: float = 0.0
    low: tuple[float, str, int] | None = None
    high: tuple[float, str, int] | None = None

    def add(self, value: float, write: Observation) -> None:
        self.n += 1
        self.mean += (value - self.mean) / self.n
        if self.low is None or value < self.low[0]:
            self.low = value, write.tag_id, write.stamp_ns
        if self.high is None or value > self.high[0]:
            self.high = value, write.tag_id, write.stamp_ns


class _Fold:
    """Takes writes in the order of time, and makes the body of the report from them."""

    def __init__(self, of: Report, alarms_ns: int) -> None:
        self._of = of
        self._alarms_ns = alarms_ns
        self._alarm_fold: AlarmFold | None = None
        self._sensors: defaultdict[str, _Extremes] = defaultdict(_Extremes)
        self._counts = Counter({"scans": 0, "failed": 0, "inspections": 0})
        self._scanned: set[str] = set()
        # The stamps of all attempts, and of the last ones of each tag; before the period too.
        self._attempted_ns = array("q")
        self._recent_ns = defaultdict[str, deque[int]](lambda: deque(maxlen=RECENT_COUNT))

    def take(self, found: PastWrites) -> None:
        """Take the next writes."""
        for write in found.writes:
            self._attempted_ns.append(write.stamp_ns)
            recent_ns = self._recent_ns[write.tag_id]
            if write.kind != KIND_FLOWER and write.stamp_ns not in recent_ns:
                recent_ns.append(write.stamp_ns)
            if write.stamp_ns >= self._of.start_ns:
                self._count(write)
        if self._alarm_fold is None:
            self._alarm_fold = self._new(found.spans)
        self._alarm_fold.take(it for it in found.writes if it.stamp_ns >= self._alarms_ns)
        if found.writes:
            # The result is not used, but so the work is done lot by lot.
            self._alarm_fold.found(found.writes[-1].stamp_ns)

    def _new(self, spans: Sequence[RunSpan]) -> AlarmFold:
        by, end_ns = self._of.criteria, self._of.end_ns
        # Without what came later: it was not known then.
        cut = [replace(it, end_ns=min(it.end_ns, end_ns)) for it in spans if it.start_ns < end_ns]
        return AlarmFold(by, cut, kept=2 * MAX_WRITES, max_episodes=MAX_EPISODES)

    def _count(self, write: Observation) -> None:
        if write.status != STATUS_OK:
            self._counts["failed"] += 1
        elif write.kind == KIND_FLOWER:
            self._counts["inspections"] += 1
        else:
            self._counts["scans"] += 1
            self._scanned.add(write.tag_id)
        # A failed attempt may have readings all the same.
        readings = readings_of([write])
        for reading in (*readings, *derive(readings)):
            of = self._sensors[reading.name]
            if self._of.criteria.sensors.named(reading.name).is_plausible(reading.value):
                of.add(reading.value, write)
            else:
                of.failed += 1

    # --- the body ---------------------------------------------------------------------------------

    def body(self, notes: Sequence[Note], known: Sequence[str]) -> dict[str, Any]:
        """`routes_schema.ShiftReport`; `known` are the tags known at its end."""
        start_ns, end_ns = self._of.start_ns, self._of.end_ns
        notes = [note for note in notes if note.made_at_ns < end_ns]
        known_ns = self._of.known_ns - 1
        every = self._alarm_fold.found(known_ns).alarms if self._alarm_fold else ()
        # As they were at the end of the period, if they were active at any time of it.
        alarms = [
            alarm
            for alarm in every
            if alarm.raised_at_ns < end_ns
            and (alarm.cleared_at_ns is None or alarm.cleared_at_ns >= start_ns)
        ]
        # An alarm that came back stays shelved by a note on the one before it.
        said = notes_of_alarms(every, notes, end_ns)
        gone = withdrawals(notes)
        spoken = [it for it in notes if it.kind != WITHDRAW and it.made_at_ns >= start_ns]
        silences = self._silences()
        never = sorted({*known} - self._scanned)
        order = {name: index for index, name in enumerate(self._of.criteria.sensors.by_name)}
        sensors = sorted(self._sensors, key=lambda name: (order.get(name, len(order)), name))
        active = [alarm for alarm in alarms if alarm.is_active]
        return {
            **bodies.stretch(start_ns, end_ns),
            "counts": {
                "raised": sum(alarm.raised_at_ns >= start_ns for alarm in alarms),
                "cleared": len(alarms) - len(active),
                "active": len(active),
                "critical": sum(alarm.reason.verdict is Verdict.CRITICAL for alarm in active),
                "notes": len(spoken),
                **self._counts,
                "tags": len(known),
                "tags_scanned": len(known) - len(never),
            },
            "alarms_from": stamp(min(max(self._alarms_ns, start_ns), end_ns)),
            "alarms": [
                alarm_json(alarm, said.get(alarm.id))
                for alarm in heapq.nsmallest(MAX_LISTED, alarms, key=active_first)
            ],
            "notes": [note_json(note, gone) for note in spoken[::-1][:MAX_LISTED]],
            "silences": [bodies.stretch(*silence) for silence in silences[:MAX_LISTED]],
            "sensors": [self._of_sensor(name) for name in sensors[:MAX_LISTED]],
            "never_scanned": never[:MAX_LISTED],
            "left_out": {
                name: max(0, count - MAX_LISTED)
                for name, count in {
                    "alarms": len(alarms),
                    "notes": len(spoken),
                    "silences": len(silences),
                    "sensors": len(sensors),
                    "never_scanned": len(never),
                }.items()
            },
            **bodies.period_fields(self._of.journal, start_ns, end_ns),
        }

    def _of_sensor(self, name: str) -> dict[str, Any]:
        of = self._sensors[name]

        def extreme(found: tuple[float, str, int] | None) -> dict[str, Any] | None:
            if found is None:
                return None
            return {"value": found[0], "tag_id": found[1], "stamp": stamp(found[2])}

        return {
            "sensor_type": name,
            "unit": self._of.criteria.sensors.named(name).unit,
            "n": of.n,
            "failed": of.failed,
            "mean": of.mean if of.n else None,
            "low": extreme(of.low),
            "high": extreme(of.high),
        }

    def _silences(self) -> list[Stretch]:
        """The times without an attempt at any tag; before the first one, there is none."""
        longest_ns = silence_ns([list(recent_ns) for recent_ns in self._recent_ns.values()])
        until_ns = [*self._attempted_ns[1:], self._of.known_ns]
        return [
            (max(from_ns, self._of.start_ns), to_ns)
            for from_ns, to_ns in zip(self._attempted_ns, until_ns, strict=False)
            if to_ns - from_ns > longest_ns and to_ns > self._of.start_ns
        ]
