"""What the operator wants readings judged by, and tags judged by that, snapshot by snapshot.

Pure, but for the file of sensors. Kept between snapshots are each tag's recent scans and its last
verdict, and since when each of its reasons holds.
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

from lupin_bridge.judge.day import COUNTS_NS, ClockDay, Day, judge_day
from lupin_bridge.judge.quantities import Sensors
from lupin_bridge.judge.scans import (
    SHORTEST_NS,
    Patrol,
    RecentScans,
    Scans,
    holds_ns,
    interval_ns,
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
from lupin_twin.core.past import DAY_NS, FOREVER_NS, PastWrite
from lupin_twin.core.state import Reading, Snapshot, TagState

# Nobody writes this much.
MAX_FILE_BYTES: Final = 1_000_000
_HOUR: Final = r"((?:[01]\d|2[0-3]):[0-5]\d)"
_HOURS: Final = re.compile(f"{_HOUR}-{_HOUR}")
# Nights of a longer period are narrower than a line.
_LONGEST_S: Final = 400 * 86_400
# No robot drove before; simulations begin at 0.
_OLDEST_S: Final = 1.4e9


@dataclass(frozen=True, slots=True)
class Criteria:
    """What readings are judged by."""

    sensors: Sensors
    recent_s: float | None
    clock: ClockDay

    @classmethod
    def of(cls, settings: Settings) -> Criteria:
        """As the settings have it, or a `SettingError`: of the file, the zone or the hours."""
        return cls(_sensors(settings), settings.reading_validity_s or None, _clock(settings))

    def holds_ns(self, scans_ns: Sequence[int]) -> int:
        """How long readings hold after scans, oldest first; a fixed time goes before that."""
        if self.recent_s is not None:
            return int(self.recent_s * 1e9)
        return holds_ns(interval_ns(scans_ns))

    def day(self, light: bool | None, stamp_ns: int) -> Day:
        """Whether it was day at a moment of ROS time at which the light said so, or None."""
        return judge_day(light, self.clock, unix_s(stamp_ns))

    def is_day(self, stamp_ns: int) -> bool:
        """Whether it was day by the clock alone."""
        return self.day(None, stamp_ns).is_day

    def nights(self, start_ns: int, end_ns: int) -> Sequence[tuple[int, int]] | None:
        """The nights by the clock that meet a period; None: simulated, or very long."""
        from_s, to_s = unix_s(start_ns), unix_s(end_ns)
        if from_s is None or to_s is None or to_s - from_s > _LONGEST_S:
            return None
        nights = self.clock.nights(from_s, to_s)
        return [(round(dusk_s * 1e9), round(dawn_s * 1e9)) for dusk_s, dawn_s in nights]

    def day_number(self, stamp_ns: int) -> int:
        """Which day it was by the clock, from dawn to dawn; a simulation's are of 24 hours."""
        now_s = unix_s(stamp_ns)
        return stamp_ns // DAY_NS if now_s is None else self.clock.number(now_s)


def own_sensors() -> Sensors:
    """The file that comes with the bridge."""
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
        raise settings.wrong("day_hours", f"is {settings.day_hours!r}, not such as 06:00-20:00")
    begins, ends = (time.fromisoformat(hour) for hour in hours.groups())
    # None: this machine's, which changes with summer and winter.
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
    """The wall's time of a moment in ROS time; None: that is simulated, and has no such hours."""
    seconds = stamp_ns / 1e9
    return seconds if seconds > _OLDEST_S else None


# --- snapshot by snapshot -------------------------------------------------------------------------

# Readings that are judged at once, a tag counting as one more: some 20 ms.
MAX_AT_ONCE: Final = 6_000
_UNKNOWN: Final = Health(Verdict.UNKNOWN)


@dataclass(frozen=True, slots=True)
class Judged:
    """The greenhouse and its tags as of one snapshot: the very same values where nothing changed.

    `number` counts what was told. While the twin's clock does not run, everything is unknown.
    """

    house: Health
    tags: Mapping[str, Health]
    day: Day
    number: int = 0
    patrol: Patrol = field(default_factory=Patrol)


NOTHING_JUDGED: Final = Judged(_UNKNOWN, {}, Day(True, "assumed"))


def silenced(judged: Judged) -> Judged:
    """The same of a greenhouse whose twin has fallen silent since."""
    return replace(judged, house=judge_site({}, is_silent=True))


def unjudged(snapshot: Snapshot) -> Judged:
    """Of a snapshot that could not be judged nothing is known; it is next to no other."""
    tags = {tag.tag_id: _UNKNOWN for tag in snapshot.tags}
    return replace(NOTHING_JUDGED, tags=tags, number=-1)


def judge_once(
    snapshot: Snapshot,
    writes: Iterable[PastWrite],
    criteria: Criteria,
    *,
    days: Mapping[str, Sequence[Reading]] = MappingProxyType({}),
) -> Judged:
    """What is to be said of one snapshot, given what was recent in the log then.

    Nobody knows since when a reason holds: told is the observation that says so.
    """
    judge = Judge(criteria, max_at_once=math.inf)
    judge.note_days(days)
    judge.learn(writes, snapshot)
    return judge.see(snapshot)


@dataclass(slots=True)
class _Tag:
    """A tag; for how long its readings hold, and until when what was said of it does."""

    state: TagState
    holds_ns: int = SHORTEST_NS
    until_ns: int = FOREVER_NS
    # It was scanned once, and nothing says how long that holds.
    is_once: bool = False


