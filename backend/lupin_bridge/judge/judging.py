"""Snapshot by snapshot: who has changed is judged again, and who was right only until now.

Pure. What is kept from one snapshot to the next is each tag's rhythm and its last verdict, and
since when each of its reasons holds.
"""

from __future__ import annotations

import heapq
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice
from typing import Final

from lupin_bridge.judge.daylight import LEFT_OUT_NS, LIGHT, Day, Light
from lupin_bridge.judge.patrol import NO_PATROL, Patrol, Scans, is_overdue, stamps_of
from lupin_bridge.judge.ranges import Sensors
from lupin_bridge.judge.rhythm import SHORTEST_NS, Rhythm, holds_ns
from lupin_bridge.judge.verdict import (
    FORGOTTEN_NS,
    NOTHING_CHANGED,
    Health,
    Reason,
    Verdict,
    judge_house,
    judge_tag,
)
from lupin_twin.state import Snapshot, TagState

_NEVER: Final = 2**63 - 1
# Readings that are judged at once, a tag counting as one more: some 20 ms.
MAX_AT_ONCE: Final = 6_000
_UNKNOWN: Final = Health(Verdict.UNKNOWN)


@dataclass(frozen=True, slots=True)
class Judged:
    """The house and its tags as of one snapshot; `changed` are the tags that are not as before.

    `number` counts what was told. While the twin's clock does not run, everything is unknown.
    """

    house: Health
    tags: Mapping[str, Health]
    changed: frozenset[str]
    day: Day
    number: int = 0
    patrol: Patrol = NO_PATROL


NOTHING_JUDGED: Final = Judged(_UNKNOWN, {}, frozenset(), Day(True, "assumed"))


def silenced(judged: Judged) -> Judged:
    """The same of a house whose twin has fallen silent since."""
    return replace(judged, house=judge_house({}, is_silent=True))


DayJudge = Callable[[Light], Day]


def judge_once(
    snapshot: Snapshot, sensors: Sensors, holds: Mapping[str, int], judge_day: DayJudge
) -> Judged:
    """What is to be said of one snapshot by itself; `holds` is for how long readings do, ns.

    Nobody knows since when a reason holds: told is the observation that says so.
    """
    light = Light()
    for tag in snapshot.tags:
        light.put(tag.tag_id, _light_of(tag))
    day, now_ns = judge_day(light), snapshot.now_ns
    healths = {
        tag.tag_id: _UNKNOWN
        if now_ns is None
        else judge_tag(
            tag,
            now_ns,
            sensors,
            holds_ns=holds.get(tag.tag_id, SHORTEST_NS),
            is_day=day.is_day,
        )
        for tag in snapshot.tags
    }
    counts = Counter(health.verdict for health in healths.values())
    house = judge_house(counts, is_silent=now_ns is None)
    scans = Scans()
    scans.heard((stamp for tag in snapshot.tags for stamp in stamps_of(tag)), now_ns)
    patrol = scans.patrol(sum(map(is_overdue, healths.values())))
    return Judged(house, healths, frozenset(healths), day, patrol=patrol)


def _light_of(tag: TagState) -> float | None:
    """What a tag's sensor reads, None where its scans have left that out for long."""
    light = next((reading for reading in tag.readings if reading.name == LIGHT), None)
    if light is None:
        return None
    at_ns = light.observed_at_ns
    if at_ns is not None and max(stamps_of(tag), default=at_ns) - at_ns > LEFT_OUT_NS:
        return None
    return light.value


@dataclass(slots=True)
class _Tag:
    state: TagState
    rhythm: Rhythm = field(default_factory=Rhythm)
    until_ns: int = _NEVER
    due_ns: int = _NEVER


def _note_scan(kept: _Tag) -> None:
    """Count a tag's last scan; what older readings say of others is what scans have left out."""
    newest_ns = max(stamps_of(kept.state), default=None)
    if newest_ns is not None:
        kept.rhythm.scanned(newest_ns)


