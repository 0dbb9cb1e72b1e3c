"""Folds the log, write by write, into the alarms of all tags and of the greenhouse. Pure.

The alarms depend on the log, the ranges and the moment alone: not on the order of receipt, on
repetition, or on how writes are divided into lots.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain
from statistics import median
from typing import Final

from lupin_bridge.judge.day import DayLine, TagDays
from lupin_bridge.judge.episodes import MAX_EPISODES, SITE, Alarm, TagEpisodes, alarm_id
from lupin_bridge.judge.judging import Criteria
from lupin_bridge.judge.scans import LONGEST_NS, SHORTEST_NS, Stretches
from lupin_bridge.judge.tag_log import Gap, TagStates, is_long
from lupin_bridge.judge.verdict import Kind, Reason, Verdict
from lupin_twin.core.past import (
    FOREVER_NS,
    HOUR_NS,
    PastWrites,
    RunSpan,
    WritesRequest,
)
from lupin_twin.core.state import Observation, Reading, TagState

# Writes kept for all tags together, roughly; each tag has an equal share. They take 13 MB.
KEPT: Final = 20_000
# Interval of dropping what is over and no longer reported.
FORGET_EVERY_NS: Final = HOUR_NS
# Writes of the past that are read in all: the last day of a large greenhouse, weeks of a small one.
REACH_COUNT: Final = 300_000
# How much further back the log is read, again and again, for an alarm that may be older.
_FURTHER: Final = 4.0


@dataclass(frozen=True, slots=True)
class Found:
    """All alarms, unordered; the same tuple object if none has changed.

    At `due_ns` they may change by time alone. `days` has, by tag, the daily quantities of the last
    whole day of the newest run.
    """

    alarms: tuple[Alarm, ...]
    due_ns: int = FOREVER_NS
    days: Mapping[str, Sequence[Reading]] = field(default_factory=dict)


@dataclass(slots=True)
class _Run:
    """One run of the clock."""

    begun_ns: int
    tags: dict[str, TagStates] = field(default_factory=dict)
    stretches: Stretches = field(default_factory=Stretches)
    days: DayLine = field(default_factory=DayLine)
    alarms: dict[str, tuple[Alarm, ...]] = field(default_factory=dict)
    overdue: dict[str, tuple[Alarm, ...]] = field(default_factory=dict)
    limits: dict[int, int] = field(default_factory=dict)
    news: dict[str, None] = field(default_factory=dict)
    house: tuple[Alarm, ...] = ()
    # Whether earlier pauses have changed, and with them what was overdue.
    is_late: bool = False
    # By tag with an open gap: when it will be overdue.
    due: dict[str, int] = field(default_factory=dict)


class AlarmFold:
    """Derives the alarms from the writes that it takes. Belongs to one thread at a time.

    `spans` are the runs of the clock; when they change, a new fold is needed. It keeps about
    `kept` writes, and `max_episodes` cleared alarms of each tag.

    `missed` counts writes that were ignored because they were older than what is kept of their tag.
    """

    def __init__(
        self,
        criteria: Criteria,
        spans: Sequence[RunSpan],
        *,
        kept: int = KEPT,
        max_episodes: int = MAX_EPISODES,
    ) -> None:
        self._kept = kept
        self._max_episodes = max_episodes
        self.missed = 0
        self._forgotten_ns = 0
        self.spans = tuple(spans)
        self._spans_of: dict[int, list[RunSpan]] = {}
        for span in self.spans:
            self._spans_of.setdefault(span.run, []).append(span)
        self._criteria = criteria
        self._days: Mapping[str, Sequence[Reading]] = {}
        self._runs: dict[int, _Run] = {}
        self._tags = 0
        self._is_other = True
        self._alarms: tuple[Alarm, ...] = ()

    def take(self, writes: Iterable[Observation]) -> None:
        """Take writes, in the order of receipt."""
        for write in writes:
            if write.stamp_ns < self._forgotten_ns:
                self.missed += 1
                continue
            # Where two runs overlap, only the newer one counts.
            spans = self._spans_of.get(write.run, ())
            if not any(span.start_ns <= write.stamp_ns < span.end_ns for span in spans):
                continue
            run = self._runs.get(write.run)
            if run is None:
                run = self._runs[write.run] = _Run(self._spans_of[write.run][0].start_ns)
            self._take(run, write)
        for run in self._runs.values():
            self._settle(run)

    def may_begin_earlier(self, tag_ids: Iterable[str]) -> bool:
        """Whether an alarm of now, at one of these tags, may be older than what was taken.

        Then it began with the first observation of its tag, or nothing of its tag was taken.
        """
        run = self._runs.get(self.spans[-1].run) if self.spans else None
        tags = {} if run is None else run.tags
        return any(name not in tags or tags[name].episodes.may_begin_earlier for name in tag_ids)

    def found(self, now_ns: int, since_ns: int = 0) -> Found:
        """The alarms at `now_ns`.

        Those cleared before `since_ns` may be among them; they are dropped from time to time.
        """
        if since_ns > self._forgotten_ns + FORGET_EVERY_NS:
            self._forget(since_ns)
        due_ns = FOREVER_NS
        newest = self.spans[-1].run if self.spans else None
        for number, run in self._runs.items():
            is_on = number == newest
            self._judge(run, is_on=is_on)
            house, due = self._stops(run, now_ns if is_on else None, since_ns)
            self._is_other |= run.house != house
            run.house = house
            due_ns = min(due_ns, due)
        if self._is_other:
            self._is_other = False
            self._alarms = tuple(chain.from_iterable(map(_all_of, self._runs.values())))
        return Found(self._alarms, due_ns, self._days)

    # --- taking in -----------------------------------------------------------------------------

    def _take(self, run: _Run, write: Observation) -> None:
        tag = run.tags.get(write.tag_id)
        if tag is None:
            self._tags += 1
            by = self._criteria
            days = TagDays(by.sensors, by.is_day, by.day_number)
            episodes = TagEpisodes(write.tag_id, run.begun_ns, by, days, self._max_episodes)
            tag = TagStates(episodes, by.holds_ns, _matters(run), self._is_day(run))
            run.tags[write.tag_id] = tag
        newest_ns = run.stretches.newest_ns
        if newest_ns is not None and write.stamp_ns <= newest_ns:
            # A pause's limit follows from the scans before it, so those of earlier pauses stand.
            run.limits = {at: ns for at, ns in run.limits.items() if at < write.stamp_ns}
            run.is_late |= run.stretches.add(write.stamp_ns)
        else:
            run.stretches.add(write.stamp_ns)
        run.news[write.tag_id] = None
        if not tag.add(write):
            self.missed += 1

    def _settle(self, run: _Run) -> None:
        """Update day and night from the tags with news, and drop writes past the limit."""
        changed_ns = FOREVER_NS
        for tag_id in run.news:
            at_ns = run.days.put(tag_id, run.tags[tag_id].trail.turns)
            changed_ns = changed_ns if at_ns is None else min(changed_ns, at_ns)
        if changed_ns != FOREVER_NS:
            for tag_id, tag in run.tags.items():
                if tag.last_ns >= changed_ns:
                    run.news[tag_id] = None
                    tag.judge_anew(changed_ns)
        keep = max(1, self._kept // max(1, self._tags))
        for tag_id in run.news:
            run.tags[tag_id].keep(keep)

    def _forget(self, before_ns: int) -> None:
        """Drop what was over before a moment: it is no longer reported, and must not pile up."""
        self._forgotten_ns = before_ns
        for number, run in list(self._runs.items()):
            newest_ns = run.stretches.newest_ns
            if number != self.spans[-1].run and newest_ns is not None and newest_ns < before_ns:
                self._tags -= len(run.tags)
                self._is_other = True
                del self._runs[number]
                continue
            oldest_ns = min(tag.forget(before_ns) for tag in run.tags.values())
            known_ns = run.stretches.forget(min(before_ns, oldest_ns))
            self._forgotten_ns = max(self._forgotten_ns, known_ns)
            run.days.forget(before_ns, {name: tag.trail.turns for name, tag in run.tags.items()})
            run.limits = {at: ns for at, ns in run.limits.items() if at >= known_ns}

    def _is_day(self, run: _Run) -> Callable[[int], bool]:
        return lambda at_ns: self._criteria.day(run.days.is_day(at_ns), at_ns).is_day

    # --- the alarms ----------------------------------------------------------------------------

    def _judge(self, run: _Run, *, is_on: bool) -> None:
        last_ns = run.stretches.newest_ns or 0
        # In a run that is over, overdue alarms end with the last write received in it.
        is_all = run.is_late or (run.news and not is_on)
        due = [tag_id for tag_id, due_ns in run.due.items() if due_ns <= last_ns]
        ask = dict.fromkeys(run.tags) if is_all else run.news | dict.fromkeys(due)
        days: dict[str, Sequence[Reading]] = {}
        for tag_id in run.news:
            tag = run.tags[tag_id]
            of_tag = tuple(tag.episodes.days.values.values())
            if is_on and of_tag != self._days.get(tag_id, ()):
                days[tag_id] = of_tag
            ended_ns = None if is_on else tag.last_ns
            self._put(run.alarms, tag_id, tuple(tag.episodes.alarms(ended_ns)))
        for tag_id in ask:
            self._put(run.overdue, tag_id, tuple(self._overdue(run, tag_id, last_ns, is_on=is_on)))
        run.is_late = False
        run.news = {}
        if days:
            self._days = {**self._days, **days}

    def _put(
        self, table: dict[str, tuple[Alarm, ...]], tag_id: str, alarms: tuple[Alarm, ...]
    ) -> None:
        if table.get(tag_id, ()) != alarms:
            self._is_other = True
            table[tag_id] = alarms

    def _overdue(self, run: _Run, tag_id: str, last_ns: int, *, is_on: bool) -> Iterator[Alarm]:
        """Yield the alarms of a tag that is not scanned while others are; pauses do not count."""
        run.due.pop(tag_id, None)
        for gap in run.tags[tag_id].gaps:
            due_ns = run.stretches.overdue_ns(gap.start_ns, gap.holds_ns) + 1
            end_ns = gap.end_ns
            if due_ns > last_ns or (end_ns is not None and due_ns >= end_ns):
                if end_ns is None:
                    run.due[tag_id] = due_ns
                continue
            reason = Reason(
                Kind.OLD,
                Verdict.UNKNOWN,
                limit=gap.holds_ns / 1e9,
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
        """The alarms of pauses that exceed the tags' scan intervals, and the next due time."""
        found: list[Alarm] = []
        due_ns = FOREVER_NS
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
        """How long a pause from a moment on may last: the median validity of the tags' readings.

        It is cached, as a moment's limit does not change any more.
        """
        limit_ns = run.limits.get(at_ns)
        if limit_ns is None:
            holds = [
                gap.holds_ns
                for tag in run.tags.values()
                if (gap := _gap_at(tag, at_ns)) is not None
            ]
            limit_ns = run.limits[at_ns] = int(median(holds)) if holds else LONGEST_NS
        return limit_ns


