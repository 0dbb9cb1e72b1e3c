"""The ROS services of the estimate; their responses are made off the node's thread."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, replace
from typing import Any

from lupin_msgs.srv import GetEstimate, GetEstimateReport

from lupin_twin.core.interfaces import GET_ESTIMATE, GET_ESTIMATE_REPORT
from lupin_twin.core.past import check_moment
from lupin_twin.core.state import TwinStore
from lupin_twin.estimate.engine import (
    MAX_TAGS,
    Estimate,
    EstimateRequest,
    TagPast,
    cost_s,
    moment_of,
)
from lupin_twin.field.explored import OccupancyMap
from lupin_twin.field.idw import never
from lupin_twin.journal.fold import STATE_S_PER_TAG
from lupin_twin.journal.queries import NEWEST_S_PER_TAG
from lupin_twin.ros import convert_services
from lupin_twin.ros.base_node import NodeUtilities
from lupin_twin.ros.services import offer
from lupin_twin.runtime.estimates import (
    AS_OF,
    REPORT_DAYS,
    REPORT_S,
    estimate_at,
    readings_at,
    report_of,
)
from lupin_twin.runtime.journal_queries import Recall
from lupin_twin.runtime.workers import JobQueue, Query, ShouldStop


@dataclass(frozen=True, slots=True)
class Task:
    """A requested estimate, and its approximate cost, `cost_s` s of one core.

    `look_up()`, on the node's thread, starts the query for the readings. `make`, on any thread,
    makes the estimate from them.
    """

    cost_s: float
    look_up: Callable[[], Future[Sequence[TagPast]]]
    make: Callable[[Sequence[TagPast], ShouldStop], Estimate]


@dataclass(slots=True)
class EstimateService:
    """The estimate's services on one node; belongs to the node's thread.

    Estimates and reports on them are made on request, from the journal. `occupancy()` is the latest
    map, where another tag could stand. `day_length_s` is s of ROS time. Queries about the past use
    the same `queue`, and fields another, so that no field waits for one.
    """

    utilities: NodeUtilities
    queue: JobQueue
    store: TwinStore
    recall: Recall
    occupancy: Callable[[], OccupancyMap | None]
    day_length_s: float
    max_grid_cells: int
    now_ns: Callable[[], int]

    def offer(self, node: Any, group: Any) -> None:
        """Create the services on `node`, with names relative to its namespace."""
        plans = (
            (GetEstimate, GET_ESTIMATE.name, self._estimate),
            (GetEstimateReport, GET_ESTIMATE_REPORT.name, self._report),
        )
        offer(node, group, plans, self.queue, self.utilities.report)

    def prepare(self, request: EstimateRequest) -> Task:
        """Check a request, and return the task of making its estimate.

        Raises:
            FieldRefused, PastRefused: the request is invalid.

        """
        now_ns, day_s = self.now_ns(), self.day_length_s
        check_moment(request.at_ns, now_ns)
        cost = AS_OF * cost_s(request, min(MAX_TAGS, self.store.size[0]), self.max_grid_cells)

        def make(found: Sequence[TagPast], should_stop: ShouldStop) -> Estimate:
            at_ns = request.at_ns or moment_of(found, now_ns, day_s)
            return estimate_at(replace(request, at_ns=at_ns), found, day_s, should_stop)

        def look_up() -> Future[Sequence[TagPast]]:
            sensor, at_ns = request.box.sensor_type, request.at_ns or now_ns
            return self.recall.query(
                lambda log, _: readings_at(log, sensor, at_ns, day_s), self._search_s
            )

        return Task(cost, look_up, make)

    def _estimate(self, request: Any, reply: Callable[[Any], None]) -> Query:
        task = self.prepare(convert_services.estimate_request_of(request))
        return Query(
            task.look_up,
            reply,
            lambda found: convert_services.response_of(task.make(found, never)),
            task.cost_s,
        )

    def _report(self, request: Any, reply: Callable[[Any], None]) -> Query:
        wanted = convert_services.report_request_of(request)
        now_ns, day_s, occupancy = self.now_ns(), self.day_length_s, self.occupancy()

        def look_up() -> Future[Any]:
            return self.recall.query(
                lambda log, _: readings_at(log, wanted.sensor_type, now_ns, day_s, REPORT_DAYS),
                REPORT_DAYS * self._search_s,
            )

        def make(found: Sequence[TagPast]) -> Any:
            report = report_of(wanted, found, now_ns, day_s, occupancy=occupancy)
            return convert_services.report_response(report)

        return Query(look_up, reply, make, REPORT_S)

    @property
    def _search_s(self) -> float:
        return self.store.size[0] * (STATE_S_PER_TAG + NEWEST_S_PER_TAG)
