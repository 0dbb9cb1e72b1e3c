"""What every source has to be: both are held to the protocol, and to what it promises."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import pytest

from lupin_bridge.feed.local import LocalTwin
from lupin_bridge.feed.query import Itself
from lupin_bridge.feed.source import (
    STUCK_AFTER_S,
    ThreadState,
    TwinSource,
    TwinUnavailableError,
    TwinUpdate,
    ailment,
)
from lupin_bridge.feed.web import WebTwin
from lupin_twin.core.history import LatestRequest
from lupin_twin.runtime.estimates import ReportRequest
from tests.support.messages import discovered, occupancy_grid, pose, scan
from tests.support.processes import OFTEN, twin_node
from tests.support.ros import Peer
from tests.support.waiting import until, until_answered

SOURCES = [LocalTwin, WebTwin]


class Stage:
    """A source of one kind, a peer on its twin's topics, and what the source has told."""

    def __init__(self, source: TwinSource, peer: Peer) -> None:
        self.source, self.peer = source, peer
        self.told: list[TwinUpdate] = []
        self.deaths: list[None] = []

    async def tag(self, tag_id: str, has_pose: bool | None = None) -> TwinUpdate:
        """The first state told that has the tag, with or without a pose as asked."""

        def look() -> TwinUpdate | None:
            newest = self.told[-1] if self.told else None
            for tag in () if newest is None else newest.snapshot.tags:
                if tag.tag_id == tag_id and has_pose in (None, tag.pose is not None):
                    return newest
            return None

        found = await until(look, f"tag {tag_id}")
        assert found is not None
        return found


@asynccontextmanager
async def stage_of(source_type: type, domain: int, *ros_args: str) -> AsyncIterator[Stage]:
    """A started source; for `WebTwin`, with a twin in a process of its own."""
    arguments = (*OFTEN, "-p", "max_grid_cells:=1000", *ros_args)
    with Peer(domain) as peer:
        if source_type is WebTwin:
            with twin_node(domain, *arguments):
                async with started(WebTwin, arguments, peer) as stage:
                    yield stage
        else:
            async with started(source_type, arguments, peer) as stage:
                yield stage


@asynccontextmanager
async def started(source_type: Any, arguments: Any, peer: Peer) -> AsyncIterator[Stage]:
    source = source_type(ros_args=arguments, timeout_s=20.0)
    stage = Stage(source, peer)
    await source.start(stage.told.append, lambda: stage.deaths.append(None))
    try:
        yield stage
    finally:
        await source.stop()


@pytest.mark.parametrize("source_type", SOURCES)
async def test_a_source_tells_of_every_change_and_of_what_it_is_asked(
    domain: int, source_type: type
) -> None:
    async with stage_of(source_type, domain) as stage:
        source, peer = stage.source, stage.peer
        assert source.thread.is_alive
        assert source.occupancy_map() is None
        revisions = []

        peer.observe(scan("1", {"co2": 400.0}, stamp_s=5.0))
        revisions.append((await stage.tag("1")).revision)

        peer.discover(discovered({"1": pose(0.5, 0.5)}))
        revisions.append((await stage.tag("1", has_pose=True)).revision)

        peer.publish_map(occupancy_grid([[0, 100]]))
        await until(lambda: source.occupancy_map() is not None, "the map")
        await until(lambda: stage.told[-1].revision not in revisions, "the map's revision")
        revisions.append(stage.told[-1].revision)
        assert len(set(revisions)) == 3

        history = await until_answered(
            lambda: source.ask(Itself(LatestRequest("1", source.buffer_len)), 0.0), "the scan", bool
        )
        assert [(scan.stamp_ns, scan.readings[0].value) for scan in history] == [
            (5_000_000_000, 400.0)
        ]
        report = await until_answered(
            lambda: source.estimate_report(ReportRequest("co2")), "the service", bool
        )
        assert (report.fitted_at_ns, report.tags, report.record.since_ns) == (None, (), None)
        assert stage.told[-1].twin_count == 1
        assert source.names.state_topic == "/twin/state"
        assert source.rules.max_grid_cells == 1000
        assert (source.thread.callback_errors, source.thread.calls_waiting) == (0, 0)
    # A thread that has not ended in time is left behind, and ends for itself.
    await until(lambda: not source.thread.is_alive, "its end")
    assert stage.deaths == []
    with pytest.raises(TwinUnavailableError):
        await source.estimate_report(ReportRequest("co2"))


@pytest.mark.parametrize(
    ("is_alive", "stuck_s", "said"),
    [
        (True, 0.0, None),
        (True, STUCK_AFTER_S - 0.001, None),
        (True, STUCK_AFTER_S, "The ROS thread has been stuck in a callback for 10 s. Restart."),
        (False, 0.0, "The ROS thread has ended. Restart."),
        (False, 60.0, "The ROS thread has ended. Restart."),
    ],
)
def test_a_thread_that_only_a_restart_helps_is_told(
    is_alive: bool, stuck_s: float, said: str | None
) -> None:
    assert ailment(ThreadState(is_alive, stuck_s)) == said
