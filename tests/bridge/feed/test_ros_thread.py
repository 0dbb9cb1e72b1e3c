"""The ROS thread, with real nodes: calls and events in both directions, and its end."""

import asyncio
import json
import logging
import sys
import threading
from collections.abc import Callable
from typing import Any, Self

import pytest
from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.task import Future

from lupin_bridge.feed.ros_thread import RosThread, forward
from lupin_bridge.feed.source import STUCK_AFTER_S, ThreadState, TwinUnavailableError, ailment
from tests.support.inprocess import ros_domain
from tests.support.messages import scan
from tests.support.processes import faults, lupin_twin, url_of
from tests.support.ros import Peer
from tests.support.waiting import PATIENCE_S, until


class Probe(Node):  # type: ignore[misc]  # rclpy is not typed
    """A node that does nothing by itself, and reports what the test makes it do."""

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
    """A ROS thread with a probe, and the events that the loop has received."""

    def __init__(self) -> None:
        self.events: list[int] = []
        self.reported_by: set[threading.Thread] = set()
        self.deaths = 0
        self.ros: RosThread[Probe, int] = RosThread(
            Probe, ros_args=(), on_event=self._on_event, on_death=self._on_death
        )

    def _on_event(self, event: int) -> None:
        self.events.append(event)
        self.reported_by.add(threading.current_thread())

    def _on_death(self) -> None:
        self.deaths += 1

    async def __aenter__(self) -> Self:
        await self.ros.start()
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.ros.stop()


async def test_a_call_runs_in_the_thread_of_the_nodes_and_returns_its_result(domain: int) -> None:
    stage = Stage()
    with pytest.raises(TwinUnavailableError, match="not running"):
        await stage.ros.call(lambda _: None)
    async with stage:
        thread = await stage.ros.call(lambda _: threading.current_thread())
        assert thread is stage.ros.require_node().thread
        assert thread is not threading.current_thread()
        results = [stage.ros.call(lambda _, n=n: n * n) for n in range(50)]  # type: ignore[misc]
        assert await asyncio.gather(*results) == [n * n for n in range(50)]
        assert stage.ros.calls_waiting == 0
        with pytest.raises(ZeroDivisionError):
            await stage.ros.call(lambda _: 1 / 0)
        assert (stage.ros.is_alive, stage.ros.callback_errors) == (True, 0)


async def test_a_cancelled_caller_is_ignored(domain: int) -> None:
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


async def test_a_heartbeat_reports_a_hanging_callback_and_its_recovery(domain: int) -> None:
    async with Stage() as stage:
        gate = threading.Event()
        held = asyncio.create_task(stage.ros.call(lambda _: gate.wait(20.0)))
        await until(lambda: stage.ros.stuck_s > 0.5, "a heartbeat that does not come back")
        gate.set()
        await held
        await until(lambda: stage.ros.stuck_s == 0.0, "it to come back")


async def test_the_loop_receives_the_latest_event_and_skips_those_before_it(domain: int) -> None:
    async with Stage() as stage:

        def post_many(node: Probe) -> None:
            for number in range(1, 1_001):
                node.post(number)

        await stage.ros.call(post_many)
        await until(lambda: stage.events and stage.events[-1] == 1_000, "the latest event")
        assert len(stage.events) < 1_000
        assert stage.events == sorted(stage.events)
        assert stage.reported_by == {threading.current_thread()}


def test_events_after_the_loop_has_closed_do_no_harm(domain: int) -> None:
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


async def test_an_error_of_a_ros_future_is_raised_and_a_cancelled_one_released_in_its_thread(
    domain: int,
) -> None:
    def start(node: Probe) -> Future:
        future = Future(executor=node.executor)
        future.set_exception(OSError("no"))
        return future

    async with Stage() as stage:
        with pytest.raises(OSError, match="no"):
            await stage.ros.ask(start, lambda *_: None)
    async with Stage() as stage:
        requested, given_up = Future(), list[tuple[Future, threading.Thread]]()
        waiting = asyncio.create_task(
            stage.ros.ask(
                lambda _: requested,
                lambda _, future: given_up.append((future, threading.current_thread())),
            )
        )
        # Only then has the call returned the future, and its result is awaited.
        await stage.ros.call(lambda _: None)
        await until(lambda: stage.ros.calls_waiting == 0, "the call to start")
        waiting.cancel()
        await until(lambda: given_up, "the future to be given up")
        assert given_up == [(requested, stage.ros.require_node().thread)]


