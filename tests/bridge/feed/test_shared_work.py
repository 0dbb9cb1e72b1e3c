"""Work that is done once for all who ask for the same, and only while somebody waits."""

import asyncio

import pytest

from lupin_bridge.feed.shared_work import Shared
from tests.support.waiting import until


class Work:
    """Work that is counted, and ends when the test lets it."""

    def __init__(self) -> None:
        self.started = self.cancelled = 0
        self.may_end = asyncio.Event()
        self.failure: Exception | None = None

    async def __call__(self) -> int:
        self.started += 1
        number = self.started
        try:
            await self.may_end.wait()
        except asyncio.CancelledError:
            self.cancelled += 1
            raise
        if self.failure is not None:
            raise self.failure
        return number


async def waiting(shared: Shared[int], work: Work, *keys: str) -> list[asyncio.Task[int]]:
    tasks = [asyncio.create_task(shared.get(key, work)) for key in keys]
    # Work begins a turn of the loop after it was asked for: by then all have asked.
    await until(lambda: work.started == len(set(keys)), "the work")
    return tasks


async def test_who_asks_for_the_same_gets_the_same_work() -> None:
    shared, work = Shared[int](), Work()
    tasks = await waiting(shared, work, "a", "a", "b", "a")
    assert (work.started, len(shared)) == (2, 2)
    work.may_end.set()
    assert await asyncio.gather(*tasks) == [1, 1, 2, 1]
    assert len(shared) == 0
    assert await shared.get("a", work) == 3, "what is done is not kept"


async def test_it_lives_while_anyone_waits_and_ends_with_the_last() -> None:
    shared, work = Shared[int](), Work()
    first, second = await waiting(shared, work, "a", "a")
    first.cancel()
    await asyncio.wait([first])
    assert (first.cancelled(), work.cancelled) == (True, 0)
    second.cancel()
    await asyncio.wait([second])
    await until(lambda: work.cancelled == 1, "the end of the work")
    assert len(shared) == 0


async def test_who_comes_as_the_last_one_leaves_gets_work_of_its_own() -> None:
    shared, work = Shared[int](), Work()
    (leaving,) = await waiting(shared, work, "a")
    leaving.cancel()
    await asyncio.sleep(0)  # it has left; the work has not heard of it yet
    coming = asyncio.create_task(shared.get("a", work))
    await asyncio.wait([leaving])
    work.may_end.set()
    assert await coming == 2
    assert (work.cancelled, len(shared)) == (1, 0)


async def test_an_error_is_everybodys_and_is_not_kept() -> None:
    shared, work = Shared[int](), Work()
    tasks = await waiting(shared, work, "a", "a")
    work.failure = MemoryError("too much")
    work.may_end.set()
    for task in tasks:
        with pytest.raises(MemoryError):
            await task
    work.failure = None
    assert await shared.get("a", work) == 2
