"""The source of `web`: a twin elsewhere. As many of these as needed may share one twin."""

from __future__ import annotations

import asyncio
import math
import os
import time
from collections.abc import Awaitable, Callable, Coroutine, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from hashlib import blake2b
from pathlib import Path
from typing import Any, Final, TypeVar

from lupin_bridge.twin import web_node
from lupin_bridge.twin.log_here import LogHere
from lupin_bridge.twin.log_reader import LogReader
from lupin_bridge.twin.names import TwinNames
from lupin_bridge.twin.past_child import Now
from lupin_bridge.twin.past_process import PastProcess
from lupin_bridge.twin.relay import Relay
from lupin_bridge.twin.relay_ros import RelayRos, names_of
from lupin_bridge.twin.ros_thread import RosThread
from lupin_bridge.twin.shared import Shared
from lupin_bridge.twin.source import (
    CacheCounts,
    RevisedGrid,
    Told,
    TwinTimeoutError,
    TwinUnavailableError,
)
from lupin_bridge.twin.trust import RevisedEstimate, Trust, revised
from lupin_bridge.twin.web_node import Service, WebNode
from lupin_twin import convert_estimate, convert_field, convert_past
from lupin_twin.convert_past import NotAnAnswerError
from lupin_twin.estimate_report import ADVICE_S, Report, ReportRequest
from lupin_twin.estimates import EstimateRequest
from lupin_twin.estimates import cost_s as estimate_cost_s
from lupin_twin.explored import OccupancyMap
from lupin_twin.fields import FieldRefused, FieldRequest, FieldRules, cost_s
from lupin_twin.history import TagHistory
from lupin_twin.journal.condition import UNKNOWN, Condition
from lupin_twin.journal.follow import Lot
from lupin_twin.memory import journal_path
from lupin_twin.past import NotRemembered, lasts, may_pass
from lupin_twin.state import NANOSECONDS_PER_SECOND, Snapshot
from lupin_twin.workers import SMALL_S, Workers

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


