"""What is asked of the past, as values: each says what it has to know, and makes the answer of it.

They cross to whoever knows that, and what comes back is finished: the ETag, and the body for who
has not got it.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Mapping
from dataclasses import dataclass, field, replace
from hashlib import blake2b
from pickle import PickleBuffer
from typing import Any, Final, Protocol

import orjson

from lupin_bridge.field import query as field_query
from lupin_bridge.field.formats import FieldFormat
from lupin_bridge.judge.choosing import Criteria
from lupin_bridge.judge.daily import DAILY
from lupin_bridge.judge.derived import DERIVED
from lupin_bridge.past import as_of, complete, derived, history, timeline
from lupin_bridge.past.as_of import FieldAsked, Plan, Written
from lupin_bridge.past.query import TimelineQuery
from lupin_bridge.past.timeline import Parts
from lupin_bridge.twin.looking import Found, Need, Work
from lupin_twin.fields import FieldRefused, cost_s
from lupin_twin.journal.condition import Condition
from lupin_twin.journal.fold import STATE_S_PER_TAG
from lupin_twin.journal.queries import SERIES_S, SERIES_S_PER_TAG
from lupin_twin.past import (
    DEFAULT_POINTS,
    EVERY_TAG,
    MAX_POINTS,
    Event,
    SeriesPast,
    SeriesRequest,
)
from lupin_twin.past_writes import PastWrite, RecentRequest
from lupin_twin.state import Snapshot

# A larger body goes by itself, and is not copied.
_LARGE_BYTES: Final = 65_536
# What planning an answer takes for each tag, roughly and at worst.
_PLAN_TAG_S: Final = 10e-6
# What is too large to be estimated, or will be refused.
_LARGE_S: Final = 1.0


class NoSuchTag(LookupError):  # it says what there is not
    """The tag was not known then; `known` others were."""

    def __init__(self, tag_id: str, known: int) -> None:
        super().__init__(tag_id, known)
        self.tag_id, self.known = tag_id, known


@dataclass(frozen=True, slots=True)
class Answered:
    """The ETag of an answer; `written` is None where that is had already."""

    etag: str
    written: Written | None

    def __reduce__(self) -> tuple[Any, ...]:
        """A large body goes as a buffer of its own."""
        if self.written is None:
            return Answered, (self.etag, None)
        body, *rest = self.written.body, self.written.media_type, self.written.headers
        sent = PickleBuffer(body) if len(body) > _LARGE_BYTES else body
        return _answered, (self.etag, sent, *rest)


def _answered(
    etag: str, body: bytes | memoryview, media_type: str, headers: dict[str, str]
) -> Answered:
    return Answered(etag, Written(body, media_type, headers))


class Asked(Protocol):
    """What is asked; of equal ones there is one answer at a time. It can be pickled."""

    def cost_s(self, tags: int) -> float:
        """About what all of it takes in a house of so many tags, s of one core.

        That is whatever is looked up for it, and making the answer.
        """

    def look(self) -> Generator[Need, Found, Plan]:
        """Yield what it has to know, get that, return the plan of the answer."""


@dataclass(frozen=True, slots=True)
class Answering:
    """The question that is answered for who has these ETags, as in If-None-Match."""

    asked: Asked
    has: str = ""

    def look(self) -> Generator[Need, Found, Work[Answered]]:
        """See `Question`."""
        plan = yield from self.asked.look()
        if field_query.matches(self.has, plan.etag):
            return Work(0.0, lambda _: Answered(plan.etag, None))
        return Work(plan.cost_s, lambda stop: Answered(plan.etag, plan.write(stop)))


# --- as of a moment -------------------------------------------------------------------------------


class OfState(Protocol):
    """What is asked of a state."""

    def write_s(self, tags: int) -> float:
        """About what making the answer takes in a house of so many tags, s of one core."""

    def plan(self, snapshot: Snapshot) -> Plan:
        """The plan of the answer."""


@dataclass(frozen=True, slots=True)
class AsOf:
    """What is asked of the state as of a moment, ns of ROS time."""

    at_ns: int
    of: OfState

    def cost_s(self, tags: int) -> float:
        """See `Asked`."""
        return tags * (STATE_S_PER_TAG + _PLAN_TAG_S) + self.of.write_s(tags)

    def look(self) -> Generator[Need, Found, Plan]:
        """See `Asked`."""
        snapshot: Snapshot = yield self.at_ns
        return self.of.plan(snapshot)


@dataclass(frozen=True, slots=True)
class WholeState:
    """Every tag."""

    def write_s(self, tags: int) -> float:
        """See `OfState`."""
        return tags * as_of.WRITE_TAG_S

    def plan(self, snapshot: Snapshot) -> Plan:
        """See `OfState`."""
        return as_of.state(snapshot)


@dataclass(frozen=True, slots=True)
class OneTag:
    """One tag; `NoSuchTag` where it was not known then."""

    tag_id: str

    def write_s(self, tags: int) -> float:  # noqa: ARG002  # it is one
        """See `OfState`."""
        return as_of.WRITE_TAG_S

    def plan(self, snapshot: Snapshot) -> Plan:
        """See `OfState`."""
        found = as_of.tag(snapshot, self.tag_id)
        if found is None:
            raise NoSuchTag(self.tag_id, len(snapshot.tags))
        return found


@dataclass(frozen=True, slots=True)
class Health:
    """The verdicts as of a moment, by these criteria."""

    at_ns: int
    criteria: Criteria = field(compare=False)

    def cost_s(self, tags: int) -> float:
        """See `Asked`."""
        return tags * (STATE_S_PER_TAG + as_of.HEALTH_TAG_S)

    def look(self) -> Generator[Need, Found, Plan]:
        """See `Asked`: the state, and what was recent in the log then."""
        snapshot: Snapshot = yield self.at_ns
        recent: tuple[PastWrite, ...] = yield RecentRequest(self.at_ns)
        return as_of.health(snapshot, recent, self.criteria)


@dataclass(frozen=True, slots=True)
class Field:
    """A field in a format; None: its quality."""

    asked: FieldAsked
    field_format: FieldFormat | None

    def write_s(self, tags: int) -> float:
        """See `OfState`; without a box, as if its tags stood side by side."""
        asked, rules = self.asked, self.asked.rules
        side_m = 2.0 * rules.max_distance_m * math.sqrt(max(tags, 1))
        request = asked.query.request((0.0, 0.0, side_m, side_m), rules.max_grid_cells)
        try:
            return cost_s(request, tags, rules) + as_of.writing_s(request, asked)
        except FieldRefused:
            return _LARGE_S

    def plan(self, snapshot: Snapshot) -> Plan:
        """See `OfState`."""
        if self.field_format is None:
            return as_of.quality(snapshot, self.asked)
        return as_of.field(snapshot, self.asked, self.field_format)


@dataclass(frozen=True, slots=True)
class DailyField:
    """A field as of a moment of what is made of a day's readings; night is by the clock."""

    at_ns: int
    of: Field
    criteria: Criteria = field(compare=False)

    def cost_s(self, tags: int) -> float:
        """See `Asked`: of each tag, a day's readings are read."""
        series_s = tags * _series_s("", MAX_POINTS, tags)
        return tags * (STATE_S_PER_TAG + _PLAN_TAG_S) + series_s + self.of.write_s(tags)

    def look(self) -> Generator[Need, Found, Plan]:
        """See `Asked`."""
        snapshot: Snapshot = yield self.at_ns
        daily = DAILY[self.of.asked.query.sensor_type]
        tags = yield from derived.with_daily(snapshot.tags, daily, self.at_ns, self.criteria.is_day)
        return self.of.plan(replace(snapshot, tags=tuple(tags)))


