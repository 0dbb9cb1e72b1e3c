"""Runs of the clock: which one a twin that starts is in, and which one a moment belongs to.

Wall time goes on over a restart, and is set a little now and then; a simulation begins again at 0:
what it said yesterday at second 500 must not look fresh at second 510 today.

Where runs overlap, the newest that holds a moment has it. Between the end of a run and the next
one's beginning the earlier one goes on, and so does the last; before all of them is the first.
"""

from __future__ import annotations

import heapq
from bisect import bisect_right
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import Enum
from typing import Any, Final

from lupin_twin.core.diagnostics import origin_of
from lupin_twin.core.parameters import World
from lupin_twin.core.past import FOREVER_NS
from lupin_twin.journal.schema import DAY_LENGTH, LOCAL_SITE, ORIGIN, SiteLog

# A wall clock that is set back by no more is the same clock, corrected.
CORRECTION_NS: Final = 300 * 1_000_000_000
# How much faster than before a simulation may go on.
_FASTER: Final = 2.0


class Turn(Enum):
    """Why a clock is followed anew."""

    START = "start"
    BELIEVED = "believed"  # the start, with a clock that contradicts the log and stays so
    STEP = "step"  # a wall clock was set back a little: the run goes on
    BACK = "back"  # a new run
    AHEAD = "ahead"  # a wall clock jumped ahead: a run that it had gone back from may go on


@dataclass(frozen=True, slots=True)
class Clock:
    """A moment on both clocks, ns: ROS time, which may be simulated, and the wall's."""

    stamp_ns: int
    arrival_ns: int
    is_simulated: bool


@dataclass(frozen=True, slots=True)
class Run:
    """A stretch of ROS time, or a step within one (`joins` is the run that it is part of).

    What holds in it was written with `begun_seq` or later, copies of what was known included.
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


@dataclass(frozen=True, slots=True)
class Span:
    """A stretch of ROS time, `start_ns <= stamp < end_ns`, and the run that it belongs to."""

    run: Run
    start_ns: int
    end_ns: int


def runs(execute: Callable[..., Any]) -> list[Run]:
    """Every run and step, in the order in which they began; of a connection to either engine."""
    return [
        Run(row[0], Clock(row[2], row[3], bool(row[1])), row[4], row[5], row[6])
        for row in execute(
            "SELECT run, is_simulated, begun_stamp_ns, begun_arrival_ns, begun_seq, joins,"
            " ended_stamp_ns FROM run WHERE site = :site ORDER BY run",
            {"site": LOCAL_SITE},
        ).fetchall()
    ]


def since_seq(every: Iterable[Run], root: int, at_ns: int) -> int:
    """From which seq on the rows of a run hold as of a moment: its last step by then."""
    steps = [run for run in every if run.root == root]
    begun = [run for run in steps if run.begun.stamp_ns <= at_ns]
    return (begun or steps)[-1 if begun else 0].begun_seq


def spans(every: Iterable[Run]) -> tuple[Span, ...]:
    """All of the axis from 0 to `FOREVER_NS`, in order; empty where there is no run."""
    every = list(every)
    roots = [run for run in every if run.joins is None]
    # A step may lead to before the beginning.
    begun: dict[int, int] = {}
    for run in every:
        stamp_ns = run.begun.stamp_ns
        begun[run.root] = min(stamp_ns, begun.get(run.root, stamp_ns))
    waiting = sorted(roots, key=lambda run: (begun[run.id], run.id), reverse=True)
    # A run holds its beginning at least, and the last moment that was received.
    until = {
        run.id: FOREVER_NS if run.ended_ns is None else max(run.ended_ns, run.begun.stamp_ns) + 1
        for run in roots
    }
    edges = set(begun.values()) | set(until.values()) - {FOREVER_NS}
    starts: list[tuple[int, Run]] = []
    holding: list[tuple[int, int, Run]] = []  # the newest first
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
        Span(run, start_ns, end_ns) for (start_ns, run), end_ns in zip(starts, ends_ns, strict=True)
    )


def span_at(every: Iterable[Run], at_ns: int) -> Span | None:
    """The span of a moment; None before 0, and where there is no run."""
    found = spans(every)
    index = bisect_right([span.start_ns for span in found], at_ns)
    return found[index - 1] if index else None


def world_of(log: SiteLog) -> World:
    """What is observed, as whoever wrote last has noted it."""
    span = span_at(runs(log.execute), FOREVER_NS)
    is_simulated = span is not None and span.run.begun.is_simulated
    origin = origin_of(log.meta(ORIGIN) or "", is_simulated=is_simulated)
    try:
        day_s = float(log.meta(DAY_LENGTH) or "")
    except ValueError:
        day_s = 0.0
    # Else it is none: all that shows or estimates by the day would end in it.
    return World(origin, day_s) if 1.0 <= day_s <= World().day_length_s else World(origin)


def cut(axis: Iterable[Span], start_ns: int, end_ns: int) -> list[Span]:
    """The spans of `start_ns <= stamp < end_ns`, cut to that."""
    return [
        Span(span.run, max(span.start_ns, start_ns), min(span.end_ns, end_ns))
        for span in axis
        if max(span.start_ns, start_ns) < min(span.end_ns, end_ns)
    ]


def put_run(connection: Any, run: Run) -> None:
    """Have a run in the file."""
    connection.execute(
        "INSERT INTO run VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
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
    """Whether a simulation that is received `now` is the one last received at `last`.

    It is if its clock is further on than one could be that began after the last word of the old
    one: at twice the pace that the old one had, or the wall's. Where the wall's clock was set back
    meanwhile, how long that was is not known, and it is another.
    """
    waited_ns = now.arrival_ns - last.arrival_ns
    if waited_ns < -CORRECTION_NS:
        return False
    lasted_ns = max(1, last.arrival_ns - begun.arrival_ns)
    pace = max(1.0, (last.stamp_ns - begun.stamp_ns) / lasted_ns)
    is_later = now.stamp_ns >= last.stamp_ns
    return is_later and now.stamp_ns > _FASTER * pace * max(0, waited_ns)


def turn_of(before: Clock, now: Clock, jumped_ns: int) -> Turn | None:
    """What a clock has done while the twin lived; None: it went on.

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
