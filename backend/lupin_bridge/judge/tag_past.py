"""What was heard of one tag in one run of the clock, and what follows of it by itself. Pure.

The newest writes are kept as they are, so that one that comes late finds its place. What lies
behind them is kept as what it led to; a write that belongs there needs all to be read again.
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

from lupin_bridge.judge.day_line import Turn
from lupin_bridge.judge.daylight import DAY_FROM_LX, LEFT_OUT_NS, LIGHT
from lupin_bridge.judge.episodes import IsDay, TagEpisodes, readings_of
from lupin_bridge.judge.rhythm import INTERVALS, LONGEST_NS, SHORTEST_NS, holds_ns, interval_ns
from lupin_twin.past_writes import PastWrite


@dataclass(frozen=True, slots=True)
class Gap:
    """From one scan to the next, or to none yet; `holds_ns` is how long readings held then.

    `may_last_ns` is how long it may last: of a tag that has been scanned once, nobody knows when
    it should be again.
    """

    start_ns: int
    end_ns: int | None
    holds_ns: int
    may_last_ns: int


# Whether a gap matters for ever: one that is too long, or in which the house paused.
Matters = Callable[[int, int, int], bool]


@dataclass(frozen=True, slots=True)
class Trail:
    """What a tag's scans say of its rhythm and of its light, up to one of them."""

    scans_ns: tuple[int, ...] = ()
    gaps: tuple[Gap, ...] = ()
    turns: tuple[Turn, ...] = ()
    light_ns: int = -1

    def after(self, writes: Sequence[PastWrite], recent_ns: int | None, matters: Matters) -> Trail:
        """The trail with one more occasion."""
        readings = readings_of(writes)
        if not readings:
            return self
        stamp_ns, gaps, turns = writes[0].stamp_ns, self.gaps, self.turns
        if self.scans_ns:
            gap = self._gap(stamp_ns, recent_ns)
            if matters(gap.start_ns, stamp_ns, gap.holds_ns):
                gaps = (*gaps, gap)
        said, light_ns = turns[-1][1] if turns else None, self.light_ns
        light = next((reading.value for reading in readings if reading.name == LIGHT), None)
        if light is not None:
            says, light_ns = light >= DAY_FROM_LX if math.isfinite(light) else None, stamp_ns
        else:
            says = None if stamp_ns - light_ns > LEFT_OUT_NS else said
        if says is not said:
            turns = (*turns, (stamp_ns, says))
        return Trail((*self.scans_ns, stamp_ns)[-INTERVALS - 1 :], gaps, turns, light_ns)

    def since(self, before_ns: int) -> Trail:
        """The trail without what nobody asks for any more: what was over before."""
        gaps = tuple(gap for gap in self.gaps if gap.end_ns is None or gap.end_ns >= before_ns)
        first = bisect_right(self.turns, before_ns, key=lambda turn: turn[0])
        return replace(self, gaps=gaps, turns=self.turns[max(0, first - 1) :])

    def holds_ns(self, recent_ns: int | None) -> int:
        """How long readings hold after the last scan; a fixed time goes before what is learnt."""
        return holds_ns(interval_ns(self.scans_ns)) if recent_ns is None else recent_ns

    def open_gap(self, recent_ns: int | None) -> Gap | None:
        """The gap since the last scan; None: there was none."""
        if not self.scans_ns:
            return None
        return self._gap(None, recent_ns)

    def _gap(self, end_ns: int | None, recent_ns: int | None) -> Gap:
        holds = self.holds_ns(recent_ns)
        is_known = recent_ns is not None or len(self.scans_ns) > 1
        return Gap(self.scans_ns[-1], end_ns, holds, holds if is_known else LONGEST_NS)


