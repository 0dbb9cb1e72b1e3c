"""Queries of the past: each looks up what it needs of the log, derives, and plans its answer.

Queries are values: they are pickled and sent to the process that reads the log. That returns the
ETag, and the body for clients without it. The past does not change, so its ETag is made of content:
it is the same in every replica and after a restart, until a late write changes both.
"""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from hashlib import blake2b
from typing import Any, ClassVar, Final, Protocol

import orjson

from lupin_bridge.feed.query import LogReader
from lupin_bridge.judge.day import LIGHT, SINCE_NS, days_of, nights_by_light
from lupin_bridge.judge.judging import Criteria, judge_once
from lupin_bridge.judge.quantities import DAILY, DERIVED, Daily, Derived, IsDay, Sensors
from lupin_bridge.judge.scans import light_turns
from lupin_bridge.past import bodies
from lupin_bridge.query_string import matches
from lupin_bridge.serving.admission import REVALIDATE, Answer, content_answer
from lupin_bridge.stream.state_json import StateJson, history, judgement
from lupin_twin.core.diagnostics import Condition
from lupin_twin.core.past import (
    DAY_NS,
    DEFAULT_POINTS,
    EVERY_TAG,
    HOUR_NS,
    MAX_POINTS,
    MAX_READINGS,
    Event,
    NotFound,
    PastRefused,
    SeriesPast,
    SeriesRequest,
    grid,
    seconds,
)
from lupin_twin.core.state import NANOSECONDS_PER_SECOND, Reading, Snapshot, TagState
from lupin_twin.journal.counts import Buckets, individually
from lupin_twin.journal.fold import STATE_S_PER_TAG
from lupin_twin.journal.queries import SERIES_S, SERIES_S_PER_TAG
from lupin_twin.runtime.workers import ShouldStop

# Costs, s of one core, at worst: to plan the answer of a tag; to write a scan, or a reading or
# bucket.
PLAN_TAG_S: Final = 10e-6
_WRITE_SCAN_S: Final = 20e-6
_WRITE_ENTRY_S: Final = 5e-6


def tag_of(snapshot: Snapshot, tag_id: str) -> TagState:
    """One tag of a snapshot; raises `NotFound` if it is not known."""
    for tag in snapshot.tags:
        if tag.tag_id == tag_id:
            return tag
    raise NotFound(f"no tag {tag_id[:64]!r} is known ({len(snapshot.tags)} others are)")


@dataclass(frozen=True, slots=True)
class Plan:
    """An answer that is not written yet: its ETag, and the function that writes it."""

    etag: str
    write: Callable[[ShouldStop], Answer]


class Query(Protocol):
    """A query of the past. Equal ones share one answer while it is made. It can be pickled."""

    def cost_s(self, tags: int) -> float:
        """The cost of the lookups and of the answer with this many tags, s of one core."""

    def look(self, log: LogReader) -> Plan:
        """Look up what is needed of the log, and plan the answer."""


@dataclass(frozen=True, slots=True)
class Answered:
    """The ETag of an answer; `answer` is None where the client has it already."""

    etag: str
    answer: Answer | None


# The newest answers of this process that took longer, and are not large: many pages request the
# same report on estimates, which takes a second.
KEPT_IF_S: Final = 0.05
_KEPT_BYTES: Final = 1_000_000
_written: Final[deque[Answer]] = deque(maxlen=8)


def answered(query: Query, if_none_match: str, log: LogReader) -> Answered:
    """A `PastQuery` for a client that has the answers of these ETags (see If-None-Match)."""
    plan = query.look(log)
    if matches(if_none_match, plan.etag):
        return Answered(plan.etag, None)
    for answer in _written.copy():
        if answer.headers["ETag"] == plan.etag:
            return Answered(plan.etag, answer)
    begun_s = time.monotonic()
    answer = plan.write(log.should_stop)
    if time.monotonic() - begun_s >= KEPT_IF_S and len(answer.body) <= _KEPT_BYTES:
        _written.append(answer)
    return Answered(plan.etag, answer)


# --- as of a moment -------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class StateQuery:
    """A query of the state as of a moment, ns of ROS time; None: of the newest."""

    at_ns: int | None
    # Cost of judging and writing a tag, s of one core.
    tag_s: ClassVar[float] = 20e-6

    def cost_s(self, tags: int) -> float:
        """See `Query`."""
        return tags * (STATE_S_PER_TAG + PLAN_TAG_S) + self.write_s(tags)

    def write_s(self, tags: int) -> float:
        """The cost of writing the answer with this many tags, s of one core."""
        return tags * self.tag_s

    def look(self, log: LogReader) -> Plan:
        """See `Query`."""
        raise NotImplementedError


