"""The source of `web`: a twin elsewhere. As many of these as needed may share one twin."""

from __future__ import annotations

import asyncio
import logging
import math
import os
import time
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Final

from lupin_msgs.srv import GetEstimateReport, GetWrites

from lupin_bridge.feed.followed_log import FollowedLog
from lupin_bridge.feed.query import Now
from lupin_bridge.feed.ros_source import Post, RosSource, now_ns_of
from lupin_bridge.feed.shared_work import Periodic
from lupin_bridge.feed.source import TwinUnavailableError, TwinUpdate
from lupin_bridge.feed.web_node import WebNode
from lupin_twin.core.journal_condition import UNKNOWN, Condition
from lupin_twin.core.parameters import World
from lupin_twin.core.past import NotRemembered, PastRefused, error_of
from lupin_twin.core.state import Snapshot
from lupin_twin.field.engine import FieldRefused
from lupin_twin.journal.beside import journal_path
from lupin_twin.journal.follow import Lot
from lupin_twin.ros import convert_services
from lupin_twin.runtime.estimates import Report, ReportRequest

log = logging.getLogger(__name__)

# ROS time beyond this, in 2001, is that of a wall's clock, and goes on while nobody tells it.
_A_DATE_NS: Final = 10**18

# How often it is looked whether the twin is lost.
_LOOK_S: Final = 1.0
# A node that is made while the network has no address never hears it: so it is made again, after
# as long a silence again, and no later than this.
_REJOIN_AGAIN_S: Final = 300.0

# What reading a tag of an answer takes, roughly and at worst.
_READ_TAG_S: Final = 20e-6


