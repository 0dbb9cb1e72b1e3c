"""The source of `serve`: a twin in this process, in a thread of its own."""

from __future__ import annotations

import asyncio
import uuid
from collections.abc import Callable, Coroutine, Sequence
from typing import Any, TypeVar

from lupin_bridge.twin.ros_thread import RosThread
from lupin_bridge.twin.shared import Shared
from lupin_bridge.twin.source import CacheCounts, RevisedGrid, Told, TwinNames, TwinTimeoutError
from lupin_twin.explored import OccupancyMap
from lupin_twin.fields import FieldJob, FieldRequest, FieldRules
from lupin_twin.grid import FieldGrid
from lupin_twin.history import TagHistory
from lupin_twin.journal.condition import Condition
from lupin_twin.node import TwinNode
from lupin_twin.state import Snapshot
from lupin_twin.workers import Workers

# A third of what counts as silence (`status.STALE_AFTER_S`).
HEARTBEAT_S = 1.0

ResultT = TypeVar("ResultT")


class LocalTwin:
    """`TwinSource` over a `TwinNode` of this process."""

    def __init__(self, *, ros_args: Sequence[str], timeout_s: float) -> None:
        self._ros_args = ros_args
        self._timeout_s = timeout_s
        # A restarted server must never match an ETag of its predecessor, whose counts it repeats.
        self._identity = uuid.uuid4().hex[:12]
        self._thread: RosThread[TwinNode, Told]
        self._told: Told
        self._cache = CacheCounts()
        # The same for as long as the node lives.
        self._rules: FieldRules
        self._names: TwinNames
        self.workers = Workers("work")
        self._computing: Shared[FieldGrid] = Shared()

    async def start(self, on_state: Callable[[Told], None], on_death: Callable[[], None]) -> None:
        """Start the ROS thread with its node; see `TwinSource.start`."""

        def make_node(context: Any, post: Callable[[Told], None]) -> TwinNode:
            node = TwinNode(context=context)

            def tell(snapshot: Snapshot) -> None:
                post(
                    Told(
                        snapshot,
                        self._revision_of(node),
                        node.twins.value,
                        node.occupancy_map,
                        node.habits.counts(),
                        cache=_cache_counts(node),
                        journal=node.memory.condition,
                    )
                )

            node.add_listener(tell, HEARTBEAT_S)
            return node

        def on_told(told: Told) -> None:
            self._told = told
            self._note_cache(told.cache)
            on_state(told)

        self._thread = RosThread(
            make_node, ros_args=self._ros_args, on_event=on_told, on_death=on_death
        )
        await self._thread.start()
        self._rules, self._names = await self._thread.call(
            lambda node: (
                node.fields.rules,
                TwinNames(
                    node.resolve_topic_name(node.parameters.state_topic),
                    node.resolve_service_name(node.parameters.field_service_name),
                ),
            )
        )

    async def stop(self) -> None:
        """Stop the ROS thread and the workers."""
        self.workers.close()
        await self._thread.stop()

    @property
    def identity(self) -> str:
        """Of this process: its counts start over with the next one."""
        return self._identity

    @property
    def is_alive(self) -> bool:
        """Whether the ROS thread runs."""
        return self._thread.is_alive

    @property
    def stuck_s(self) -> float:
        """How long the ROS thread has not answered a heartbeat, s."""
        return self._thread.stuck_s

    @property
    def calls_waiting(self) -> int:
        """Calls that wait for the ROS thread now."""
        return self._thread.calls_waiting

    @property
    def callback_errors(self) -> int:
        """Errors met by the node's callbacks, as of the last heartbeat."""
        return self._thread.callback_errors

    def revision(self) -> str:
        """The process's identity, the observation count and the map's revision, as told last.

        What a call brings from the ROS thread is never newer: what has changed is told at once.
        """
        return self._told.revision

    def field_revision(self, request: FieldRequest) -> str | None:  # noqa: ARG002  # all alike
        """The revision now: here every field is made of the store as it stands."""
        return self._told.revision

    def rules(self) -> FieldRules:
        """The node's parameters for fields."""
        return self._rules

    def names(self) -> TwinNames:
        """The parameters `state_topic` and `field_service_name` as ROS resolves them."""
        return self._names

    def journal(self) -> Condition:
        """The node's journal."""
        return self._told.journal

    def cache_counts(self) -> CacheCounts:
        """The node's cache of fields."""
        return self._cache

    def occupancy_map(self) -> OccupancyMap | None:
        """The latest map that the node accepted."""
        return self._told.occupancy_map

    async def field(self, request: FieldRequest) -> RevisedGrid:
        """A hit from the node's cache, or the field computed on a worker and handed back to it."""
        return await self._in_time(self._field(request))

    async def history(self, tag_id: str) -> TagHistory | None:
        """The last `buffer_len` scans, and as many tries, of a tag."""
        return await self._in_time(self._thread.call(lambda node: node.history_of(tag_id)))

    async def _field(self, request: FieldRequest) -> RevisedGrid:
        def look_up(node: TwinNode) -> tuple[FieldGrid | FieldJob, str, CacheCounts]:
            answer = node.fields.lookup(request, node.store, node.occupancy_map)
            return answer, self._revision_of(node), _cache_counts(node)

        answer, revision, cache = await self._thread.call(look_up)
        self._note_cache(cache)
        if isinstance(answer, FieldJob):
            job = answer
            answer = await self._computing.get(job.key, lambda: self._compute(job))
        return RevisedGrid(answer, revision)

    async def _compute(self, job: FieldJob) -> FieldGrid:
        grid = await asyncio.wrap_future(self.workers.submit(job.compute, job.cost_s))

        def keep(node: TwinNode) -> CacheCounts:
            node.fields.keep(job, grid)
            return _cache_counts(node)

        self._note_cache(await self._thread.call(keep))
        return grid

    def _note_cache(self, cache: CacheCounts) -> None:
        # A call's may come behind newer ones that were told; a counter never falls.
        if cache.hits + cache.misses >= self._cache.hits + self._cache.misses:
            self._cache = cache

    async def _in_time(self, answer: Coroutine[Any, Any, ResultT]) -> ResultT:
        try:
            async with asyncio.timeout(self._timeout_s):
                return await answer
        except TimeoutError:
            raise TwinTimeoutError(
                f"the twin did not answer within {self._timeout_s:g} s (field_timeout_s)"
            ) from None

    def _revision_of(self, node: TwinNode) -> str:
        observation_count, map_revision = node.revision
        return f"{self._identity}-{observation_count}-{map_revision}"


def _cache_counts(node: TwinNode) -> CacheCounts:
    cache = node.fields.cache
    return CacheCounts(cache.hits, cache.misses, len(cache), cache.bytes)