class Judge:
    """Belongs to one thread. `recent_s` fixes how long readings hold; None: it is learnt.

    At nightfall everybody is judged anew: so many at once as nobody has to wait for, and the others
    with the next snapshots.
    """

    def __init__(self, sensors: Sensors, recent_s: float | None = None) -> None:
        self._sensors = sensors
        self._recent_ns = None if recent_s is None else int(recent_s * 1e9)
        self._tags: dict[str, _Tag] = {}
        self._holds: dict[str, int] = {}
        self._seen: tuple[TagState, ...] = ()
        self._due: list[tuple[int, str]] = []
        self._now_ns: int | None = None
        self._waiting: dict[str, None] = {}
        self._light = Light()
        self._counts = Counter[Verdict]()
        self._scans = Scans()
        self._overdue = 0
        self._judged = NOTHING_JUDGED
        self._changed: Mapping[str, Mapping[str, int]] = {}

    def see(self, snapshot: Snapshot, judge_day: DayJudge, *, is_silent: bool = False) -> Judged:
        """What is to be said now; the very same object where nothing has changed."""
        before, now_ns = self._judged, snapshot.now_ns
        is_back = now_ns is not None and self._now_ns is not None and now_ns < self._now_ns
        if is_back:
            self._scans.forget()
        news, gone = self._news(snapshot)
        day = judge_day(self._light)
        is_other_time = now_ns is None or self._now_ns is None or is_back
        if is_other_time or day.is_day != before.day.is_day:
            # All ages are others, or all ranges.
            news = dict.fromkeys(self._tags)
        self._now_ns = now_ns
        self._waiting |= news | self._grown_old(now_ns)
        healths = {
            tag_id: self._judge(tag_id, now_ns, is_day=day.is_day) for tag_id in self._turn()
        }
        changed = {
            tag_id: health
            for tag_id, health in healths.items()
            if before.tags.get(tag_id) != health
        }
        return self._tell(changed, gone, day, is_silent=is_silent or now_ns is None)

    def learn(self, tag_id: str, scans_ns: Iterable[int]) -> None:
        """When a tag was scanned before the first snapshot, as far as somebody remembers."""
        kept = self._tags.get(tag_id)
        if kept is None or kept.rhythm.interval_ns is not None:
            return
        rhythm = Rhythm()
        for stamp_ns in scans_ns:
            rhythm.scanned(stamp_ns)
        kept.rhythm = rhythm
        _note_scan(kept)
        self._waiting[tag_id] = None

    def note_changed(self, changed: Mapping[str, Mapping[str, int]]) -> None:
        """By tag, the sensors that do not read as everything else foretells, and since when.

        The next snapshot is judged by it.
        """
        for tag_id in (*self._changed, *changed):
            if self._changed.get(tag_id) != changed.get(tag_id):
                self._waiting[tag_id] = None
        self._changed = changed

    def holds_ns(self) -> dict[str, int]:
        """For how long each tag's readings hold, as was last known."""
        return self._holds.copy()

    def _news(self, snapshot: Snapshot) -> tuple[dict[str, None], list[str]]:
        """The tags whose state is another than the last one seen, and those that are gone."""
        if snapshot.tags == self._seen:
            return {}, []
        news: dict[str, None] = {}
        stamps_ns: list[int] = []
        for tag in snapshot.tags:
            kept = self._tags.get(tag.tag_id)
            if kept is None:
                kept = self._tags[tag.tag_id] = _Tag(tag)
                self._holds[tag.tag_id] = SHORTEST_NS
            elif kept.state is tag:
                continue
            kept.state = tag
            news[tag.tag_id] = None
            _note_scan(kept)
            stamps_ns += stamps_of(tag)
            self._light.put(tag.tag_id, _light_of(tag))
        self._scans.heard(stamps_ns, snapshot.now_ns)
        gone: list[str] = []
        if len(self._tags) != len(snapshot.tags):
            there = {tag.tag_id for tag in snapshot.tags}
            gone = [tag_id for tag_id in self._tags if tag_id not in there]
        for tag_id in gone:
            del self._tags[tag_id], self._holds[tag_id]
            self._light.put(tag_id, None)
        self._seen = snapshot.tags
        return news, gone

    def _turn(self) -> list[str]:
        """Who is judged now of those who wait; a tag at least."""
        turn: list[str] = []
        seen = readings = 0
        for tag_id in self._waiting:
            if readings >= MAX_AT_ONCE:
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
        old: dict[str, None] = {}
        while now_ns is not None and self._due and self._due[0][0] <= now_ns:
            _, tag_id = heapq.heappop(self._due)
            kept = self._tags.get(tag_id)
            if kept is None:
                continue
            kept.due_ns = _NEVER
            if kept.until_ns <= now_ns:
                old[tag_id] = None
            else:
                self._remind(kept)
        return old

    def _remind(self, kept: _Tag) -> None:
        """One entry a tag waits, never later than its time."""
        if kept.until_ns < kept.due_ns:
            kept.due_ns = kept.until_ns
            heapq.heappush(self._due, (kept.due_ns, kept.state.tag_id))

    def _judge(self, tag_id: str, now_ns: int | None, *, is_day: bool) -> Health:
        kept = self._tags[tag_id]
        if now_ns is None:
            return _UNKNOWN
        holds = self._holds[tag_id] = self._recent_ns or holds_ns(kept.rhythm.interval_ns)
        health = judge_tag(
            kept.state,
            now_ns,
            self._sensors,
            holds_ns=holds,
            is_day=is_day,
            changed=self._changed.get(tag_id, NOTHING_CHANGED),
        )
        kept.until_ns = min(
            (
                reading.observed_at_ns + limit + 1
                for reading in kept.state.readings
                if reading.observed_at_ns is not None
                for limit in (holds, FORGOTTEN_NS)
                if reading.observed_at_ns + limit >= now_ns
            ),
            default=_NEVER,
        )
        self._remind(kept)
        return _since(self._judged.tags.get(tag_id, _UNKNOWN), health)

    def _tell(
        self, changed: Mapping[str, Health], gone: Sequence[str], day: Day, *, is_silent: bool
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
        house = judge_house(self._counts, is_silent=is_silent)
        patrol = self._scans.patrol(self._overdue)
        is_same = (house, day, patrol) == (before.house, before.day, before.patrol)
        if tags is before.tags and is_same and before.number:
            return before
        self._judged = Judged(
            house, tags, frozenset(changed) | frozenset(gone), day, before.number + 1, patrol
        )
        return self._judged


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