@dataclass(frozen=True, slots=True)
class WholeState(StateQuery):
    """`schema.TwinState`: every tag, with what is derived of these sensors."""

    sensors: Sensors = field(compare=False)

    def look(self, log: LogReader) -> Plan:
        """See `Query`."""
        snapshot = log.state(self.at_ns or 0)
        content = snapshot.stamp_ns, snapshot.frame_id, snapshot.tags, self.sensors.text
        etag, derived = etag_of("state", content), self.sensors.by_name
        return plan_of(etag, lambda _: StateJson(derived).state(snapshot, snapshot.now_ns))


@dataclass(frozen=True, slots=True)
class OneTag(StateQuery):
    """`schema.TwinTagState` of one tag, as in `WholeState`."""

    tag_id: str
    sensors: Sensors = field(compare=False)

    def look(self, log: LogReader) -> Plan:
        """See `Query`, and `tag_of`."""
        snapshot = log.state(self.at_ns or 0)
        found = tag_of(snapshot, self.tag_id)
        etag = etag_of("tag", (snapshot.stamp_ns, found, self.sensors.text))
        derived = self.sensors.by_name
        return plan_of(etag, lambda _: StateJson(derived).tag(found, snapshot.now_ns))


@dataclass(frozen=True, slots=True)
class Health(StateQuery):
    """`schema.Judgement` by these criteria, and by what was recent in the log then.

    Daily quantities are derived from all scans of their day, also from the log up to then.
    """

    criteria: Criteria = field(compare=False)
    tag_s = 1e-3

    def look(self, log: LogReader) -> Plan:
        """See `Query`."""
        by, at_ns = self.criteria, self.at_ns or 0
        snapshot, recent = log.state(at_ns), log.recent(at_ns)
        sensors = {LIGHT, *by.sensors.judged_by_the_day}
        scans = log.scans(max(0, at_ns - SINCE_NS), at_ns, sensors)
        days = days_of(scans, by.sensors, by.is_day, by.day_number)
        judged = judge_once(snapshot, (*light_turns(scans), *recent), by, days=days)
        body = judgement(judged)
        return plan_of(etag_of("health", (snapshot.stamp_ns, body.decode())), lambda _: body)


# --- over a period --------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class History:
    """`routes_schema.History`: one sensor of one tag, measured or derived, or one event."""

    request: SeriesRequest
    now_ns: int | None = field(compare=False)
    criteria: Criteria = field(compare=False)
    journal: Condition = field(compare=False)
    # A simulation's days are not those of the clock: there, the tag's light decides.
    is_by_clock: bool = True

    def cost_s(self, tags: int) -> float:
        """See `Query`."""
        request = self.request
        own_s = series_s(request.tag_id, request.max_points, tags)
        if request.sensor_type not in DERIVED and request.sensor_type not in DAILY:
            return own_s
        # Both of its parts are read, and again for buckets.
        return own_s + 4 * series_s(request.tag_id, MAX_POINTS, tags)

    def look(self, log: LogReader) -> Plan:
        """See `Query`."""
        sensors = self.criteria.sensors
        past = derived_series(self.request, sensors, self.criteria.is_day, log.series)
        nights = self.criteria.nights(past.start_ns, past.end_ns)
        if not self.is_by_clock and self.request.event is None:
            light = log.series(replace(self.request, sensor_type=LIGHT, end_ns=past.end_ns))
            nights = nights_by_light(zip(light.stamps_ns, light.means, strict=True), past.end_ns)
        return of_json(
            bodies.history_body(
                self.request, past, self.now_ns, sensors, self.journal, nights=nights
            )
        )