# --- over a period --------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class History:
    """One sensor of one tag, measured or derived, or one event."""

    request: SeriesRequest
    now_ns: int | None = field(compare=False)
    criteria: Criteria = field(compare=False)
    journal: Condition = field(compare=False)

    def cost_s(self, tags: int) -> float:
        """See `Asked`."""
        asked = self.request
        # Of what is derived, both of its parts are read, and again for buckets.
        parts_s = 4 * _series_s(asked.tag_id, MAX_POINTS, tags)
        is_derived = asked.sensor_type in DERIVED or asked.sensor_type in DAILY
        return _series_s(asked.tag_id, asked.max_points, tags) + (parts_s if is_derived else 0.0)

    def look(self) -> Generator[Need, Found, Plan]:
        """See `Asked`."""
        past = yield from derived.series(self.request, self.criteria.is_day)
        sensors = self.criteria.sensors
        return _plan(history.body(self.request, past, self.now_ns, sensors, self.journal))


@dataclass(frozen=True, slots=True)
class Timeline:
    """What happened when."""

    query: TimelineQuery
    journal: Condition = field(compare=False)

    def cost_s(self, tags: int) -> float:
        """See `Asked`: as if all that is counted had to be asked for twice."""
        counted_s = _series_s(self._tag_id, self.query.points, tags)
        runs_s = _series_s(EVERY_TAG, DEFAULT_POINTS, tags)
        silences_s = _series_s(self._tag_id, MAX_POINTS, tags)
        return runs_s + 2 * len(timeline.COUNTED) * counted_s + silences_s

    def look(self) -> Generator[Need, Found, Plan]:
        """See `Asked`: the runs, every event over the one period, the silences."""
        runs: SeriesPast = yield SeriesRequest(EVERY_TAG, Event.RUNS)
        period = timeline.period(self.query, runs)
        counted = yield from self._counted(period.start_ns, period.end_ns)
        coarsest = timeline.coarsest(period, counted.values())
        if coarsest != period:
            # What comes one by one is asked for over all of the wider period too.
            period = coarsest
            counted = yield from self._counted(period.start_ns, period.end_ns)
        # Of what was not written yet, nobody knows whether it is a silence.
        until_ns = complete.complete_to(self.journal, period.end_ns)
        silences: SeriesPast = yield self._of(
            Event.SILENCES,
            period.start_ns,
            max(period.start_ns, period.end_ns if until_ns is None else until_ns),
            MAX_POINTS,
        )
        return _plan(timeline.body(Parts(runs, period, counted, silences), self.journal))

    def _counted(
        self, start_ns: int, end_ns: int
    ) -> Generator[Need, Found, dict[Event, SeriesPast]]:
        counted = {}
        for event in timeline.COUNTED.values():
            counted[event] = yield self._of(event, start_ns, end_ns, self.query.points)
        return counted

    def _of(self, event: Event, start_ns: int, end_ns: int, points: int) -> SeriesRequest:
        return SeriesRequest(self._tag_id, event, start_ns, end_ns, points)

    @property
    def _tag_id(self) -> str:
        return self.query.tag_id or EVERY_TAG


# What writing a reading or a bucket takes, roughly and at worst.
_WRITE_ENTRY_S: Final = 5e-6


def _series_s(tag_id: str, points: int, tags: int) -> float:
    """About what a series takes, looked up and written, s of one core."""
    looked_at = tags if tag_id == EVERY_TAG else 0
    return SERIES_S + looked_at * SERIES_S_PER_TAG + points * _WRITE_ENTRY_S


def _plan(body: Mapping[str, Any]) -> Plan:
    text = orjson.dumps(body)
    tag = f'"{blake2b(text, digest_size=12).hexdigest()}"'
    return Plan(tag, 0.0, lambda _: Written(text, "application/json", {}))
