"""A made-up past, for routes over any source: plain lists, searched linearly."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Callable, Sequence
from dataclasses import dataclass, field, replace
from statistics import fmean
from typing import Any, TypeVar

from lupin_bridge.feed.query import LogReader, Now, PastQuery
from lupin_bridge.past.plans import Query, answered
from lupin_twin.core.diagnostics import UNKNOWN_JOURNAL
from lupin_twin.core.notes import NotesRequest, PastNotes
from lupin_twin.core.past import (
    Event,
    NotRemembered,
    PastRow,
    PastWrites,
    SeriesPast,
    SeriesRequest,
    WritesRequest,
)
from lupin_twin.core.state import Observation, Snapshot
from lupin_twin.estimate.engine import TagPast
from lupin_twin.runtime.workers import Workers

NS = 10**9
ResultT = TypeVar("ResultT")


async def look_up(query: PastQuery[ResultT], past: MadeUp, workers: Workers) -> ResultT:
    log: Any = past
    return await asyncio.wrap_future(workers.submit(lambda _: query(log), 0.0))


@dataclass
class MadeUp:
    """A `LogReader` without a log, and the calls that it received.

    `points` are (stamp, value) by (tag, sensor or event); `lots` are the rows of an export. What
    was `scanned` is the answer for any period.
    """

    now_ns: int = 1_000 * NS
    points: dict[tuple[str, str], list[tuple[int, float]]] = field(default_factory=dict)
    lots: list[list[PastRow]] = field(default_factory=list)
    snapshot: Snapshot = field(default_factory=lambda: Snapshot(0, "map", ()))
    scanned: tuple[Observation, ...] = ()
    pasts: list[TagPast] = field(default_factory=list)
    error: Exception | None = None
    requested: list[object] = field(default_factory=list)
    costs: list[float] = field(default_factory=list)
    lots_taken: int = 0
    is_closed: bool = False

    @staticmethod
    def should_stop() -> bool:
        """No query is cancelled."""
        return False

    def notes(self, _: NotesRequest) -> PastNotes:
        """There are none."""
        return PastNotes("", 0, ())

    def writes(self, _: WritesRequest) -> PastWrites:
        """The alarms do without a log."""
        raise NotRemembered("the log is not read here")

    def state(self, at_ns: int) -> Snapshot:
        """The one state, for any moment."""
        self._note(at_ns)
        return replace(self.snapshot, stamp_ns=at_ns)

    def recent(self, at_ns: int) -> tuple[Observation, ...]:
        """What was scanned; usually nothing: the state has everything."""
        self._note(at_ns)
        return self.scanned

    def readings(self, *_: object) -> list[TagPast]:
        """What an estimate is made of."""
        return self.pasts

    def scans(self, *_: object) -> tuple[Observation, ...]:
        """Nothing before that."""
        return ()

    def latest(self, *_: object) -> list[Observation]:
        """Nothing: the state is ahead of the log."""
        return []

    def series(self, request: SeriesRequest) -> SeriesPast:
        """The points of a period, or the requested number of buckets."""
        self._note(request)
        end_ns = request.end_ns or self.now_ns
        all_points = self.points.get((request.tag_id, request.sensor_type), [])
        points = [p for p in all_points if request.start_ns <= p[0] < end_ns]
        if len(points) <= request.max_points or request.event is Event.RUNS:
            stamps, values = zip(*points, strict=True) if points else ((), ())
            ones = (1,) * len(points)
            return SeriesPast(request.start_ns, end_ns, None, stamps, ones, values, values, values)
        width_ns = -(-(end_ns - request.start_ns) // request.max_points)
        found: dict[int, list[float]] = {}
        for stamp_ns, value in points:
            start_ns = stamp_ns - (stamp_ns - request.start_ns) % width_ns
            found.setdefault(start_ns, []).append(value)
        groups = tuple(found.values())
        return SeriesPast(
            request.start_ns,
            end_ns,
            width_ns,
            tuple(found),
            tuple(map(len, groups)),
            tuple(map(fmean, groups)),
            tuple(map(min, groups)),
            tuple(map(max, groups)),
        )

    async def rows(
        self,
        start_ns: int,
        end_ns: int,
        tag_id: str | None,
        sensor_type: str | None,
        write: Callable[[Sequence[PastRow]], Any],
    ) -> AsyncGenerator[Any]:
        """The batches, one by one; the error, if there is one, after the last."""
        self.requested.append((start_ns, end_ns, tag_id, sensor_type))
        try:
            for lot in self.lots:
                await asyncio.sleep(0)  # as it is for every source of batches
                self.lots_taken += 1
                yield write(lot)
            if self.error is not None:
                raise self.error
        finally:
            self.is_closed = True

    def _note(self, requested: object) -> None:
        self.requested.append(requested)
        if self.error is not None:
            raise self.error


def answered_by(log: Any, query: Query) -> bytes:
    """The body of a query's answer over a log, as the past process makes it."""
    now = Now(2**62, "map", UNKNOWN_JOURNAL)
    answer = answered(query, "", LogReader(log, now)).answer
    assert answer is not None
    return answer.body
