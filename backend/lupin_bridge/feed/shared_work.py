"""Identical work under way is done once, and ends when nobody waits for it any more."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine, Hashable
from typing import Any, Generic, TypeVar

ResultT = TypeVar("ResultT")


class Shared(Generic[ResultT]):
    """The work under way, by what it makes. Belongs to the event loop."""

    def __init__(self) -> None:
        self._flights: dict[Hashable, _Flight[ResultT]] = {}

    def __len__(self) -> int:
        return len(self._flights)

    async def get(
        self, key: Hashable, start: Callable[[], Coroutine[Any, Any, ResultT]]
    ) -> ResultT:
        """The result of `start()`, or of the one under way with this key.

        Who leaves does not end it for the others; the last one who leaves does.

        Raises:
            Exception: whatever the work raised, for all who wait.

        """
        flight = self._flights.get(key)
        if flight is None:
            flight = self._flights[key] = _Flight(asyncio.create_task(start()))
            flight.task.add_done_callback(lambda _: self._forget(key, flight))
        flight.waiting += 1
        try:
            return await asyncio.shield(flight.task)
        finally:
            flight.waiting -= 1
            if not flight.waiting and not flight.task.done():
                self._forget(key, flight)  # or who comes now would wait for what is about to end
                flight.task.cancel()

    def _forget(self, key: Hashable, flight: _Flight[ResultT]) -> None:
        if self._flights.get(key) is flight:
            del self._flights[key]
        if flight.task.done() and not flight.task.cancelled():
            flight.task.exception()  # looked at, should all who waited have left


class _Flight(Generic[ResultT]):
    def __init__(self, task: asyncio.Task[ResultT]) -> None:
        self.task = task
        self.waiting = 0
