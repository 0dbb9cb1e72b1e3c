"""The ROS thread, with real nodes: what crosses, in both directions, and how it ends."""

import asyncio
import logging
import sys
import threading
from collections.abc import Callable, Sequence
from typing import Any, Self

import pytest
from rclpy.node import Node
from rclpy.task import Future

from lupin_bridge.feed.ros_thread import STOP_TIMEOUT_S, RosThread
from lupin_bridge.feed.source import TwinUnavailableError
from tests.support.inprocess import ros_domain
from tests.support.waiting import until


class Probe(Node):  # type: ignore[misc]  # rclpy is not typed
    """A node that does nothing by itself, and tells of what it is made to do."""

    def __init__(self, context: Any, post: Callable[[int], None]) -> None:
        super().__init__("probe", context=context)
        self.post = post
        self.utilities: Any = self
        self.callback_errors = 0
        self.thread = threading.current_thread()
        self.ticks = 0

    def report(self, what: str, error: Exception) -> None:
        self.callback_errors += 1

    def tick(self) -> None:
        self.ticks += 1
        self.post(self.ticks)


class Stage:
    """A ROS thread with a probe, and what the loop has been told."""

    def __init__(
        self,
        make_node: Callable[[Any, Callable[[int], None]], Probe] = Probe,
        ros_args: Sequence[str] = (),
    ) -> None:
        self.events: list[int] = []
        self.told_by: set[threading.Thread] = set()
        self.deaths = 0
        self.ros: RosThread[Probe, int] = RosThread(
            make_node, ros_args=ros_args, on_event=self._on_event, on_death=self._on_death
        )

    def _on_event(self, event: int) -> None:
        self.events.append(event)
        self.told_by.add(threading.current_thread())

    def _on_death(self) -> None:
        self.deaths += 1

    async def __aenter__(self) -> Self:
        await self.ros.start()
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.ros.stop()


# --- towards ROS --------------------------------------------------------------------------------


async def test_a_call_runs_in_the_nodes_thread_and_its_result_comes_back(domain: int) -> None:
    async with Stage() as stage:
        thread = await stage.ros.call(lambda _: threading.current_thread())
        assert thread is stage.ros.require_node().thread
        assert thread is not threading.current_thread()
        assert not stage.ros._unanswered, "who has an answer is forgotten"
        results = [stage.ros.call(lambda _, n=n: n * n) for n in range(50)]  # type: ignore[misc]
        assert await asyncio.gather(*results) == [n * n for n in range(50)]
        assert stage.ros.calls_waiting == 0


async def test_what_a_call_raises_is_its_callers_and_not_the_nodes(domain: int) -> None:
    async with Stage() as stage:
        with pytest.raises(ZeroDivisionError):
            await stage.ros.call(lambda _: 1 / 0)
        assert (stage.ros.is_alive, stage.ros.callback_errors) == (True, 0)


async def test_a_caller_that_leaves_is_not_missed(domain: int) -> None:
    async with Stage() as stage:
        gate, begun = threading.Event(), list[Probe]()
        held = asyncio.create_task(stage.ros.call(lambda _: gate.wait(20.0)))
        await until(lambda: stage.ros.calls_waiting == 1, "the call to be waiting")
        behind = asyncio.create_task(stage.ros.call(begun.append))
        await until(lambda: stage.ros.calls_waiting == 2, "another behind it")
        for left in (held, behind):
            left.cancel()
            with pytest.raises(asyncio.CancelledError):
                await left
        gate.set()
        assert await stage.ros.call(lambda _: "next") == "next"
        assert stage.ros.calls_waiting == 0
        assert not begun, "nobody waits for it"


async def test_before_the_start_and_after_the_end_there_is_nobody_to_call(domain: int) -> None:
    stage = Stage()
    with pytest.raises(TwinUnavailableError, match="not running"):
        await stage.ros.call(lambda _: None)
    async with stage:
        pass
    with pytest.raises(TwinUnavailableError, match="not running"):
        await stage.ros.call(lambda _: None)


