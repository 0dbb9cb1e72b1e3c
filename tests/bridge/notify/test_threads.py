"""The end of an event loop does not wait for a name that nobody can tell."""

from __future__ import annotations

import asyncio
import threading

from lupin_bridge.notify.channels import DetachedThreads
from tests.support.waiting import PATIENCE_S, wait_for


def test_a_loop_ends_although_a_thread_of_it_is_at_work() -> None:
    has_begun, may_end, has_ended = threading.Event(), threading.Event(), threading.Event()

    def look_up() -> None:
        has_begun.set()
        may_end.wait(PATIENCE_S)
        has_ended.set()

    async def give_up() -> None:
        loop = asyncio.get_running_loop()
        loop.set_default_executor(DetachedThreads())
        looking = loop.run_in_executor(None, look_up)
        await asyncio.to_thread(has_begun.wait, PATIENCE_S)
        looking.cancel()

    asyncio.run(give_up())
    assert not has_ended.is_set()
    may_end.set()
    wait_for(has_ended.is_set, "the thread to end")
