"""The source of `web`: a twin elsewhere. As many of these as needed may share one twin."""

from __future__ import annotations

import asyncio
import time
from collections import OrderedDict
from collections.abc import Callable, Sequence
from contextlib import AbstractAsyncContextManager, nullcontext
from dataclasses import dataclass
from hashlib import blake2b
from typing import Any, Final

from lupin_bridge.twin.ros_thread import RosThread
from lupin_bridge.twin.shared import Shared
from lupin_bridge.twin.source import (
    CacheCounts,
    RevisedGrid,
    Told,
    TwinNames,
    TwinTimeoutError,
    TwinUnavailableError,
)
from lupin_bridge.twin.web_node import WebNode
from lupin_twin import convert
from lupin_twin.explored import OccupancyMap
from lupin_twin.fields import FieldRefused, FieldRequest, FieldRules, cost_s
from lupin_twin.history import TagHistory
from lupin_twin.journal.condition import OFF, Condition
from lupin_twin.state import Snapshot
from lupin_twin.workers import SMALL_S, Workers

# Requests on their way to the twin at once. It answers one after the other anyway; more would
# only wait in DDS, where they cannot be taken back.
MAX_REQUESTS = 4

SERVICE_LOOK_S = 0.02

# How long an answer stands for the twin's field while nothing is heard of a change. There are some
# that no state tells: a map that reached the twin later than this process.
TRUST_S: Final = 5.0
# A page asks for a few fields; so many may be told without asking the twin.
MAX_TRUSTED: Final = 256
# What reading a cell of an answer takes, roughly and at worst.
_READ_CELL_S: Final = 10e-9


