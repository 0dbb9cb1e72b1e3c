"""Every reading and failed try of a period of a twin elsewhere, put together of many answers.

GetHistory tells one sensor of one tag. So the period is gone through in windows, each as long as
no series of it comes in buckets and all of it is some ten thousand rows: a question takes as long
for one reading as for hundreds. Within a window, the state at its end tells which sensors of which
tags were read in it at all, and a few of them are asked for at once. A window ends where a run of
the clock does: what was known then is what that run has heard.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import AsyncIterator, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from lupin_bridge.twin.source import TwinUnavailableError
from lupin_bridge.twin.web_past import WebPast
from lupin_twin.convert_past import Entries
from lupin_twin.past import (
    EVERY_TAG,
    HOUR_NS,
    MAX_POINTS,
    Event,
    NotRemembered,
    PastRow,
    SeriesRequest,
)
from lupin_twin.past_writes import PastWrites, WritesRequest
from lupin_twin.state import STATUS_OK, TagState

LOT: Final = 1_000
# Rows of a window: what is aimed at, and the most; and what is aimed at of one series.
_WANTED_ROWS: Final = 40_000
MAX_ROWS: Final = 160_000
_WANTED_POINTS: Final = MAX_POINTS * 3 // 4
# A window that holds too much is never shorter than this.
_SHORTEST_NS: Final = 1_000
_SHORTER: Final = 4
_LONGER: Final = 8
# Questions on their way at once: of `web_twin.MAX_REQUESTS`, one is left to everybody else.
AT_ONCE: Final = 3
_NOWHERE: Final = (math.nan, math.nan)


@dataclass(frozen=True, slots=True)
class _Wanted:
    """The tag and the sensor that are asked for; None: all."""

    tag_id: str | None
    sensor_type: str | None

    @property
    def events_of(self) -> str:
        return EVERY_TAG if self.tag_id is None else self.tag_id


async def rows(
    past: WebPast, start_ns: int, end_ns: int, tag_id: str | None, sensor_type: str | None
) -> AsyncIterator[Sequence[PastRow]]:
    """Lots of rows in the order of time; their `source` is not known, a reading's status is 0.

    Nor, where the clock went back, a place that was learnt at a moment which another run has taken.

    Raises:
        PastRefused, NotRemembered, TwinUnavailableError: see `WebPast`; NotRemembered also where
            behind rows that were told some are given up since.

    """
    wanted = _Wanted(tag_id, sensor_type)
    now_ns = past.now_ns()
    runs = await _runs(past, now_ns + 1)
    kept = _Kept(past, await _beginning(past))
    for begins_ns, ends_ns in runs:
        within = max(begins_ns, start_ns), min(ends_ns, end_ns, now_ns + 1)
        if within[0] < within[1]:
            run = _Run(past, kept, wanted, *within)
            await run.find_places(min(ends_ns - 1, now_ns))
            async for window in run.windows():
                for lot in window.lots():
                    yield lot


async def _runs(past: WebPast, end_ns: int) -> list[tuple[int, int]]:
    """Where each stretch of the axis that belongs to one run begins, and where it ends."""
    told = await past.entries(SeriesRequest(EVERY_TAG, Event.RUNS, 0, end_ns, MAX_POINTS))
    return list(pairwise((*told.stamps_ns, end_ns)))


async def _beginning(past: WebPast) -> PastWrites:
    return await past.writes(WritesRequest(max_count=1))


class _Kept:
    """Whether the twin still has what it had: `noted` is the oldest that it has.

    What is given up is what was heard first. A late observation with an older stamp is not seen to
    go; nor is it known of a silence behind what was told whether it was one.
    """

    def __init__(self, past: WebPast, noted: PastWrites) -> None:
        self._past = past
        self._noted = noted
        self._has_told = False

    async def is_whole(self, at_ns: int) -> bool:
        """Whether of what comes from a moment on, nothing was given up since it was asked last.

        Raises:
            NotRemembered: some was, and rows that lie before it are told.

        """
        noted, now = self._noted, await _beginning(self._past)
        is_lost = _lies_before(now, at_ns) and not _lies_before(noted, at_ns)
        if now.journal != noted.journal or is_lost:
            if self._has_told:
                why = "readings that come next were given up while others were taken: begin again"
                raise NotRemembered(why, is_lasting=False)
            self._noted = now
            return False
        return True

    def tell(self) -> None:
        """Rows are told from here on: none may be missing behind them."""
        self._has_told = True


def _lies_before(kept: PastWrites, at_ns: int) -> bool:
    """Whether a moment lies before the oldest that is kept, in the order of hearing."""
    if not kept.writes:
        return True
    oldest = kept.writes[0]
    run = next((span.run for span in kept.spans if span.start_ns <= at_ns < span.end_ns), None)
    return run is not None and (run, at_ns) < (oldest.run, oldest.stamp_ns)


@dataclass(frozen=True, slots=True)
class _Series:
    """The readings of one sensor of a tag in a window, or the tries that failed."""

    tag_id: str
    name: str
    stamps_ns: NDArray[np.int64]
    values: NDArray[np.float64]

    def row(self, stamp_ns: int, value: float, place: tuple[float, float]) -> PastRow:
        if self.name == Event.FAILURES:
            return PastRow(stamp_ns, self.tag_id, *place, "", math.nan, int(value), "")
        return PastRow(stamp_ns, self.tag_id, *place, self.name, value, STATUS_OK, "")


class _Window:
    """What a window holds, in the order of time: rows are made as they are taken."""

    def __init__(self, series: Sequence[_Series], places: dict[str, tuple[float, float]]) -> None:
        self._series = [each for each in series if len(each.stamps_ns)]
        self._places = [places.get(each.tag_id, _NOWHERE) for each in self._series]
        lengths = [len(each.stamps_ns) for each in self._series]
        self.longest = max(lengths, default=0)
        if lengths:
            stamps_ns = np.concatenate([each.stamps_ns for each in self._series])
            values = np.concatenate([each.values for each in self._series])
            order = np.argsort(stamps_ns, kind="stable")
            of_series = np.repeat(np.arange(len(lengths), dtype=np.int32), lengths)
            self._columns = of_series[order], stamps_ns[order], values[order]

    def __len__(self) -> int:
        return len(self._columns[0]) if self._series else 0

    def lots(self) -> Iterator[list[PastRow]]:
        for first in range(0, len(self), LOT):
            part = (column[first : first + LOT].tolist() for column in self._columns)
            yield [
                self._series[number].row(stamp_ns, value, self._places[number])
                for number, stamp_ns, value in zip(*part, strict=True)
            ]


class _Run:
    """What is exported of a run."""

    def __init__(
        self, past: WebPast, kept: _Kept, wanted: _Wanted, start_ns: int, end_ns: int
    ) -> None:
        self._past = past
        self._kept = kept
        self._wanted = wanted
        self._start_ns, self._end_ns = start_ns, end_ns
        self._places: dict[str, tuple[float, float]] = {}

    async def find_places(self, at_ns: int) -> None:
        """Where tags are, as the run knew it in the end: a tag does not move."""
        state = await self._past.state_at(at_ns)
        self._places = {
            tag.tag_id: (tag.pose.x, tag.pose.y) for tag in state.tags if tag.pose is not None
        }

    async def windows(self) -> AsyncIterator[_Window]:
        at_ns, length_ns = await self._next(self._start_ns), HOUR_NS
        while at_ns is not None and at_ns < self._end_ns:
            until_ns = min(at_ns + length_ns, self._end_ns)
            found = await self._window(at_ns, until_ns)
            if found is None:
                if length_ns <= _SHORTEST_NS:
                    raise TwinUnavailableError(
                        f"the twin tells of more than {MAX_POINTS} readings of a sensor, or "
                        f"{MAX_ROWS} in all, within {length_ns} ns from {at_ns} ns on"
                    )
                length_ns = max(_SHORTEST_NS, (until_ns - at_ns) // _SHORTER)
                continue
            next_ns = until_ns if found else await self._next(until_ns)
            # Only now: none of what lies between the two is passed over then.
            if not await self._kept.is_whole(at_ns) and found:
                continue
            if found:
                self._kept.tell()
                yield found
            length_ns = _adapted(length_ns, found)
            at_ns = next_ns

    async def _next(self, from_ns: int) -> int | None:
        """The first try from a moment on: what lies before it was never read, or is given up."""
        if from_ns >= self._end_ns:
            return None
        found = [
            await self._past.first_ns(
                SeriesRequest(self._wanted.events_of, event, max(1, from_ns), self._end_ns)
            )
            for event in (Event.SCANS, Event.FAILURES)
        ]
        return min((at_ns for at_ns in found if at_ns is not None), default=None)

    async def _window(self, start_ns: int, end_ns: int) -> _Window | None:
        """What a window holds; None: too much."""
        state = await self._past.state_at(end_ns - 1)
        asked = [
            SeriesRequest(tag.tag_id, name, start_ns, end_ns, MAX_POINTS)
            for tag in state.tags
            # What was tried last before the window was not tried in it.
            if self._wanted.tag_id in (None, tag.tag_id)
            and tag.last_try is not None
            and tag.last_try.stamp_ns >= start_ns
            for name in self._names(tag, start_ns)
        ]
        found = await self._all_of(asked)
        return None if found is None else _Window(found, self._places)

    async def _all_of(self, asked: Sequence[SeriesRequest]) -> list[_Series] | None:
        """The answers in the order of the questions; None: too much in one, or in all."""
        waiting = iter(enumerate(asked))
        found: dict[int, _Series] = {}
        rows = 0

        async def is_too_much() -> bool:
            nonlocal rows
            for number, request in waiting:
                told = await self._series(request)
                if told is None:
                    return True
                found[number] = told
                rows += len(told.stamps_ns)
                if rows > MAX_ROWS:
                    return True
            return False

        asking = [asyncio.create_task(is_too_much()) for _ in range(AT_ONCE)]
        try:
            for done in asyncio.as_completed(asking):
                if await done:
                    return None
        finally:
            for task in asking:
                task.cancel()
            await asyncio.gather(*asking, return_exceptions=True)
        return [found[number] for number in range(len(asked))]

    def _names(self, tag: TagState, since_ns: int) -> list[str]:
        """What to ask of a tag: sensors that were read since, and the tries that failed."""
        if self._wanted.sensor_type is None and tag.tag_id != EVERY_TAG:
            names = [Event.FAILURES.value]
        else:
            names = []
        return names + [
            reading.name
            for reading in tag.readings
            if (reading.observed_at_ns or 0) >= since_ns
            and self._wanted.sensor_type in (None, reading.name)
            and not reading.name.startswith("~")  # it would be taken for an event
        ]

    async def _series(self, asked: SeriesRequest) -> _Series | None:
        """What is told of one question; None: too much."""
        told = await self._past.entries(asked)
        stamps_ns, values = told.stamps_ns, told.means
        if told.is_bucketed:
            if not await self._is_given_up(asked, told):
                return None
            stamps_ns, values = (), ()
        return _Series(
            asked.tag_id,
            asked.sensor_type,
            np.array(stamps_ns, dtype=np.int64),
            np.array(values, dtype=np.float64),
        )

    async def _is_given_up(self, asked: SeriesRequest, told: Entries) -> bool:
        """Whether so few come in buckets because their scans are no longer kept.

        What is given up is the older part of a run: with its last hour, all of a window is.
        """
        if sum(told.counts) > MAX_POINTS:
            return False
        last_hour_ns = asked.end_ns - HOUR_NS
        if asked.start_ns >= last_hour_ns:
            return True
        return (await self._past.entries(replace(asked, start_ns=last_hour_ns))).is_bucketed


def _adapted(length_ns: int, window: _Window) -> int:
    """How long the window behind one is to be, by what that one held."""
    wanted = min(
        _LONGER,
        _WANTED_ROWS / max(1, len(window)),
        _WANTED_POINTS / max(1, window.longest),
    )
    return max(_SHORTEST_NS, int(length_ns * wanted))