class Judge:
    """Belongs to one thread. Of many, so many are judged at once as nobody has to wait for.

    While `knows_recent` is false, the robot counts as moving: until `learn`, every tag looks as if
    it had one scan only.
    """

    def __init__(
        self,
        criteria: Criteria,
        *,
        max_at_once: float = MAX_AT_ONCE,
        knows_recent: bool = True,
    ) -> None:
        self._criteria = criteria
        self._max_at_once = max_at_once
        self._tags: dict[str, _Tag] = {}
        self._recent = RecentScans(criteria.day)
        self._seen: tuple[TagState, ...] = ()
        # Before that, what was said of each tag holds.
        self._first_until_ns = FOREVER_NS
        self._now_ns: int | None = None
        # The last time that was known: a simulation that is started anew stops its clock before.
        self._known_ns = 0
        self._waiting: dict[str, None] = {}
        self._counts = Counter[Verdict]()
        self._scans = Scans()
        self._overdue = 0
        self._once = 0
        self._judged = NOTHING_JUDGED
        self._changed: Mapping[str, Mapping[str, int]] = {}
        self._days: Mapping[str, Sequence[Reading]] = {}
        self.knows_recent = knows_recent

    def see(self, snapshot: Snapshot) -> Judged:
        """What is to be said now; the very same object where nothing has changed."""
        before, now_ns = self._judged, snapshot.now_ns
        is_back = now_ns is not None and now_ns < self._known_ns
        self._known_ns = self._known_ns if now_ns is None else now_ns
        if is_back:
            # What was before is no part of any interval.
            self._scans.forget()
            self._recent = RecentScans(self._criteria.day)
            _, stamps_ns = self._recent.see(snapshot.tags)
            self._scans.heard(stamps_ns, now_ns)
        news, gone = self._news(snapshot)
        day = self._recent.day(snapshot.stamp_ns)
        if now_ns is None or self._now_ns is None or is_back:
            # All ages are others.
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

    def learn(self, writes: Iterable[PastWrite], first: Snapshot | None = None) -> None:
        """What was recent at the first snapshot: `first`, where it has not been seen."""
        tags = [kept.state for kept in self._tags.values()] if first is None else first.tags
        self._recent = RecentScans.of(tags, writes, self._criteria.day)
        # With what is known already: of the last scan of each tag alone, no interval can be told.
        self._scans.forget()
        self._scans.heard(self._recent.stamps_ns(), self._now_ns if first is None else first.now_ns)
        self._waiting |= dict.fromkeys(self._tags)

    def note_changed(self, changed: Mapping[str, Mapping[str, int]]) -> None:
        """By tag, the sensors that do not read as predicted, and since when: for the next time."""
        self._waiting |= _others(self._changed, changed)
        self._changed = changed

    def note_days(self, days: Mapping[str, Sequence[Reading]]) -> None:
        """By tag, the values of quantities of a day: for the next time."""
        if days is not self._days:
            self._waiting |= _others(self._days, days)
            self._days = days

    def holds_ns(self) -> dict[str, int]:
        """For how long each tag's readings hold, as was last known."""
        return {tag_id: kept.holds_ns for tag_id, kept in self._tags.items()}

    def _news(self, snapshot: Snapshot) -> tuple[dict[str, None], list[str]]:
        """The tags whose state is another than the last one seen, and those that are gone."""
        if snapshot.tags == self._seen:
            return {}, []
        news: dict[str, None] = {}
        states: list[TagState] = []
        for tag in snapshot.tags:
            kept = self._tags.get(tag.tag_id)
            if kept is None:
                kept = self._tags[tag.tag_id] = _Tag(tag)
            elif kept.state is tag:
                continue
            kept.state = tag
            news[tag.tag_id] = None
            states.append(tag)
        others, stamps_ns = self._recent.see(states)
        news |= dict.fromkeys(others)
        self._scans.heard(stamps_ns, snapshot.now_ns)
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
        """Who is judged now of those who wait; a tag at least."""
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
        """The tags of which something was true until now only."""
        if now_ns is None or now_ns < self._first_until_ns:
            return {}
        untils = [(kept.until_ns, tag_id) for tag_id, kept in self._tags.items()]
        self._first_until_ns = min((it for it, _ in untils if it > now_ns), default=FOREVER_NS)
        return {tag_id: None for until_ns, tag_id in untils if until_ns <= now_ns}

    def _judge(self, tag_id: str, now_ns: int | None) -> Health:
        kept = self._tags[tag_id]
        if now_ns is None:
            return _UNKNOWN
        recent, by = self._recent.tag(tag_id), self._criteria
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
        patrol = self._scans.patrol(self._overdue)
        once = self._once if self.knows_recent else 0
        stop = stopped(patrol.last_scan_ns, now_ns, once, len(tags))
        house = judge_site(self._counts, is_silent=now_ns is None, stopped=stop)
        is_same = (house, day, patrol) == (before.house, before.day, before.patrol)
        if tags is before.tags and is_same and before.number:
            return before
        self._judged = Judged(house, tags, day, before.number + 1, patrol)
        return self._judged


def _others(before: Mapping[str, object], now: Mapping[str, object]) -> dict[str, None]:
    """The tags of which not the same is said."""
    return {name: None for name in (*before, *now) if before.get(name) != now.get(name)}


def _since(before: Health, now: Health) -> Health:
    """Reasons that held before hold since then."""
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