class TagPast:
    """One tag in one run. `recent_ns` fixes how long readings hold; None: it is learnt."""

    def __init__(self, episodes: TagEpisodes, recent_ns: int | None, matters: Matters) -> None:
        self._recent_ns = recent_ns
        self._matters = matters
        self._base, self._base_trail, self._base_ns = episodes, Trail(), -1
        self._newest: list[PastWrite] = []
        # The same, gone on with up to the newest, as far as nothing came late.
        self._ahead: TagEpisodes | None = None
        self._ahead_ns = -1
        self.trail, self._trail_ns = Trail(), -1
        self.last_ns = -1

    def add(self, write: PastWrite) -> bool:
        """Take a write in; False: it belongs to what is no longer kept as it was."""
        if write.stamp_ns <= self._base_ns:
            return False
        at = bisect_left(self._newest, _order(write), key=_order)
        is_known = at < len(self._newest) and self._newest[at].number == write.number
        if not is_known:
            self._newest.insert(at, write)
            self.last_ns = max(self.last_ns, write.stamp_ns)
            if write.stamp_ns <= self._trail_ns:
                self.trail, self._trail_ns = self._base_trail, self._base_ns
            if write.stamp_ns <= self._ahead_ns:
                self._ahead = None
        return True

    def settle(self, keep: int, is_day: IsDay) -> None:
        """Keep only about so many writes as they are, once there are twice as many."""
        if len(self._newest) <= 2 * keep:
            return
        groups = list(_occasions(self._newest))
        while len(groups) > 1 and len(self._newest) - len(groups[0]) >= keep:
            self._settle(groups.pop(0), is_day)

    def _settle(self, group: Sequence[PastWrite], is_day: IsDay) -> None:
        del self._newest[: len(group)]
        self._base.step(group, is_day)
        self._base_trail = self._base_trail.after(group, self._recent_ns, self._matters)
        self._base_ns = group[0].stamp_ns
        if self._ahead_ns < self._base_ns:
            self._ahead = None

    def forget(self, before_ns: int, is_day: IsDay) -> int:
        """Drop what was over before; returns when the oldest gap begins that is kept."""
        count = bisect_left(self._newest, before_ns, key=lambda write: write.stamp_ns)
        for group in list(_occasions(self._newest[:count])):
            self._settle(group, is_day)
        self.trail = self.trail.since(before_ns)
        self._base_trail = self._base_trail.since(before_ns)
        gaps = self.trail.gaps if self.open_gap is None else (*self.trail.gaps, self.open_gap)
        return min((gap.start_ns for gap in gaps), default=before_ns)

    def follow(self) -> None:
        """Bring `trail` up to what was heard: what is late has it worked out anew."""
        after = bisect_right(self._newest, self._trail_ns, key=lambda write: write.stamp_ns)
        for group in _occasions(self._newest[after:]):
            self.trail = self.trail.after(group, self._recent_ns, self._matters)
        self._trail_ns = max(self._trail_ns, self.last_ns)

    def judge_anew(self) -> None:
        """What was day is night: of what is kept as it was, all is gone through again."""
        self._ahead = None

    def episodes(self, is_day: IsDay) -> TagEpisodes:
        """What was wrong with it when; the caller only looks at it."""
        if self._ahead is None:
            self._ahead, self._ahead_ns = self._base.copy(), self._base_ns
        after = bisect_right(self._newest, self._ahead_ns, key=lambda write: write.stamp_ns)
        for group in _occasions(self._newest[after:]):
            self._ahead.step(group, is_day)
        self._ahead_ns = max(self._ahead_ns, self.last_ns)
        return self._ahead

    @property
    def settled_ns(self) -> int:
        """Up to when nothing can be judged again without reading it again; -1: nothing is."""
        return self._base_ns

    @property
    def open_gap(self) -> Gap | None:
        """The gap since the last scan; None: there was none."""
        return self.trail.open_gap(self._recent_ns)


def is_long(start_ns: int, end_ns: int) -> bool:
    """Whether it is longer than readings hold at least."""
    return end_ns - start_ns > SHORTEST_NS


def _occasions(writes: Sequence[PastWrite]) -> Iterator[list[PastWrite]]:
    for _, group in groupby(writes, key=lambda write: write.stamp_ns):
        yield list(group)


def _order(write: PastWrite) -> tuple[int, int]:
    return write.stamp_ns, write.number
