"""Judges the tags of each snapshot by the operator's criteria.

Pure, except that it reads the sensors file. Between snapshots it keeps each tag's recent scans, its
last verdict, and since when each of its reasons has held.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import time
from importlib.resources import files
from itertools import islice
from types import MappingProxyType
from typing import Final
from zoneinfo import ZoneInfo

from lupin_bridge.judge.day import COUNTS_NS, ClockDay, Day
from lupin_bridge.judge.quantities import Sensors
from lupin_bridge.judge.scans import (
    NO_TAG,
    SHORTEST_NS,
    Patrol,
    RecentScans,
    holds_ns,
    writes_of,
)
from lupin_bridge.judge.verdict import (
    FORGOTTEN_NS,
    Health,
    Reason,
    Verdict,
    is_overdue,
    judge_site,
    judge_tag,
    stopped,
)
from lupin_bridge.settings import SettingError, Settings, read_text
from lupin_twin.core.past import DAY_NS, FOREVER_NS, interval_ns
from lupin_twin.core.state import Observation, Reading, Snapshot, TagState

# More than anybody writes.
MAX_FILE_BYTES: Final = 1_000_000
_HOUR: Final = r"((?:[01]\d|2[0-3]):[0-5]\d)"
_HOURS: Final = re.compile(f"{_HOUR}-{_HOUR}")
# In a chart of a longer period, nights are narrower than a line.
_LONGEST_S: Final = 400 * 86_400
# ROS time before this, in 2014, is simulated: simulations begin at 0.
_OLDEST_S: Final = 1.4e9


@dataclass(frozen=True, slots=True)
class Criteria:
    """What readings are judged by: sensors with ranges, a fixed validity, and the hours of day."""

    sensors: Sensors
    recent_s: float | None
    clock: ClockDay

    @classmethod
    def of(cls, settings: Settings) -> Criteria:
        """The criteria of the settings; raises `SettingError` about the file, zone or hours."""
        return cls(_sensors(settings), settings.reading_validity_s or None, _clock(settings))

    def holds_ns(self, scans_ns: Sequence[int]) -> int:
        """How long readings are valid after scans, oldest first; a fixed time takes precedence."""
        if self.recent_s is not None:
            return int(self.recent_s * 1e9)
        return holds_ns(interval_ns(scans_ns))

    def day(self, light: bool | None, stamp_ns: int) -> Day:
        """Whether it was day at a moment of ROS time: by the light; if that is None, the clock."""
        if light is not None:
            return Day(light, "light")
        now_s = unix_s(stamp_ns)
        return Day(True, "assumed") if now_s is None else Day(self.clock.is_day(now_s), "clock")

    def is_day(self, stamp_ns: int) -> bool:
        """Whether it was day by the clock alone."""
        return self.day(None, stamp_ns).is_day

    def nights(self, start_ns: int, end_ns: int) -> Sequence[tuple[int, int]] | None:
        """The nights by the clock that overlap a period; None: simulated, or very long."""
        from_s, to_s = unix_s(start_ns), unix_s(end_ns)
        if from_s is None or to_s is None or to_s - from_s > _LONGEST_S:
            return None
        nights = self.clock.nights(from_s, to_s)
        return [(round(dusk_s * 1e9), round(dawn_s * 1e9)) for dusk_s, dawn_s in nights]

    def day_number(self, stamp_ns: int) -> int:
        """The number of the day by the clock, from dawn to dawn; in a simulation, of each 24 h."""
        now_s = unix_s(stamp_ns)
        return stamp_ns // DAY_NS if now_s is None else self.clock.number(now_s)


def own_sensors() -> Sensors:
    """The sensors of the file that comes with the bridge."""
    from lupin_bridge.judge.sensors_file import parse  # noqa: PLC0415  # nothing of the past needs it

    return parse(files("lupin_bridge").joinpath("sensors.json").read_text(encoding="utf-8"))


def _sensors(settings: Settings) -> Sensors:
    if not settings.sensors:
        return own_sensors()
    from lupin_bridge.judge.sensors_file import SensorsError, parse  # noqa: PLC0415  # as above

    called = settings.called("sensors")
    try:
        return parse(read_text(settings.sensors, called, MAX_FILE_BYTES))
    except SensorsError as error:
        raise SettingError(f"{called} {settings.sensors}: {error}") from error


def _clock(settings: Settings) -> ClockDay:
    hours = _HOURS.fullmatch(settings.day_hours)
    if hours is None:
        raise settings.wrong("day_hours", f"is {settings.day_hours!r}, expected HH:MM-HH:MM")
    begins, ends = (time.fromisoformat(hour) for hour in hours.groups())
    # None: this machine's zone, daylight saving time included.
    zone = zone_of(settings.time_zone) if settings.time_zone else None
    if settings.time_zone and zone is None:
        raise settings.wrong(
            "time_zone", f"is {settings.time_zone!r}, which this machine does not know"
        )
    return ClockDay(zone, begins, ends)


def zone_of(name: str) -> ZoneInfo | None:
    """The time zone of a name; None: this machine does not know it."""
    try:
        return ZoneInfo(name)
    except (KeyError, OSError, ValueError):
        return None


def unix_s(stamp_ns: int) -> float | None:
    """The Unix time of a moment of ROS time, s; None: that is simulated, and has none."""
    seconds = stamp_ns / 1e9
    return seconds if seconds > _OLDEST_S else None


# --- snapshot by snapshot -------------------------------------------------------------------------

# Readings judged per snapshot, where each tag counts as one more: some 20 ms.
MAX_AT_ONCE: Final = 6_000
_UNKNOWN: Final = Health(Verdict.UNKNOWN)


@dataclass(frozen=True, slots=True)
class Judged:
    """The judgement of the greenhouse and its tags; unchanged parts are the same objects as before.

    `number` grows with each change. While the twin's clock does not run, everything is unknown.
    """

    house: Health
    tags: Mapping[str, Health]
    day: Day
    number: int = 0
    patrol: Patrol = field(default_factory=Patrol)


NOTHING_JUDGED: Final = Judged(_UNKNOWN, {}, Day(True, "assumed"))


def silenced(judged: Judged) -> Judged:
    """The same judgement, after the twin has fallen silent."""
    return replace(judged, house=judge_site({}, is_silent=True))


def unjudged(snapshot: Snapshot) -> Judged:
    """The judgement of a snapshot that could not be judged: all unknown, and outside the count."""
    tags = {tag.tag_id: _UNKNOWN for tag in snapshot.tags}
    return replace(NOTHING_JUDGED, tags=tags, number=-1)


def judge_once(
    snapshot: Snapshot,
    writes: Iterable[Observation],
    criteria: Criteria,
    *,
    days: Mapping[str, Sequence[Reading]] = MappingProxyType({}),
) -> Judged:
    """Judge one snapshot, given what was recent in the log then.

    Since when a reason has held is not known: `since_ns` is the observation that shows it.
    """
    judge = Judge(criteria, max_at_once=math.inf)
    judge.note_days(days)
    judge.learn(writes, snapshot)
    return judge.see(snapshot)


@dataclass(slots=True)
class _Tag:
    """A tag, how long its readings are valid, and until when its judgement is."""

    state: TagState
    holds_ns: int = SHORTEST_NS
    until_ns: int = FOREVER_NS
    # It was scanned only once, so its scan interval is not known.
    is_once: bool = False


class Judge:
    """Judges snapshot after snapshot. Belongs to one thread.

    `max_at_once` bounds the readings that are judged per snapshot, so that none takes long; other
    tags wait for the next one. While `knows_recent` is false, the robot counts as moving: until
    `learn`, every tag seems to have been scanned only once.
    """

    def __init__(
        self,
        criteria: Criteria,
        *,
        max_at_once: float = MAX_AT_ONCE,
        knows_recent: bool = True,
    ) -> None:
        self.criteria = criteria
        self._max_at_once = max_at_once
        self._tags: dict[str, _Tag] = {}
        self._recent = RecentScans(criteria.day)
        self._seen: tuple[TagState, ...] = ()
        # Until then, no judgement changes by age alone.
        self._first_until_ns = FOREVER_NS
        self._now_ns: int | None = None
        # The last known time: a simulation stops its clock before it starts anew.
        self._known_ns = 0
        self._waiting: dict[str, None] = {}
        self._counts = Counter[Verdict]()
        self._overdue = 0
        self._once = 0
        self._judged = NOTHING_JUDGED
        self._changed: Mapping[str, Mapping[str, int]] = {}
        self._days: Mapping[str, Sequence[Reading]] = {}
        self.knows_recent = knows_recent

    def see(self, snapshot: Snapshot) -> Judged:
        """Judge a snapshot; returns the same object as before if nothing has changed."""
        before, now_ns = self._judged, snapshot.now_ns
        is_back = now_ns is not None and now_ns < self._known_ns
        self._known_ns = self._known_ns if now_ns is None else now_ns
        if is_back:
            # Earlier scans are not part of any interval.
            self._recent = RecentScans.of(snapshot.tags, (), self.criteria.day)
        news, gone = self._news(snapshot)
        day = self._recent.day(snapshot.stamp_ns)
        if now_ns is None or self._now_ns is None or is_back:
            # All ages have changed.
            news = dict.fromkeys(self._tags)
        self._now_ns = None  # after an error, all are judged again
        self._waiting |= news | self._grown_old(now_ns)
        healths = {tag_id: self._judge(tag_id, now_ns) for tag_id in self._turn()}
        changed = {
            tag_id: health
            for tag_id, health in healths.items()
            if before.tags.get(tag_id) != health
        }
        judged = self._notify(changed, gone, day, now_ns)
        self._now_ns = now_ns
        return judged

    def learn(self, writes: Iterable[Observation], first: Snapshot | None = None) -> None:
        """Take what was recent at the first snapshot; `first`: that, if it has not been seen."""
        tags = [kept.state for kept in self._tags.values()] if first is None else first.tags
        self._recent = RecentScans.of(tags, writes, self.criteria.day)
        self._waiting |= dict.fromkeys(self._tags)

    def note_writes(self, writes: Iterable[Observation]) -> None:
        """Take writes of the log, for the next snapshot: no state shows all of them."""
        tags = {tag_id: kept.state for tag_id, kept in self._tags.items()}
        self._waiting |= dict.fromkeys(self._recent.take(writes, tags))

    def note_changed(self, changed: Mapping[str, Mapping[str, int]]) -> None:
        """Set, for the next snapshot, the sensors that deviate from predictions, and since when."""
        self._waiting |= _others(self._changed, changed)
        self._changed = changed

    def note_days(self, days: Mapping[str, Sequence[Reading]]) -> None:
        """Set, for the next snapshot, the daily quantities by tag."""
        if days is not self._days:
            self._waiting |= _others(self._days, days)
            self._days = days

    def holds_ns(self) -> dict[str, int]:
        """By tag, how long its readings are valid, as of its last judgement."""
        return {tag_id: kept.holds_ns for tag_id, kept in self._tags.items()}

    def _news(self, snapshot: Snapshot) -> tuple[dict[str, None], list[str]]:
        """The tags whose state has changed since the last snapshot, and those that are gone."""
        if snapshot.tags == self._seen:
            return {}, []
        states: dict[str, TagState] = {}
        writes: list[Observation] = []
        for tag in snapshot.tags:
            kept = self._tags.get(tag.tag_id)
            if kept is None:
                kept = self._tags[tag.tag_id] = _Tag(NO_TAG)
            if kept.state is not tag:
                writes += writes_of(kept.state, tag)
                kept.state = states[tag.tag_id] = tag
        news = dict.fromkeys((*states, *self._recent.take(writes, states)))
        gone: list[str] = []
        if len(self._tags) != len(snapshot.tags):
            there = {tag.tag_id for tag in snapshot.tags}
            gone = [tag_id for tag_id in self._tags if tag_id not in there]
        for tag_id in gone:
            self._once -= self._tags.pop(tag_id).is_once
            self._recent.forget(tag_id)
        self._seen = snapshot.tags
        return news, gone

    def _turn(self) -> list[str]:
        """The waiting tags that are judged now, at least one."""
        turn: list[str] = []
        seen = readings = 0
        for tag_id in self._waiting:
            if readings >= self._max_at_once:
                break
            seen += 1
            kept = self._tags.get(tag_id)
            if kept is not None:
                turn.append(tag_id)
                readings += 1 + len(kept.state.readings)
        self._waiting = dict.fromkeys(islice(self._waiting, seen, None))
        return turn

    def _grown_old(self, now_ns: int | None) -> dict[str, None]:
        """The tags whose judgement may change now by age alone."""
        if now_ns is None or now_ns < self._first_until_ns:
            return {}
        untils = [(kept.until_ns, tag_id) for tag_id, kept in self._tags.items()]
        self._first_until_ns = min((it for it, _ in untils if it > now_ns), default=FOREVER_NS)
        return {tag_id: None for until_ns, tag_id in untils if until_ns <= now_ns}

    def _judge(self, tag_id: str, now_ns: int | None) -> Health:
        kept = self._tags[tag_id]
        if now_ns is None:
            return _UNKNOWN
        recent, by = self._recent.tag(tag_id), self.criteria
        holds = kept.holds_ns = by.holds_ns(recent.stamps_ns)
        was_once = kept.is_once
        kept.is_once = len(recent.stamps_ns) == 1 and by.recent_s is None
        self._once += kept.is_once - was_once
        health = judge_tag(
            kept.state,
            now_ns,
            by.sensors,
            recent,
            holds_ns=holds,
            changed=self._changed.get(tag_id, {}),
            days=self._days.get(tag_id, ()),
        )
        kept.until_ns = min(
            (
                reading.observed_at_ns + limit + 1
                for readings, limits in (
                    (kept.state.readings, (holds, FORGOTTEN_NS)),
                    (self._days.get(tag_id, ()), (COUNTS_NS,)),
                )
                for reading in readings
                if reading.observed_at_ns is not None
                for limit in limits
                if reading.observed_at_ns + limit >= now_ns
            ),
            default=FOREVER_NS,
        )
        self._first_until_ns = min(self._first_until_ns, kept.until_ns)
        return _since(self._judged.tags.get(tag_id, _UNKNOWN), health)

    def _notify(
        self, changed: Mapping[str, Health], gone: Sequence[str], day: Day, now_ns: int | None
    ) -> Judged:
        before = self._judged
        tags = before.tags
        if changed or gone:
            self._counts.subtract(
                tags[tag_id].verdict for tag_id in (*changed, *gone) if tag_id in tags
            )
            self._counts.update(health.verdict for health in changed.values())
            self._overdue += sum(map(is_overdue, changed.values())) - sum(
                is_overdue(tags[tag_id]) for tag_id in (*changed, *gone) if tag_id in tags
            )
            tags = {**tags, **changed}
            for tag_id in gone:
                tags.pop(tag_id, None)
        patrol = self._recent.patrol(now_ns or self._now_ns, self._overdue)
        once = self._once if self.knows_recent else 0
        stop = stopped(patrol.last_scan_ns, now_ns, once, len(tags))
        house = judge_site(self._counts, is_silent=now_ns is None, stopped=stop)
        is_same = (house, day, patrol) == (before.house, before.day, before.patrol)
        if tags is before.tags and is_same and before.number:
            return before
        self._judged = Judged(house, tags, day, before.number + 1, patrol)
        return self._judged


def _others(before: Mapping[str, object], now: Mapping[str, object]) -> dict[str, None]:
    """The tags whose values differ."""
    return {name: None for name in (*before, *now) if before.get(name) != now.get(name)}


def _since(before: Health, now: Health) -> Health:
    """The judgement; reasons that held before keep their `since_ns`."""
    if not before.reasons or not now.reasons:
        return now
    known = {_key(reason): reason.since_ns for reason in before.reasons}
    return replace(
        now,
        reasons=tuple(
            replace(reason, since_ns=known[_key(reason)]) if _key(reason) in known else reason
            for reason in now.reasons
        ),
    )


def _key(reason: Reason) -> tuple[str, str, str]:
    return reason.kind, reason.sensor, reason.verdict
