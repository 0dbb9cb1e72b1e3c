"""A twin elsewhere that answers for its past: the journal, and messages as they are on the wire."""

from __future__ import annotations

import asyncio
import sqlite3
from collections.abc import AsyncIterator, Callable, Coroutine, Sequence
from typing import Any, TypeVar

from lupin_msgs.srv import GetHistory
from rclpy.serialization import deserialize_message, serialize_message

from lupin_bridge.twin.web_past import WebPast
from lupin_twin import convert, convert_past
from lupin_twin.journal.fold import state_at
from lupin_twin.journal.queries import series
from lupin_twin.journal.writes import writes
from lupin_twin.past import PastRefused, PastRow, check_moment
from lupin_twin.workers import Workers

ResultT = TypeVar("ResultT")


def over_the_wire(message: Any) -> Any:
    """The message as it arrives."""
    return deserialize_message(serialize_message(message), type(message))


class Elsewhere:
    """Answers what is asked of a journal, as of `now_ns`; `asked` are the questions.

    `most_at_once` is how many questions for a series have been on their way together.
    """

    def __init__(self, connection: sqlite3.Connection, now_ns: int) -> None:
        self._connection = connection
        self._now_ns = now_ns
        self.asked: list[Any] = []
        self.most_at_once = 0
        self._under_way = 0
        # What a twin that is broken makes of its answers.
        self.spoil: Callable[[Any], None] = lambda _: None

    def ask(self, question: Callable[[WebPast], Coroutine[Any, Any, ResultT]]) -> ResultT:
        """What a `WebPast` makes of a question, in a loop of its own."""

        async def answer() -> ResultT:
            workers = Workers("test")
            try:
                return await question(
                    WebPast(
                        self._state,
                        self._history,
                        self._writes,
                        workers,
                        now_ns=lambda: self._now_ns,
                        tags=lambda: 0,
                    )
                )
            finally:
                workers.close()

        return asyncio.run(answer())

    async def _state(self, request: Any) -> Any:
        at_ns = convert.nanoseconds(self._heard(request).at)
        check_moment(at_ns, self._now_ns)
        return self._told(convert_past.state_response(state_at(self._connection, at_ns, "map")))

    async def _history(self, request: Any) -> Any:
        self._under_way += 1
        self.most_at_once = max(self.most_at_once, self._under_way)
        # As on the wire, others come in between.
        await asyncio.sleep(0)
        try:
            return self._series(request)
        finally:
            self._under_way -= 1

    def _series(self, request: Any) -> Any:
        try:
            asked = convert_past.series_request(self._heard(request))
        except PastRefused as error:
            return convert_past.refused(GetHistory.Response(), error)
        return self._told(
            convert_past.series_response(series(self._connection, asked, self._now_ns))
        )

    async def _writes(self, request: Any) -> Any:
        asked = convert_past.writes_request(self._heard(request))
        return self._told(convert_past.writes_response(writes(self._connection, asked)))

    def _heard(self, request: Any) -> Any:
        self.asked.append(request)
        return over_the_wire(request)

    def _told(self, response: Any) -> Any:
        response = over_the_wire(response)
        self.spoil(response)
        return response


async def gathered(lots: AsyncIterator[Sequence[PastRow]]) -> list[Sequence[PastRow]]:
    """All of them."""
    return [lot async for lot in lots]
