"""The source of `web`: a twin elsewhere. As many of these as needed may share one twin."""

from __future__ import annotations

import asyncio
import math
import os
import time
from collections.abc import Callable, Coroutine, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from hashlib import blake2b
from pathlib import Path
from typing import Any, Final, TypeVar

from lupin_bridge.feed import web_node
from lupin_bridge.feed.followed_log import FollowedLog
from lupin_bridge.feed.query import Now
from lupin_bridge.feed.revisions import RevisedEstimate, revised
from lupin_bridge.feed.ros_source import RosSource
from lupin_bridge.feed.shared_work import Shared
from lupin_bridge.feed.source import (
    RevisedGrid,
    TwinTimeoutError,
    TwinUnavailableError,
    TwinUpdate,
)
from lupin_bridge.feed.web_node import Service, WebNode
from lupin_twin.core.journal_condition import UNKNOWN, Condition
from lupin_twin.core.past import NotRemembered, lasts, may_pass
from lupin_twin.core.state import NANOSECONDS_PER_SECOND, Snapshot
from lupin_twin.estimate.engine import EstimateRequest
from lupin_twin.estimate.engine import cost_s as estimate_cost_s
from lupin_twin.field.engine import FieldRefused, FieldRequest, FieldRules, cost_s
from lupin_twin.field.explored import OccupancyMap
from lupin_twin.journal.beside import journal_path
from lupin_twin.journal.follow import Lot
from lupin_twin.ros import convert_field, convert_past
from lupin_twin.ros.convert_past import NotAnAnswerError
from lupin_twin.runtime.estimate_rounds import ADVICE_S, Report, ReportRequest
from lupin_twin.runtime.workers import SMALL_S

ResultT = TypeVar("ResultT")

# Requests on their way to the twin at once. It answers one after the other anyway; more would
# only wait in DDS, where they cannot be taken back.
MAX_REQUESTS = 4

SERVICE_LOOK_S = 0.02
# How often who waits for an answer looks whether the twin has fallen silent.
SILENCE_LOOK_S: Final = 0.2

# ROS time beyond this, in 2001, is that of a wall's clock, and goes on while nobody tells it.
_A_DATE_NS: Final = 10**18

# What reading a cell of an answer takes, roughly and at worst.
_READ_CELL_S: Final = 10e-9
_READ_TAG_S: Final = 20e-6


@dataclass(frozen=True, slots=True)
class _Received:
    """All that crosses to the loop: the newest update, and what holds now.

    `epoch`, `revision`, the map and the rules are newer than `update` where a map has come since.
    """

    update: TwinUpdate | None = None
    epoch: int = 0
    revision: str = ""
    occupancy_map: OccupancyMap | None = None
    rules: FieldRules | None = None