class AlarmLog:
    """Reads a log into a fold, lot by lot: the last `days`, and more while an alarm may be older.

    So an alarm has the same id after a restart, and keeps the notes on it.
    """

    def __init__(self, criteria: Criteria, days: float) -> None:
        self._criteria = criteria
        self._days = days
        self.missed = 0
        self._begin()

    def _begin(self) -> None:
        self.fold: AlarmFold | None = None
        self.is_caught_up = False
        # The stamp of the oldest write.
        self.since_ns: int | None = None
        # The last number that was read; the first, now and in the reading before.
        self.last = 0
        self._first = self._first_before = FOREVER_NS
        self._journal = ""
        self._reach_s = self._days * 86_400.0

    def request(self, max_count: int) -> WritesRequest:
        """The request for the next writes."""
        return WritesRequest(self.last, self._reach_s, REACH_COUNT, max_count)

    def take(self, past: PastWrites, tags: Iterable[TagState]) -> bool:
        """Take the answer; returns whether nothing more is to be read. `tags` is the state of now.

        Another journal, or a new run of the clock, is read from its beginning.
        """
        is_other = bool(self._journal) and past.journal != self._journal
        is_other |= self.fold is not None and self.fold.spans != past.spans
        if is_other or past.last < self.last:
            self._begin()
            return False
        if self.fold is None:
            self.fold, self.since_ns = AlarmFold(self._criteria, past.spans), None
            self._first_before, self._first = self._first, past.first
        self._journal, self.last = past.journal, past.last
        stamps = [write.stamp_ns for write in past.writes]
        self.since_ns = min((*stamps, self.since_ns or FOREVER_NS)) if stamps else self.since_ns
        missed = self.fold.missed
        self.fold.take(past.writes)
        self.missed += self.fold.missed - missed
        if past.is_all and not self.is_caught_up:
            observed = (tag.tag_id for tag in tags if tag.last_observed_ns is not None)
            # Writes that are made from states have no journal.
            has_more = bool(self._journal) and 1 < self._first < self._first_before
            has_more &= self.last - self._first < REACH_COUNT - 1
            if has_more and self.fold.may_begin_earlier(observed):
                self._reach_s = min(1e9, self._reach_s * _FURTHER)
                self.fold, self.last = None, 0
                return False
            self.is_caught_up = True
        return past.is_all


