"""Connects the store with its journal: hands each write over, and restores the state at a start.

A wall clock that contradicts the journal is doubted (`_Doubt`). Then the restored state is shown as
it was, and new observations are shown, but not written. Once the clock agrees, they are written,
with stamps corrected by the clock's jump.

No ROS; time and environment are arguments. Everything here runs on the thread that the store
belongs to, and takes microseconds, except for the start, which waits for the restored state.
"""

from __future__ import annotations

import tempfile
import time
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Final, NamedTuple

from lupin_twin.core import ingest
from lupin_twin.core.diagnostics import Condition
from lupin_twin.core.drops import Drop
from lupin_twin.core.history import Repeats
from lupin_twin.core.parameters import World
from lupin_twin.core.state import Pin, TwinStore, Write
from lupin_twin.journal.fold import Restored
from lupin_twin.journal.retention import Limits
from lupin_twin.journal.runs import CORRECTION_NS, Clock, Turn, turn_of
from lupin_twin.journal.writer import Journal
from lupin_twin.runtime.journal_queries import Recall

# How long, s, a start waits for the restored state; after that, it is taken in when it arrives.
_START_WAIT_S: Final = 10.0

# Two simulations on one /clock make it go back dozens of times a second, and each run stays in the
# file. So only this many may begin within this wall time.
MAX_NEW_RUNS: Final = 10
NEW_RUNS_NS: Final = 100 * 1_000_000_000
# A clock that has contradicted the journal for this long, by the steady clock, is believed.
DOUBT_NS: Final = 600 * 1_000_000_000
# Writes that are buffered at most while the journal is read at the start.
MAX_EARLY: Final = 20_000


class _Early(NamedTuple):
    """A write that was received before the state was restored.

    `lead_ns` is how far the wall clock was ahead of the steady clock then.
    """

    write: Write
    lead_ns: int


class _Doubt(NamedTuple):
    """A wall clock that contradicts the journal from `clock` on; `last_ns`: its last arrival."""

    clock: Clock
    since_ns: int
    last_ns: int


