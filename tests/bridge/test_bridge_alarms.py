"""How often a bridge tells its clients of alarms."""

import asyncio
from collections.abc import Sequence

from lupin_bridge.alarms.board import Change, page_of
from lupin_bridge.bridge import ALARMS_REST_S
from tests.bridge.test_bridge import Stage, state
from tests.support.seen import alarm
from tests.support.waiting import until


def test_alarms_are_told_at_once_and_those_right_behind_once_a_second() -> None:
    async def test() -> None:
        async with Stage() as stage:
            await stage.bridge._alarm_feed.stop()  # these are the test's alone

            def put(tag_ids: Sequence[str]) -> None:
                page = page_of(map(alarm, tag_ids))
                stage.bridge.alarms.put(page, Change(()), "heard", 1)

            def told() -> list[int]:
                return [
                    len(frame["alarms"])
                    for frame in stage.ear.heard
                    if frame["type"] == "alarms" and frame["alarms"]
                ]

            stage.script.tell(state(1))
            loop = asyncio.get_running_loop()
            put("a")
            await until(lambda: told() == [1], "the first")
            first_s = loop.time()
            for count in range(2, 6):
                put("abcde"[:count])
                for _ in range(5):  # as a frame of its own would, were it written now
                    work = stage.script.workers.submit(lambda _: None)
                    await asyncio.wrap_future(work)
            await until(lambda: told()[-1] == 5, "the newest")
            assert told() == [1, 5]
            assert loop.time() - first_s > 0.8 * ALARMS_REST_S

    asyncio.run(test())
