"""The source of `web`: a twin elsewhere. As many of these as needed may share one twin."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from typing import Any

from lupin_bridge.twin.ros_thread import RosThread
from lupin_bridge.twin.shared import Shared
from lupin_bridge.twin.source import (
    CacheCounts,
    Revised,
    RevisedGrid,
    TwinNames,
    TwinTimeoutError,
    TwinUnavailableError,
)
from lupin_bridge.twin.web_node import WebNode
from lupin_twin import convert
from lupin_twin.explored import OccupancyMap
from lupin_twin.fields import FieldRefused, FieldRequest, FieldRules
from lupin_twin.history import TagHistory
from lupin_twin.state import Snapshot
from lupin_twin.workers import Workers

# Requests on their way to the twin at once. It answers one after the other anyway; more would
# only wait in DDS, where they cannot be taken back.
MAX_REQUESTS = 4

SERVICE_LOOK_S = 0.02


class WebTwin:
    """`TwinSource` over the ROS contracts of a twin in another process."""

    def __init__(self, *, ros_args: Sequence[str], timeout_s: float) -> None:
        self._ros_args = ros_args
        self._timeout_s = timeout_s
        self._thread: RosThread[WebNode, Revised]
        self.workers = Workers("work")
        self._asking: Shared[RevisedGrid] = Shared()
        self._slots = asyncio.Semaphore(MAX_REQUESTS)

    async def start(
        self, on_state: Callable[[Revised], None], on_death: Callable[[], None]
    ) -> None:
        """Start the ROS thread with its node; see `TwinSource.start`."""

        def make_node(context: Any, post: Callable[[Revised], None]) -> WebNode:
            def pass_on(snapshot: Snapshot) -> None:
                post(Revised(snapshot, node.revision))

            node = WebNode(pass_on, context=context)
            return node

        self._thread = RosThread(
            make_node, ros_args=self._ros_args, on_event=on_state, on_death=on_death
        )
        await self._thread.start()

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
        """Errors met by the node's callbacks so far."""
        return self._thread.callback_errors

    def revision(self) -> str:
        """A digest of poses and readings, and the map's revision."""
        return self._thread.peek(lambda node: node.revision)

    def twin_count(self) -> int:
        """How many nodes publish the state topic."""
        return self._thread.peek(lambda node: node.twins.value)

    def rules(self) -> FieldRules:
        """The twin's parameters for fields, as far as this process was given the same."""
        return self._thread.peek(lambda node: node.rules)

    def names(self) -> TwinNames:
        """The parameters `state_topic` and `field_service_name` as ROS resolves them."""
        return self._thread.peek(
            lambda node: TwinNames(
                node.resolve_topic_name(node.parameters.state_topic),
                node.resolve_service_name(node.parameters.field_service_name),
            )
        )

    def cache_counts(self) -> CacheCounts:
        """Nothing: the cache is the twin's."""
        return CacheCounts()

    def occupancy_map(self) -> OccupancyMap | None:
        """The latest map."""
        return self._thread.peek(lambda node: node.occupancy_map)

    async def history(self, tag_id: str) -> TagHistory | None:
        """The last scans and tries of a tag, as far as they were seen from here."""
        return await self._thread.call(lambda node: node.history_of(tag_id))

    async def field(self, request: FieldRequest) -> RevisedGrid:
        """The field from the twin's service; identical requests in flight are asked once.

        Identical is what was asked at the same revision: who has heard of a change must not get
        the field from before.
        """
        revision = self.revision()
        return await self._asking.get(
            (revision, request), lambda: self._ask_once(revision, request)
        )

    async def _find_service(self) -> None:
        while not await self._thread.call(lambda node: node.field_client.service_is_ready()):
            if not self._thread.peek(lambda node: node.has_new_twin):
                service = self._thread.peek(lambda node: node.parameters.field_service_name)
                raise TwinUnavailableError(f"no twin offers {service}: is it running?")
            await asyncio.sleep(SERVICE_LOOK_S)

    async def _ask_once(self, revision: str, request: FieldRequest) -> RevisedGrid:
        try:
            async with asyncio.timeout(self._timeout_s), self._slots:
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
        return RevisedGrid(convert.grid_of(response), revision)