class Memory:
    """The store, what it received, and the journal of both; `recall` queries the journal.

    `steady_ns` is a clock that never jumps.
    """

    def __init__(
        self,
        store: TwinStore,
        journal: Journal,
        steady_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        self._store = store
        self.repeats = Repeats()
        self.journal = journal
        self._steady_ns = steady_ns
        self._clock: Clock | None = None
        # How far the wall clock is ahead of the steady clock.
        self._lead_ns = 0
        self._begun_ns: deque[int] = deque(maxlen=MAX_NEW_RUNS)
        # Since when each tag has its pose.
        self._placed_ns: dict[str, int] = {}
        self._early: deque[_Early] | None = deque(maxlen=MAX_EARLY)
        self._lost = 0
        self._doubt: _Doubt | None = None
        self._is_requested = False
        self._agrees = False
        self.recall = Recall(lambda: self.condition, heal=journal.heal)

    def follow(self, now: Clock) -> str | None:
        """Follow a clock: its first moment restores the state, and going back begins a new run.

        Returns a summary of what was restored from the journal, once it was. A moment of 0 is a
        simulated clock that has not started, and is ignored. A clock that goes back too often stays
        in its run, at its latest moment, until it may begin another (`MAX_NEW_RUNS`).
        """
        if now.stamp_ns <= 0:
            return None
        before, lead_before_ns = self._clock, self._lead_ns
        lead_ns = now.arrival_ns - self._steady_ns()
        if before is None:
            self._clock, self._lead_ns = now, lead_ns
            self.journal.begin(now)
            return self._take(self.journal.take_restored(_START_WAIT_S), now)
        if self._doubt is not None:
            self._clock, self._lead_ns = now, lead_ns
            return self._check_doubt(self._doubt, now)
        turn = turn_of(before, now, lead_ns - lead_before_ns)
        if turn in {None, Turn.AHEAD} or self._may_begin(now.arrival_ns):
            self._clock, self._lead_ns = now, lead_ns
            if turn is not None:
                self.journal.begin(now, turn=turn, before_ns=before.stamp_ns)
                self._placed_ns = {
                    tag_id: min(at_ns, now.stamp_ns) for tag_id, at_ns in self._placed_ns.items()
                }
        return self._take(self.journal.take_restored(), now)

    def apply(self, write: Write, arrival_ns: int) -> Drop | None:
        """Apply a write to the store, and hand it to the journal; returns a drop if refused."""
        write = replace(write, arrival_ns=arrival_ns)
        if self._early is not None:
            self._lost += len(self._early) == MAX_EARLY
            self._early.append(_Early(write, self._lead_ns))
        dropped = ingest.apply(write, self._store, self.repeats)
        if dropped is None and self._doubt is None:
            self._hand_over(write)
        return dropped

    @property
    def is_clock_doubted(self) -> bool:
        """Whether the clock contradicts the journal, so that ages are not known."""
        return self._doubt is not None

    @property
    def condition(self) -> Condition:
        """The journal's condition."""
        condition, early = self.journal.condition, self._early
        if condition.complete_ns is None and self._clock is not None:
            condition = replace(condition, complete_ns=self._clock.stamp_ns)
        if self._doubt is None or early is None:
            return condition
        last_ns = self._doubt.last_ns
        return replace(condition, waiting=len(early), lost=self._lost, complete_ns=last_ns)

    def close(self) -> None:
        """Stop answering queries, and write the waiting rows."""
        self.recall.close()
        self.journal.close()

    def _may_begin(self, arrival_ns: int) -> bool:
        begun = self._begun_ns
        if len(begun) == MAX_NEW_RUNS and abs(arrival_ns - begun[0]) < NEW_RUNS_NS:
            return False
        begun.append(arrival_ns)
        return True

    def _hand_over(self, write: Write) -> None:
        now_ns = 0 if self._clock is None else self._clock.stamp_ns
        if write.pose is not None:
            # A place has the stamp of the scan that brought it, as its readings do.
            stamp_ns = now_ns if isinstance(write, Pin) else write.stamp_ns
            tag, placed_ns = self._store.tag(write.tag_id), self._placed_ns.get(write.tag_id)
            if tag and tag.pose and (placed_ns is None or stamp_ns < placed_ns):
                self._placed_ns[write.tag_id] = stamp_ns
                pin = Pin(write.tag_id, tag.pose, stamp_ns, write.arrival_ns)
                self.journal.write(pin, now_ns)
        if not isinstance(write, Pin):
            self.journal.write(write, now_ns)

    # --- what was known before ----------------------------------------------------------------

    def _take(self, restored: Restored | None, now: Clock) -> str | None:
        """Restore what the journal knows, and apply what was received meanwhile on top of it."""
        if restored is None:
            return None
        doubt, early = self._doubt, self._early or ()
        self._is_requested = False
        self._doubt = None
        if restored.doubted_ns is not None:
            clock, since_ns, _ = doubt or (now, self._steady_ns(), 0)
            self._doubt = _Doubt(clock, since_ns, restored.doubted_ns)
        else:
            self._early = None
        self._restore(restored)
        for entry in early:
            if doubt is not None and self._agrees:
                entry = _moved(entry, self._lead_ns - entry.lead_ns)  # noqa: PLW2901
            ingest.apply(entry.write, self._store, self.repeats)
            if doubt is not None and self._doubt is None:
                self._hand_over(entry.write)
        self.clamp_to(now)
        return f"journal {self.condition.path}: restored {len(restored.known.tags):,} tags"

    def _restore(self, restored: Restored) -> None:
        count = self._store.observation_count
        self._store.restore(restored.known.tags, restored.known.observed)
        self.repeats = Repeats()
        for row in restored.rows:
            self.repeats.add(row)
        # A place that was handed over meanwhile counts if it is earlier.
        placed = dict(restored.known.placed_ns)
        for tag_id, at_ns in self._placed_ns.items():
            placed[tag_id] = min(at_ns, placed.get(tag_id, at_ns))
        self._placed_ns = placed
        # The count never falls, not even over a restart.
        self._store.observation_count = max(
            self._store.observation_count, count + 1, restored.last_seq
        )

    def clamp_to(self, now: Clock) -> bool:
        """Follow a clock that has gone back; returns whether anything was later than now.

        A simulation that starts over repeats its stamps for new writes; wall time does not.
        """
        if not self._store.clamp_to(now.stamp_ns):
            return False
        self.repeats.clamp_to(now.stamp_ns, retains_keys=not now.is_simulated)
        return True

    def _check_doubt(self, doubt: _Doubt, now: Clock) -> str | None:
        """Restore again once the clock agrees with the journal, or has contradicted it for long."""
        if self._is_requested:
            return self._take(self.journal.take_restored(), now)
        self._agrees = now.is_simulated or now.arrival_ns >= doubt.last_ns - CORRECTION_NS
        if self._agrees:
            self.journal.begin(now)
        elif self._steady_ns() - doubt.since_ns >= DOUBT_NS:
            self.journal.begin(doubt.clock, Turn.BELIEVED)
        else:
            return None
        self._is_requested = True
        return self._take(self.journal.take_restored(_START_WAIT_S), now)


def open_journal(
    path: Path | None, holder: str, days: float, max_mb: float, world: World = World()
) -> Journal:
    """Open a journal; without a path, in a temporary file that is deleted at the end.

    `holder` names this process to others; `world` is what is observed.
    """
    limits = Limits(days, int(max_mb * 1e6))
    if path is not None:
        return Journal(path, holder, limits, world=world)
    folder = Path(tempfile.mkdtemp(prefix="lupin-twin-"))
    file = folder / "journal.sqlite"
    return Journal(file, holder, limits, world=world, is_temporary=True)


def _moved(early: _Early, by_ns: int) -> _Early:
    """Correct a write that was received while the clock was wrong by `by_ns`.

    If the producer's own clock was right, its stamp counts.
    """
    write = replace(early.write, arrival_ns=early.write.arrival_ns + by_ns)
    if not isinstance(write, Pin):
        stamp_ns, own_ns = write.stamp_ns + by_ns, write.own_stamp_ns
        was_right = write.stamp_ns < own_ns <= stamp_ns
        write = replace(write, stamp_ns=own_ns if was_right else stamp_ns)
    return early._replace(write=write)
