"""The twin of this process: its fields, computed once, beside its ROS thread."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from rclpy.parameter import Parameter

from lupin_bridge.feed.local import LocalTwin
from lupin_bridge.feed.source import TwinTimeoutError, TwinUpdate
from lupin_twin.core.parameters import ParameterError
from lupin_twin.core.state import Pose, Reading, Scan
from lupin_twin.field.engine import FieldJob, FieldRefused, FieldRequest
from lupin_twin.field.grid import FieldGrid
from lupin_twin.ros.node import TwinNode
from lupin_twin.runtime.estimate_rounds import ReportRequest
from lupin_twin.runtime.workers import ShouldStop
from tests.support.waiting import PATIENCE_S, until

REQUEST = FieldRequest("co2", 0.5, 0.0, 0.0, 2.0, 2.0)
OTHER = FieldRequest("co2", 0.25, 0.0, 0.0, 2.0, 2.0)
SILENT = ("--ros-args", "-p", "state_publish_rate_hz:=0.01")


class Stage:
    """A twin, what it has told, and a gate at which held computations wait."""

    def __init__(self, twin: LocalTwin) -> None:
        self.twin = twin
        self.told: list[TwinUpdate] = []
        self.computed: list[FieldRequest] = []
        self.held: set[FieldRequest] = set()
        self.gate = threading.Event()
        self.failure: Exception | None = None

    async def record(self, tag_id: str, value: float) -> None:
        """Record a scan at (1, 1), as a callback would."""
        scan = Scan(
            tag_id,
            1_000_000_000,
            (Reading("co2", value),),
            Pose(1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0),
        )

        def take(node: TwinNode) -> None:
            node.store.record(scan)
            node.notify_listeners()

        await self.twin.thread.call(take)

    async def waiting(self, *requests: FieldRequest) -> list[asyncio.Task[Any]]:
        """Ask for fields that wait at the gate; returns when all of them do."""
        self.held |= set(requests)
        tasks = [asyncio.create_task(self.twin.field(request)) for request in requests]
        await until(lambda: len(self.computed) == len(set(requests)), "the computations")
        await until(lambda: self.twin.thread.calls_waiting == 0, "everybody to have asked")
        return tasks


@pytest.fixture
def stage_of(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Any]:
    """Stages whose field jobs are counted, and held and failed as the test likes."""

    @asynccontextmanager
    async def make(*ros_args: str, timeout_s: float = PATIENCE_S) -> AsyncIterator[Stage]:
        twin = LocalTwin(ros_args=ros_args, timeout_s=timeout_s)
        stage = Stage(twin)
        compute = FieldJob.compute

        def watched(job: FieldJob, should_stop: ShouldStop) -> FieldGrid:
            stage.computed.append(job.request)
            if job.request in stage.held:
                stage.gate.wait(20.0)
            if stage.failure is not None:
                raise stage.failure
            return compute(job, should_stop)

        monkeypatch.setattr(FieldJob, "compute", watched)
        await twin.start(stage.told.append, lambda: None)
        try:
            yield stage
        finally:
            stage.gate.set()
            await twin.stop()

    return make


# --- fields -------------------------------------------------------------------------------------


async def test_a_field_is_computed_once_until_something_is_recorded(
    domain: int, stage_of: Callable[..., Any]
) -> None:
    async with stage_of() as stage:
        await stage.record("1", 400.0)
        first = await stage.twin.field(REQUEST)
        again = await stage.twin.field(REQUEST)
        assert stage.computed == [REQUEST]
        assert again.revision == first.revision == stage.twin.revision()
        np.testing.assert_array_equal(first.grid.values, np.full(16, 400.0, np.float32))

        await stage.record("1", 500.0)
        counts = stage.twin.update.cache
        assert (counts.hits, counts.misses, counts.entries) == (1, 1, 1)
        assert counts.bytes == first.grid.values.nbytes
        newer = await stage.twin.field(REQUEST)
        assert newer.revision != first.revision
        np.testing.assert_array_equal(newer.grid.values, np.full(16, 500.0, np.float32))


async def test_a_heavy_request_does_not_hold_up_another_one(
    domain: int, stage_of: Callable[..., Any]
) -> None:
    async with stage_of() as stage:
        (heavy,) = await stage.waiting(REQUEST)
        assert (await stage.twin.field(OTHER)).grid.width == 8
        assert not heavy.done()
        stage.gate.set()
        assert (await heavy).grid.width == 4


async def test_a_request_made_after_a_change_does_not_get_the_field_from_before(
    domain: int, stage_of: Callable[..., Any]
) -> None:
    async with stage_of() as stage:
        await stage.record("1", 400.0)
        (old,) = await stage.waiting(REQUEST)
        await stage.record("1", 500.0)
        new = asyncio.create_task(stage.twin.field(REQUEST))
        await until(lambda: len(stage.computed) == 2, "the second computation")
        stage.gate.set()
        assert (await old).grid.value_max == 400.0
        assert (await new).grid.value_max == 500.0
        assert (await old).revision != (await new).revision


async def test_a_computation_that_nobody_waits_for_is_taken_back(
    domain: int, stage_of: Callable[..., Any]
) -> None:
    """Off the queue, or out of its thread: whoever came last has not computed for nobody."""

    async with stage_of() as stage:
        workers = stage.twin.workers
        large = [replace(REQUEST, resolution=0.002 + n / 1e6) for n in range(4)]
        for number in range(10):  # enough to make a million cells dear
            await stage.record(str(number), 400.0)
        stage.held |= set(large)
        tasks = [asyncio.create_task(stage.twin.field(request)) for request in large]
        await until(lambda: workers.running == workers.waiting == 2, "two of four at work")
        for task in tasks:
            task.cancel()
        await until(lambda: workers.waiting == 0, "an empty queue")
        assert workers.abandoned == 4
        stage.gate.set()
        await until(lambda: workers.running == 0, "the end of both at work")
        assert len(stage.computed) == 2, "what was in the queue never began"
        assert stage.twin.update.cache.entries == 0, "neither was computed to its end"


async def test_a_refusal_is_get_fields_own(domain: int, stage_of: Callable[..., Any]) -> None:
    async with stage_of() as stage:
        with pytest.raises(FieldRefused, match="sensor_type is empty"):
            await stage.twin.field(FieldRequest("", 0.5, 0.0, 0.0, 1.0, 1.0))
        assert stage.computed == []


# --- time ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("what", ["ROS thread", "computation"])
async def test_what_takes_too_long_ends_by_the_setting_that_says_so(
    domain: int, stage_of: Callable[..., Any], what: str
) -> None:
    async with stage_of(timeout_s=0.2) as stage:
        stage.held.add(REQUEST)
        if what == "ROS thread":
            busy = threading.Event()

            def hold(_: TwinNode) -> bool:
                busy.set()
                return bool(stage.gate.wait(20.0))

            held = asyncio.create_task(stage.twin.thread.call(hold))
            await until(busy.is_set, "the thread to be held")
            with pytest.raises(TwinTimeoutError):
                await stage.twin.estimate_report(ReportRequest("co2"))
        with pytest.raises(TwinTimeoutError, match=r"within 0\.2 s"):
            await stage.twin.field(REQUEST)
        stage.gate.set()
        if what == "ROS thread":
            await held
        await until(lambda: not stage.twin._computing, "the end of the computation")
        stage.twin.timeout_s = PATIENCE_S
        assert (await stage.twin.field(REQUEST)).grid.width == 4


async def test_a_silent_node_is_heard_of_all_the_same(
    domain: int, stage_of: Callable[..., Any]
) -> None:
    async with stage_of(*SILENT) as stage:
        await until(lambda: len(stage.told) >= 2, "a heartbeat")
        first, second = stage.told[:2]
        assert first.revision == second.revision
        assert first.snapshot.stamp_ns < second.snapshot.stamp_ns


# --- the rest -----------------------------------------------------------------------------------


async def test_two_twins_of_the_same_content_have_different_revisions(domain: int) -> None:
    twins = [LocalTwin(ros_args=(), timeout_s=20.0) for _ in range(2)]
    for twin in twins:
        await twin.start(lambda _: None, lambda: None)
    assert len({twin.revision() for twin in twins}) == 2
    for twin in twins:
        await twin.stop()


async def test_parameters_come_from_the_ros_arguments(
    domain: int, stage_of: Callable[..., Any]
) -> None:
    arguments = ["--ros-args", "-p", "max_grid_cells:=9", "-p", "idw_max_distance_m:=0.75"]
    async with stage_of(*arguments, "-r", "/twin/state:=/north/state") as stage:
        rules = stage.twin.rules()
        assert (rules.max_grid_cells, rules.max_distance_m) == (9, 0.75)
        assert stage.twin.names().state_topic == "/north/state"
        assert stage.twin.names().field_service == "/twin/get_field"
        revision = stage.twin.revision()
        wanted = [Parameter("idw_max_distance_m", value=0.25)]
        await stage.twin.thread.call(lambda node: node.set_parameters(wanted))
        await until(lambda: stage.twin.rules().max_distance_m == 0.25, "the new rules")
        assert stage.twin.revision() != revision


async def test_a_parameter_out_of_its_range_fails_the_start(domain: int) -> None:
    twin = LocalTwin(ros_args=["--ros-args", "-p", "idw_power:=-1.0"], timeout_s=20.0)
    with pytest.raises(ParameterError, match=r"parameter idw_power is -1\.0"):
        await twin.start(lambda _: None, lambda: None)
    await twin.stop()