@dataclass(frozen=True, slots=True)
class Timeline:
    """`routes_schema.Timeline`: what happened when."""

    start_ns: int
    end_ns: int
    points: int
    tag_id: str
    journal: Condition = field(compare=False)

    def cost_s(self, tags: int) -> float:
        """See `Query`: as if every event had to be counted twice."""
        counted_s = series_s(self.tag_id, self.points, tags)
        runs_s = series_s(EVERY_TAG, DEFAULT_POINTS, tags)
        silences_s = series_s(self.tag_id, MAX_POINTS, tags)
        return runs_s + 2 * len(bodies.COUNTED) * counted_s + silences_s

    def look(self, log: LogReader) -> Plan:
        """See `Query`: the runs, every event over the one period, the silences."""
        runs = log.series(SeriesRequest(EVERY_TAG, Event.RUNS))
        period = bodies.timeline_period(self.start_ns, self.end_ns, self.points, runs)
        counted = self._counted(log, period.start_ns, period.end_ns)
        coarsest = bodies.coarsest(period, counted.values())
        if coarsest != period:
            # The wider period also holds single events outside the first one.
            period = coarsest
            counted = self._counted(log, period.start_ns, period.end_ns)
        # Past what the log has so far, no silence is certain.
        until_ns = bodies.complete_to(self.journal, period.end_ns)
        until_ns = max(period.start_ns, period.end_ns if until_ns is None else until_ns)
        silences = log.series(
            SeriesRequest(self.tag_id, Event.SILENCES, period.start_ns, until_ns, MAX_POINTS)
        )
        return of_json(bodies.timeline_body(runs, period, counted, silences, self.journal))

    def _counted(self, log: LogReader, start_ns: int, end_ns: int) -> dict[Event, SeriesPast]:
        points = self.points
        return {
            event: log.series(SeriesRequest(self.tag_id, event, start_ns, end_ns, points))
            for event in bodies.COUNTED.values()
        }


@dataclass(frozen=True, slots=True)
class LatestOfTag:
    """`schema.TagHistory`: the last scans and attempts of a tag, `count` of each at most."""

    tag_id: str
    count: int

    def cost_s(self, tags: int) -> float:  # noqa: ARG002
        """See `Query`."""
        return SERIES_S + self.count * _WRITE_SCAN_S

    def look(self, log: LogReader) -> Plan:
        """See `Query`."""
        found = log.latest(self.tag_id, self.count)
        return of_json(history(self.tag_id, found, self.count))


def series_s(tag_id: str, points: int, tags: int) -> float:
    """The cost of looking a series up and writing it, s of one core."""
    looked_at = tags if tag_id == EVERY_TAG else 0
    return SERIES_S + looked_at * SERIES_S_PER_TAG + points * _WRITE_ENTRY_S


def plan_of(etag: str, write: Callable[[ShouldStop], bytes]) -> Plan:
    """The plan of a JSON answer that is written when it is wanted."""
    headers = {"ETag": etag, **REVALIDATE}
    return Plan(etag, lambda stop: Answer(write(stop), "application/json", headers))


def of_content(answer: Answer) -> Plan:
    """The plan of an answer that is already written."""
    return Plan(answer.headers["ETag"], lambda _: answer)


def of_json(body: Mapping[str, Any]) -> Plan:
    """The plan of a JSON answer that is already made."""
    return of_content(content_answer(orjson.dumps(body)))


def etag_of(kind: str, content: object) -> str:
    """A strong ETag of content; NaN and infinity are the same in it, as they are in JSON."""
    digest = blake2b(kind.encode(), digest_size=12)
    digest.update(orjson.dumps(content))
    return f'"{digest.hexdigest()}"'


# --- derived series, from readings or from buckets of an hour at most -----------------------------

# With this many points, the buckets of a day are a minute long at least.
_POINTS_A_DAY: Final = DAY_NS // (60 * NANOSECONDS_PER_SECOND)
# (ns of ROS time, value), oldest first; and with the period that they are of.
Readings = list[tuple[int, float]]
OfPeriod = tuple[tuple[int, int], Readings]
FindSeries = Callable[[SeriesRequest], SeriesPast]


def derived_series(
    request: SeriesRequest, sensors: Sensors, is_day: IsDay, find: FindSeries
) -> SeriesPast:
    """The series as measured, or else derived; raises `PastRefused` if it has too many parts."""
    measured = find(request)
    derived, daily = DERIVED.get(request.sensor_type), DAILY.get(request.sensor_type)
    if measured.stamps_ns:
        return measured
    # All parts end at the same moment.
    request = replace(request, end_ns=measured.end_ns)
    if derived is not None:
        read = partial(_readings, derived, find)
    elif daily is not None:
        read = partial(_of_days, daily, sensors, is_day, find)
    else:
        return measured
    period, readings = read(request)
    if len(readings) <= request.max_points:
        return individually(readings, *period)
    wide = grid(*period, request.max_points)
    _, readings = read(replace(request, start_ns=wide.start_ns, end_ns=wide.end_ns))
    buckets = Buckets(wide)
    for stamp_ns, value in readings:
        buckets.add_value(stamp_ns, value)
    return buckets.past()


