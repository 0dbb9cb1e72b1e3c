"""The past of a twin elsewhere, asked for over its services.

What GetHistory does not say is worked out here: the period that its buckets divide, by the rule of
`lupin_twin.past.grid`, and where a period without a start begins. What cannot be is not believed.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable
from dataclasses import replace
from typing import Any, Final, TypeVar

from lupin_bridge.twin.shared import Shared
from lupin_bridge.twin.source import TwinUnavailableError
from lupin_twin import convert_past
from lupin_twin.convert_past import Entries, NotAnAnswerError
from lupin_twin.past import (
    EVERY_TAG,
    HOUR_NS,
    MAX_POINTS,
    Event,
    Grid,
    NotRemembered,
    SeriesPast,
    SeriesRequest,
    grid,
)
from lupin_twin.past_writes import (
    MAX_WRITES,
    RECENT_NS,
    PastWrite,
    PastWrites,
    RecentRequest,
    WritesRequest,
    recent_of,
)
from lupin_twin.state import Snapshot
from lupin_twin.workers import Workers

# Looking for the first entry, each answer narrows the time to a bucket of five thousand.
_NARROWINGS: Final = 6
_READ_SERIES_S: Final = 0.01
_READ_WRITES_S: Final = 0.02
# What is recent is looked for in so many answers; and clocks that are so little apart agree.
_RECENT_LOTS: Final = 100
_RIGHT_NS: Final = 60 * 1_000_000_000

ResultT = TypeVar("ResultT")


Ask = Callable[[Any], Awaitable[Any]]


class WebPast:
    """Questions to a twin elsewhere; identical ones under way are asked once.

    `ask_state`, `ask_history` and `ask_writes` give the responses to GetStateAt, GetHistory and
    GetWrites, in time. `now_ns` tells ROS time as far as it is known here, `tags` about how many
    tags there are. Each method may raise `PastRefused`, `NotRemembered` or `TwinUnavailableError`.
    """

    def __init__(
        self,
        ask_state: Ask,
        ask_history: Ask,
        ask_writes: Ask,
        workers: Workers,
        *,
        now_ns: Callable[[], int],
        tags: Callable[[], int],
    ) -> None:
        self._ask_state = ask_state
        self._ask_history = ask_history
        self._ask_writes = ask_writes
        self._workers = workers
        self.now_ns = now_ns
        self._tags = tags
        self._states: Shared[Snapshot] = Shared()
        self._series: Shared[SeriesPast] = Shared()

    async def state_at(self, at_ns: int) -> Snapshot:
        """Every tag as of a moment."""
        return await self._states.get(at_ns, lambda: self._look_up_state(at_ns))

    async def series(self, request: SeriesRequest) -> SeriesPast:
        """A series, its period and its buckets as the twin itself has them."""
        # A reading of this very moment counts as one of the past.
        end_ns = max(request.end_ns or self.now_ns() + 1, request.start_ns)
        asked = replace(request, end_ns=end_ns)
        return await self._series.get(asked, lambda: self._look_up(asked))

    async def entries(self, request: SeriesRequest) -> Entries:
        """What the twin answers to this very question."""
        response = await self._ask_history(convert_past.series_request_message(request))
        return await self._read(
            lambda: convert_past.entries_of(response, request), cost_s=_READ_SERIES_S
        )

    async def writes(self, request: WritesRequest) -> PastWrites:
        """What was heard, in the order of hearing."""
        response = await self._ask_writes(convert_past.writes_request_message(request))
        return await self._read(
            lambda: convert_past.writes_of(response, request), cost_s=_READ_WRITES_S
        )

    async def recent(self, request: RecentRequest) -> tuple[PastWrite, ...]:
        """What was recent at a moment, out of all that was received since what can be."""
        at_ns, now_ns = request.at_ns, self.now_ns()
        # By a clock that is right, nothing arrives before its stamp.
        is_right = abs(time.time_ns() - now_ns) < _RIGHT_NS
        reach_s = (now_ns - at_ns + RECENT_NS + _RIGHT_NS) / 1e9 if is_right else 0.0
        after, found = 0, list[PastWrite]()
        for _ in range(_RECENT_LOTS):
            part = await self.writes(WritesRequest(after, max(0.0, reach_s), 0, MAX_WRITES))
            run = next((s.run for s in part.spans if s.start_ns <= at_ns < s.end_ns), None)
            found += [write for write in part.writes if write.run == run]
            found = list(recent_of(found, at_ns))
            if part.is_all:
                return tuple(found)
            after = part.last
        raise NotRemembered(
            f"the twin has received more than {_RECENT_LOTS * MAX_WRITES:,} scans since then, the "
            "limit; ask where its journal is",
            is_lasting=False,
        )

    async def first_ns(self, asked: SeriesRequest) -> int | None:
        """The stamp of the first entry of a period that has an end; None: there is none."""
        start_ns, end_ns = asked.start_ns, asked.end_ns
        found: int | None = None
        for _ in range(_NARROWINGS):
            entries = await self.entries(
                replace(asked, start_ns=start_ns, end_ns=end_ns, max_points=MAX_POINTS)
            )
            if not entries.stamps_ns:
                break
            found = entries.stamps_ns[0]
            # The first bucket is no longer than this.
            until_ns = found - -(end_ns - start_ns) // MAX_POINTS + 2 * HOUR_NS
            narrowed = max(1, found), min(end_ns, until_ns)
            if not entries.is_bucketed or narrowed == (start_ns, end_ns):
                break
            start_ns, end_ns = narrowed
        return found

    async def _look_up_state(self, at_ns: int) -> Snapshot:
        response = await self._ask_state(convert_past.moment_message(at_ns))
        return await self._read(
            lambda: convert_past.snapshot_of(response, at_ns),
            cost_s=self._tags() * convert_past.TAG_S,
        )

    async def _look_up(self, asked: SeriesRequest) -> SeriesPast:
        entries = await self.entries(asked)
        start_ns = asked.start_ns or await self._oldest_ns(asked, entries)
        told = Grid(start_ns, asked.end_ns, 0)
        if entries.is_bucketed:
            told = await self._grid(entries, start_ns, asked)
        return SeriesPast(told.start_ns, told.end_ns, told.bucket_ns or None, *entries[1:])

    async def _grid(self, entries: Entries, start_ns: int, asked: SeriesRequest) -> Grid:
        told, *longer = grids_of(entries, start_ns, asked)
        if longer and entries.stamps_ns:
            # What lies between the ends of the two is in the longer one, or nowhere.
            first_ns = entries.stamps_ns[0]
            between = first_ns + told.bucket_ns, first_ns + longer[0].bucket_ns
            rest = replace(asked, start_ns=between[0], end_ns=max(between), max_points=MAX_POINTS)
            if (await self.entries(rest)).stamps_ns:
                return longer[0]
        return told

    async def _oldest_ns(self, asked: SeriesRequest, entries: Entries) -> int:
        """Where a period begins that has no start: at its first reading, or at the first try."""
        if asked.event is None:
            if entries.stamps_ns and not entries.is_bucketed:
                return entries.stamps_ns[0]
            first = [await self.first_ns(asked)]
        elif asked.tag_id == EVERY_TAG:
            first = [await self.first_ns(replace(asked, sensor_type=Event.RUNS))]
        else:
            tried = (Event.SCANS, Event.FAILURES, Event.LOOKS)
            first = [await self.first_ns(replace(asked, sensor_type=event)) for event in tried]
        return min((at_ns for at_ns in first if at_ns is not None), default=asked.end_ns)

    async def _read(self, read: Callable[[], ResultT], cost_s: float) -> ResultT:
        try:
            return await asyncio.wrap_future(self._workers.submit(lambda _: read(), cost_s))
        except NotAnAnswerError as error:
            raise TwinUnavailableError(f"the twin's answer cannot be used: {error}") from error


def grids_of(entries: Entries, start_ns: int, asked: SeriesRequest) -> list[Grid]:
    """The buckets that a twin may have divided a period into, the shorter ones first.

    Where scans are deleted, or too many, they are told by the hour.

    Raises:
        TwinUnavailableError: none that fits.

    """
    found: list[Grid] = []
    for least_ns in (0, HOUR_NS):
        told = grid(start_ns, asked.end_ns, asked.max_points, least_ns)
        if told not in found and all(
            told.start_ns <= at_ns < told.end_ns and (at_ns - told.start_ns) % told.bucket_ns == 0
            for at_ns in entries.stamps_ns
        ):
            found.append(told)
    if not found:
        raise TwinUnavailableError("the twin's answer cannot be used: no buckets are like its own")
    return found
