"""Questions about the past, driven in this process."""

from __future__ import annotations

import asyncio

import pytest

from lupin_bridge.twin.looking import Itself, look_up
from lupin_twin.past import NotRemembered, SeriesRequest
from lupin_twin.state import Snapshot, TagState
from lupin_twin.workers import Workers
from tests.support.looking import Count, Failing
from tests.support.past import NS, MadeUp


def test_each_need_is_asked_for_and_the_work_is_done_on_a_worker() -> None:
    past = MadeUp(snapshot=Snapshot(0, "map", (TagState("1"), TagState("2"))))
    past.points["1", "co2"] = [(NS, 400.0)]
    workers = Workers("test")

    async def test() -> None:
        assert await look_up(Count(5), past, workers) == 2
        found = await look_up(Itself(SeriesRequest("1", "co2")), past, workers)
        assert found.means == (400.0,)
        assert past.asked == [5, SeriesRequest("1", "co2")]
        with pytest.raises(ZeroDivisionError):
            await look_up(Failing("fault"), past, workers)
        past.error = NotRemembered("gone", is_lasting=True)
        with pytest.raises(NotRemembered, match="gone"):
            await look_up(Count(5), past, workers)

    try:
        asyncio.run(test())
    finally:
        workers.close()
