"""The ROS services of the estimate; their responses are made off the node's thread."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from typing import Any, Final

from lupin_msgs.srv import GetEstimate, GetEstimateReport

from lupin_twin.core.diagnostics import OK, WARN, Finding, shown
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
    LastResult,
    Report,
    ReportRequest,
    advice,
    estimate_at,
    find,
    readings_at,
)
from lupin_twin.runtime.journal_queries import Recall
from lupin_twin.runtime.workers import JobQueue, Query, ShouldStop

# Worst-case cost of a report, s of one core.
_REPORT_S: Final = 2.0
# A sensor's report is reused for this long, s: tags are scanned minutes apart. The factor limits
# reports of all sensors, requested again and again, to a tenth of a core.
REST_S: Final = 30.0
REST_FACTOR: Final = 9.0


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

    Estimates are made on request, from the journal; each sensor's last result is cached.
    `occupancy()` is the latest map, where another tag could stand. `day_length_s` is s of ROS time.
    Queries about the past use the same `queue`, and fields another, so that no field waits for one.
    """

    utilities: NodeUtilities
    queue: JobQueue
    store: TwinStore
    recall: Recall
    occupancy: Callable[[], OccupancyMap | None]
    day_length_s: float
    max_grid_cells: int
    now_ns: Callable[[], int]
    _known: dict[str, LastResult] = field(default_factory=dict)
    _rests_until_s: dict[str, float] = field(default_factory=dict)
    # Sensors whose estimates were reported as overconfident, and have not recovered since.
    _warned: set[str] = field(default_factory=set)

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

    def report(self, request: ReportRequest) -> Future[Report]:
        """Request a report; returns its future."""
        answer: Future[Report] = Future()

        def reply(report: Report | Exception) -> None:
            if not answer.set_running_or_notify_cancel():
                return
            if isinstance(report, Exception):
                answer.set_exception(report)
            else:
                answer.set_result(report)

        query = self._query(request, reply, lambda report: report)
        self.queue.ask(replace(query, is_wanted=lambda: not answer.cancelled()))
        return answer

    def _query(
        self,
        request: ReportRequest,
        reply: Callable[[Any], None],
        write: Callable[[Report], Any],
    ) -> Query:
        """The query for a report, which `write` converts to an answer on a worker."""
        sensor, day_s, occupancy = request.sensor_type, self.day_length_s, self.occupancy()

        def look_up() -> Future[Any]:
            before, at_ns, now_s = self._known.get(sensor), self.now_ns(), time.monotonic()
            if before is not None and now_s < self._rests_until_s[sensor]:
                served: Future[Any] = Future()
                served.set_result((before, at_ns, now_s, None))
                return served
            return self.recall.query(
                lambda log, _: (before, at_ns, now_s, readings_at(log, sensor, at_ns, day_s)),
                self._search_s,
            )

        def make(looked_up: Any) -> tuple[LastResult, float, Any]:
            before, at_ns, begun_s, pasts = looked_up
            known = before if pasts is None else find(before, pasts, at_ns, day_s)
            took_s = 0.0 if pasts is None else time.monotonic() - begun_s
            report = known.report
            if request.max_places is not None and known.loaded is not None:
                places = advice(known.loaded, occupancy, request.max_places)
                report = replace(report, places=places)
            return known, took_s, write(report)

        def end(made: Any) -> None:
            if not isinstance(made, Exception):
                known, took_s, made = made
                self._learn(sensor, known, took_s)
            reply(made)

        return Query(look_up, end, make, _REPORT_S)

    def _learn(self, sensor: str, known: LastResult, took_s: float) -> None:
        """Cache a sensor's new result, if there is one, and warn of problems."""
        if known is self._known.get(sensor) or not (known.loaded or known.failed):
            return
        self._known[sensor] = known
        rest_s = max(REST_S, REST_FACTOR * took_s * len(self._known))
        self._rests_until_s[sensor] = time.monotonic() + rest_s
        report = known.report
        if report.fit_problem:
            text = f"no new model of {sensor}: {report.fit_problem}"
            self.utilities.warn(("estimate", sensor), text)
        if report.record.is_trusted is not False:
            self._warned.discard(sensor)
        elif sensor not in self._warned:
            # Only once: while it lasts, /diagnostics and the page show it.
            self._warned.add(sensor)
            self.utilities.warn(
                ("trust", sensor),
                f"the predicted range of {sensor} is too narrow: {report.record.week.inside} of "
                f"{report.record.week.scans} scans lay in it, expected 9 of 10",
            )

    def finding(self) -> Finding:
        """The state of the requested estimates, for the twin's diagnostics."""
        wrong = []
        for sensor, known in self._known.items():
            if known.report.fit_problem:
                wrong.append(f"{sensor}: {known.report.fit_problem}")
            if known.report.record.is_trusted is False:
                wrong.append(f"{sensor}: the predicted range is too narrow")
        failed = sum(known.failed for known in self._known.values())
        return Finding(
            "estimates",
            WARN if wrong else OK,
            shown("; ".join(wrong)) or "nothing is wrong",
            {"fits failed": str(failed)},
        )

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
        return self._query(wanted, reply, convert_services.report_response)

    @property
    def _search_s(self) -> float:
        return self.store.size[0] * (STATE_S_PER_TAG + NEWEST_S_PER_TAG)