class WebTwin(RosSource[WebNode, _Received]):
    """`TwinSource` over the ROS contracts of a twin in another process.

    One that was received, and then for `stale_after_s` no more, is asked nothing. `journal` is its
    file as it is called here; None: as the twin calls it.
    """

    def __init__(
        self,
        *,
        ros_args: Sequence[str],
        timeout_s: float,
        stale_after_s: float = math.inf,
        journal: Path | None = None,
    ) -> None:
        super().__init__(ros_args=ros_args, timeout_s=timeout_s)
        self._stale_after_s = stale_after_s
        self._received = _Received()
        self._frame_id: str
        self._requests: Shared[RevisedGrid] = Shared()
        self._log = FollowedLog(self._rows_behind, self.workers, journal)
        self._slots = asyncio.Semaphore(MAX_REQUESTS)
        # One way is left to the small, which would wait behind the large otherwise.
        self._large_slots = asyncio.Semaphore(MAX_REQUESTS - 1)

    async def start(
        self, on_state: Callable[[TwinUpdate], None], on_death: Callable[[], None]
    ) -> None:
        """Start the ROS thread with its node; see `TwinSource.start`."""

        def make_node(context: Any, post: Callable[[_Received], None]) -> WebNode:
            update: TwinUpdate | None = None

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
                    origin=report.origin,
                    input_problems=report.input_problems,
                )
                post_all()

            def post_all() -> None:
                post(_Received(update, node.epoch, node.revision, node.occupancy_map, node.rules))

            node = WebNode(pass_on, post_all, context=context)
            return node

        def on_received(received: _Received) -> None:
            before, self._received = self._received.update, received
            if received.rules is not None:
                self._rules = received.rules
            # A map alone is no sign of life of the twin.
            if received.update is not None and received.update is not before:
                self._log.on_update(received.update.journal)
                on_state(received.update)

        await self._start_thread(make_node, on_received, on_death)
        self._frame_id, folder = await self.thread.call(
            lambda node: (node.parameters.frame_id, _folder(node))
        )
        await self._log.start(folder)

    async def stop(self) -> None:
        """See `RosSource`."""
        await self._log.stop()
        await super().stop()

    def revision(self) -> str:
        """A digest of poses and readings, and the map's revision."""
        return self._received.revision

    def journal(self) -> Condition:
        """The twin's, as far as it is read here; before that, what is said on `/diagnostics`."""
        update = self._received.update
        return self._log.condition or (UNKNOWN if update is None else update.journal)

    def occupancy_map(self) -> OccupancyMap | None:
        """The latest map."""
        return self._received.occupancy_map

    def field_revision(self, request: FieldRequest) -> str | None:
        """That of the last answer, as long as nothing was received that could have changed it.

        An answer may hold what no state has yet, so it is known by its content. It is at least as
        new as the state at which it was requested, and holds for the field until the next change,
        or for `revisions.REVISION_TTL_S`.
        """
        return self._revisions.revision(request, self._received.epoch)

    async def field(self, request: FieldRequest) -> RevisedGrid:
        """The field from the twin's service; identical requests in flight are one.

        Identical are those between which no change was received: after one, the field from before
        is no answer.
        """
        epoch = self._received.epoch
        return await self._requests.get(
            (epoch, request), lambda: self._request_field(epoch, request)
        )

    def estimate_revision(self, request: EstimateRequest) -> str | None:
        """As a field's: that of the last answer."""
        return self._revisions.revision(request, self._received.epoch)

    async def estimate(self, request: EstimateRequest) -> RevisedEstimate:
        """The estimate from the twin's service; identical requests in flight are asked once."""
        epoch = self._received.epoch
        return await self._estimating.get(
            (epoch, request), lambda: self._request_estimate(epoch, request)
        )

    async def estimate_report(self, request: ReportRequest) -> Report:
        """What the twin's service says."""
        response = await self._request(
            Service.REPORT, convert_field.report_request_message(request), ADVICE_S
        )
        _check_ok(response)
        cost_s = len(response.tag_ids) * _READ_TAG_S
        return await self._read(lambda: convert_field.report_of(response), cost_s)

    @property
    def _tags(self) -> int:
        update = self._received.update
        return 0 if update is None else len(update.snapshot.tags)

    async def now(self) -> Now:
        """What who looks back has to know of now, and where the log is."""
        if self._received.update is not None:
            await self._log.wait()
        condition, update = self._log.condition, self._received.update
        if condition is None:
            raise TwinUnavailableError("the twin's journal is not known here yet")
        if update is None:  # it has been followed before, and its twin is not there
            now_ns = condition.complete_ns or 0
            if now_ns > _A_DATE_NS:
                now_ns = max(now_ns, time.time_ns())
            return Now(now_ns, self._frame_id, condition)
        snapshot, now_ns = update.snapshot, update.snapshot.stamp_ns
        if snapshot.clock == "running":
            now_ns += int((time.monotonic() - update.made_s) * NANOSECONDS_PER_SECOND)
        return Now(now_ns, snapshot.frame_id, condition)

    async def _explain(self, error: NotRemembered) -> NotRemembered:
        return await self._log.explain(error)

    async def _rows_behind(self, after: int) -> Lot:
        response = await self._request(
            Service.WRITES, convert_past.rows_request_message(after), 0.0
        )
        return convert_past.lot_of(response, after)

    async def _find(self, service: Service) -> None:
        # From here on too: a twin that comes and goes would be a new one for ever.
        until_s = time.monotonic() + web_node.NEW_TWIN_S
        while why := await self.thread.call(lambda node: node.why_not(service)):
            is_new = await self.thread.call(lambda node: node.has_new_twin)
            if not is_new or time.monotonic() > until_s:
                raise TwinUnavailableError(why)
            await asyncio.sleep(SERVICE_LOOK_S)

    async def _request(self, service: Service, request: Any, cost_s: float) -> Any:
        """The twin's response; `cost_s` estimates what it takes there, s of one core.

        Raises:
            TwinUnavailableError: nobody there to answer, or not in time.

        """
        lane = self._large_slots if cost_s > SMALL_S else nullcontext()
        self._check_live()
        try:
            async with asyncio.timeout(self.timeout_s), lane, self._slots:
                await self._find(service)
                return await self._while_live(
                    self.thread.ask(
                        lambda node: node.ask(service, request),
                        lambda node, future: node.forget(service, future),
                    )
                )
        except TimeoutError:
            raise TwinTimeoutError(f"the twin did not answer within {self.timeout_s:g} s") from None

    def _check_live(self) -> None:
        # DDS offers the services of a twin that was killed for another twenty seconds.
        update = self._received.update
        if update is not None and time.monotonic() - update.made_s >= self._stale_after_s:
            raise TwinUnavailableError(
                f"nothing was received on {self._names.state_topic} for {self._stale_after_s:g} s: "
                "is the twin running?"
            )

    async def _while_live(self, answer: Coroutine[Any, Any, Any]) -> Any:
        asking = asyncio.create_task(answer)
        try:
            while not asking.done():
                self._check_live()
                await asyncio.wait((asking,), timeout=SILENCE_LOOK_S)
            return asking.result()
        finally:
            asking.cancel()
            await asyncio.wait((asking,))

    async def _request_field(self, epoch: int, request: FieldRequest) -> RevisedGrid:
        response = await self._request(
            Service.FIELD,
            convert_field.field_request_message(request),
            cost_s(request, self._tags, self._rules),
        )
        _check_ok(response)
        result = await self._read(
            lambda: _revised(response), response.width * response.height * _READ_CELL_S
        )
        self._remember(request, epoch, result.revision)
        return result

    async def _request_estimate(self, epoch: int, request: EstimateRequest) -> RevisedEstimate:
        response = await self._request(
            Service.ESTIMATE,
            convert_field.estimate_request_message(request),
            estimate_cost_s(request, self._tags, self._rules.max_grid_cells),
        )
        _check_ok(response)
        result = await self._read(
            lambda: revised(convert_field.estimate_of(response)),
            2 * response.width * response.height * _READ_CELL_S,
        )
        self._remember(request, epoch, result.revision)
        return result

    async def _read(self, read: Callable[[], ResultT], cost_s: float) -> ResultT:
        try:
            return await asyncio.wrap_future(self.workers.submit(lambda _: read(), cost_s))
        except NotAnAnswerError as error:
            raise TwinUnavailableError(f"the twin's answer cannot be used: {error}") from error

    def _remember(self, request: FieldRequest | EstimateRequest, epoch: int, revision: str) -> None:
        # Else it was asked for before a change, and nobody knows how long before.
        if epoch == self._received.epoch:
            self._revisions.put(request, epoch, revision)


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
    if may_pass(response.error_message):
        raise TwinUnavailableError(response.error_message)
    why = lasts(response.error_message)
    if why is not None:
        raise NotRemembered(why, is_lasting=True)
    raise FieldRefused(response.error_message)


def _revised(response: Any) -> RevisedGrid:
    """The grid of an answer, and a digest of it: the same in all replicas."""
    grid = convert_field.grid_of(response)
    values = grid.values
    about = (grid.width, grid.height, grid.origin_x, grid.origin_y, grid.resolution)
    digest = blake2b(repr((about, grid.sample_count)).encode(), digest_size=12)
    digest.update(values.data)
    return RevisedGrid(grid, digest.hexdigest())
