"""From what was heard, write by write, to the alarms of all tags and of the house. Pure.

The alarms are the same whatever the order of hearing, however often anything was heard, and however
the hearing was divided: they follow from what was heard, the ranges, and the moment.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from heapq import heappop, heappush
from statistics import median
from typing import Final

from lupin_bridge.judge.alarm import HOUSE, Alarm, alarm_id
from lupin_bridge.judge.day_line import DayLine
from lupin_bridge.judge.episodes import MAX_EPISODES, TagEpisodes
from lupin_bridge.judge.pauses import Stretches
from lupin_bridge.judge.ranges import Sensors
from lupin_bridge.judge.rhythm import LONGEST_NS, SHORTEST_NS
from lupin_bridge.judge.tag_past import Gap, TagPast, is_long
from lupin_bridge.judge.verdict import Kind, Reason, Verdict
from lupin_twin.past_writes import PastWrite, RunSpan

# Writes that are kept as they are: of a tag at most, and of all tags about.
KEPT_OF_TAG: Final = 32
KEPT: Final = 100_000
# And of a tag of which something came later than that, where there are few of these.
WIDE_OF_TAG: Final = 4_096
# What is over and not told any more is dropped as often as that.
FORGET_EVERY_NS: Final = 3600 * 1_000_000_000
_NEVER: Final = 2**63 - 1
# What the light said, if anything, and the moment: whether it was day.
DayOf = Callable[[bool | None, int], bool]


@dataclass(frozen=True, slots=True)
class Found:
    """What is not as it was when it was last asked for; `is_whole`: these are all alarms.

    By their ids, those that are `withdrawn`, for they never were, and those that are `forgotten`,
    for they are old. At `due_ns` alarms may be others by themselves.
    """

    changed: tuple[Alarm, ...]
    withdrawn: tuple[str, ...] = ()
    forgotten: tuple[str, ...] = ()
    due_ns: int = _NEVER
    is_whole: bool = True


@dataclass(slots=True)
class _Run:
    """One run of the clock."""

    begun_ns: int
    tags: dict[str, TagPast] = field(default_factory=dict)
    stretches: Stretches = field(default_factory=Stretches)
    days: DayLine = field(default_factory=DayLine)
    alarms: dict[str, tuple[Alarm, ...]] = field(default_factory=dict)
    overdue: dict[str, tuple[Alarm, ...]] = field(default_factory=dict)
    limits: dict[int, int] = field(default_factory=dict)
    news: dict[str, None] = field(default_factory=dict)
    house: tuple[Alarm, ...] = ()
    # Whether the pauses of before are others, and with them what was overdue.
    is_late: bool = False
    # When tags may be overdue: one entry a tag whose gap is open, never later than its time.
    due: list[tuple[int, str]] = field(default_factory=list)
    reminded: dict[str, int] = field(default_factory=dict)


class Follower:
    """Belongs to one thread at a time.

    `recent_s` fixes how long readings hold, None: it is learnt. `day_of` says whether it was day.
    `spans` are the runs of the clock; of other ones another follower has to be made. `keep` is how
    many writes of a tag are kept as they are, about; of the tags that are `wide` it is more.

    `missed` counts what was older than anything that is told; it was not taken in.
    """

    def __init__(
        self,
        sensors: Sensors,
        day_of: DayOf,
        spans: Sequence[RunSpan],
        recent_s: float | None = None,
        *,
        keep: int = KEPT_OF_TAG,
        wide: frozenset[str] = frozenset(),
    ) -> None:
        self._keep = keep
        self.wide = wide
        self.missed = 0
        self._forgotten_ns = 0
        self.spans = tuple(spans)
        self._spans_of: dict[int, list[RunSpan]] = {}
        for span in self.spans:
            self._spans_of.setdefault(span.run, []).append(span)
        self._sensors = sensors
        self._day_of = day_of
        self._recent_ns = None if recent_s is None else int(recent_s * 1e9)
        self._runs: dict[int, _Run] = {}
        self._tags = 0
        self._was_asked = False

    def take(self, writes: Iterable[PastWrite]) -> frozenset[str]:
        """Take in what was heard; returns the tags that can only be told from the beginning on.

        That is so where something is later than what is kept as it was.
        """
        late: set[str] = set()
        for write in writes:
            if write.stamp_ns < self._forgotten_ns:
                self.missed += 1
                continue
            if not self._is_told(write):
                continue
            run = self._runs.get(write.run)
            if run is None:
                run = self._runs[write.run] = _Run(self._spans_of[write.run][0].start_ns)
            if not self._take(run, write):
                late.add(write.tag_id)
        for run in self._runs.values():
            late.update(self._settle(run))
        return frozenset(late)

    def found(self, now_ns: int, since_ns: int = 0) -> Found:
        """What the alarms at `now_ns` are that they were not when this was last asked.

        Those that were over before `since_ns` may be among them; they are forgotten by and by.
        """
        news = _News()
        if since_ns > self._forgotten_ns + FORGET_EVERY_NS:
            self._forget(since_ns)
        due_ns = _NEVER
        newest = self.spans[-1].run if self.spans else None
        for number, run in self._runs.items():
            is_on = number == newest
            self._judge(run, news, is_on=is_on)
            house, due = self._stops(run, now_ns if is_on else None, since_ns)
            news.put(run.house, house)
            run.house = house
            due_ns = min(due_ns, due)
        is_whole, self._was_asked = not self._was_asked, True
        gone, old = tuple(news.withdrawn), tuple(news.forgotten)
        return Found(tuple(news.changed), gone, old, due_ns, is_whole)

    # --- taking in -----------------------------------------------------------------------------

    def _take(self, run: _Run, write: PastWrite) -> bool:
        tag = run.tags.get(write.tag_id)
        if tag is None:
            self._tags += 1
            episodes = TagEpisodes(write.tag_id, run.begun_ns, self._sensors, self._recent_ns)
            tag = run.tags[write.tag_id] = TagPast(episodes, self._recent_ns, _matters(run))
        newest_ns = run.stretches.newest_ns
        if newest_ns is not None and write.stamp_ns <= newest_ns:
            # How long a pause may be follows from the scans before it: of earlier ones it stands.
            run.limits = {at: ns for at, ns in run.limits.items() if at < write.stamp_ns}
            run.is_late |= run.stretches.add(write.stamp_ns)
        else:
            run.stretches.add(write.stamp_ns)
        run.news[write.tag_id] = None
        return tag.add(write)

    def _settle(self, run: _Run) -> Iterator[str]:
        """Work out what each tag's news are, and forget what nobody needs any more."""
        changed_ns = _NEVER
        for tag_id in run.news:
            tag = run.tags[tag_id]
            tag.follow()
            at_ns = run.days.put(tag_id, tag.trail.turns)
            changed_ns = changed_ns if at_ns is None else min(changed_ns, at_ns)
        if changed_ns != _NEVER:
            for tag_id, tag in run.tags.items():
                if tag.last_ns >= changed_ns:
                    run.news[tag_id] = None
                    tag.judge_anew()
                if tag.settled_ns >= changed_ns:
                    yield tag_id
        keep = max(1, min(self._keep, KEPT // max(1, self._tags)))
        wide = max(keep, min(WIDE_OF_TAG, KEPT // max(1, len(self.wide))))
        is_day = self._is_day(run)
        for tag_id in run.news:
            run.tags[tag_id].settle(wide if tag_id in self.wide else keep, is_day)

    def _forget(self, before_ns: int) -> None:
        """What was over before is told to nobody, and must not grow for as long as this runs."""
        self._forgotten_ns = before_ns
        for number, run in list(self._runs.items()):
            newest_ns = run.stretches.newest_ns
            if number != self.spans[-1].run and newest_ns is not None and newest_ns < before_ns:
                self._tags -= len(run.tags)
                del self._runs[number]
                continue
            is_day = self._is_day(run)
            oldest_ns = min(tag.forget(before_ns, is_day) for tag in run.tags.values())
            known_ns = run.stretches.forget(min(before_ns, oldest_ns))
            self._forgotten_ns = max(self._forgotten_ns, known_ns)
            run.days.forget(before_ns, {name: tag.trail.turns for name, tag in run.tags.items()})
            run.limits = {at: ns for at, ns in run.limits.items() if at >= known_ns}

    def _is_told(self, write: PastWrite) -> bool:
        """Whether its moment is that of its run: where two overlap, the newer one is told."""
        spans = self._spans_of.get(write.run, ())
        return any(span.start_ns <= write.stamp_ns < span.end_ns for span in spans)

    def _is_day(self, run: _Run) -> Callable[[int], bool]:
        return lambda at_ns: self._day_of(run.days.is_day(at_ns), at_ns)

    # --- telling -------------------------------------------------------------------------------

    def _judge(self, run: _Run, news: _News, *, is_on: bool) -> None:
        is_day = self._is_day(run)
        last_ns = run.stretches.newest_ns or 0
        # Of a run that is over, what is overdue ends with the last that was heard in it.
        is_all = run.is_late or (run.news and not is_on)
        ask = dict.fromkeys(run.tags) if is_all else run.news | _due(run, last_ns)
        for tag_id in run.news:
            tag = run.tags[tag_id]
            ended_ns = None if is_on else tag.last_ns
            alarms = tuple(tag.episodes(is_day).alarms(ended_ns))
            _put(run.alarms, tag_id, alarms, news)
        for tag_id in ask:
            _put(
                run.overdue,
                tag_id,
                tuple(self._overdue(run, tag_id, last_ns, is_on=is_on)),
                news,
            )
        run.is_late = False
        run.news = {}

    def _overdue(self, run: _Run, tag_id: str, last_ns: int, *, is_on: bool) -> Iterator[Alarm]:
        """Of a tag that is not scanned, while others are: pauses of the house do not count."""
        tag = run.tags[tag_id]
        open_gap = tag.open_gap
        gaps = tag.trail.gaps if open_gap is None else (*tag.trail.gaps, open_gap)
        for gap in gaps:
            due_ns = run.stretches.overdue_ns(gap.start_ns, gap.may_last_ns) + 1
            end_ns = gap.end_ns
            if due_ns > last_ns or (end_ns is not None and due_ns >= end_ns):
                if end_ns is None:
                    _remind(run, tag_id, due_ns)
                continue
            reason = Reason(
                Kind.OLD,
                Verdict.UNKNOWN,
                limit=gap.may_last_ns / 1e9,
                since_ns=gap.start_ns,
            )
            if end_ns is None and not is_on:
                end_ns = last_ns
            yield Alarm(
                alarm_id(tag_id, Kind.OLD, "", run.begun_ns, gap.start_ns),
                reason,
                tag_id,
                due_ns,
                end_ns,
            )

    def _stops(self, run: _Run, now_ns: int | None, since_ns: int) -> tuple[tuple[Alarm, ...], int]:
        """When nothing was tried anywhere for longer than the tags' own rhythms allow."""
        found: list[Alarm] = []
        due_ns = _NEVER
        last_ns = run.stretches.newest_ns
        pauses: list[tuple[int, int | None]] = [*run.stretches.pauses(since_ns - 1)]
        if last_ns is not None and now_ns is not None:
            if is_long(last_ns, now_ns):
                pauses.append((last_ns, None))
            else:
                due_ns = last_ns + SHORTEST_NS + 1
        for start_ns, end_ns in pauses:
            limit_ns = self._limit_ns(run, start_ns)
            raised_ns = start_ns + limit_ns + 1
            until_ns = now_ns if end_ns is None else end_ns
            if until_ns is not None and raised_ns <= until_ns:
                found.append(_stop(run, start_ns, end_ns, limit_ns))
            elif end_ns is None:
                due_ns = raised_ns
        return tuple(found), due_ns

    def _limit_ns(self, run: _Run, at_ns: int) -> int:
        """How long nothing may be tried after a moment: as long as half of the tags may wait.

        Pauses come one behind the other; that of a moment does not change any more.
        """
        limit_ns = run.limits.get(at_ns)
        if limit_ns is None:
            holds = [
                gap.may_last_ns
                for tag in run.tags.values()
                if (gap := _gap_at(tag, at_ns)) is not None
            ]
            limit_ns = run.limits[at_ns] = int(median(holds)) if holds else LONGEST_NS
        return limit_ns


def _matters(run: _Run) -> Callable[[int, int, int], bool]:
    def matters(start_ns: int, end_ns: int, holds_ns: int) -> bool:
        return is_long(start_ns, end_ns) and (
            end_ns - start_ns > holds_ns or run.stretches.has_pause_within(start_ns, end_ns)
        )

    return matters


def _gap_at(tag: TagPast, at_ns: int) -> Gap | None:
    """The gap between scans that a moment lies in, its start included."""
    gap = tag.open_gap
    if gap is not None and gap.start_ns <= at_ns:
        return gap
    return next(
        (
            gap
            for gap in reversed(tag.trail.gaps)
            if gap.start_ns <= at_ns and gap.end_ns is not None and at_ns < gap.end_ns
        ),
        None,
    )


def _stop(run: _Run, start_ns: int, end_ns: int | None, limit_ns: int) -> Alarm:
    return Alarm(
        alarm_id(HOUSE, Kind.STOPPED, "", run.begun_ns, start_ns),
        Reason(Kind.STOPPED, Verdict.UNKNOWN, limit=limit_ns / 1e9, since_ns=start_ns),
        HOUSE,
        start_ns + limit_ns + 1,
        end_ns,
    )


def _remind(run: _Run, tag_id: str, due_ns: int) -> None:
    if due_ns < run.reminded.get(tag_id, _NEVER):
        run.reminded[tag_id] = due_ns
        heappush(run.due, (due_ns, tag_id))


def _due(run: _Run, last_ns: int) -> dict[str, None]:
    """The tags that may have become overdue by now."""
    found: dict[str, None] = {}
    while run.due and run.due[0][0] <= last_ns:
        _, tag_id = heappop(run.due)
        run.reminded.pop(tag_id, None)
        found[tag_id] = None
    return found


@dataclass(slots=True)
class _News:
    changed: list[Alarm] = field(default_factory=list)
    withdrawn: list[str] = field(default_factory=list)
    forgotten: list[str] = field(default_factory=list)

    def put(self, before: Sequence[Alarm], now: Sequence[Alarm]) -> None:
        """What the one has that the other has not; of what was dropped for its age, that it was."""
        known = {alarm.id: alarm for alarm in before}
        self.changed += [alarm for alarm in now if known.pop(alarm.id, None) != alarm]
        over = [alarm.cleared_at_ns for alarm in now if alarm.cleared_at_ns is not None]
        before_ns = min(over) if len(over) >= MAX_EPISODES else -1
        for alarm in known.values():
            is_old = alarm.cleared_at_ns is not None and alarm.cleared_at_ns <= before_ns
            (self.forgotten if is_old else self.withdrawn).append(alarm.id)


def _put(
    table: dict[str, tuple[Alarm, ...]], tag_id: str, alarms: tuple[Alarm, ...], news: _News
) -> None:
    news.put(table.get(tag_id, ()), alarms)
    if alarms:
        table[tag_id] = alarms
    else:
        table.pop(tag_id, None)
