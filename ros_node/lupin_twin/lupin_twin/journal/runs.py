"""Runs of the clock: which one a starting twin is in, and which one a moment belongs to.

In a run, ROS time goes forward. Wall time continues over a restart, and is corrected a little now
and then. A simulation begins again at 0: an observation of yesterday at second 500 must not look
fresh at second 510 today.

If runs overlap, a moment belongs to the latest that contains it. A run lasts until the next one
begins, and the last one forever; the first one also has all time before it.
"""

from __future__ import annotations

import heapq
from bisect import bisect_right
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any, Final

from lupin_twin.core.diagnostics import origin_of
from lupin_twin.core.parameters import DAY_S, World
from lupin_twin.core.past import FOREVER_NS, RunSpan
from lupin_twin.journal import sql
from lupin_twin.journal.schema import DAY_LENGTH, LOCAL_SITE, ORIGIN, SiteLog, insert_into

# A wall clock that is set back by at most this was only corrected: the run goes on.
CORRECTION_NS: Final = 300 * 1_000_000_000
# How much faster than before a simulation that goes on may be.
_FASTER: Final = 2.0


class Turn(Enum):
    """What a clock did, so that its run has to be determined anew."""

    START = "start"
    BELIEVED = "believed"  # the start, with a clock that keeps contradicting the journal
    STEP = "step"  # a wall clock was set back a little: the run goes on
    BACK = "back"  # the clock went back: a new run
    AHEAD = "ahead"  # a wall clock jumped ahead: the run that it had gone back from may go on


@dataclass(frozen=True, slots=True)
class Clock:
    """A moment on both clocks, ns: ROS time, which may be simulated, and wall time."""

    stamp_ns: int
    arrival_ns: int
    is_simulated: bool


@dataclass(frozen=True, slots=True)
class Run:
    """A run of the clock, or a step within one (`joins` is the run that it is part of).

    Its rows have the number `begun_seq` or a later one, including copies of what was known.
    """

    id: int
    begun: Clock
    begun_seq: int
    joins: int | None = None
    ended_ns: int | None = None

    @property
    def root(self) -> int:
        """The number of the run that rows refer to."""
        return self.id if self.joins is None else self.joins


def runs(execute: Callable[..., Any]) -> list[Run]:
    """Every run and step, in the order in which they began; in SQLite or PostgreSQL."""
    return [
        Run(row[0], Clock(row[2], row[3], bool(row[1])), row[4], row[5], row[6])
        for row in execute(sql.RUNS, {"site": LOCAL_SITE}).fetchall()
    ]


def since_seq(every: Iterable[Run], root: int, at_ns: int) -> int:
    """The seq from which rows of a run count as of a moment: that of its last step by then."""
    steps = [run for run in every if run.root == root]
    begun = [run for run in steps if run.begun.stamp_ns <= at_ns]
    return (begun or steps)[-1 if begun else 0].begun_seq


def spans(every: Iterable[Run]) -> tuple[RunSpan, ...]:
    """Divide the time axis from 0 to `FOREVER_NS` among the runs, in order; empty without a run."""
    every = list(every)
    roots = [run for run in every if run.joins is None]
    # A step may begin before its run.
    begun: dict[int, int] = {}
    for run in every:
        stamp_ns = run.begun.stamp_ns
        begun[run.root] = min(stamp_ns, begun.get(run.root, stamp_ns))
    waiting = sorted(roots, key=lambda run: (begun[run.id], run.id), reverse=True)
    # A run contains at least its beginning, and the last stamp that was received.
    until = {
        run.id: FOREVER_NS if run.ended_ns is None else max(run.ended_ns, run.begun.stamp_ns) + 1
        for run in roots
    }
    edges = set(begun.values()) | set(until.values()) - {FOREVER_NS}
    starts: list[tuple[int, Run]] = []
    holding: list[tuple[int, int, Run]] = []  # the latest first
    for at_ns in sorted(edges):
        while waiting and begun[waiting[-1].id] <= at_ns:
            run = waiting.pop()
            heapq.heappush(holding, (-run.id, until[run.id], run))
        while holding and holding[0][1] <= at_ns:
            heapq.heappop(holding)
        if holding and (not starts or starts[-1][1] is not holding[0][2]):
            starts.append((at_ns if starts else 0, holding[0][2]))
    if not starts:
        return ()
    ends_ns = [*(start_ns for start_ns, _ in starts[1:]), FOREVER_NS]
    return tuple(
        RunSpan(run.id, start_ns, end_ns, run.begun.is_simulated)
        for (start_ns, run), end_ns in zip(starts, ends_ns, strict=True)
    )


def span_at(every: Iterable[Run], at_ns: int) -> RunSpan | None:
    """The span of a moment; None before 0, or if there is no run."""
    found = spans(every)
    index = bisect_right([span.start_ns for span in found], at_ns)
    return found[index - 1] if index else None


def world_of(log: SiteLog) -> World:
    """The observed world, as noted by the twin that wrote last."""
    span = span_at(runs(log.execute), FOREVER_NS)
    is_simulated = span is not None and span.is_simulated
    origin = origin_of(log.meta(ORIGIN) or "", is_simulated=is_simulated)
    try:
        day_s = float(log.meta(DAY_LENGTH) or "")
    except ValueError:
        day_s = 0.0
    # Any other length is invalid: displays and estimates by the day would fail with it.
    return World(origin, day_s) if 1.0 <= day_s <= DAY_S else World(origin)


def cut(axis: Iterable[RunSpan], start_ns: int, end_ns: int) -> list[RunSpan]:
    """The spans of `start_ns <= stamp < end_ns`, cut to that."""
    return [
        replace(span, start_ns=max(span.start_ns, start_ns), end_ns=min(span.end_ns, end_ns))
        for span in axis
        if max(span.start_ns, start_ns) < min(span.end_ns, end_ns)
    ]


def put_run(connection: Any, run: Run) -> None:
    """Write a run into the file."""
    connection.execute(
        insert_into("run"),
        (
            LOCAL_SITE,
            run.id,
            int(run.begun.is_simulated),
            run.begun.stamp_ns,
            run.begun.arrival_ns,
            run.begun_seq,
            run.joins,
            run.ended_ns,
        ),
    )


def simulation_goes_on(begun: Clock, last: Clock, now: Clock) -> bool:
    """Whether the simulation that is received `now` is the one that was last received at `last`.

    It is, if its clock is further than that of a new one could be. That would have begun after
    `last`, and run at most twice as fast as the old one, or as wall time. If the wall clock was set
    back meanwhile, the time between is unknown, and it counts as a new one.
    """
    waited_ns = now.arrival_ns - last.arrival_ns
    if waited_ns < -CORRECTION_NS:
        return False
    lasted_ns = max(1, last.arrival_ns - begun.arrival_ns)
    pace = max(1.0, (last.stamp_ns - begun.stamp_ns) / lasted_ns)
    is_later = now.stamp_ns >= last.stamp_ns
    return is_later and now.stamp_ns > _FASTER * pace * max(0, waited_ns)


def turn_of(before: Clock, now: Clock, jumped_ns: int) -> Turn | None:
    """What a clock did while the twin was running; None: it just went on.

    `jumped_ns` is how much further it went than the steady clock.
    """
    back_ns = before.stamp_ns - now.stamp_ns
    if before.is_simulated != now.is_simulated or (now.is_simulated and back_ns > 0):
        return Turn.BACK
    if now.is_simulated:
        return None
    if back_ns > 0:
        return Turn.STEP if back_ns <= CORRECTION_NS else Turn.BACK
    return Turn.AHEAD if jumped_ns > CORRECTION_NS else None
