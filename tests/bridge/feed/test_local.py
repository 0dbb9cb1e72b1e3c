"""The twin of this process, in its ROS thread; the past process; and shared or repeated work."""

import asyncio
import logging
import os
import signal
import sys
import threading
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import partial
from pathlib import Path

import pytest
from rclpy.parameter import Parameter

from lupin_bridge.feed import past_process
from lupin_bridge.feed.local import LocalTwin
from lupin_bridge.feed.past_process import PastProcess
from lupin_bridge.feed.query import NICENESS, LogReader, Now, export_step
from lupin_bridge.feed.source import TwinTimeoutError
from lupin_bridge.feed.tasks import Periodic, Shared
from lupin_bridge.past.plans import Answered
from lupin_twin.core.diagnostics import Condition, JournalState
from lupin_twin.core.notes import COMMENT, Note
from lupin_twin.core.past import NotRemembered, PastRefused
from lupin_twin.journal.runs import Clock
from lupin_twin.journal.writes import Export
from lupin_twin.ros.node import TwinNode
from tests.support.inprocess import started
from tests.support.journal import NOW, SECOND, append, scan
from tests.support.past_queries import (
    at_work,
    endless,
    faulty,
    refused,
    sevens,
    tags_at,
    unpicklable,
)
from tests.support.proc_stat import resident_mb
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
        await twin.past.ask(partial(LogReader.state, at_ns=0), await twin.now(), 0.0)
        waiting = asyncio.create_task(twin.ask(endless, 0.0))
        await until(lambda: len(twin.past.pending) == 1, "the query")
        # Meanwhile the ROS thread answers as usual.
        await twin.thread.call(lambda node: node.notify_listener())
        assert not waiting.done()
        twin.timeout_s = 0.1
        with pytest.raises(TwinTimeoutError, match=r"within 0\.1 s"):
            await twin.ask(endless, 0.0)
        waiting.cancel()
        await until(lambda: twin.past.pending == {}, "the end of both")


async def test_a_request_that_arrives_as_the_last_one_is_cancelled_starts_new_work() -> None:
    shared, begun, may_end = Shared(), list[None](), asyncio.Event()

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
    shared, begun = Shared(), list[None]()

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


pytestmark = pytest.mark.usefixtures("children_know_the_tests")

