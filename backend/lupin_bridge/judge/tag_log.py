"""One tag's log in one run of the clock, and the states derived from it. Pure.

Writes that come in order extend the state. A late write is inserted at its place, and all states
after it are computed again. Writes that the log has no room for survive as the state they led to.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from operator import attrgetter
from typing import Final, Generic, TypeVar

from lupin_bridge.judge.day import LEFT_OUT_NS, LIGHT, Turn, says_day
from lupin_bridge.judge.episodes import TagEpisodes, readings_of
from lupin_bridge.judge.quantities import IsDay
from lupin_bridge.judge.scans import INTERVALS, SHORTEST_NS
from lupin_twin.core.past import PastWrite

# Occasions between two checkpoints of a tag's state.
MARK: Final = 64
StateT = TypeVar("StateT")


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

    def after(self, writes: Sequence[PastWrite], holds_ns: HoldsNs, matters: Matters) -> Trail:
        """The trail with one more occasion."""
        readings = readings_of(writes)
        if not readings:
            return self
        stamp_ns, gaps, turns = writes[0].stamp_ns, self.gaps, self.turns
        if self.scans_ns and matters(self.scans_ns[-1], stamp_ns, self.holds_ns):
            gaps = (*gaps, Gap(self.scans_ns[-1], stamp_ns, self.holds_ns))
        said, light_ns = turns[-1][1] if turns else None, self.light_ns
        light = next((reading.value for reading in readings if reading.name == LIGHT), None)
        if light is not None:
            says, light_ns = says_day(light), stamp_ns
        else:
            says = None if stamp_ns - light_ns > LEFT_OUT_NS else said
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


class TagLog:
    """The writes of one tag, ordered by stamp and number."""

    def __init__(self) -> None:
        self._writes: list[PastWrite] = []

    def __len__(self) -> int:
        return len(self._writes)

    @property
    def last_ns(self) -> int:
        """The stamp of the newest; -1: there is none."""
        return self._writes[-1].stamp_ns if self._writes else -1

    def put(self, write: PastWrite) -> bool:
        """Insert a write at its place; False: it is there already."""
        at = bisect_right(self._writes, _order(write), key=_order)
        if at and _order(self._writes[at - 1]) == _order(write):
            return False
        self._writes.insert(at, write)
        return True

    def occasions(self, after_ns: int, until_ns: int | None = None) -> Iterator[list[PastWrite]]:
        """The writes of each stamp, oldest first."""
        end = len(self) if until_ns is None else self._count(until_ns)
        for _, group in groupby(self._writes[self._count(after_ns) : end], key=_stamp_ns):
            yield list(group)

    def newest(self, count: int) -> int:
        """A stamp after which there are about `count` writes."""
        return self._writes[-count - 1].stamp_ns if count < len(self) else -1

    def drop(self, until_ns: int) -> None:
        """Drop all writes up to and including a stamp."""
        del self._writes[: self._count(until_ns)]

    def _count(self, until_ns: int) -> int:
        return bisect_right(self._writes, until_ns, key=_stamp_ns)


class Replay(Generic[StateT]):
    """The state that a log leads to, with checkpoints; `step` applies one occasion to a state.

    The first checkpoint is the state after the writes that the log has dropped.
    """

    def __init__(
        self,
        state: StateT,
        step: Callable[[StateT, Sequence[PastWrite]], StateT],
        copy: Callable[[StateT], StateT],
    ) -> None:
        self._step, self._copy = step, copy
        self._marks = [(-1, copy(state))]
        self._at_ns, self._state, self._since_mark = -1, state, 0

    def state(self, log: TagLog) -> StateT:
        """The state after the whole log; the caller must not change it."""
        for group in log.occasions(self._at_ns):
            self._state = self._step(self._state, group)
            self._at_ns = group[0].stamp_ns
            self._since_mark += 1
            if self._since_mark >= MARK:
                self._since_mark = 0
                mark = self._at_ns, self._copy(self._state)
                self._marks = [self._marks[0], *self._marks[1:][-1:], mark]
        return self._state

    def back_to(self, before_ns: int) -> None:
        """Return to a checkpoint before a stamp, so that all from there on is computed again."""
        if before_ns > self._at_ns:
            return
        while len(self._marks) > 1 and self._marks[-1][0] >= before_ns:
            self._marks.pop()
        self._at_ns, state = self._marks[-1]
        self._state, self._since_mark = self._copy(state), 0

    def each(self, change: Callable[[StateT], StateT]) -> None:
        """Change every checkpoint, and the current state."""
        self._marks = [(at_ns, change(state)) for at_ns, state in self._marks]
        self._state = change(self._state)

    def settle(self, log: TagLog, until_ns: int) -> None:
        """Move the first checkpoint to `until_ns`: the log is about to drop all until then."""
        at_ns, state = self._marks[0]
        for group in log.occasions(at_ns, until_ns):
            state = self._step(state, group)
        self._marks = [(until_ns, state), *(m for m in self._marks[1:] if m[0] > until_ns)]
        if self._at_ns < until_ns:
            self.back_to(self._at_ns)


class TagStates:
    """One tag in one run of the clock: its log, and the trail and episodes derived from it."""

    def __init__(
        self, episodes: TagEpisodes, holds_ns: HoldsNs, matters: Matters, is_day: IsDay
    ) -> None:
        self._log = TagLog()
        self._settled_ns = -1

        def stepped(before: TagEpisodes, group: Sequence[PastWrite]) -> TagEpisodes:
            before.step(group, is_day)
            return before

        self._trail: Replay[Trail] = Replay(
            Trail(), lambda trail, group: trail.after(group, holds_ns, matters), lambda it: it
        )
        self._episodes: Replay[TagEpisodes] = Replay(episodes, stepped, TagEpisodes.copy)

    @property
    def last_ns(self) -> int:
        """The stamp of its newest write; -1: none is kept."""
        return self._log.last_ns

    @property
    def trail(self) -> Trail:
        """Its gaps between scans, and the turns of its light."""
        return self._trail.state(self._log)

    @property
    def episodes(self) -> TagEpisodes:
        """Its episodes; the caller must not change them."""
        return self._episodes.state(self._log)

    def add(self, write: PastWrite) -> bool:
        """Add a write; False: it is older than what the log keeps."""
        if write.stamp_ns <= self._settled_ns:
            return False
        if self._log.put(write):
            self._trail.back_to(write.stamp_ns)
            self._episodes.back_to(write.stamp_ns)
        return True

    def judge_anew(self, from_ns: int) -> None:
        """Compute the episodes again from a moment on: day and night have changed."""
        self._episodes.back_to(from_ns)

    def keep(self, count: int) -> None:
        """Shrink the log to about `count` writes, once there are a quarter more."""
        if len(self._log) > count + max(1, count // 4):
            self._settle(self._log.newest(count))

    def forget(self, before_ns: int) -> int:
        """Drop what was over before a moment; returns the start of the oldest gap that is kept."""
        self._trail.state(self._log)
        self._settle(before_ns - 1)
        self._trail.each(lambda trail: trail.since(before_ns))
        return min((gap.start_ns for gap in self.gaps), default=before_ns)

    @property
    def gaps(self) -> Sequence[Gap]:
        """The gaps that matter, and the open one since the last scan."""
        trail = self.trail
        if not trail.scans_ns:
            return trail.gaps
        return (*trail.gaps, Gap(trail.scans_ns[-1], None, trail.holds_ns))

    def _settle(self, until_ns: int) -> None:
        until_ns = min(until_ns, self._log.last_ns)
        if until_ns <= self._settled_ns:
            return
        self._trail.settle(self._log, until_ns)
        self._episodes.settle(self._log, until_ns)
        self._settled_ns = until_ns
        self._log.drop(until_ns)


def is_long(start_ns: int, end_ns: int) -> bool:
    """Whether a gap is longer than the shortest time for which readings are valid."""
    return end_ns - start_ns > SHORTEST_NS