class WebTwin(LogReader):
    """`TwinSource` over the ROS contracts of a twin in another process.

    One that was heard, and then for `stale_after_s` no more, is asked nothing.
    """

    def __init__(
        self,
        *,
        ros_args: Sequence[str],
        timeout_s: float,
        stale_after_s: float = math.inf,
        expects: type | None = None,
    ) -> None:
        self._ros_args = ros_args
        self.timeout_s = timeout_s
        self._stale_after_s = stale_after_s
        self.thread: RosThread[WebNode, _Heard]
        self._heard = _Heard()
        self._number = 0
        self._rules: FieldRules
        # The same for as long as the node lives.
        self._names: TwinNames
        self.workers = Workers("work")
        self.relay = Relay(lambda: self.thread, RelayRos())
        self._asking: Shared[RevisedGrid] = Shared()
        self._log = LogHere(self._rows_behind, self.workers)
        self.past = PastProcess(expects, lambda: self.now() if self._log.condition else None)
        self._estimating: Shared[RevisedEstimate] = Shared()
        self._trust = Trust()
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
                    journal=node.journal,
                    origin=node.origin,
                    input_problems=node.input_problems,
                )
                post_all()

            def post_all() -> None:
                post(_Heard(told, node.epoch, node.revision, node.occupancy_map, node.rules))

            node = WebNode(pass_on, post_all, context=context)
            return node

        def on_heard(heard: _Heard) -> None:
            before, self._heard = self._heard.told, heard
            self._number += 1
            if heard.rules is not None:
                self._rules = heard.rules
            # A map alone is no sign of life of the twin.
            if heard.told is not None and heard.told is not before:
                self._log.on_told(heard.told.journal)
                on_state(heard.told)

        self.thread = RosThread(
            make_node, ros_args=self._ros_args, on_event=on_heard, on_death=on_death
        )
        await self.thread.start()
        self._rules, self._names, self._frame_id, folder = await self.thread.call(
            lambda node: (node.rules, names_of(node), node.parameters.frame_id, _folder(node))
        )
        await self._log.start(folder)
        self.past.start()

    async def stop(self) -> None:
        """Stop the ROS thread, the workers, and the process that looks back."""
        await self._log.stop()
        self.workers.close()
        await asyncio.gather(self.past.stop(), self.thread.stop())

    @property
    def identity(self) -> str:
        """None: all replicas, and a restarted one, give the same content the same ETag."""
        return ""

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
        """A digest of poses and readings, and the map's revision."""
        return self._heard.revision

    def rules(self) -> FieldRules:
        """The twin's parameters for fields, as far as this process was given the same."""
        return self._rules

    def names(self) -> TwinNames:
        """The twin's, as ROS resolves and remaps them."""
        return self._names

    def journal(self) -> Condition:
        """The twin's, as far as it is read here; before that, what is said on `/diagnostics`."""
        told = self._heard.told
        return self._log.condition or (UNKNOWN if told is None else told.journal)

    def cache_counts(self) -> CacheCounts:
        """Nothing: the cache is the twin's."""
        return CacheCounts()

    def occupancy_map(self) -> OccupancyMap | None:
        """The latest map."""
        return self._heard.occupancy_map

    async def history(self, tag_id: str) -> TagHistory | None:
        """The last scans and tries of a tag, as far as they were seen from here."""
        return await self.thread.call(lambda node: node.history_of(tag_id))

    def field_revision(self, request: FieldRequest) -> str | None:
        """That of the last answer, as long as nothing was heard that could have changed it.

        An answer may hold what no state has told yet, so it is known by its content. It is at least
        as new as the state at which it was asked for, and stands for the field until the next
        change, or for `trust.TRUST_S`.
        """
        return self._trust.revision(request, self._heard.epoch)

    async def field(self, request: FieldRequest) -> RevisedGrid:
        """The field from the twin's service; identical requests in flight are asked once.

        Identical is what was asked with no change heard of in between: who has heard of one must
        not get the field from before.
        """
        epoch = self._heard.epoch
        return await self._asking.get((epoch, request), lambda: self._ask_once(epoch, request))

    def estimate_revision(self, request: EstimateRequest) -> str | None:
        """As a field's: that of the last answer."""
        return self._trust.revision(request, self._heard.epoch)

    async def estimate(self, request: EstimateRequest) -> RevisedEstimate:
        """The estimate from the twin's service; identical requests in flight are asked once."""
        epoch = self._heard.epoch
        return await self._estimating.get(
            (epoch, request), lambda: self._ask_estimate(epoch, request)
        )

    async def estimate_report(self, request: ReportRequest) -> Report:
        """What the twin's service says."""
        response = await self._ask(
            Service.REPORT, convert_estimate.report_request_message(request), ADVICE_S
        )
        _check_ok(response)
        cost_s = len(response.tag_ids) * _READ_TAG_S
        return await self._read(lambda: convert_estimate.report_of(response), cost_s)

    @property
    def _tags(self) -> int:
        told = self._heard.told
        return 0 if told is None else len(told.snapshot.tags)

    def now(self) -> Now:
        """What who looks back has to know of now, and where the log is."""
        condition, told = self._log.condition, self._heard.told
        if condition is None:
            raise TwinUnavailableError("the twin's journal is not known here yet")
        if told is None:  # it has been followed before, and its twin is not there
            now_ns = condition.complete_ns or 0
            if now_ns > _A_DATE_NS:
                now_ns = max(now_ns, time.time_ns())
            return Now(now_ns, self._frame_id, condition, 0)
        snapshot, now_ns = told.snapshot, told.snapshot.stamp_ns
        if snapshot.clock == "running":
            now_ns += int((time.monotonic() - told.made_s) * NANOSECONDS_PER_SECOND)
        return Now(now_ns, snapshot.frame_id, condition, self._number)

    async def _found(self) -> None:
        if self._heard.told is not None:
            await self._log.found()

    async def _in_time(self, answer: Awaitable[ResultT]) -> ResultT:
        try:
            async with asyncio.timeout(self.timeout_s):
                return await answer
        except TimeoutError:
            raise TwinTimeoutError(
                f"the answer was not there within {self.timeout_s:g} s (field_timeout_s)"
            ) from None

    async def _rows_behind(self, after: int) -> Lot:
        response = await self._ask(Service.WRITES, convert_past.rows_request_message(after), 0.0)
        return convert_past.lot_of(response, after)

    async def _find(self, service: Service) -> None:
        # From here on too: a twin that comes and goes would be a new one for ever.
        until_s = time.monotonic() + web_node.NEW_TWIN_S
        while not await self.thread.call(lambda node: node.offers(service)):
            is_new = await self.thread.call(lambda node: node.has_new_twin)
            if not is_new or time.monotonic() > until_s:
                raise TwinUnavailableError(
                    await self.thread.call(lambda node: node.why_not(service))
                )
            await asyncio.sleep(SERVICE_LOOK_S)

    async def _ask(self, service: Service, request: Any, cost_s: float) -> Any:
        """The twin's response; `cost_s` estimates what it takes there, s of one core.

        Raises:
            TwinUnavailableError: nobody there to answer, or not in time.

        """
        lane = self._large_slots if cost_s > SMALL_S else nullcontext()
        try:
            async with asyncio.timeout(self.timeout_s), lane, self._slots:
                self._check_heard()
                await self._find(service)
                return await self._while_heard(
                    self.thread.ask(
                        lambda node: node.ask(service, request),
                        lambda node, future: node.forget(service, future),
                    )
                )
        except TimeoutError:
            raise TwinTimeoutError(f"the twin did not answer within {self.timeout_s:g} s") from None

    def _check_heard(self) -> None:
        # DDS offers the services of a twin that was killed for another twenty seconds.
        told = self._heard.told
        if told is not None and time.monotonic() - told.made_s >= self._stale_after_s:
            raise TwinUnavailableError(
                f"nothing was heard on {self._names.state_topic} for {self._stale_after_s:g} s: "
                "is the twin running?"
            )

    async def _while_heard(self, answer: Coroutine[Any, Any, Any]) -> Any:
        asking = asyncio.create_task(answer)
        try:
            while not asking.done():
                self._check_heard()
                await asyncio.wait((asking,), timeout=SILENCE_LOOK_S)
            return asking.result()
        finally:
            asking.cancel()
            await asyncio.wait((asking,))

    async def _ask_once(self, epoch: int, request: FieldRequest) -> RevisedGrid:
        response = await self._ask(
            Service.FIELD,
            convert_field.request_message(request),
            cost_s(request, self._tags, self._rules),
        )
        _check_ok(response)
        result = await asyncio.wrap_future(
            self.workers.submit(
                lambda _: _revised(response), response.width * response.height * _READ_CELL_S
            )
        )
        self._stands(request, epoch, result.revision)
        return result

    async def _ask_estimate(self, epoch: int, request: EstimateRequest) -> RevisedEstimate:
        response = await self._ask(
            Service.ESTIMATE,
            convert_estimate.request_message(request),
            estimate_cost_s(request, self._tags, self._rules.max_grid_cells),
        )
        _check_ok(response)
        result = await self._read(
            lambda: revised(convert_estimate.estimate_of(response)),
            2 * response.width * response.height * _READ_CELL_S,
        )
        self._stands(request, epoch, result.revision)
        return result

    async def _read(self, read: Callable[[], ResultT], cost_s: float) -> ResultT:
        try:
            return await asyncio.wrap_future(self.workers.submit(lambda _: read(), cost_s))
        except NotAnAnswerError as error:
            raise TwinUnavailableError(f"the twin's answer cannot be used: {error}") from error

    def _stands(self, request: FieldRequest | EstimateRequest, epoch: int, revision: str) -> None:
        # Else it was asked for before a change, and nobody knows how long before.
        if epoch == self._heard.epoch:
            self._trust.put(request, epoch, revision)


@dataclass(frozen=True, slots=True)
class _Heard:
    """All that crosses to the loop: the newest state as it was told, and what stands now.

    `epoch`, `revision`, the map and the rules are newer than `told` where a map has come since.
    """

    told: Told | None = None
    epoch: int = 0
    revision: str = ""
    occupancy_map: OccupancyMap | None = None
    rules: FieldRules | None = None


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
