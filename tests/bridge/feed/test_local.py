"""The twin of this process, in its ROS thread; and work that is shared or repeated."""

import asyncio
import threading
import time
from functools import partial
from pathlib import Path

import pytest
from rclpy.parameter import Parameter

from lupin_bridge.feed.local import LocalTwin
from lupin_bridge.feed.query import as_found
from lupin_bridge.feed.source import TwinTimeoutError
from lupin_bridge.feed.tasks import Periodic, Shared
from lupin_twin.core.diagnostics import JournalState
from lupin_twin.core.notes import COMMENT, Note
from lupin_twin.core.past import NotRemembered
from lupin_twin.journal.runs import Clock
from lupin_twin.ros.node import TwinNode
from tests.support.inprocess import started
from tests.support.journal import SECOND, append, scan
from tests.support.past_queries import Endless
from tests.support.waiting import PATIENCE_S, until

NOTE = Note("", time.time_ns(), "anna", COMMENT, "site", "a comment")


async def test_a_busy_thread_ends_a_request_after_the_configured_timeout(domain: int) -> None:
    busy, gate = threading.Event(), threading.Event()

    def hold(_: TwinNode) -> bool:
        busy.set()
        return gate.wait(20.0)

    async with started(LocalTwin, timeout_s=0.2) as (twin, _):
        held = asyncio.create_task(twin.thread.call(hold))
        await until(busy.is_set, "the thread to be held")
        with pytest.raises(TwinTimeoutError, match=r"within 0\.2 s"):
            await twin.write_note(NOTE)
        gate.set()
        assert await held
        twin.timeout_s = PATIENCE_S
        assert (await twin.write_note(NOTE)).text == NOTE.text


async def test_names_and_limits_are_those_of_the_node(domain: int) -> None:
    async with started(LocalTwin, "--ros-args", "-r", "/twin/state:=/north/state") as (twin, _):
        assert twin.names.state_topic == "/north/state"
        assert twin.names.field_service == "/twin/get_field"
        revision = twin.revision()
        wanted = [Parameter("idw_max_distance_m", value=0.25)]
        await twin.thread.call(lambda node: node.set_parameters(wanted))
        await until(lambda: twin.rules.max_distance_m == 0.25, "the new rules")
        assert twin.revision() != revision


async def test_two_twins_with_equal_content_have_different_revisions(domain: int) -> None:
    async with started(LocalTwin) as (first, _), started(LocalTwin) as (second, _):
        assert first.revision() != second.revision()


@pytest.mark.usefixtures("children_know_the_tests")
async def test_damage_found_by_a_query_quarantines_the_file(domain: int, tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    begun_ns = time.time_ns() - 9_000 * SECOND
    append(
        path,
        [scan(str(n % 9), begun_ns + n * SECOND, t=n) for n in range(5_000)],
        Clock(begun_ns, begun_ns, is_simulated=False),
    )
    end_ns = begun_ns + 5_000 * SECOND

    async with started(LocalTwin, "--ros-args", "-p", f"journal:={path}") as (twin, _):
        with path.open("r+b") as file:
            file.seek(path.stat().st_size // 4)
            file.write(b"\xff" * (path.stat().st_size // 2))
        # The twin may find the damage first. Then there is nothing left to refuse.
        refused = None
        try:
            [lot async for lot in twin.rows(0, end_ns, None, None, len)]
        except NotRemembered as error:
            refused = error
        assert refused is None or "is damaged" in str(refused)
        await until(lambda: twin.journal().quarantined, "the damaged file to be quarantined")
        assert Path(twin.journal().quarantined).exists()
        await until(lambda: twin.journal().state is JournalState.RECORDING, "a new file")
        assert 0 < sum([lot async for lot in twin.rows(0, end_ns, None, None, len)]) < 5_000


@pytest.mark.usefixtures("children_know_the_tests")
async def test_a_query_that_takes_too_long_ends_and_delays_no_observation(domain: int) -> None:
    async with started(LocalTwin) as (twin, _):
        await until(lambda: twin.journal().state == "recording", "the journal")
        await twin.past.ask(partial(as_found, 0), await twin.now(), 0.0)
        waiting = asyncio.create_task(twin.ask(Endless(), 0.0))
        await until(lambda: len(twin.past.pending) == 1, "the query")
        # Meanwhile the ROS thread answers as usual.
        await twin.thread.call(lambda node: node.notify_listener())
        assert not waiting.done()
        twin.timeout_s = 0.1
        with pytest.raises(TwinTimeoutError, match=r"within 0\.1 s"):
            await twin.ask(Endless(), 0.0)
        waiting.cancel()
        await until(lambda: twin.past.pending == {}, "the end of both")


# --- work that is shared or repeated --------------------------------------------------------------


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