async def test_a_heartbeat_tells_of_a_callback_that_hangs_and_that_it_goes_on(domain: int) -> None:
    async with Stage() as stage:
        gate = threading.Event()
        held = asyncio.create_task(stage.ros.call(lambda _: gate.wait(20.0)))
        await until(lambda: stage.ros.stuck_s > 0.5, "a heartbeat that does not come back")
        assert stage.ros.is_alive
        gate.set()
        await held
        await until(lambda: stage.ros.stuck_s == 0.0, "it to come back")


# --- towards the loop ---------------------------------------------------------------------------


async def test_the_loop_is_told_the_newest_and_skips_what_came_in_between(domain: int) -> None:
    async with Stage() as stage:

        def post_many(node: Probe) -> None:
            for number in range(1, 1_001):
                node.post(number)

        await stage.ros.call(post_many)
        await until(lambda: stage.events and stage.events[-1] == 1_000, "the newest event")
        assert len(stage.events) < 1_000
        assert stage.events == sorted(stage.events)
        assert stage.told_by == {threading.current_thread()}


async def test_an_event_from_a_nodes_first_moment_finds_a_node_to_look_at(domain: int) -> None:
    seen: list[int] = []

    def make_node(context: Any, post: Callable[[int], None]) -> Probe:
        post(1)
        loop_had_a_turn.wait(20.0)
        return Probe(context, post)

    loop_had_a_turn = threading.Event()
    asyncio.get_running_loop().call_later(0.05, loop_had_a_turn.set)
    ros: RosThread[Probe, int] = RosThread(
        make_node,
        ros_args=(),
        on_event=lambda event: seen.append(event + ros.require_node().ticks),
        on_death=lambda: None,
    )
    await ros.start()
    await until(lambda: seen == [1], "the first event")
    await ros.stop()


def test_events_of_a_node_whose_loop_is_gone_do_no_harm(domain: int) -> None:
    with ros_domain(domain):
        stage = Stage()
        with asyncio.Runner() as runner:
            runner.run(stage.ros.start())
            runner.run(stage.ros.call(lambda node: node.create_timer(0.01, node.tick)))

        async def end() -> None:
            ticks = stage.ros.require_node().ticks
            await until(lambda: stage.ros.require_node().ticks > ticks + 3, "more ticks")
            assert (stage.ros.is_alive, stage.ros.callback_errors) == (True, 0)
            await stage.ros.stop()
            await until(lambda: not stage.ros.is_alive, "the end of the thread")

        asyncio.run(end())


# --- futures of ROS -----------------------------------------------------------------------------


async def test_a_future_of_ros_is_awaited_without_spinning(domain: int) -> None:
    async with Stage() as stage:
        futures: list[Future] = []

        def start(node: Probe) -> Future:
            futures.append(Future(executor=node.executor))
            return futures[-1]

        good = asyncio.create_task(stage.ros.ask(start, lambda *_: None))
        await until(lambda: len(futures) == 1, "the question")
        await stage.ros.call(lambda _: futures[0].set_result("answer"))
        assert await good == "answer"

        bad = asyncio.create_task(stage.ros.ask(start, lambda *_: None))
        await until(lambda: len(futures) == 2, "the next question")
        await stage.ros.call(lambda _: futures[1].set_exception(OSError("no")))
        with pytest.raises(OSError, match="no"):
            await bad


async def test_who_waits_no_longer_gives_the_future_up_in_the_nodes_thread(domain: int) -> None:
    async with Stage() as stage:
        asked, given_up = Future(), list[tuple[Future, threading.Thread]]()
        waiting = asyncio.create_task(
            stage.ros.ask(
                lambda _: asked,
                lambda _, future: given_up.append((future, threading.current_thread())),
            )
        )
        # Only then has the call brought the future back, and it is the answer that is awaited.
        await stage.ros.call(lambda _: None)
        await until(lambda: stage.ros.calls_waiting == 0, "the question to be asked")
        waiting.cancel()
        await until(lambda: given_up, "the future to be given up")
        assert given_up == [(asked, stage.ros.require_node().thread)]


