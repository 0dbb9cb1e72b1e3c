"""The source of `serve`: a twin in this process, in a thread of its own; its past in another."""

from __future__ import annotations

import asyncio
import time
import uuid
from collections.abc import Awaitable, Callable, Sequence
from concurrent.futures import Future
from contextlib import nullcontext
from typing import Any, TypeVar

from lupin_bridge.twin.log_reader import LogReader
from lupin_bridge.twin.names import TwinNames
from lupin_bridge.twin.past_child import Now
from lupin_bridge.twin.past_process import PastProcess
from lupin_bridge.twin.relay import Relay
from lupin_bridge.twin.relay_ros import RelayRos, names_of
from lupin_bridge.twin.ros_thread import RosThread
from lupin_bridge.twin.shared import Shared
from lupin_bridge.twin.source import CacheCounts, RevisedGrid, Told, TwinTimeoutError
from lupin_bridge.twin.trust import RevisedEstimate, Trust, revised
from lupin_twin.estimate_report import ADVICE_S, Report, ReportRequest
from lupin_twin.estimate_service import Task
from lupin_twin.estimates import EstimateRequest, TagPast
from lupin_twin.explored import OccupancyMap
from lupin_twin.fields import FieldJob, FieldRequest, FieldRules
from lupin_twin.grid import FieldGrid
from lupin_twin.history import TagHistory
from lupin_twin.journal.condition import Condition
from lupin_twin.node import TwinNode
from lupin_twin.parameters import World
from lupin_twin.past import NotRemembered
from lupin_twin.state import NANOSECONDS_PER_SECOND, Snapshot
from lupin_twin.workers import SMALL_S, Workers

# A third of what counts as silence (`status.STALE_AFTER_S`).
HEARTBEAT_S = 1.0
ResultT = TypeVar("ResultT")


