"""Recent scans of each tag, with the day or night of their time, and inspections; intervals.

Pure; times are ns of ROS time. For any moment, recent scans are computed from the state and the
recent log; for states as they come, scan by scan.

A patrol that comes every two minutes and stays away for ten has stopped; one that comes twice a day
has not. So a tag's readings are valid for three times the median of its own last intervals.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from heapq import nlargest
from itertools import chain, groupby, takewhile
from operator import attrgetter, itemgetter
from typing import Any, Final

from lupin_bridge.judge.day import LIGHT, SINCE_NS, Day, Light, light_after
from lupin_twin.core.past import SILENCE_NS, SILENT_INTERVALS, usual_ns
from lupin_twin.core.state import KIND_FLOWER, STATUS_OK, Observation, TagState

_S: Final = 1_000_000_000
SHORTEST_NS: Final = SILENCE_NS
LONGEST_NS: Final = 24 * 3600 * _S
# How many of the last intervals count: a patrol may change its pace.
INTERVALS: Final = 8


def holds_ns(interval_ns: int | None) -> int:
    """How long readings are valid at a scan interval.

    None: the tag was scanned only once. When it should be scanned again is not known, so its
    readings are valid for the longest time.
    """
    if interval_ns is None:
        return LONGEST_NS
    return min(LONGEST_NS, max(SHORTEST_NS, SILENT_INTERVALS * interval_ns))


# How many of the tags that were scanned last count for the scan interval of the greenhouse.
USUAL_TAGS: Final = 30


@dataclass(frozen=True, slots=True)
class Patrol:
    """How the greenhouse is scanned; `interval_ns` is the usual one between two scans of a tag.

    None: no tag was scanned twice, or none at all. `overdue` counts the tags whose readings are all
    too old, including those that never had one.
    """

    interval_ns: int | None = None
    last_scan_ns: int | None = None
    overdue: int = 0


# Pauses kept at most: those of some months, at least.
MAX_PAUSES: Final = 10_000


class Stretches:
    """Periods without a pause: attempts in them are at most `SHORTEST_NS` apart.

    They do not depend on the order in which attempts are added, or on repetition.
    """

    def __init__(self) -> None:
        self._first: list[int] = []
        self._last: list[int] = []

    def add(self, stamp_ns: int) -> bool:
        """Add an attempt at this moment; returns whether it lies outside all known stretches."""
        first, last = self._first, self._last
        after = bisect_right(first, stamp_ns)
        before = after - 1
        if before >= 0 and stamp_ns <= last[before]:
            return False
        joins_before = before >= 0 and stamp_ns - last[before] <= SHORTEST_NS
        joins_after = after < len(first) and first[after] - stamp_ns <= SHORTEST_NS
        if joins_before and joins_after:
            last[before] = last[after]
            del first[after], last[after]
        elif joins_before:
            last[before] = stamp_ns
        elif joins_after:
            first[after] = stamp_ns
        else:
            first.insert(after, stamp_ns)
            last.insert(after, stamp_ns)
        return True

    def forget(self, before_ns: int) -> int:
        """Drop the pauses that ended before a moment; returns from when on no pause is missing.

        Past `MAX_PAUSES`, the oldest are dropped too.
        """
        old = max(bisect_left(self._first, before_ns) - 1, 0)
        many = max(len(self._first) - MAX_PAUSES - 1, 0)
        del self._first[: max(old, many)], self._last[: max(old, many)]
        return self._first[0] if many > old else before_ns

    @property
    def newest_ns(self) -> int | None:
        """The last attempt of all; None: there was none."""
        return self._last[-1] if self._last else None

    def pauses(self, since_ns: int = 0) -> Iterator[tuple[int, int]]:
        """(last attempt before, first attempt after) of each pause that ends after `since_ns`."""
        at = bisect_right(self._first, since_ns)
        for index in range(max(at, 1), len(self._first)):
            yield self._last[index - 1], self._first[index]

    def has_pause_within(self, start_ns: int, end_ns: int) -> bool:
        """Whether a pause lies between two moments."""
        begun = takewhile(lambda pause: pause[0] <= end_ns, self.pauses(start_ns))
        return any(start_ns <= first and last <= end_ns for first, last in begun)

    def overdue_ns(self, since_ns: int, holds_ns: int) -> int:
        """When `holds_ns` have passed since a scan at `since_ns`, pauses not counted.

        If they pass just as a pause begins, the result is its end: overdue begins a moment later,
        and in a pause no time passes.
        """
        due_ns = since_ns + holds_ns
        for first, last in self.pauses(since_ns):
            if first > due_ns:
                break
            due_ns += last - max(first, since_ns)
        return due_ns


# --- the recent scans of each tag -----------------------------------------------------------------

# Whether it was day, given what the light said (None: nothing) and the moment, ns of ROS time.
DayOf = Callable[[bool | None, int], Day]


@dataclass(frozen=True, slots=True)
class Scanned:
    """One scan: the values of its sensors, and whether it was day."""

    stamp_ns: int
    values: Mapping[str, float]
    is_day: bool = True


_stamp_ns = attrgetter("stamp_ns")


@dataclass(slots=True)
class Recent:
    """One tag's recent scans, oldest first, and inspections, each (stamp, species)."""

    scans: tuple[Scanned, ...] = ()
    looks: tuple[tuple[int, str], ...] = ()

    @property
    def stamps_ns(self) -> tuple[int, ...]:
        """The stamps of its last scans."""
        return tuple(scan.stamp_ns for scan in self.scans[-INTERVALS - 1 :])

    def see(self, at_ns: int, species: str) -> bool:
        """Add an inspection; returns whether it is news. For one moment, the last one counts."""
        before = self.looks
        self.looks = tuple(sorted({**dict(before), at_ns: species}.items()))[-INTERVALS - 1 :]
        return self.looks != before

    def put(self, tag: TagState, at_ns: int, values: Mapping[str, float]) -> bool:
        """Add a scan, and drop those that no judgement needs; returns whether it is news."""
        before = bisect_left(self.scans, at_ns, key=_stamp_ns)
        behind = bisect_right(self.scans, at_ns, before, key=_stamp_ns)
        known = self.scans[before].values if before < behind else {}
        scan = Scanned(at_ns, {**known, **values})
        # As text, because NaN is not equal to itself.
        if repr(known) == repr(scan.values):
            return False
        scans = (*self.scans[:before], scan, *self.scans[behind:])
        if len(scans) > INTERVALS + 1:
            kept: dict[int, dict[str, float]] = {}
            for reading in tag.readings:
                kept.setdefault(reading.observed_at_ns or 0, {})[reading.name] = reading.value
            older = (
                replace(it, values=kept[it.stamp_ns])
                for it in scans[: -INTERVALS - 1]
                if it.stamp_ns in kept
            )
            scans = (*older, *scans[-INTERVALS - 1 :])
        self.scans = scans
        return any(it.stamp_ns == at_ns for it in scans)

    def decide(self, at_ns: int, *, is_day: bool) -> bool:
        """Set day or night for the scan of a moment; returns whether that has changed."""
        for index, scan in enumerate(self.scans):
            if scan.stamp_ns == at_ns and scan.is_day is not is_day:
                now = replace(scan, is_day=is_day)
                self.scans = (*self.scans[:index], now, *self.scans[index + 1 :])
                return True
        return False

    def day_at(self, at_ns: int) -> bool | None:
        """What the light said at a moment; None: scans left it out for long, or never had it."""
        says, light_ns = None, 0
        for scan in self.scans[: bisect_right(self.scans, at_ns, key=_stamp_ns)]:
            says, light_ns = light_after(says, light_ns, scan.stamp_ns, scan.values.get(LIGHT))
        return says

    def species_at(self, at_ns: int) -> str:
        """The last species until then that the camera was sure of; empty: none."""
        by_then = self.looks[: bisect_right(self.looks, at_ns, key=lambda look: look[0])]
        return next((species for _, species in reversed(by_then) if species), "")