async def test_a_caller_cancelled_while_its_call_starts_leaves_nothing_behind(domain: int) -> None:
    async with Stage() as stage:
        gate, busy = threading.Event(), threading.Event()
        open_queries: list[Future] = []

        def start(_: Probe) -> Future:
            busy.set()
            gate.wait(20.0)
            open_queries.append(Future())
            return open_queries[-1]

        waiting = asyncio.create_task(
            stage.ros.ask(start, lambda _, future: open_queries.remove(future))
        )
        await until(busy.is_set, "a busy thread")
        waiting.cancel()
        with pytest.raises(asyncio.CancelledError):
            await waiting
        gate.set()
        # By then, all that was handed over before has run.
        for _ in range(3):
            await stage.ros.call(lambda _: None)
        assert open_queries == []
        assert stage.ros.callback_errors == 0


async def test_the_end_of_the_thread_is_reported_once_and_logged(
    domain: int, caplog: pytest.LogCaptureFixture
) -> None:
    async with Stage() as stage:
        asked = asyncio.create_task(stage.ros.ask(lambda _: Future(), lambda *_: None))
        await stage.ros.call(lambda node: node.create_timer(0.01, lambda: sys.exit("the end")))
        await until(lambda: stage.deaths, "the death")
        with pytest.raises(TwinUnavailableError, match="not running"):
            await asyncio.wait_for(asked, PATIENCE_S)
        await until(lambda: not stage.ros.is_alive, "the end of the thread")
        with pytest.raises(TwinUnavailableError, match="not running"):
            await stage.ros.call(lambda _: None)
    assert stage.deaths == 1
    record = next(r for r in caplog.records if "the ROS thread has ended" in r.message)
    assert record.levelno == logging.CRITICAL
    assert record.exc_info is not None
    assert "the end" in str(record.exc_info[1])


async def test_a_thread_that_is_being_stopped_is_not_reported_as_dead(domain: int) -> None:
    async with Stage() as stage:
        thread = await stage.ros.call(lambda node: node.thread)
        stopping = asyncio.create_task(stage.ros.stop())
        await asyncio.sleep(0)
        thread.join()  # on the loop, which cannot have received it yet
        assert stage.ros.is_alive
        await stopping
        assert not stage.ros.is_alive


def test_a_thread_that_needs_a_restart_is_reported() -> None:
    assert ailment(ThreadState(is_alive=True, stuck_s=STUCK_AFTER_S - 0.001)) is None
    stuck = "The ROS thread has been stuck in a callback for 10 s. Restart."
    assert ailment(ThreadState(is_alive=True, stuck_s=STUCK_AFTER_S)) == stuck
    for stuck_s in (0.0, 60.0):
        ended = ThreadState(is_alive=False, stuck_s=stuck_s)
        assert ailment(ended) == "The ROS thread has ended. Restart."


BROKEN = faults("--raise", "lupin_twin.core.state:TwinStore.record:boom")


def entries(output: str) -> list[dict[str, Any]]:
    """The log of a process. Every line but the address is a JSON object."""
    lines = [line for line in output.splitlines() if not line.startswith("lupin-twin: http")]
    return [json.loads(line) for line in lines]


def test_with_json_logging_every_line_of_a_bridge_is_an_object(domain: int) -> None:
    arguments = ("--log-format", "json", "--ros-args", "-p", "idw_power:=3")
    with (
        lupin_twin(domain, "serve", *BROKEN, *arguments) as process,
        Peer(domain) as robot,
    ):
        url_of(process)
        robot.observe(scan("elsewhere", {"co2": 1.0}, frame_id="odom"), scan("boom", {"co2": 1.0}))
        process.wait_for_output("odom")
        process.wait_for_output("sabotage of")
        process.stop()
        written = entries(process.output)
    reported = {entry["level"]: entry for entry in written if entry["logger"] == "lupin_twin"}
    assert "'odom'" in reported["warning"]["message"]
    assert "Traceback" in reported["error"]["message"], "a trace of many lines is in one"


def test_every_severity_is_passed_on_once_with_its_level(caplog: pytest.LogCaptureFixture) -> None:
    forward()
    forward()
    logger = get_logger("probe")
    logger.info("100 %s")
    logger.warning("careful")
    logger.error("broken")
    logger.fatal("gone")
    for _ in range(2):
        logger.warning("logged once", once=True)
    logger.debug("not logged")
    reported = [
        (record.levelno, record.message) for record in caplog.records if record.name == "probe"
    ]
    assert reported == [
        (logging.INFO, "100 %s"),
        (logging.WARNING, "careful"),
        (logging.ERROR, "broken"),
        (logging.CRITICAL, "gone"),
        (logging.WARNING, "logged once"),
    ]