class WebTwin(RosSource[WebNode]):
    """`TwinSource` over the ROS contracts of a twin in another process.

    One that was received, and then for `stale_after_s` no more, is asked nothing; after
    `rejoin_after_s`, the node is made anew: Fast DDS may never find a twin again that it lost for
    longer than its lease of 20 s. `journal` is its file as it is called here; None: as the twin
    calls it.
    """

    def __init__(
        self,
        *,
        ros_args: Sequence[str],
        timeout_s: float,
        stale_after_s: float = math.inf,
        rejoin_after_s: float = math.inf,
        journal: Path | None = None,
    ) -> None:
        super().__init__(ros_args=ros_args, timeout_s=timeout_s)
        self._stale_after_s = stale_after_s
        self.rejoin_after_s = rejoin_after_s
        self._rejoining = Periodic(self._rejoin_if_lost, _LOOK_S, "the look for a lost twin")
        self._join: Callable[[], Awaitable[None]]
        # When the update was made that nothing follows.
        self._lost_s = 0.0
        self._rejoin_at_s = 0.0
        self._node: WebNode | None = None
        self._frame_id: str
        self._log = FollowedLog(self._rows_behind, self.workers, journal)

    async def start(
        self, on_state: Callable[[TwinUpdate], None], on_death: Callable[[], None]
    ) -> None:
        """Start the ROS thread with its node; see `TwinSource.start`."""

        def make_node(context: Any, post: Post) -> WebNode:
            update = self.update

            def pass_on(snapshot: Snapshot) -> None:
                nonlocal update
                report = node.self_report
                update = TwinUpdate(
                    snapshot,
                    node.revision,
                    node.twins.value,
                    node.occupancy_map,
                    report.counts,
                    node.utilities.counts(),
                    journal=report.journal,
                    rules=node.rules,
                    origin=report.origin,
                    input_problems=report.input_problems,
                )
                post(update)

            def renew() -> None:
                nonlocal update
                if update is not None:
                    update = replace(
                        update,
                        revision=node.revision,
                        occupancy_map=node.occupancy_map,
                        rules=node.rules,
                    )
                    post(update)

            node = WebNode(pass_on, renew, context=context)
            # As `update`, it holds on in a node that is made anew.
            if self._node is not None:
                node.take_over(self._node)
            self._node = node
            return node

        def on_update(update: TwinUpdate) -> None:
            self._log.on_update(update.journal)
            on_state(update)

        self._join = partial(self._start_thread, make_node, on_update, on_death)
        await self._join()
        self._rejoining.start()
        self._frame_id, folder = await self.thread.call(
            lambda node: (node.parameters.frame_id, _folder(node))
        )
        await self._log.start(folder)

    async def stop(self) -> None:
        """See `RosSource`."""
        await self._rejoining.stop()
        await self._log.stop()
        await super().stop()

    async def _rejoin_if_lost(self) -> None:
        update = self.update
        if update is None:
            return
        if update.made_s != self._lost_s:
            self._lost_s, self._rejoin_at_s = update.made_s, self.rejoin_after_s
        silent_s = time.monotonic() - update.made_s
        if silent_s < self._rejoin_at_s:
            return
        log.warning("%s: joining ROS again", self._silence(round(silent_s)))
        await self.thread.stop()
        await self._join()
        self._rejoin_at_s = silent_s + min(silent_s, _REJOIN_AGAIN_S)
        self.relay.renew()

    def _silence(self, seconds: float) -> str:
        return f"nothing was received on {self.names.state_topic} for {seconds:g} s"

    @property
    def world(self) -> World:
        """As the log says, where it is read here."""
        return self._log.world

    def journal(self) -> Condition:
        """The twin's, as far as it is read here; before that, what is said on `/diagnostics`."""
        return self._log.condition or (UNKNOWN if self.update is None else self.update.journal)

    async def estimate_report(self, request: ReportRequest) -> Report:
        """What the twin's service says."""
        wanted = convert_services.report_request_message(request)
        response = await self._request(GetEstimateReport, wanted)
        _check_ok(response)
        cost_s = len(response.tag_ids) * _READ_TAG_S
        reading = self.workers.submit(lambda _: convert_services.report_of(response), cost_s)
        try:
            return await asyncio.wrap_future(reading)
        except ValueError as error:
            raise TwinUnavailableError(f"the twin's answer cannot be used: {error}") from error

    async def now(self) -> Now:
        """What who looks back has to know of now, and where the log is."""
        if self.update is not None:
            await self._log.wait()
        condition, update = self._log.condition, self.update
        if condition is None:
            raise TwinUnavailableError("the twin's journal is not known here yet")
        if update is None:  # it has been followed before, and its twin is not there
            now_ns = condition.complete_ns or 0
            if now_ns > _A_DATE_NS:
                now_ns = max(now_ns, time.time_ns())
            return Now(now_ns, self._frame_id, condition)
        return Now(now_ns_of(update), update.snapshot.frame_id, condition)

    async def _explain(self, error: NotRemembered) -> NotRemembered:
        return await self._log.explain(error)

    async def _rows_behind(self, after: int) -> Lot:
        response = await self._request(GetWrites, convert_services.rows_request_message(after))
        return convert_services.lot_of(response, after)

    async def _request(self, service: Any, request: Any) -> Any:
        """The twin's response; `service` is its type.

        Raises:
            TwinUnavailableError: nobody there to answer, or not in time.

        """
        # DDS offers the services of a twin that was killed for another twenty seconds.
        update = self.update
        if update is not None and time.monotonic() - update.made_s >= self._stale_after_s:
            raise TwinUnavailableError(
                f"{self._silence(self._stale_after_s)}: is the twin running?"
            )
        if why := await self.thread.call(lambda node: node.why_not(service)):
            raise TwinUnavailableError(why)
        return await self._in_time(
            self.thread.ask(
                lambda node: node.clients_of_twin[service].call_async(request),
                # Or it would be kept for ever.
                lambda node, future: node.clients_of_twin[service].remove_pending_request(future),
            )
        )


def _folder(node: WebNode) -> Path | None:
    """Where a log is followed to."""
    domain = int(node.context.get_domain_id())
    try:
        journal = journal_path("", os.environ, domain, node.get_namespace())
    except RuntimeError:
        return None
    return None if journal is None else journal.with_suffix(".followed")


def _check_ok(response: Any) -> None:
    """Raise what a service's refusal says."""
    if response.ok:
        return
    error = error_of(response.error_message)
    if isinstance(error, PastRefused):
        raise FieldRefused(str(error))
    raise error if error.is_lasting else TwinUnavailableError(str(error))
