"""The one reader of a log: whatever is asked of the past, a process of its own answers it.

`serve` and `web` differ in where the log is, and in nothing that is read of it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from contextlib import aclosing
from typing import TypeVar

from lupin_bridge.twin.looking import Itself, Question
from lupin_bridge.twin.past_child import Now
from lupin_bridge.twin.past_process import PastProcess
from lupin_twin.journal.queries import SERIES_S
from lupin_twin.journal.writes import WRITES_S
from lupin_twin.past import PastRow, SeriesPast, SeriesRequest
from lupin_twin.past_writes import PastWrite, PastWrites, RecentRequest, WritesRequest
from lupin_twin.state import Snapshot

ResultT = TypeVar("ResultT")


class LogReader(ABC):
    """The part of a source that looks back, through `past`; it names the log and the moment.

    What is observed within the journal's 100 ms may be missing.
    """

    past: PastProcess

    @abstractmethod
    def now(self) -> Now:
        """At what a question is asked."""

    @abstractmethod
    async def _in_time(self, answer: Awaitable[ResultT]) -> ResultT:
        """Wait for an answer, as long as it may take."""

    @abstractmethod
    async def _found(self) -> None:
        """Wait for the log, where it is just being looked for."""

    async def ask(self, question: Question[ResultT], cost_s: float) -> ResultT:
        """See `TwinSource`."""
        await self._found()
        return await self._in_time(self.past.ask(question, self.now(), cost_s))

    async def state_at(self, at_ns: int) -> Snapshot:
        """Every tag as of a moment."""
        return await self.ask(Itself(at_ns), 0.0)

    async def series(self, request: SeriesRequest) -> SeriesPast:
        """See `TwinSource`."""
        return await self.ask(Itself(request), SERIES_S)

    async def recent(self, request: RecentRequest) -> tuple[PastWrite, ...]:
        """What was recent at a moment."""
        return await self.ask(Itself(request), WRITES_S)

    async def writes(self, request: WritesRequest) -> PastWrites:
        """See `TwinSource`."""
        return await self.ask(Itself(request), WRITES_S)

    async def rows(
        self,
        start_ns: int,
        end_ns: int,
        tag_id: str | None,
        sensor_type: str | None,
        write: Callable[[Sequence[PastRow]], ResultT],
    ) -> AsyncIterator[ResultT]:
        """Read a stretch when the last one was taken; what nobody takes is not read."""
        await self._found()
        query = start_ns, end_ns, tag_id, sensor_type
        async with aclosing(self.past.rows(query, write, self.now)) as lots:
            while True:
                try:
                    lot = await self._in_time(anext(lots))
                except StopAsyncIteration:
                    return
                yield lot