def _matters(run: _Run) -> Callable[[int, int, int], bool]:
    def matters(start_ns: int, end_ns: int, holds_ns: int) -> bool:
        return is_long(start_ns, end_ns) and (
            end_ns - start_ns > holds_ns or run.stretches.has_pause_within(start_ns, end_ns)
        )

    return matters


def _all_of(run: _Run) -> Iterator[Alarm]:
    yield from chain.from_iterable(run.alarms.values())
    yield from chain.from_iterable(run.overdue.values())
    yield from run.house


def _gap_at(tag: TagStates, at_ns: int) -> Gap | None:
    """The gap between scans that a moment lies in, its start included."""
    return next(
        (
            gap
            for gap in reversed(tag.gaps)
            if gap.start_ns <= at_ns and (gap.end_ns is None or at_ns < gap.end_ns)
        ),
        None,
    )


def _stop(run: _Run, start_ns: int, end_ns: int | None, limit_ns: int) -> Alarm:
    return Alarm(
        alarm_id(SITE, Kind.STOPPED, "", run.begun_ns, start_ns),
        Reason(Kind.STOPPED, Verdict.UNKNOWN, limit=limit_ns / 1e9, since_ns=start_ns),
        SITE,
        start_ns + limit_ns + 1,
        end_ns,
    )