def with_daily(
    tags: Sequence[TagState],
    daily: Daily,
    at_ns: int,
    *,
    sensors: Sensors,
    is_day: IsDay,
    find: FindSeries,
) -> list[TagState]:
    """The tags as of a moment, with a reading of the daily quantity added where it is known."""
    found = []
    for tag in tags:
        names = {reading.name for reading in tag.readings}
        if daily.sensor in names and daily.name not in names:
            span = max(1, at_ns - DAY_NS), at_ns + 1
            part = find(SeriesRequest(tag.tag_id, daily.sensor, *span, _POINTS_A_DAY))
            value = daily.at(at_ns, _readings_of(daily, sensors, part, at_ns), is_day)
            if math.isfinite(value):
                readings = (*tag.readings, Reading(daily.name, value, at_ns))
                tag = replace(tag, readings=readings)  # noqa: PLW2901
        found.append(tag)
    return found


def _of_days(
    daily: Daily, sensors: Sensors, is_day: IsDay, find: FindSeries, request: SeriesRequest
) -> OfPeriod:
    """The daily quantity at the last reading of each hour."""
    first_ns = max(1, request.start_ns - DAY_NS) if request.start_ns else 0
    part = find(
        replace(request, sensor_type=daily.sensor, start_ns=first_ns, max_points=MAX_POINTS)
    )
    start_ns = request.start_ns or part.start_ns
    every = _readings_of(daily, sensors, part, request.end_ns)
    last = {at_ns // HOUR_NS: at_ns for at_ns, _ in every if at_ns >= start_ns}
    readings = []
    for at_ns in last.values():
        value = daily.at(at_ns, every, is_day)
        if math.isfinite(value):
            readings.append((at_ns, value))
    return (start_ns, part.end_ns), readings


def _readings_of(daily: Daily, sensors: Sensors, part: SeriesPast, until_ns: int) -> Readings:
    """The plausible readings of a series; for one stamp, the last.

    A bucket that has ended counts as its minimum and maximum at its start, and its mean throughout.
    """
    is_plausible = sensors.named(daily.sensor).is_plausible
    if part.bucket_ns is None:
        latest = dict(zip(part.stamps_ns, part.means, strict=True))
        return [(at_ns, value) for at_ns, value in latest.items() if is_plausible(value)]
    if part.bucket_ns > HOUR_NS:
        raise PastRefused(
            f"{daily.name} is made of {daily.sensor} by the hour or shorter, and from"
            f" {seconds(part.start_ns)} s to {seconds(part.end_ns)} s there are more than"
            f" {MAX_POINTS} hours, the limit: ask for a shorter period"
        )
    readings = []
    for at_ns, low, high, mean in zip(
        part.stamps_ns, part.minima, part.maxima, part.means, strict=True
    ):
        last_ns = at_ns + part.bucket_ns - 1
        if last_ns <= until_ns and is_plausible(low) and is_plausible(high):
            # The line from the bucket before ends at the mean: an extreme would shift every sum.
            of_bucket = (mean, low, high, mean)
            readings += [*((at_ns, value) for value in of_bucket), (last_ns, mean)]
    return readings


def _readings(derived: Derived, find: FindSeries, request: SeriesRequest) -> OfPeriod:
    """The derived readings, each from two readings of one stamp: one scan."""
    parts: list[SeriesPast] = []
    for name in derived.sources:
        part = find(replace(request, sensor_type=name, max_points=MAX_READINGS))
        if part.is_bucketed:
            raise PastRefused(
                f"{derived.name} is derived of {' and '.join(derived.sources)}, reading by reading:"
                f" from {seconds(part.start_ns)} s to {seconds(part.end_ns)} s {name} has more than"
                f" {MAX_READINGS} of them, the limit, or hours alone: ask for a shorter period"
            )
        parts.append(part)
    first, second = parts
    # For equal stamps, the reading received last counts.
    ones = dict(zip(first.stamps_ns, first.means, strict=True))
    others = dict(zip(second.stamps_ns, second.means, strict=True))
    readings = [
        (stamp_ns, value)
        for stamp_ns, one in ones.items()
        if stamp_ns in others and math.isfinite(value := derived.formula(one, others[stamp_ns]))
    ]
    return (min(first.start_ns, second.start_ns), first.end_ns), readings