class WebTwin:
    """`TwinSource` over the ROS contracts of a twin in another process."""

    def __init__(self, *, ros_args: Sequence[str], timeout_s: float) -> None:
        self._ros_args = ros_args
        self._timeout_s = timeout_s
        self._thread: RosThread[WebNode, _Heard]
        self._heard = _Heard()
        # The same for as long as the node lives.
        self._rules: FieldRules
        self._names: TwinNames
        self.workers = Workers("work")
        self._asking: Shared[RevisedGrid] = Shared()
        self._trusted: OrderedDict[FieldRequest, _Trusted] = OrderedDict()
        self._slots = asyncio.Semaphore(MAX_REQUESTS)
        # One way is left to the small, which would wait behind the large otherwise.
        self._large_slots = asyncio.Semaphore(MAX_REQUESTS - 1)

    async def start(self, on_state: Callable[[Told], None], on_death: Callable[[], None]) -> None:
        """Start the ROS thread with its node; see `TwinSource.start`."""

        def make_node(context: Any, post: Callable[[_Heard], None]) -> WebNode:
            told: Told | None = None

            def pass_on(snapshot: Snapshot) -> None:
                nonlocal told
                told = Told(
                    snapshot,
                    node.revision,
                    node.twins.value,
                    node.occupancy_map,
                    node.twin_counts,
                    node.habits.counts(),
                )
                post_all()

            def post_all() -> None:
                post(_Heard(told, node.epoch, node.revision, node.occupancy_map))

            node = WebNode(pass_on, post_all, context=context)
            return node

        def on_heard(heard: _Heard) -> None:
            before, self._heard = self._heard.told, heard
            # A map alone is no sign of life of the twin.
            if heard.told is not None and heard.told is not before:
                on_state(heard.told)

        self._thread = RosThread(
            make_node, ros_args=self._ros_args, on_event=on_heard, on_death=on_death
        )
        await self._thread.start()
        self._rules, self._names = await self._thread.call(
            lambda node: (
                node.rules,
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
        """None: all replicas, and a restarted one, give the same content the same ETag."""
        return ""

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
        """A digest of poses and readings, and the map's revision."""
        return self._heard.revision

    def rules(self) -> FieldRules:
        """The twin's parameters for fields, as far as this process was given the same."""
        return self._rules

    def names(self) -> TwinNames:
        """The parameters `state_topic` and `field_service_name` as ROS resolves them."""
        return self._names

    def journal(self) -> Condition:
        """Off: the journal is the twin's, elsewhere."""
        return OFF

    def cache_counts(self) -> CacheCounts:
        """Nothing: the cache is the twin's."""
        return CacheCounts()

    def occupancy_map(self) -> OccupancyMap | None:
        """The latest map."""
        return self._heard.occupancy_map

    async def history(self, tag_id: str) -> TagHistory | None:
        """The last scans and tries of a tag, as far as they were seen from here."""
        return await self._thread.call(lambda node: node.history_of(tag_id))

    def field_revision(self, request: FieldRequest) -> str | None:
        """That of the last answer, as long as nothing was heard that could have changed it.

        An answer may hold what no state has told yet, so it is known by its content. It is at least
        as new as the state at which it was asked for, and stands for the field until the next
        change, or for `TRUST_S`.
        """
        trusted = self._trusted.get(request)
        if trusted is None:
            return None
        if trusted.epoch != self._heard.epoch or time.monotonic() > trusted.until_s:
            del self._trusted[request]
            return None
        return trusted.revision

    async def field(self, request: FieldRequest) -> RevisedGrid:
        """The field from the twin's service; identical requests in flight are asked once.

        Identical is what was asked with no change heard of in between: who has heard of one must
        not get the field from before.
        """
        epoch = self._heard.epoch
        return await self._asking.get((epoch, request), lambda: self._ask_once(epoch, request))

    def _trust(self, request: FieldRequest, epoch: int, revision: str) -> None:
        if epoch != self._heard.epoch:
            return  # it was asked for before a change, and nobody knows how long before
        self._trusted[request] = _Trusted(epoch, revision, time.monotonic() + TRUST_S)
        self._trusted.move_to_end(request)
        if len(self._trusted) > MAX_TRUSTED:
            self._trusted.popitem(last=False)

    def _lane(self, request: FieldRequest) -> AbstractAsyncContextManager[Any]:
        told = self._heard.told
        tags = 0 if told is None else len(told.snapshot.tags)
        is_large = cost_s(request, tags, self._rules) > SMALL_S
        return self._large_slots if is_large else nullcontext()

    async def _find_service(self) -> None:
        while not await self._thread.call(lambda node: node.field_client.service_is_ready()):
            if not await self._thread.call(lambda node: node.has_new_twin):
                raise TwinUnavailableError(
                    f"no twin offers {self._names.field_service}: is it running?"
                )
            await asyncio.sleep(SERVICE_LOOK_S)

    async def _ask_once(self, epoch: int, request: FieldRequest) -> RevisedGrid:
        try:
            async with asyncio.timeout(self._timeout_s), self._lane(request), self._slots:
                await self._find_service()
                response = await self._thread.ask(
                    lambda node: node.request_field(request),
                    lambda node, future: node.forget_request(future),
                )
        except TimeoutError:
            raise TwinTimeoutError(
                f"the twin did not answer within {self._timeout_s:g} s (field_timeout_s)"
            ) from None
        if not response.ok:
            raise FieldRefused(response.error_message)
        result = await asyncio.wrap_future(
            self.workers.submit(
                lambda _: _revised(response), response.width * response.height * _READ_CELL_S
            )
        )
        self._trust(request, epoch, result.revision)
        return result


@dataclass(frozen=True, slots=True)
class _Heard:
    """All that crosses to the loop: the newest state as it was told, and what stands now.

    `epoch`, `revision` and the map are newer than `told` where a map has come since.
    """

    told: Told | None = None
    epoch: int = 0
    revision: str = ""
    occupancy_map: OccupancyMap | None = None


@dataclass(frozen=True, slots=True)
class _Trusted:
    """The revision of an answer that was asked for in `epoch`, and until when it stands, s."""

    epoch: int
    revision: str
    until_s: float


def _revised(response: Any) -> RevisedGrid:
    """The grid of an answer, and a digest of it: the same in all replicas."""
    grid = convert.grid_of(response)
    values = grid.values
    about = (grid.width, grid.height, grid.origin_x, grid.origin_y, grid.resolution)
    digest = blake2b(repr((about, grid.sample_count)).encode(), digest_size=12)
    digest.update(values.data)
    return RevisedGrid(grid, digest.hexdigest())