@pytest.mark.parametrize("has_begun", [True, False])
async def test_who_leaves_before_the_question_is_asked_leaves_nothing_behind(
    domain: int, has_begun: bool
) -> None:
    async with Stage() as stage:
        gate, busy = threading.Event(), threading.Event()
        open_questions: list[Future] = []

        def hold() -> None:
            busy.set()
            gate.wait(20.0)

        def start(_: Probe) -> Future:
            if has_begun:
                hold()
            open_questions.append(Future())
            return open_questions[-1]

        if not has_begun:
            held = asyncio.create_task(stage.ros.call(lambda _: hold()))
            await until(busy.is_set, "a busy thread")
        waiting = asyncio.create_task(
            stage.ros.ask(start, lambda _, future: open_questions.remove(future))
        )
        waiting_calls = 1 if has_begun else 2
        await until(lambda: stage.ros.calls_waiting == waiting_calls, "the question to wait")
        await until(busy.is_set, "a busy thread")
        waiting.cancel()
        with pytest.raises(asyncio.CancelledError):
            await waiting
        gate.set()
        # What was handed over before this has run after it, at the latest.
        for _ in range(3):
            await stage.ros.call(lambda _: None)
        assert open_questions == []
        assert stage.ros.callback_errors == 0
        if not has_begun:
            await held


# --- the end ------------------------------------------------------------------------------------


async def test_a_callback_that_raises_is_reported_and_the_thread_lives_on(domain: int) -> None:
    async with Stage() as stage:

        def fail() -> None:
            raise RuntimeError("a callback's own")

        await stage.ros.call(lambda node: node.create_timer(0.01, fail))
        await until(lambda: stage.ros.callback_errors > 2, "errors of the callback")
        assert await stage.ros.call(lambda _: "alive") == "alive"
        assert stage.deaths == 0


async def test_the_end_of_the_thread_is_told_once_and_said_aloud(
    domain: int, caplog: pytest.LogCaptureFixture
) -> None:
    async with Stage() as stage:
        await stage.ros.call(lambda node: node.create_timer(0.01, lambda: sys.exit("the end")))
        await until(lambda: stage.deaths, "the death")
        await until(lambda: not stage.ros.is_alive, "the end of the thread")
        with pytest.raises(TwinUnavailableError, match="not running"):
            await stage.ros.call(lambda _: None)
    assert stage.deaths == 1
    record = next(r for r in caplog.records if "the ROS thread has ended" in r.message)
    assert record.levelno == logging.CRITICAL
    assert record.exc_info is not None
    assert "the end" in str(record.exc_info[1])


async def test_a_thread_that_is_being_stopped_has_not_died(domain: int) -> None:
    async with Stage() as stage:
        thread = await stage.ros.call(lambda node: node.thread)
        stopping = asyncio.create_task(stage.ros.stop())
        await asyncio.sleep(0)
        thread.join()  # on the loop, which cannot have been told yet
        assert stage.ros.is_alive
        await stopping
        assert not stage.ros.is_alive


async def test_what_the_making_of_a_node_raises_is_the_starts(domain: int) -> None:
    def make_node(context: Any, post: Callable[[int], None]) -> Probe:
        raise LookupError("no node today")

    stage = Stage(make_node)
    with pytest.raises(LookupError, match="no node today"):
        await stage.ros.start()
    await until(lambda: not stage.ros.is_alive, "the end of the thread")
    await stage.ros.stop()
    assert stage.deaths == 0


async def test_arguments_that_ros_does_not_understand_fail_the_start(domain: int) -> None:
    stage = Stage(ros_args=["--ros-args", "--remap", "nonsense"])
    with pytest.raises(Exception, match="nonsense"):
        await stage.ros.start()
    await stage.ros.stop()


async def test_a_stop_does_not_wait_for_ever_for_a_callback(
    domain: int, caplog: pytest.LogCaptureFixture
) -> None:
    stage, gate, busy = Stage(), threading.Event(), threading.Event()

    def hold(_: Probe) -> bool:
        busy.set()
        return gate.wait(20.0)

    await stage.ros.start()
    held = asyncio.create_task(stage.ros.call(hold))
    await until(busy.is_set, "a busy thread")
    await stage.ros.stop()
    assert f"did not end within {STOP_TIMEOUT_S} s" in caplog.text
    with pytest.raises(TwinUnavailableError, match="not running"):
        await held
    gate.set()
    await until(lambda: not stage.ros.is_alive, "the end of the thread")
