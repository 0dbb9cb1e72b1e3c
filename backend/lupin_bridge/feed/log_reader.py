"""What both sources have in common: a ROS thread, and the one reader of a log.

`serve` and `web` differ in where the log is, and in nothing that is read of it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from contextlib import aclosing
from typing import TYPE_CHECKING, Any, TypeVar

from lupin_bridge.feed.past_child import Now
from lupin_bridge.feed.past_process import PastProcess
from lupin_bridge.feed.query import Itself, Question
from lupin_bridge.feed.source import ELSEWHERE
from lupin_twin.core.notes import Note, NotesRequest, NotesUnwritable, PastNotes
from lupin_twin.core.past import PastRow, SeriesPast, SeriesRequest
from lupin_twin.core.state import Snapshot
from lupin_twin.core.writes import PastWrite, PastWrites, RecentRequest, WritesRequest
from lupin_twin.journal.follow import WRITES_S
from lupin_twin.journal.notes import NOTES_S
from lupin_twin.journal.queries import SERIES_S

if TYPE_CHECKING:  # `fleet` reads logs without ROS
    from lupin_bridge.feed.ros_thread import RosThread

ResultT = TypeVar("ResultT")


class LogReader(ABC):
    """The part of a source that reads the past, through `past`; it names the log and the moment.

    What is observed within the journal's 100 ms may be missing.
    """

    past: PastProcess
    thread: RosThread[Any, Any]

    @property
    def is_alive(self) -> bool:
        """Whether the ROS thread runs."""
        return self.thread.is_alive

    @property
    def stuck_s(self) -> float:
        """How long the ROS thread has not answered a heartbeat, s."""
        return self.thread.stuck_s

    @property
    def calls_waiting(self) -> int:
        """Calls that wait for the ROS thread now."""
        return self.thread.calls_waiting

    @property
    def callback_errors(self) -> int:
        """Errors met by the node's callbacks, as of the last heartbeat."""
        return self.thread.callback_errors

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

    async def notes(self, request: NotesRequest) -> PastNotes:
        """See `TwinSource`."""
        return await self.ask(Itself(request), NOTES_S)

    # Only the process that keeps the journal writes it.
    writes_notes = False

    async def write_note(self, note: Note) -> Note:
        """See `TwinSource`."""
        raise NotesUnwritable(f"the note of {note.by} cannot be written: {ELSEWHERE}")

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
