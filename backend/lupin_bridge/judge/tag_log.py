"""One tag's log in one run of the clock, and the states derived from it. Pure.

Writes that come in order extend the states. A late write is inserted at its place, and the states
are computed again. Writes that the log has no room for survive as the states that they led to.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from operator import attrgetter

from lupin_bridge.judge.day import LIGHT, Turn, light_after
from lupin_bridge.judge.episodes import TagEpisodes, readings_of
from lupin_bridge.judge.quantities import IsDay
from lupin_bridge.judge.scans import INTERVALS, SHORTEST_NS
from lupin_twin.core.past import FOREVER_NS
from lupin_twin.core.state import Observation


@dataclass(frozen=True, slots=True)
class Gap:
    """From one scan to the next (None: none yet); `holds_ns`: how long readings were valid then."""

    start_ns: int
    end_ns: int | None
    holds_ns: int


# Whether a gap (start, end, validity) has to be kept: it is too long, or the greenhouse paused.
Matters = Callable[[int, int, int], bool]


# How long readings are valid after scans, oldest first.
HoldsNs = Callable[[Sequence[int]], int]


@dataclass(frozen=True, slots=True)
class Trail:
    """A tag's gaps between scans, and the turns of its light, up to one of its scans.

    `holds_ns` is how long readings are valid after that scan.
    """

    scans_ns: tuple[int, ...] = ()
    gaps: tuple[Gap, ...] = ()
    turns: tuple[Turn, ...] = ()
    light_ns: int = -1
    holds_ns: int = 0

    def after(self, writes: Sequence[Observation], holds_ns: HoldsNs, matters: Matters) -> Trail:
        """The trail with one more occasion."""
        readings = readings_of(writes)
        if not readings:
            return self
        stamp_ns, gaps, turns = writes[0].stamp_ns, self.gaps, self.turns
        if self.scans_ns and matters(self.scans_ns[-1], stamp_ns, self.holds_ns):
            gaps = (*gaps, Gap(self.scans_ns[-1], stamp_ns, self.holds_ns))
        said = turns[-1][1] if turns else None
        light = next((reading.value for reading in readings if reading.name == LIGHT), None)
        says, light_ns = light_after(said, self.light_ns, stamp_ns, light)
        if says is not said:
            turns = (*turns, (stamp_ns, says))
        scans_ns = (*self.scans_ns, stamp_ns)[-INTERVALS - 1 :]
        return Trail(scans_ns, gaps, turns, light_ns, holds_ns(scans_ns))

    def since(self, before_ns: int) -> Trail:
        """The trail without what was over before a moment."""
        gaps = tuple(gap for gap in self.gaps if gap.end_ns is None or gap.end_ns >= before_ns)
        first = bisect_right(self.turns, before_ns, key=lambda turn: turn[0])
        return replace(self, gaps=gaps, turns=self.turns[max(0, first - 1) :])


_stamp_ns = attrgetter("stamp_ns")
_order = attrgetter("stamp_ns", "number")


class TagStates:
    """One tag in one run of the clock: its log, and the trail and episodes derived from it."""

    def __init__(
        self, episodes: TagEpisodes, holds_ns: HoldsNs, matters: Matters, is_day: IsDay
    ) -> None:
        self._holds_ns, self._matters, self._is_day = holds_ns, matters, is_day
        # The writes that are kept, by stamp and number; and the states after all before them.
        self._log: list[Observation] = []
        self._settled_ns = -1
        self._first = Trail(), episodes
        # The states after all writes up to these stamps.
        self._trail, self._trail_ns = self._first[0], -1
        self._episodes, self._episodes_ns = episodes.copy(), -1

    @property
    def last_ns(self) -> int:
        """The stamp of its newest write; -1: none is kept."""
        return self._log[-1].stamp_ns if self._log else -1

    @property
    def trail(self) -> Trail:
        """Its gaps between scans, and the turns of its light."""
        for group in self._occasions(self._trail_ns):
            self._trail = self._trail.after(group, self._holds_ns, self._matters)
            self._trail_ns = group[0].stamp_ns
        return self._trail

    @property
    def episodes(self) -> TagEpisodes:
        """Its episodes; the caller must not change them."""
        for group in self._occasions(self._episodes_ns):
            self._episodes.step(group, self._is_day)
            self._episodes_ns = group[0].stamp_ns
        return self._episodes

    def add(self, write: Observation) -> bool:
        """Add a write; False: it is older than what the log keeps."""
        if write.stamp_ns <= self._settled_ns:
            return False
        at = bisect_right(self._log, _order(write), key=_order)
        if at and _order(self._log[at - 1]) == _order(write):
            return True  # it is there already
        self._log.insert(at, write)
        if write.stamp_ns <= self._trail_ns:
            self._trail, self._trail_ns = self._first[0], self._settled_ns
        self.judge_anew(write.stamp_ns)
        return True

    def judge_anew(self, from_ns: int) -> None:
        """Compute the episodes again: from a moment on, day and night or the log have changed."""
        if from_ns <= self._episodes_ns:
            self._episodes, self._episodes_ns = self._first[1].copy(), self._settled_ns

    def keep(self, count: int) -> None:
        """Shrink the log to about `count` writes, once there are a quarter more."""
        if len(self._log) > count + max(1, count // 4):
            self._settle(self._log[-count - 1].stamp_ns)

    def forget(self, before_ns: int) -> int:
        """Drop what was over before a moment; returns the start of the oldest gap that is kept."""
        self._settle(before_ns - 1)
        self._first = self._first[0].since(before_ns), self._first[1]
        self._trail = self.trail.since(before_ns)
        return min((gap.start_ns for gap in self.gaps), default=before_ns)

    @property
    def gaps(self) -> Sequence[Gap]:
        """The gaps that matter, and the open one since the last scan."""
        trail = self.trail
        if not trail.scans_ns:
            return trail.gaps
        return (*trail.gaps, Gap(trail.scans_ns[-1], None, trail.holds_ns))

    def _occasions(self, after_ns: int, until_ns: int = FOREVER_NS) -> Iterator[list[Observation]]:
        """The writes of each stamp, oldest first."""
        first, end = (bisect_right(self._log, at, key=_stamp_ns) for at in (after_ns, until_ns))
        for _, group in groupby(self._log[first:end], key=_stamp_ns):
            yield list(group)

    def _settle(self, until_ns: int) -> None:
        """Drop the writes up to a moment, and keep the states that they led to."""
        until_ns = min(until_ns, self.last_ns)
        if until_ns <= self._settled_ns:
            return
        trail, episodes = self._first
        for group in self._occasions(self._settled_ns, until_ns):
            trail = trail.after(group, self._holds_ns, self._matters)
            episodes.step(group, self._is_day)
        self._first, self._settled_ns = (trail, episodes), until_ns
        if self._trail_ns < until_ns:
            self._trail, self._trail_ns = trail, until_ns
        if self._episodes_ns < until_ns:
            self._episodes, self._episodes_ns = episodes.copy(), until_ns
        del self._log[: bisect_right(self._log, until_ns, key=_stamp_ns)]


def is_long(start_ns: int, end_ns: int) -> bool:
    """Whether a gap is longer than the shortest time for which readings are valid."""
    return end_ns - start_ns > SHORTEST_NS
