"""The axis of time, cut into spans: the run of the clock that a moment belongs to, what it carries.

Where runs overlap, the newest that holds a moment has it. Between the end of a run and the next
one's beginning the earlier one goes on, and so does the last; before all of them is the first.
Whatever is asked of the past goes by these spans, so that all answers agree.
"""

from __future__ import annotations

import heapq
import sqlite3
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from lupin_twin.journal.reading import runs
from lupin_twin.journal.runs import Carries, Run

# Later than any stamp.
FOREVER_NS: Final = 2**63 - 1
# Runs behind the present one whose readings can still be the newest of a tag.
MAX_RUNS: Final = 100


@dataclass(frozen=True, slots=True)
class Span:
    """A stretch of ROS time, `start_ns <= stamp < end_ns`, and the run that it belongs to."""

    run: Run
    start_ns: int
    end_ns: int


def spans(connection: sqlite3.Connection) -> tuple[Span, ...]:
    """All of the axis from 0 to `FOREVER_NS`, in order; empty where there is no run."""
    # No run ends before it begins; a damaged file may say otherwise.
    ends = dict(connection.execute("SELECT id, max(ended_stamp_ns, begun_stamp_ns) FROM run"))
    waiting = sorted(
        runs(connection).values(), key=lambda run: (run.begun.stamp_ns, run.id), reverse=True
    )
    edges = {run.begun.stamp_ns for run in waiting}
    # A run holds its beginning at least, and the last moment that was heard.
    edges |= {ended_ns + 1 for ended_ns in ends.values() if ended_ns is not None}
    starts: list[tuple[int, Run]] = []
    holding: list[tuple[int, int, Run]] = []  # the newest first
    for at_ns in sorted(edges):
        while waiting and waiting[-1].begun.stamp_ns <= at_ns:
            run = waiting.pop()
            ended_ns = ends[run.id]
            until_ns = FOREVER_NS if ended_ns is None else ended_ns + 1
            heapq.heappush(holding, (-run.id, until_ns, run))
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


def span_at(connection: sqlite3.Connection, at_ns: int) -> Span | None:
    """The span of a moment; None before 0, and where there is no run."""
    every = spans(connection)
    index = bisect_right([span.start_ns for span in every], at_ns)
    return every[index - 1] if index else None


def spans_within(connection: sqlite3.Connection, start_ns: int, end_ns: int) -> tuple[Span, ...]:
    """The spans of `start_ns <= stamp < end_ns`, cut to that."""
    return tuple(
        Span(span.run, max(span.start_ns, start_ns), min(span.end_ns, end_ns))
        for span in spans(connection)
        if max(span.start_ns, start_ns) < min(span.end_ns, end_ns)
    )


def behind(connection: sqlite3.Connection, run: Run) -> Iterator[tuple[Run, int | None, Carries]]:
    """The run and those it follows: each with what it is held to, and what of it still holds.

    Past `MAX_RUNS` only those in which a tag was pinned: a clock that goes back all day leaves
    thousands behind.
    """
    by_id = runs(connection)
    pinned = {number for (number,) in connection.execute("SELECT DISTINCT run FROM pin")}
    depth = 0
    begun_ns: int | None = None
    carries = Carries.ALL
    past: Run | None = run
    while past is not None and carries is not Carries.NOTHING:
        if depth < MAX_RUNS or past.id in pinned:
            yield past, begun_ns, carries
        depth += 1
        begun_ns = min(past.begun.stamp_ns, past.begun.stamp_ns if begun_ns is None else begun_ns)
        carries = min(carries, past.carries)
        # A run follows an earlier one; a damaged file may say otherwise.
        follows = past.follows
        past = by_id.get(follows) if follows is not None and follows < past.id else None
