"""The twin of this process: its past, which is the journal's."""

from __future__ import annotations

import asyncio
import time
from pathlib import Path

import pytest

from lupin_bridge.feed.query import Itself
from lupin_bridge.feed.source import TwinTimeoutError
from lupin_twin.core.journal_condition import JournalState
from lupin_twin.core.past import (
    EVERY_TAG,
    Event,
    NotRemembered,
    PastRefused,
    SeriesRequest,
    seconds,
)
from lupin_twin.core.state import Reading, Scan
from lupin_twin.journal.runs import Clock
from lupin_twin.ros.node import TwinNode
from tests.bridge.feed.test_local import SILENT, started
from tests.support.journal import SECOND, kept, scan
from tests.support.looking import Endless
from tests.support.waiting import until

pytestmark = pytest.mark.usefixtures("children_know_the_tests")


async def test_a_state_as_of_then_is_the_journals(domain: int) -> None:
    async with started() as (twin, told):

        def take(node: TwinNode) -> int:
            now_ns = node.now_ns()
            for at_ns, value in ((now_ns - 9, 400.0), (now_ns - 4, 500.0)):
                scan = Scan("1", at_ns, (Reading("co2", value),))
                assert node.memory.apply(scan, at_ns) is None
            node.notify_listeners()
            return now_ns

        now_ns = await twin.thread.call(take)
        await until(lambda: twin.journal().written == 2, "both in the journal")
        past = await twin.ask(Itself(now_ns - 5), 0.0)
        assert past.stamp_ns == now_ns - 5
        assert past.frame_id == "map"
        assert past.tags[0].readings == (Reading("co2", 400.0, now_ns - 9),)
        (tag,) = (await twin.ask(Itself(now_ns - 1), 0.0)).tags
        assert tag == told[-1].snapshot.tags[0]
        assert (await twin.ask(Itself(0), 0.0)).tags == ()


async def test_series_and_rows_are_the_journals(domain: int) -> None:
    async with started() as (twin, _):
        values = tuple(map(float, range(20)))

        def take(node: TwinNode) -> None:
            for at_ns, value in enumerate(values, node.now_ns() - 9_000):
                node.memory.apply(Scan("1", at_ns, (Reading("co2", value),)), at_ns)
            node.notify_listeners()

        await twin.thread.call(take)
        await until(lambda: twin.journal().written == 20, "all in the journal")
        past = await twin.ask(Itself(SeriesRequest("1", "co2")), 0.0)
        assert past.means == values
        assert (await twin.ask(Itself(SeriesRequest(EVERY_TAG, Event.SCANS)), 0.0)).means == (
            1.0,
        ) * 20
        lots = [lot async for lot in twin.rows(0, past.end_ns, "1", "co2", list)]
        assert tuple(row.value for lot in lots for row in lot) == values


async def test_damage_that_is_met_looking_back_has_the_file_set_aside(
    domain: int, tmp_path: Path
) -> None:
    path = tmp_path / "j.sqlite"
    begun_ns = time.time_ns() - 9_000 * SECOND
    kept(
        path,
        [scan(str(n % 9), begun_ns + n * SECOND, t=n) for n in range(5_000)],
        Clock(begun_ns, begun_ns, is_simulated=False),
    )
    end_ns = begun_ns + 5_000 * SECOND

    async with started("--ros-args", "-p", f"journal:={path}") as (twin, _):
        with path.open("r+b") as file:
            file.seek(path.stat().st_size // 4)
            file.write(b"\xff" * (path.stat().st_size // 2))
        # The twin may meet the damage first by itself: then nothing is left to refuse.
        refused = None
        try:
            [lot async for lot in twin.rows(0, end_ns, None, None, len)]
        except NotRemembered as error:
            refused = error
        assert refused is None or ("is damaged" in str(refused) and not refused.is_lasting)
        await until(lambda: twin.journal().set_aside, "the damaged file to be set aside")
        assert Path(twin.journal().set_aside).exists()
        await until(lambda: twin.journal().state is JournalState.RECORDING, "a new file")
        assert 0 < sum([lot async for lot in twin.rows(0, end_ns, None, None, len)]) < 5_000


async def test_the_future_is_refused(domain: int) -> None:
    async with started(*SILENT) as (twin, _):
        now_ns = twin.update.snapshot.stamp_ns
        assert (await twin.ask(Itself(now_ns), 0.0)).stamp_ns == now_ns
        # Time goes on between two heartbeats.
        between_ns = twin.now_ns
        assert (await twin.ask(Itself(between_ns), 0.0)).stamp_ns == between_ns > now_ns
        later_ns = now_ns + 3600 * 10**9
        with pytest.raises(PastRefused, match=f"at is {seconds(later_ns)} s, later than now"):
            await twin.ask(Itself(later_ns), 0.0)


async def test_a_journal_that_is_off_remembers_for_as_long_as_the_twin_lives(domain: int) -> None:
    async with started("--ros-args", "-p", "journal:=off") as (twin, _):
        await until(lambda: twin.journal().state == "off", "the journal")
        folder = Path(twin.journal().path).parent

        def take(node: TwinNode) -> int:
            at_ns = node.now_ns()
            node.memory.apply(Scan("1", at_ns, (Reading("co2", 400.0),)), at_ns)
            return at_ns

        at_ns = await twin.thread.call(take)
        await until(lambda: twin.journal().written, "the scan")
        # The source's clock goes on from its last update, a moment behind the node's.
        await until(lambda: twin.now_ns >= at_ns, "the moment of the scan")
        [tag] = (await twin.ask(Itself(at_ns), 0.0)).tags
        assert tag.readings[0].value == 400.0
        assert folder.exists()
    assert not folder.exists()


async def test_an_answer_that_takes_too_long_ends_and_delays_no_observation(domain: int) -> None:
    """Meanwhile the ROS thread answers as ever."""

    async with started() as (twin, _):
        await until(lambda: twin.journal().state == "recording", "the journal")
        await twin.past.ask(Itself(0), await twin.now(), 0.0)
        waiting = asyncio.create_task(twin.ask(Endless(), 0.0))
        await until(lambda: len(twin.past.asked) == 1, "the question")
        await twin.thread.call(lambda node: node.notify_listeners())
        assert not waiting.done()
        twin.timeout_s = 0.1
        with pytest.raises(TwinTimeoutError, match=r"within 0\.1 s"):
            await twin.ask(Endless(), 0.0)
        assert len(twin.past.asked) == 1
        waiting.cancel()
        await until(lambda: twin.past.asked == {}, "the end of both")
