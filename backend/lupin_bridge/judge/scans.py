"""Recent scans of each tag, with the day or night and the species of their time; scan intervals.

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
from itertools import groupby, pairwise, takewhile
from operator import attrgetter, itemgetter
from statistics import median
from typing import Final

from lupin_bridge.judge.day import LEFT_OUT_NS, LIGHT, Day, Light, says_day
from lupin_twin.core.past import PastWrite
from lupin_twin.core.state import Reading, TagState, sure_species

_S: Final = 1_000_000_000
SHORTEST_NS: Final = 600 * _S
LONGEST_NS: Final = 24 * 3600 * _S
TIMES_MEDIAN: Final = 3
# How many of the last intervals count: a patrol may change its pace.
INTERVALS: Final = 8


def interval_ns(scans_ns: Sequence[int]) -> int | None:
    """The median of the intervals between scans, oldest first; None: there are fewer than two."""
    if len(scans_ns) < 2:
        return None
    return int(median(after - before for before, after in pairwise(scans_ns)))


def holds_ns(interval_ns: int | None) -> int:
    """How long readings are valid at a scan interval.

    None: the tag was scanned only once. When it should be scanned again is not known, so its
    readings are valid for the longest time.
    """
    if interval_ns is None:
        return LONGEST_NS
    return min(LONGEST_NS, max(SHORTEST_NS, TIMES_MEDIAN * interval_ns))


# How many of the last intervals count: about a lap, so that the way back to its start is included.
LAP_INTERVALS: Final = 30


@dataclass(frozen=True, slots=True)
class Patrol:
    """How the greenhouse is scanned; `interval_ns` is the median of the last intervals of any tags.

    Each tag's recent scans count, those of one time once. None: fewer than two scans are known, or
    none. `overdue` counts the tags whose readings are all too old, including those that never had
    one.
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
    """One scan: the values of its sensors, and by what they are judged."""

    stamp_ns: int
    values: Mapping[str, float]
    is_day: bool = True
    species: str = ""


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

    def see(self, looks: Iterable[tuple[int, str]]) -> None:
        """Add inspections; for one moment, the last one counts."""
        known = dict(self.looks)
        known.update(looks)
        found = tuple(sorted(known.items()))[-INTERVALS - 1 :]
        if found != self.looks:
            self.looks = found
            self.scans = tuple(
                replace(scan, species=self.species_at(scan.stamp_ns)) for scan in self.scans
            )

    def put(self, tag: TagState, at_ns: int, values: Mapping[str, float]) -> None:
        """Add a scan, and drop those that no judgement needs any more."""
        scan = Scanned(at_ns, values, species=self.species_at(at_ns))
        before = bisect_left(self.scans, at_ns, key=_stamp_ns)
        behind = bisect_right(self.scans, at_ns, before, key=_stamp_ns)
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
        by_then = self.scans[: bisect_right(self.scans, at_ns, key=_stamp_ns)]
        for scan in reversed(by_then):
            if by_then[-1].stamp_ns - scan.stamp_ns > LEFT_OUT_NS:
                break
            if LIGHT in scan.values:
                return says_day(scan.values[LIGHT])
        return None

    def news(self, readings: Iterable[Reading]) -> dict[int, dict[str, float]]:
        """The scans that are new or have changed by these readings, by stamp."""
        known = {scan.stamp_ns: scan.values for scan in self.scans}
        found: dict[int, dict[str, float]] = {}
        for reading in readings:
            at_ns = reading.observed_at_ns
            if at_ns is None:
                continue
            # As text, because NaN is not equal to itself.
            before = found.get(at_ns) or known.get(at_ns, {})
            if repr(before.get(reading.name)) != repr(reading.value):
                found.setdefault(at_ns, dict(before))[reading.name] = reading.value
        return found

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
        # The last scans of any tags; None: to be found again.
        self._lap_ns: list[int] | None = None

    @classmethod
    def of(
        cls, tags: Sequence[TagState], writes: Iterable[PastWrite], day_of: DayOf
    ) -> RecentScans:
        """The recent scans of a state; `writes` is the log of them (see `RecentRequest`)."""
        found = cls(day_of)
        scans: dict[tuple[int, str], dict[str, float]] = {}
        looks: dict[str, list[tuple[int, str]]] = {}
        for write in writes:
            if write.has_seen:
                looks.setdefault(write.tag_id, []).append((write.stamp_ns, write.species))
            else:
                scan = scans.setdefault((write.stamp_ns, write.tag_id), {})
                scan.update(zip(write.sensors, write.values, strict=True))
        for tag in tags:
            for reading in tag.readings:
                if reading.observed_at_ns is not None:
                    # The state takes precedence over the log.
                    key = reading.observed_at_ns, tag.tag_id
                    scans.setdefault(key, {})[reading.name] = reading.value
            found.tag(tag.tag_id).see((*looks.get(tag.tag_id, ()), *_inspection_of(tag)))
        by_id = {tag.tag_id: tag for tag in tags}
        found.take(
            [(at_ns, by_id[name], it) for (at_ns, name), it in scans.items() if name in by_id]
        )
        return found

    def tag(self, tag_id: str) -> Recent:
        """A tag's recent scans and inspections."""
        return self._tags[tag_id]

    def patrol(self, now_ns: int | None, overdue: int) -> Patrol:
        """How the greenhouse is scanned; scans after `now_ns` do not count."""
        if self._lap_ns is None:
            last = ((it.scans[-1].stamp_ns, name) for name, it in self._tags.items() if it.scans)
            lap = [self._tags[name].scans for _, name in nlargest(LAP_INTERVALS + 1, last)]
            self._lap_ns = sorted({scan.stamp_ns for scans in lap for scan in scans})
        scans = [at_ns for at_ns in self._lap_ns if now_ns is None or at_ns <= now_ns]
        if not scans:
            return Patrol(overdue=overdue)
        return Patrol(interval_ns(scans[-LAP_INTERVALS - 1 :]), scans[-1], overdue)

    def day(self, at_ns: int) -> Day:
        """Whether it is day at a moment, by the last scans of all tags."""
        return self._day_of(self._light.is_day, at_ns)

    def see(self, tags: Iterable[TagState]) -> set[str]:
        """Take changed tags; returns those with scans that are now judged otherwise."""
        scans: list[TakenScan] = []
        for tag in tags:
            recent = self.tag(tag.tag_id)
            recent.see(_inspection_of(tag))
            scans += [(at_ns, tag, values) for at_ns, values in recent.news(tag.readings).items()]
        return self.take(scans)

    def note(self, writes: Iterable[PastWrite], tags: Mapping[str, TagState]) -> set[str]:
        """Take writes that the states of `tags` may never show; returns the tags with news.

        That is so if they came late, or soon after one another.
        """
        scans: list[TakenScan] = []
        others: set[str] = set()
        for write in writes:
            tag, recent = tags.get(write.tag_id), self.tag(write.tag_id)
            if tag is None:
                continue
            if write.has_seen:
                before = recent.looks
                recent.see([(write.stamp_ns, write.species)])
                others |= {write.tag_id} if recent.looks != before else set()
                continue
            if len(recent.scans) > INTERVALS and write.stamp_ns < recent.stamps_ns[0]:
                continue
            own = {(it.name, it.observed_at_ns) for it in tag.readings}
            readings = (
                Reading(name, value, write.stamp_ns)
                for name, value in zip(write.sensors, write.values, strict=True)
                # The state takes precedence over the log.
                if (name, write.stamp_ns) not in own
            )
            scans += [(at_ns, tag, values) for at_ns, values in recent.news(readings).items()]
        return others | self.take(scans) | {tag.tag_id for _, tag, _ in scans}

    def take(self, scans: Sequence[TakenScan]) -> set[str]:
        """Add scans; returns the tags with a scan that is judged by another light than before."""
        self._lap_ns = None if scans else self._lap_ns
        late_ns: int | None = None
        in_time = sorted(scans, key=lambda scan: (scan[0], scan[1].tag_id))
        for at_ns, group in groupby(in_time, key=itemgetter(0)):
            taken = list(group)
            for _, tag, values in taken:
                recent = self.tag(tag.tag_id)
                recent.put(tag, at_ns, values)
                self._light.put(tag.tag_id, recent.day_at(recent.scans[-1].stamp_ns))
            if at_ns > self._newest_ns:
                self._newest_ns = at_ns
                is_day = self.day(at_ns).is_day
                for _, tag, _ in taken:
                    self.tag(tag.tag_id).decide(at_ns, is_day=is_day)
            elif late_ns is None:
                late_ns = at_ns
        return set() if late_ns is None else self._decide_since(late_ns)

    def forget(self, tag_id: str) -> None:
        """Forget a tag that is gone."""
        self._tags.pop(tag_id, None)
        self._lap_ns = None
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


# The stamp, the tag, and the values by sensor.
TakenScan = tuple[int, TagState, Mapping[str, float]]


def _inspection_of(tag: TagState) -> Sequence[tuple[int, str]]:
    if tag.looked_at_ns is None:
        return ()
    return ((tag.looked_at_ns, sure_species(tag.flower.species, tag.flower.confidence)),)
