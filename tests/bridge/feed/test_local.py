"""The twin of this process, in its ROS thread."""

import asyncio
import threading
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest
from rclpy.parameter import Parameter

from lupin_bridge.feed.local import LocalTwin
from lupin_bridge.feed.source import TwinTimeoutError, TwinUpdate
from lupin_twin.core.parameters import ParameterError
from lupin_twin.ros.node import TwinNode
from lupin_twin.runtime.estimates import ReportRequest
from tests.support.waiting import PATIENCE_S, until

SILENT = ("--ros-args", "-p", "state_publish_rate_hz:=0.01")


@asynccontextmanager
async def started(
    *ros_args: str, timeout_s: float = PATIENCE_S
) -> AsyncIterator[tuple[LocalTwin, list[TwinUpdate]]]:
    """A twin that is started, and what it has told."""
    twin, told = LocalTwin(ros_args=ros_args, timeout_s=timeout_s), list[TwinUpdate]()
    await twin.start(told.append, lambda: None)
    try:
        yield twin, told
    finally:
        await twin.stop()


async def test_a_thread_that_is_held_up_ends_a_request_by_the_setting_that_says_so(
    domain: int,
) -> None:
    busy, gate = threading.Event(), threading.Event()

    def hold(_: TwinNode) -> bool:
        busy.set()
        return gate.wait(20.0)

    async with started(timeout_s=0.2) as (twin, _):
        held = asyncio.create_task(twin.thread.call(hold))
        await until(busy.is_set, "the thread to be held")
        with pytest.raises(TwinTimeoutError, match=r"within 0\.2 s"):
            await twin.estimate_report(ReportRequest("co2"))
        gate.set()
        assert await held
        twin.timeout_s = PATIENCE_S
        assert (await twin.estimate_report(ReportRequest("co2"))).tags == ()


async def test_a_silent_node_is_heard_of_all_the_same(domain: int) -> None:
    async with started(*SILENT) as (_, told):
        await until(lambda: len(told) >= 2, "a heartbeat")
        first, second = told[:2]
        assert first.revision == second.revision
        assert first.snapshot.stamp_ns < second.snapshot.stamp_ns


async def test_two_twins_of_the_same_content_have_different_revisions(domain: int) -> None:
    async with started() as (first, _), started() as (second, _):
        assert first.revision() != second.revision()


async def test_parameters_come_from_the_ros_arguments(domain: int) -> None:
    arguments = ["--ros-args", "-p", "max_grid_cells:=9", "-p", "idw_max_distance_m:=0.75"]
    async with started(*arguments, "-r", "/twin/state:=/north/state") as (twin, _):
        assert (twin.rules.max_grid_cells, twin.rules.max_distance_m) == (9, 0.75)
        assert twin.names.state_topic == "/north/state"
        assert twin.names.field_service == "/twin/get_field"
        revision = twin.revision()
        wanted = [Parameter("idw_max_distance_m", value=0.25)]
        await twin.thread.call(lambda node: node.set_parameters(wanted))
        await until(lambda: twin.rules.max_distance_m == 0.25, "the new rules")
        assert twin.revision() != revision


async def test_a_parameter_out_of_its_range_fails_the_start(domain: int) -> None:
    twin = LocalTwin(ros_args=["--ros-args", "-p", "idw_power:=-1.0"], timeout_s=20.0)
    with pytest.raises(ParameterError, match=r"parameter idw_power is -1\.0"):
        await twin.start(lambda _: None, lambda: None)
    await twin.stop()
