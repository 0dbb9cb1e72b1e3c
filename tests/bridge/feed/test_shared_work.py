"""Work that is done once for all equal requests; and work that is repeated."""

import asyncio

import pytest

from lupin_bridge.feed.tasks import Periodic, Shared
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


async def test_an_error_that_stays_ends_no_repetition_and_is_logged_once(
    caplog: pytest.LogCaptureFixture,
) -> None:
    errors, done = [ValueError("a"), ValueError("a"), ValueError("b"), None, ValueError("b")], 0

    async def work() -> None:
        nonlocal done
        error = errors[min(done, 4)]
        done += 1
        if error is not None:
            raise error

    periodic = Periodic(work, 0.0, "the work")
    periodic.start()
    await until(lambda: done > len(errors), "all of them")
    await periodic.stop()
    logged = [record.getMessage() for record in caplog.records]
    assert logged == [f"the work had an error and continues: {name}" for name in "abb"]