class RecentScans:
    """The recent scans of all tags. `day_of` decides whether it was day.

    The order in which scans are added does not matter. Each is judged by the light of its own time:
    by what the last scan of every tag until then says.
    """

    def __init__(self, day_of: DayOf) -> None:
        self._day_of = day_of
        self._tags: defaultdict[str, Recent] = defaultdict(Recent)
        self._light = Light()
        self._newest_ns = -1
        # The last scans of the tags that were scanned last; None: to be found again.
        self._last: list[tuple[int, ...]] | None = None

    @classmethod
    def of(
        cls, tags: Sequence[TagState], writes: Iterable[Observation], day_of: DayOf
    ) -> RecentScans:
        """The recent scans of a state; `writes` is the log of them (see `recent_writes`)."""
        found = cls(day_of)
        # Of one moment, the state takes precedence over the log.
        of_state = (write for tag in tags for write in writes_of(NO_TAG, tag))
        found.take(chain(writes, of_state), {tag.tag_id: tag for tag in tags})
        return found

    def tag(self, tag_id: str) -> Recent:
        """A tag's recent scans and inspections."""
        return self._tags[tag_id]

    def patrol(self, now_ns: int | None, overdue: int) -> Patrol:
        """How the greenhouse is scanned; scans after `now_ns` do not count."""
        if self._last is None:
            every = (it.stamps_ns for it in self._tags.values() if it.scans)
            self._last = nlargest(USUAL_TAGS, every, key=itemgetter(-1))
        by_now = [
            [at_ns for at_ns in stamps_ns if now_ns is None or at_ns <= now_ns]
            for stamps_ns in self._last
        ]
        last_ns = max((stamps_ns[-1] for stamps_ns in by_now if stamps_ns), default=None)
        return Patrol(usual_ns(by_now), last_ns, overdue)

    def day(self, at_ns: int) -> Day:
        """Whether it is day at a moment, by the last scans of all tags."""
        return self._day_of(self._light.is_day, at_ns)

    def take(self, writes: Iterable[Observation], tags: Mapping[str, TagState]) -> set[str]:
        """Add writes of `tags`, as these are now; returns those that are judged otherwise."""
        scans: dict[tuple[int, str], dict[str, float]] = {}
        others: set[str] = set()
        for write in writes:
            name = write.tag_id
            if name in tags and write.flower is not None:
                is_news = self.tag(name).see(write.stamp_ns, write.flower.sure_species)
                others |= {name} if is_news else set()
            elif name in tags and write.readings:
                scans.setdefault((write.stamp_ns, name), {}).update(write.readings)
        late_ns: int | None = None
        for at_ns, group in groupby(sorted(scans), key=itemgetter(0)):
            names = [it for _, it in group if self.tag(it).put(tags[it], at_ns, scans[at_ns, it])]
            for name in names:
                recent = self.tag(name)
                self._light.put(name, recent.day_at(recent.scans[-1].stamp_ns))
            if names:
                self._last = None
                others |= {*names}
            if at_ns > self._newest_ns:
                self._newest_ns = at_ns
                is_day = self.day(at_ns).is_day
                for name in names:
                    self.tag(name).decide(at_ns, is_day=is_day)
            elif names and late_ns is None:
                late_ns = at_ns
        return others if late_ns is None else others | self._decide_since(late_ns)

    def forget(self, tag_id: str) -> None:
        """Forget a tag that is gone."""
        self._tags.pop(tag_id, None)
        self._last = None
        self._light.put(tag_id, None)

    def _decide_since(self, at_ns: int) -> set[str]:
        """After a late scan, decide day or night again of all scans since; returns their tags."""
        light, others = Light(), set[str]()
        since: list[tuple[int, str]] = []
        for tag_id, recent in self._tags.items():
            light.put(tag_id, recent.day_at(at_ns - 1))
            first = bisect_left(recent.scans, at_ns, key=_stamp_ns)
            since += [(scan.stamp_ns, tag_id) for scan in recent.scans[first:]]
        for stamp_ns, group in groupby(sorted(since), key=itemgetter(0)):
            tag_ids = [tag_id for _, tag_id in group]
            for tag_id in tag_ids:
                light.put(tag_id, self._tags[tag_id].day_at(stamp_ns))
            is_day = self._day_of(light.is_day, stamp_ns).is_day
            others |= {it for it in tag_ids if self._tags[it].decide(stamp_ns, is_day=is_day)}
        return others


