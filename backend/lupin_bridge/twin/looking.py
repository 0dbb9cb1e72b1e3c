"""Questions about the past as values, so that another process may answer them.

A question says one by one what it has to know, a state as of a moment or a series, and with
the last of that what is left to do. Who drives it knows the past: over a journal in another process
(`past_child`), or over ROS (`look_up`).
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import Any, Final, Generic, Protocol, TypeVar

from lupin_twin.past import NotRemembered, SeriesPast, SeriesRequest
from lupin_twin.past_writes import PastWrite, RecentRequest, WritesRequest
from lupin_twin.state import Snapshot
from lupin_twin.workers import ShouldStop, Workers

ResultT = TypeVar("ResultT")

# A moment, ns of ROS time, which `Snapshot` answers; a series, which `SeriesPast` does; what was
# recent at a moment, which a tuple of `PastWrite` does; or what was received, which `PastWrites`
# does: only a journal knows that.
Need = int | SeriesRequest | RecentRequest | WritesRequest
# What is known as of then crosses by itself, so it is of any type.
Found = Any
# What writing a row of an export takes, roughly and at worst, s.
WRITE_ROW_S: Final = 5e-6


@dataclass(frozen=True, slots=True)
class Work(Generic[ResultT]):
    """What is left when all is known, and about how long that takes, s of one core."""

    cost_s: float
    do: Callable[[ShouldStop], ResultT]


class Question(Protocol[ResultT]):
    """A value that can be pickled, and so can its answer."""

    def look(self) -> Generator[Need, Found, Work[ResultT]]:
        """Yield each need, get what was found, return the work."""


class Past(Protocol):
    """Who knows the past in this process. Each may raise `PastRefused` or `NotRemembered`."""

    async def state_at(self, at_ns: int) -> Snapshot:
        """Every tag as of a moment that has passed; `stamp_ns` is that moment."""

    async def series(self, request: SeriesRequest) -> SeriesPast:
        """Readings of one sensor of one tag, or events."""

    async def recent(self, request: RecentRequest) -> tuple[PastWrite, ...]:
        """What was recent at a moment."""


@dataclass(frozen=True, slots=True)
class Itself:
    """The question whose answer is what was found, as it is."""

    need: Need

    def look(self) -> Generator[Need, Found, Work[Any]]:
        """One need and no work."""
        found = yield self.need
        return Work(0.0, lambda _: found)


async def look_up(question: Question[ResultT], past: Past, workers: Workers) -> ResultT:
    """Answer a question here; its work is done on a worker."""
    import asyncio  # noqa: PLC0415  # `past_child` has no use for it, and it is 3 MB

    looking = question.look()
    try:
        need = next(looking)
        while True:
            if isinstance(need, SeriesRequest):
                need = looking.send(await past.series(need))
            elif isinstance(need, RecentRequest):
                need = looking.send(await past.recent(need))
            elif isinstance(need, WritesRequest):
                raise NotRemembered("what was heard is asked of the journal", is_lasting=True)
            else:
                need = looking.send(await past.state_at(need))
    except StopIteration as end:
        work: Work[ResultT] = end.value
    return await asyncio.wrap_future(workers.submit(work.do, work.cost_s))
