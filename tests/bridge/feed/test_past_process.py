"""The past process: pending, cancelled, killed and restarted queries."""

import asyncio
import logging
import os
import signal
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import partial
from pathlib import Path

import pytest

from lupin_bridge.feed import past_process
from lupin_bridge.feed.past_process import MAX_PENDING, PastProcess
from lupin_bridge.feed.query import NICENESS, Now, export_step
from lupin_bridge.past.plans import Answered
from lupin_twin.core.diagnostics import Condition, JournalState
from lupin_twin.core.past import NotRemembered, PastRefused
from lupin_twin.journal.writes import Export
from tests.support.journal import NOW, SECOND, append, scan
from tests.support.past_queries import Body, Count, Endless, Failing, Running
from tests.support.waiting import until

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


async def test_it_runs_at_a_lower_priority_and_returns_bodies_of_any_size(path: Path) -> None:
    async with looking_back() as past:
        assert await past.ask(Count(NOW_NS), now(path), 0.0) == 1
        nice = os.getpriority(os.PRIO_PROCESS, 0) + NICENESS
        assert await past.ask(Running(), now(path), 0.0) == (0, nice)
        for count in (0, 3_000_000):
            answered: Answered = await past.ask(Body(count), now(path), 0.0)
            assert answered.answer is not None
            assert answered.answer.body == b"7" * count
        assert past.starts == 1


async def test_its_errors_are_raised_here(path: Path) -> None:
    async with looking_back() as past:
        with pytest.raises(PastRefused, match="x is 7, the limit is 6"):
            await past.ask(Failing("refused"), now(path), 0.0)
        with pytest.raises(PastRefused, match="later than now"):
            await past.ask(Count(NOW_NS + 1), now(path), 0.0)
        with pytest.raises(ZeroDivisionError) as caught:
            await past.ask(Failing("fault"), now(path), 0.0)
        assert "in _fail" in caught.value.__notes__[0], "where it was"
        with pytest.raises(RuntimeError, match=r"LocalError.*nobody's knowledge"):
            await past.ask(Failing("local"), now(path), 0.0)
        with pytest.raises(NotRemembered, match="is not there"):
            await past.ask(Count(1), now(path.with_name("none")), 0.0)
        assert past.starts == 1


async def test_a_query_that_is_no_longer_awaited_ends_in_the_process(path: Path) -> None:
    async with looking_back() as past:
        asking = [
            asyncio.create_task(past.ask(Endless(), now(path), 1.0)) for _ in range(MAX_PENDING)
        ]
        await until(lambda: len(past.pending) == MAX_PENDING, "all of them")
        with pytest.raises(NotRemembered, match=f"{MAX_PENDING} requests .* the limit"):
            await past.ask(Running(), now(path), 0.0)
        asking.pop().cancel()
        await until(lambda: len(past.pending) < MAX_PENDING, "one to go")
        running, _ = await past.ask(Running(), now(path), 0.0)
        assert running <= 3, "those that no thread has taken wait"
        for pending in asking:
            pending.cancel()
        while (await past.ask(Running(), now(path), 0.0))[0]:
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
                    await past.ask(Endless(), now(path), 0.0)

        assert await past.ask(Count(NOW_NS), now(path), 0.0) == 1
        monkeypatch.setattr(past_process, "STUCK_S", 1.5)
        await cancel_a_query()
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(2.0):  # longer than it may take to react
                await past.ask(Endless(), now(path), 0.0)
        assert await past.ask(Count(NOW_NS), now(path), 0.0) == 1
        assert past.starts == 1
        os.kill(past.pid or 0, signal.SIGSTOP)
        await cancel_a_query()
        with pytest.raises(NotRemembered, match="did not react"):
            await past.ask(Count(NOW_NS), now(path), 0.0)
        await until(lambda: not past.why_down, "the rest")
        assert await past.ask(Count(NOW_NS), now(path), 0.0) == 1


async def test_a_process_that_dies_or_cannot_start_is_reported_and_replaced(
    path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(past_process, "REST_S", 0.2)
    async with looking_back() as past:
        with monkeypatch.context() as nowhere:
            nowhere.setattr(sys, "executable", "/nowhere/python")
            with pytest.raises(NotRemembered, match="cannot be started"):
                await past.ask(Count(NOW_NS), now(path), 0.0)
        with pytest.raises(NotRemembered, match="is being restarted"):
            await past.ask(Count(NOW_NS), now(path), 0.0)
        await until(lambda: not past.why_down, "the rest")
        waiting = asyncio.create_task(past.ask(Endless(), now(path), 0.0))
        await until(lambda: past.pid is not None, "a process")
        os.kill(past.pid or 0, signal.SIGKILL)
        with pytest.raises(NotRemembered, match="was killed by SIGKILL"):
            await waiting
        await until(lambda: not past.why_down, "the next one")
        assert past.pid is None, "no query"
        assert await past.ask(Count(NOW_NS), now(path), 0.0) == 1
        reported = [r.getMessage() for r in caplog.records if r.levelno == logging.ERROR]
        assert reported[-1] == "the process that reads the past was killed by SIGKILL"