# A tag before anything is known of it.
NO_TAG: Final = TagState("")


def writes_of(before: TagState, tag: TagState) -> list[Observation]:
    """What happened at a tag between two of its states, oldest first, without run and number.

    If there were several attempts, all but the last may be missed. A failed attempt counts as a
    failed scan.
    """
    # As text, because NaN is not equal to itself.
    known = {repr(reading) for reading in before.readings}
    scans: dict[int, dict[str, float]] = {}
    for reading in tag.readings:
        at_ns = reading.observed_at_ns
        if at_ns is not None and repr(reading) not in known:
            scans.setdefault(at_ns, {})[reading.name] = reading.value
    found = [Observation(tag.tag_id, at_ns, values) for at_ns, values in scans.items()]
    looked_ns, flower, last = tag.looked_at_ns, tag.flower, tag.last_try
    if looked_ns is not None and (looked_ns, flower) != (before.looked_at_ns, before.flower):
        bare = replace(flower, blooms=(), footprint=())  # for who keeps it: they may be thousands
        found.append(Observation(tag.tag_id, looked_ns, kind=KIND_FLOWER, flower=bare))
    if last is not None and last.status != STATUS_OK and last != before.last_try:
        found.append(Observation(tag.tag_id, last.stamp_ns, status=last.status))
    return sorted(found, key=_stamp_ns)


def recent_writes(at_ns: int, log: Any) -> list[Observation]:
    """All that `RecentScans` needs of the log, a `LogReader`, at a moment.

    That is what was recent, and what light sensors said before that, by which it is judged.
    """
    before = log.scans(max(0, at_ns - SINCE_NS), at_ns, {LIGHT})
    return [*light_turns(before), *log.recent(at_ns)]


def light_turns(scans: Iterable[Observation]) -> Iterator[Observation]:
    """Yield the scans, oldest first, at which what a tag's light sensor says changes."""
    said: dict[str, tuple[bool | None, int]] = {}
    for scan in scans:
        before, light_ns = said.get(scan.tag_id, (None, 0))
        light = scan.readings.get(LIGHT)
        said[scan.tag_id] = light_after(before, light_ns, scan.stamp_ns, light)
        if said[scan.tag_id][0] is not before:
            yield scan