class LocalTwin(LogReader):
    """`TwinSource` over a `TwinNode` of this process; see `PastProcess` for what it `expects`."""

    def __init__(
        self,
        *,
        ros_args: Sequence[str],
        timeout_s: float,
        expects: type | None = None,
        world: World = World(),
    ) -> None:
        self._ros_args = ros_args
        self._world = world
        self.timeout_s = timeout_s
        # A restarted server must never match an ETag of its predecessor, whose counts it repeats.
        self._identity = uuid.uuid4().hex[:12]
        self.thread: RosThread[TwinNode, Told]
        self.told: Told
        self._cache = CacheCounts()
        self._rules: FieldRules
        # The same for as long as the node lives.
        self._names: TwinNames
        self.past = PastProcess(expects, lambda: self.now() if self._told_number else None)
        self._told_number = 0
        self.workers = Workers("work")
        self.relay = Relay(lambda: self.thread, RelayRos())
        self._computing: Shared[FieldGrid] = Shared()
        self._estimating: Shared[RevisedEstimate] = Shared()
        self._trust = Trust()
        # One at a time: fields have the other workers, and frames the other cores.
        self._large_estimate = asyncio.Semaphore(1)

    async def start(self, on_state: Callable[[Told], None], on_death: Callable[[], None]) -> None:
        """Start the ROS thread with its node; see `TwinSource.start`."""

        def make_node(context: Any, post: Callable[[Told], None]) -> TwinNode:
            node = TwinNode(context=context, world=self._world)

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
                        rules=node.fields.rules,
                        origin=node.origin,
                        input_problems=node.habits.input_problems,
                    )
                )

            node.add_listener(tell, HEARTBEAT_S)
            return node

        def on_told(told: Told) -> None:
            self.told = told
            self._told_number += 1
            self._note_cache(told.cache)
            if told.rules is not None:
                self._rules = told.rules
            on_state(told)

        self.thread = RosThread(
            make_node, ros_args=self._ros_args, on_event=on_told, on_death=on_death
        )
        await self.thread.start()
        self._rules, self._names = await self.thread.call(
            lambda node: (node.fields.rules, names_of(node))
        )
        self.past.start()

    async def stop(self) -> None:
        """Stop the ROS thread, the workers and the process that looks back."""
        self.workers.close()
        await asyncio.gather(self.past.stop(), self.thread.stop())

    @property
    def identity(self) -> str:
        """Of this process: its counts start over with the next one."""
        return self._identity

    @property
    def is_alive(self) -> bool:
        """Whether the ROS thread runs."""
        return self.thread.is_alive

    @property
    def stuck_s(self) -> float:
        """How long the ROS thread has not answered a heartbeat, s."""
        return self.thread.stuck_s

    @property
    def calls_waiting(self) -> int:
        """Calls that wait for the ROS thread now."""
        return self.thread.calls_waiting

    @property
    def callback_errors(self) -> int:
        """Errors met by the node's callbacks, as of the last heartbeat."""
        return self.thread.callback_errors

    def revision(self) -> str:
        """The process's identity, the observation count and the map's revision, as told last.

        What a call brings from the ROS thread is never newer: what has changed is told at once.
        """
        return self.told.revision

    def field_revision(self, request: FieldRequest) -> str | None:  # noqa: ARG002  # all alike
        """The revision now: here every field is made of the store as it stands."""
        return self.told.revision

    def rules(self) -> FieldRules:
        """The node's parameters for fields."""
        return self._rules

    def names(self) -> TwinNames:
        """The twin's, as ROS resolves and remaps them."""
        return self._names

    def journal(self) -> Condition:
        """The node's journal."""
        return self.told.journal

    def cache_counts(self) -> CacheCounts:
        """The node's cache of fields."""
        return self._cache

    def occupancy_map(self) -> OccupancyMap | None:
        """The latest map that the node accepted."""
        return self.told.occupancy_map

    async def field(self, request: FieldRequest) -> RevisedGrid:
        """A hit from the node's cache, or the field computed on a worker and handed back to it."""
        return await self._in_time(self._field(request))

    def estimate_revision(self, request: EstimateRequest) -> str | None:
        """That of the last answer, as long as nothing was told that could have changed it."""
        return self._trust.revision(request, self.told.revision)

    async def estimate(self, request: EstimateRequest) -> RevisedEstimate:
        """The node says of what, and by which model; it is computed on a worker."""
        key = (self.told.revision, request)
        return await self._in_time(self._estimating.get(key, lambda: self._estimate(request)))

    async def estimate_report(self, request: ReportRequest) -> Report:
        """What the node knows; where another tag helps is worked out on a worker."""
        return await self._in_time(self._report(request))

    async def history(self, tag_id: str) -> TagHistory | None:
        """The last `buffer_len` scans, and as many tries, of a tag."""
        return await self._in_time(self.thread.call(lambda node: node.history_of(tag_id)))

    @property
    def now_ns(self) -> int:
        """ROS time now: what was told last may be a heartbeat old."""
        now = self.told.snapshot
        if now.clock != "running":
            return now.stamp_ns
        return now.stamp_ns + int((time.monotonic() - self.told.made_s) * NANOSECONDS_PER_SECOND)

    async def _found(self) -> None:
        """It is the node's, from its start."""

    def now(self) -> Now:
        """What who looks back has to know of now."""
        told = self.told
        return Now(self.now_ns, told.snapshot.frame_id, told.journal, self._told_number)

    async def _field(self, request: FieldRequest) -> RevisedGrid:
        def look_up(node: TwinNode) -> tuple[FieldGrid | FieldJob, str, CacheCounts]:
            answer = node.fields.lookup(request, node.store, node.occupancy_map)
            return answer, self._revision_of(node), _cache_counts(node)

        answer, revision, cache = await self.thread.call(look_up)
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

        self._note_cache(await self.thread.call(keep))
        return grid

    async def _estimate(self, request: EstimateRequest) -> RevisedEstimate:
        def begin(node: TwinNode) -> tuple[Task, Future[Sequence[TagPast]]]:
            task = node.estimates.prepare(request)
            return task, task.look_up()

        epoch = self.told.revision
        task, looking_up = await self.thread.call(begin)
        found = await asyncio.wrap_future(looking_up)
        async with self._large_estimate if task.cost_s > SMALL_S else nullcontext():
            result = await asyncio.wrap_future(
                self.workers.submit(
                    lambda should_stop: revised(task.make(found, should_stop)), task.cost_s
                )
            )
        if epoch == self.told.revision:
            self._trust.put(request, epoch, result.revision)
        return result

    async def _report(self, request: ReportRequest) -> Report:
        work = await self.thread.call(lambda node: node.estimates.report(request))
        return await asyncio.wrap_future(self.workers.submit(lambda _: work(), ADVICE_S))

    def _note_cache(self, cache: CacheCounts) -> None:
        # A call's may come behind newer ones that were told; a counter never falls.
        if cache.hits + cache.misses >= self._cache.hits + self._cache.misses:
            self._cache = cache

    async def _in_time(self, answer: Awaitable[ResultT]) -> ResultT:
        try:
            async with asyncio.timeout(self.timeout_s):
                return await answer
        except TimeoutError:
            raise TwinTimeoutError(f"the twin did not answer within {self.timeout_s:g} s") from None
        except NotRemembered as error:
            damage = error.damage
            if damage:
                await self.thread.call(lambda node: node.memory.heal(damage))
            raise

    def _revision_of(self, node: TwinNode) -> str:
        return "-".join((self._identity, *map(str, node.revision)))


def _cache_counts(node: TwinNode) -> CacheCounts:
    cache = node.fields.cache
    return CacheCounts(cache.hits, cache.misses, len(cache), cache.bytes)
