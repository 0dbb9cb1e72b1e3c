"""The source of `serve`: a twin in this process, in a thread of its own; its past in another."""

from __future__ import annotations

import asyncio
import time
import uuid
from collections.abc import Callable, Sequence
from typing import Any

from lupin_bridge.feed.query import Now
from lupin_bridge.feed.ros_source import RosSource
from lupin_bridge.feed.source import TwinUpdate
from lupin_twin.core.journal_condition import Condition
from lupin_twin.core.notes import Note
from lupin_twin.core.parameters import World
from lupin_twin.core.past import NotRemembered
from lupin_twin.core.state import NANOSECONDS_PER_SECOND, Snapshot
from lupin_twin.field.explored import OccupancyMap
from lupin_twin.ros.node import TwinNode
from lupin_twin.runtime.estimates import Report, ReportRequest

# A third of what counts as silence (`status.STALE_AFTER_S`).
HEARTBEAT_S = 1.0


class LocalTwin(RosSource[TwinNode, TwinUpdate]):
    """`TwinSource` over a `TwinNode` of this process."""

    def __init__(
        self, *, ros_args: Sequence[str], timeout_s: float, world: World = World()
    ) -> None:
        super().__init__(ros_args=ros_args, timeout_s=timeout_s)
        self._world = world
        self.day_length_s = world.day_length_s
        # A restarted server must never match an ETag of its predecessor, whose counts it repeats.
        self.identity = uuid.uuid4().hex[:12]
        self.update: TwinUpdate

    async def start(
        self, on_state: Callable[[TwinUpdate], None], on_death: Callable[[], None]
    ) -> None:
        """Start the ROS thread with its node; see `TwinSource.start`."""

        def make_node(context: Any, post: Callable[[TwinUpdate], None]) -> TwinNode:
            node = TwinNode(context=context, world=self._world)

            def notify(snapshot: Snapshot) -> None:
                post(
                    TwinUpdate(
                        snapshot,
                        self._revision_of(node),
                        node.twins.value,
                        node.occupancy_map,
                        node.utilities.counts(),
                        journal=node.memory.condition,
                        rules=node.rules,
                        origin=node.origin,
                        input_problems=node.utilities.input_problems,
                    )
                )

            node.add_listener(notify, HEARTBEAT_S)
            return node

        def on_update(update: TwinUpdate) -> None:
            self.update = update
            if update.rules is not None:
                self._rules = update.rules
            on_state(update)

        await self._start_thread(make_node, on_update, on_death)

    def revision(self) -> str:
        """The process's identity, the observation count and the map's revision, as updated last.

        What a call brings from the ROS thread is never newer: what has changed is posted at once.
        """
        return self.update.revision

    def journal(self) -> Condition:
        """The node's journal."""
        return self.update.journal

    def occupancy_map(self) -> OccupancyMap | None:
        """The latest map that the node accepted."""
        return self.update.occupancy_map

    async def estimate_report(self, request: ReportRequest) -> Report:
        """What the node makes of its log."""
        return await self._in_time(self._report(request))

    writes_notes = True

    async def write_note(self, note: Note) -> Note:
        """Through the node's journal, whose thread writes it."""
        return await self._in_time(self._write_note(note))

    async def _write_note(self, note: Note) -> Note:
        writing = await self.thread.call(lambda node: node.memory.write_note(note))
        return await asyncio.wrap_future(writing)

    @property
    def now_ns(self) -> int:
        """ROS time now: the last update may be a heartbeat old."""
        now = self.update.snapshot
        if now.clock != "running":
            return now.stamp_ns
        return now.stamp_ns + int((time.monotonic() - self.update.made_s) * NANOSECONDS_PER_SECOND)

    async def now(self) -> Now:
        """What who looks back has to know of now."""
        update = self.update
        return Now(self.now_ns, update.snapshot.frame_id, update.journal)

    async def _report(self, request: ReportRequest) -> Report:
        reporting = await self.thread.call(lambda node: node.estimates.report(request))
        return await asyncio.wrap_future(reporting)

    async def _explain(self, error: NotRemembered) -> NotRemembered:
        damage = error.damage
        if damage:
            await self.thread.call(lambda node: node.memory.heal(damage))
        return error

    def _revision_of(self, node: TwinNode) -> str:
        return "-".join((self.identity, *map(str, node.revision)))
