"""Work that is done once for all equal requests, and only while one of them waits."""

import asyncio

from lupin_bridge.feed.tasks import Shared
from tests.support.waiting import until


async def test_a_request_that_arrives_as_the_last_one_is_cancelled_starts_new_work() -> None:
    shared, begun, may_end = Shared[int](), list[None](), asyncio.Event()

    async def work() -> int:
        begun.append(None)
        number = len(begun)
        await may_end.wait()
        return number

    leaving = asyncio.create_task(shared.get("a", work))
    await until(lambda: begun, "the work")
    leaving.cancel()
    await asyncio.sleep(0)  # it has left; the work has not been cancelled yet
    coming = asyncio.create_task(shared.get("a", work))
    await asyncio.wait([leaving])
    may_end.set()
    assert await coming == 2
    assert len(shared) == 0


async def test_an_error_reaches_all_waiters_and_is_not_cached() -> None:
    shared, begun = Shared[int](), list[None]()

    async def work() -> int:
        begun.append(None)
        if len(begun) == 1:
            raise MemoryError("too much")
        return len(begun)

    found = await asyncio.gather(*(shared.get("a", work) for _ in "ab"), return_exceptions=True)
    assert [type(error) for error in found] == [MemoryError] * 2
    assert await shared.get("a", work) == 2