NOW_NS = NOW + SECOND


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A journal of 2,500 scans of one tag."""
    found = tmp_path_factory.mktemp("past") / "j.sqlite"
    append(found, [scan(at_ns=NOW + number) for number in range(2_500)])
    return found


@asynccontextmanager
async def looking_back() -> AsyncIterator[PastProcess]:
    past = PastProcess()
    try:
        yield past
    finally:
        await past.stop()


def now(path: Path) -> Now:
    return Now(NOW_NS, "map", Condition(JournalState.RECORDING, path=str(path)))


async def test_it_runs_at_a_lower_priority_and_returns_bodies_of_any_size_with_their_memory(
    path: Path,
) -> None:
    async with looking_back() as past:
        assert await past.ask(partial(tags_at, NOW_NS), now(path), 0.0) == 1
        nice = os.getpriority(os.PRIO_PROCESS, 0) + NICENESS
        assert await past.ask(at_work, now(path), 0.0) == (0, nice)
        pid = past.pid or 0
        before_mb = resident_mb(pid)
        for count in (0, 20_000_000, 20_000_000):
            answered: Answered = await past.ask(partial(sevens, count), now(path), 0.0)
            assert answered.answer is not None
            assert answered.answer.body == b"7" * count
        await until(lambda: resident_mb(pid) < before_mb + 10.0, "the memory to be free")
        assert past.starts == 1


async def test_its_errors_are_raised_here(path: Path) -> None:
    async with looking_back() as past:
        with pytest.raises(PastRefused, match="x is 7, the limit is 6"):
            await past.ask(refused, now(path), 0.0)
        with pytest.raises(PastRefused, match="later than now"):
            await past.ask(partial(tags_at, NOW_NS + 1), now(path), 0.0)
        with pytest.raises(ZeroDivisionError) as caught:
            await past.ask(faulty, now(path), 0.0)
        assert "in faulty" in caught.value.__notes__[0], "where it was"
        with pytest.raises(RuntimeError, match=r"LocalError.*nobody's knowledge"):
            await past.ask(unpicklable, now(path), 0.0)
        with pytest.raises(NotRemembered, match="is not there"):
            await past.ask(partial(tags_at, 1), now(path.with_name("none")), 0.0)
        assert past.starts == 1


async def test_a_query_that_is_no_longer_awaited_ends_in_the_process(path: Path) -> None:
    async with looking_back() as past:
        asking = [asyncio.create_task(past.ask(endless, now(path), 1.0)) for _ in range(100)]
        await until(lambda: len(past.pending) == 100, "all of them")
        running, _ = await past.ask(at_work, now(path), 0.0)
        assert running <= 3, "those that no thread has taken wait"
        for pending in asking:
            pending.cancel()
        while (await past.ask(at_work, now(path), 0.0))[0]:
            pass
        assert past.pending == {}


async def test_an_export_goes_on_in_a_restarted_process(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(past_process, "REST_S", 0.0)
    async with looking_back() as past:
        export: Export | None = Export(0, NOW_NS, None, None)
        found: list[int] = []
        while export is not None:
            export, lots = await past.ask(partial(export_step, export, len), now(path), 0.0)
            found += lots
            if past.starts == 1:
                assert past.pid is not None
                os.kill(past.pid, signal.SIGKILL)
                await until(lambda: past.pid is None and not past.why_down, "its end")
        assert (found, past.starts) == ([1_000, 1_000, 500], 2)


async def test_a_process_that_does_not_react_is_replaced_and_one_that_is_busy_is_not(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(past_process, "REST_S", 0.0)
    async with looking_back() as past:

        async def cancel_a_query() -> None:
            with pytest.raises(TimeoutError):
                async with asyncio.timeout(0.01):
                    await past.ask(endless, now(path), 0.0)

        assert await past.ask(partial(tags_at, NOW_NS), now(path), 0.0) == 1
        monkeypatch.setattr(past_process, "STUCK_S", 1.5)
        await cancel_a_query()
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(2.0):  # longer than it may take to react
                await past.ask(endless, now(path), 0.0)
        assert await past.ask(partial(tags_at, NOW_NS), now(path), 0.0) == 1
        assert past.starts == 1
        os.kill(past.pid or 0, signal.SIGSTOP)
        await cancel_a_query()
        with pytest.raises(NotRemembered, match="did not react"):
            await past.ask(partial(tags_at, NOW_NS), now(path), 0.0)
        await until(lambda: not past.why_down, "the rest")
        assert await past.ask(partial(tags_at, NOW_NS), now(path), 0.0) == 1


async def test_a_process_that_dies_or_cannot_start_is_reported_and_replaced(
    path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(past_process, "REST_S", 0.2)
    async with looking_back() as past:
        with monkeypatch.context() as nowhere:
            nowhere.setattr(sys, "executable", "/nowhere/python")
            with pytest.raises(NotRemembered, match="cannot be started"):
                await past.ask(partial(tags_at, NOW_NS), now(path), 0.0)
        with pytest.raises(NotRemembered, match="is being restarted"):
            await past.ask(partial(tags_at, NOW_NS), now(path), 0.0)
        await until(lambda: not past.why_down, "the rest")
        waiting = asyncio.create_task(past.ask(endless, now(path), 0.0))
        await until(lambda: past.pid is not None, "a process")
        os.kill(past.pid or 0, signal.SIGKILL)
        with pytest.raises(NotRemembered, match="was killed by SIGKILL"):
            await waiting
        await until(lambda: not past.why_down, "the next one")
        assert past.pid is None, "no query"
        assert await past.ask(partial(tags_at, NOW_NS), now(path), 0.0) == 1
        reported = [r.getMessage() for r in caplog.records if r.levelno == logging.ERROR]
        assert reported[-1] == "the process that reads the past was killed by SIGKILL"
