"""The source of `serve`: a twin in a thread of this process; another process reads its past."""

from __future__ import annotations

import asyncio
import uuid
from collections.abc import Callable, Sequence
from typing import Any

from lupin_bridge.feed.query import Now
from lupin_bridge.feed.ros_source import Post, RosSource, now_ns_of
from lupin_bridge.feed.source import TwinUpdate
from lupin_twin.core.diagnostics import Origin
from lupin_twin.core.notes import Note
from lupin_twin.core.parameters import DAY_S, World
from lupin_twin.core.past import NotRemembered
from lupin_twin.core.state import Snapshot
from lupin_twin.ros.node import TwinNode

# A third of what counts as silence (`frames.STALE_AFTER_S`).
HEARTBEAT_S = 1.0


class LocalTwin(RosSource[TwinNode]):
    """`TwinSource` over a `TwinNode` of this process."""

    def __init__(
        self, *, ros_args: Sequence[str], timeout_s: float, origin: Origin = "robot"
    ) -> None:
        super().__init__(ros_args=ros_args, timeout_s=timeout_s)
        self._origin = origin
        self._day_length_s = DAY_S
        # A restarted server must never match an ETag of its predecessor, whose counts it repeats.
        self.identity = uuid.uuid4().hex[:12]
        # Never None once started: the first one comes before `start` returns.
        self.update: TwinUpdate

    async def start(
        self, on_state: Callable[[TwinUpdate], None], on_death: Callable[[], None]
    ) -> None:
        """Start the ROS thread with its node; see `TwinSource.start`."""

        def make_node(context: Any, post: Post) -> TwinNode:
            node = TwinNode(context=context, origin=self._origin)
            self._day_length_s = node.parameters.day_length_s

            def notify(snapshot: Snapshot) -> None:
                post(
                    TwinUpdate(
                        snapshot,
                        "-".join((self.identity, *map(str, node.revision))),
                        node.utilities.twins,
                        node.occupancy_map,
                        node.utilities.counts(),
                        journal=node.memory.condition,
                        rules=node.rules,
                        origin=node.origin,
                        input_problems=node.utilities.input_problems,
                    )
                )

            node.listen(notify, HEARTBEAT_S)
            return node

        await self._start_thread(make_node, on_state, on_death)

    @property
    def world(self) -> World:
        """See `TwinSource`."""
        return World(self._origin, self._day_length_s)

    writes_notes = True

    async def write_note(self, note: Note) -> Note:
        """See `TwinSource`: the thread of the node's journal writes it."""

        async def written() -> Note:
            write = self.thread.call(lambda node: node.memory.journal.write_note(note))
            return await asyncio.wrap_future(await write)

        return await self._in_time(written())

    async def now(self) -> Now:
        """See `TwinSource`."""
        update = self.update
        return Now(now_ns_of(update), update.snapshot.frame_id, update.journal)

    async def _explain(self, error: NotRemembered) -> NotRemembered:
        damage = error.damage
        if damage:
            await self.thread.call(lambda node: node.memory.journal.heal(damage))
        return error
