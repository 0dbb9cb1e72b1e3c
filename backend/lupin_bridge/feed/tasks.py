"""Asyncio helpers: survive errors (`Guard`), repeat work, run identical work once, end tasks."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable, Coroutine, Hashable
from typing import Any, Generic, TypeVar

ResultT = TypeVar("ResultT")

log = logging.getLogger(__name__)


async def end(*tasks: asyncio.Task[Any] | None) -> None:
    """Cancel tasks, and wait until they have ended; None: a task that never started."""
    begun = [task for task in tasks if task is not None]
    for task in begun:
        task.cancel()
    await asyncio.gather(*begun, return_exceptions=True)


class Guard:
    """Runs work of a task that nobody awaits: an error ends nothing, and is logged under `what`.

    An error that persists is logged once. `known` are the errors that need no traceback.
    """

    def __init__(self, what: str, *known: type[Exception]) -> None:
        self._what, self._known, self._last = what, known, ""

    async def run(self, work: Awaitable[ResultT]) -> ResultT | Exception:
        """The result of the work, or its error."""
        try:
            result = await work
        except Exception as error:
            last, self._last = self._last, repr(error)
            if last != self._last:
                is_known = isinstance(error, self._known)
                level = logging.WARNING if is_known else logging.ERROR
                log.log(level, "%s: %s", self._what, error, exc_info=not is_known)
            return error
        self._last = ""
        return result


class Periodic:
    """Repeats `work` with pauses of `every_s`, from `start` to `stop`; the first is `first_s`.

    After an error, it goes on; see `Guard`.
    """

    def __init__(
        self,
        work: Callable[[], Awaitable[None]],
        every_s: float,
        what: str,
        first_s: float | None = None,
    ) -> None:
        self._work, self._every_s, self._what = work, every_s, what
        self._first_s = every_s if first_s is None else first_s
        self._task: asyncio.Task[None] | None = None

    def start(self) -> None:
        """Start, unless it has started."""
        if self._task is None:
            self._task = asyncio.create_task(self._repeat(), name=self._what)

    async def stop(self) -> None:
        """Stop."""
        await end(self._task)

    async def _repeat(self) -> None:
        guard = Guard(f"{self._what} had an error and continues")
        await asyncio.sleep(self._first_s)
        while True:
            await guard.run(self._work())
            await asyncio.sleep(self._every_s)


class Shared:
    """Runs identical work once for all callers, and cancels it when nobody waits any more.

    A key identifies the work, and with it the type of its result. Belongs to the event loop.
    """

    def __init__(self) -> None:
        self._flights: dict[Hashable, _Flight[Any]] = {}

    def __len__(self) -> int:
        return len(self._flights)

    async def get(
        self, key: Hashable, start: Callable[[], Coroutine[Any, Any, ResultT]]
    ) -> ResultT:
        """The result of `start()`, or of the work under way with this key.

        A cancelled caller does not end it for the others; the last cancelled caller does.

        Raises:
            Exception: whatever the work raised, in all callers.

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
                self._forget(key, flight)  # or a new caller would wait for cancelled work
                flight.task.cancel()

    def _forget(self, key: Hashable, flight: _Flight[Any]) -> None:
        if self._flights.get(key) is flight:
            del self._flights[key]
        if flight.task.done() and not flight.task.cancelled():
            flight.task.exception()  # retrieved, in case all callers have gone


class _Flight(Generic[ResultT]):
    def __init__(self, task: asyncio.Task[ResultT]) -> None:
        self.task = task
        self.waiting = 0
