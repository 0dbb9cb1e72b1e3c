"""The services of fields, of the past and of estimates, and delayed responses of any service.

A response is delayed if it is made off the node's thread, or cannot be sent yet. A service may get
a request before its middleware has discovered the reader of the response; on a busy machine that
takes seconds. The middleware waits 0.1 s, then drops the response. rclpy reports it in a Python
warning, once per process, and the client waits forever (ros2/rmw_fastrtps issue 842). Beside four
busy processes, it happened to one in 162 clients on their first request. So such a response is
retried for a while.
"""

from __future__ import annotations

import re
import sqlite3
import time
import warnings
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Final, NamedTuple

from lupin_msgs.srv import (
    GetEstimate,
    GetEstimateReport,
    GetField,
    GetHistory,
    GetStateAt,
    GetWrites,
)

from lupin_twin.core.interfaces import (
    GET_ESTIMATE,
    GET_ESTIMATE_REPORT,
    GET_HISTORY,
    GET_STATE_AT,
    GET_WRITES,
)
from lupin_twin.core.past import EVERY_TAG, NotRemembered, PastRefused, check_moment, message_of
from lupin_twin.core.state import TwinStore
from lupin_twin.estimate import engine
from lupin_twin.estimate.engine import Estimate, EstimateRequest, TagPast, moment_of
from lupin_twin.field.engine import (
    FieldCache,
    FieldKey,
    FieldRefused,
    FieldRules,
    check_request,
    compute_field,
    cost_s,
)
from lupin_twin.field.explored import OccupancyMap
from lupin_twin.field.idw import never
from lupin_twin.journal import follow
from lupin_twin.journal.fold import STATE_S_PER_TAG, state_at
from lupin_twin.journal.queries import NEWEST_S_PER_TAG, SERIES_S, SERIES_S_PER_TAG, series
from lupin_twin.journal.writes import WRITES_S, writes
from lupin_twin.ros import convert, convert_services
from lupin_twin.ros.base_node import SERVICE_QOS, NodeUtilities
from lupin_twin.ros.parameters import naming
from lupin_twin.runtime.estimates import (
    AS_OF,
    REPORT_DAYS,
    REPORT_S,
    estimate_at,
    readings_at,
    report_of,
)
from lupin_twin.runtime.journal_queries import Recall
from lupin_twin.runtime.workers import SMALL_S, JobQueue, Query, ShouldStop, Workers

Report = Callable[[str, Exception], None]


@dataclass(frozen=True, slots=True)
class FieldService:
    """The service of fields, which are computed off the node's thread unless they are cached."""

    utilities: NodeUtilities
    workers: Workers
    queue: JobQueue
    cache: FieldCache
    rules: Callable[[], FieldRules]
    store: TwinStore
    occupancy: Callable[[], OccupancyMap | None]

    def offer(self, node: Any, name: str, group: Any) -> None:
        """Create the service on `node`.

        Raises:
            ParameterError: the name is invalid in ROS.

        """
        with naming("field_service_name", name):
            plans = ((GetField, name, self._field),)
            offer(node, group, plans, self.queue, self.utilities.report)

    def _field(self, request: Any, reply: Callable[[Any], None]) -> Query | None:
        wanted = convert_services.field_request_of(request)
        rules, occupancy = self.rules(), self.occupancy()
        check_request(wanted, rules.max_grid_cells)
        is_clipped = occupancy is not None and rules.clip_to_explored
        revision = occupancy.revision if occupancy is not None and is_clipped else None
        key = FieldKey(wanted, self.store.observation_count, revision, rules)
        if (found := self.cache.get(key)) is not None:
            reply(convert_services.field_response(found))
            return None
        samples = self.store.samples_for_sensor(wanted.sensor_type)
        compute = partial(compute_field, wanted, samples, occupancy, rules)
        cost = cost_s(wanted, len(samples), rules)

        def keep(grid: Any) -> None:
            if not isinstance(grid, Exception):
                self.cache.put(key, grid)
                grid = convert_services.field_response(grid)
            reply(grid)

        return Query(partial(self.workers.submit, compute, cost), keep, cost_s=cost)


# Worst-case cost of the message of a series, s of one core; and of that of all tags.
MESSAGE_S: Final = SMALL_S
EVERY_TAG_S: Final = 1.0


@dataclass(frozen=True, slots=True)
class PastService:
    """The services of the past on one node; belongs to the node's thread.

    Every request gets a response; if there is no answer, it says why. The size of a past state is
    estimated from the current one, `store`.
    """

    utilities: NodeUtilities
    queue: JobQueue
    recall: Recall
    store: TwinStore
    now_ns: Callable[[], int]
    frame_id: str

    def offer(self, node: Any, group: Any) -> None:
        """Create the services on `node`, with names relative to its namespace."""
        plans = (
            (GetStateAt, GET_STATE_AT.name, self._state_at),
            (GetHistory, GET_HISTORY.name, self._history),
            (GetWrites, GET_WRITES.name, self._writes),
        )
        offer(node, group, plans, self.queue, self.utilities.report)

    def _state_at(self, request: Any, reply: Callable[[Any], None]) -> Query:
        at_ns = convert.nanoseconds(request.at)
        check_moment(at_ns, self.now_ns())
        tags, items = self.store.size
        return Query(
            self._search(lambda log: state_at(log, at_ns, self.frame_id), tags * STATE_S_PER_TAG),
            reply,
            convert_services.state_response,
            tags * convert_services.TAG_S + items * convert_services.ITEM_S,
        )

    def _history(self, request: Any, reply: Callable[[Any], None]) -> Query:
        query, now_ns = convert_services.series_request(request), self.now_ns()
        is_of_all = query.tag_id == EVERY_TAG
        search_s = SERIES_S + (self.store.size[0] * SERIES_S_PER_TAG if is_of_all else 0.0)
        return Query(
            self._search(lambda log: series(log, query, now_ns), search_s),
            reply,
            convert_services.series_response,
            EVERY_TAG_S if is_of_all else MESSAGE_S,
        )

    def _writes(self, request: Any, reply: Callable[[Any], None]) -> Query:
        query = convert_services.writes_request(request)
        if request.as_rows:
            search = self._search(
                lambda log: follow.read(log, query.after, query.max_count), WRITES_S
            )
            return Query(search, reply, convert_services.rows_response, MESSAGE_S)
        search = self._search(lambda log: writes(log, query), WRITES_S)
        return Query(search, reply, convert_services.writes_response, MESSAGE_S)

    def _search(
        self, search: Callable[[sqlite3.Connection], Any], cost_s: float
    ) -> Callable[[], Future[Any]]:
        return lambda: self.recall.query(lambda log, _: search(log), cost_s)


@dataclass(frozen=True, slots=True)
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

    def look_up(self, request: EstimateRequest, now_ns: int) -> Future[Sequence[TagPast]]:
        """Start the query for an estimate's readings."""
        sensor, at_ns, day_s = request.box.sensor_type, request.at_ns or now_ns, self.day_length_s
        return self.recall.query(
            lambda log, _: readings_at(log, sensor, at_ns, day_s), self._search_s
        )

    def make(
        self,
        request: EstimateRequest,
        now_ns: int,
        found: Sequence[TagPast],
        should_stop: ShouldStop = never,
    ) -> Estimate:
        """Make an estimate of the readings found, in any thread."""
        at_ns = request.at_ns or moment_of(found, now_ns, self.day_length_s)
        return estimate_at(replace(request, at_ns=at_ns), found, self.day_length_s, should_stop)

    def _estimate(self, request: Any, reply: Callable[[Any], None]) -> Query:
        wanted, now_ns = convert_services.estimate_request_of(request), self.now_ns()
        check_moment(wanted.at_ns, now_ns)
        tags = min(engine.MAX_TAGS, self.store.size[0])
        return Query(
            partial(self.look_up, wanted, now_ns),
            reply,
            lambda found: convert_services.response_of(self.make(wanted, now_ns, found)),
            AS_OF * engine.cost_s(wanted, tags, self.max_grid_cells),
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


def offer(
    node: Any,
    group: Any,
    services: Iterable[tuple[Any, str, Callable[[Any, Callable[[Any], None]], Query | None]]],
    queue: JobQueue,
    report: Report,
) -> None:
    """Create services on `node`: type, name, and a function of `request` and `reply`.

    The function returns the query that makes the answer, or None if it has replied already.
    """
    for kind, name, plan in services:

        def answer(request: Any, _: Any, kind: Any = kind, plan: Any = plan) -> Any:
            later: Future[Any] = Future()

            def reply(found: Any) -> None:
                is_error = isinstance(found, Exception)
                later.set_result(refusal(kind, found, report) if is_error else found)

            try:
                if (query := plan(request, reply)) is not None:
                    queue.ask(query)
            except Exception as error:  # noqa: BLE001  # no client may wait forever
                return refusal(kind, error, report)
            return later

        node.create_service(kind, name, answer, qos_profile=SERVICE_QOS, callback_group=group)


# The beginning of rclpy's warning (7.1.6) that the middleware has dropped a response.
UNSENT: Final = "failed to send response (timeout)"
# For how long responses are retried, s. Discovery that lost a message recovers within about 3 s, or
# later on a busy machine.
PATIENCE_S: Final = 30.0
# Responses retained at most. One that took longer to try, s, is too large (60 MB took 0.5 s).
MAX_UNSENT: Final = 8
MAX_ATTEMPT_S: Final = 0.5

Send = Callable[[Any, Any], None]


def refusal(kind: Any, error: Exception, report: Report) -> Any:
    """A service's response with only an error message; an unexpected error is also reported."""
    if isinstance(error, FieldRefused):
        return kind.Response(error_message=str(error))
    if not isinstance(error, PastRefused | NotRemembered):
        report(kind.__qualname__, error)
    return kind.Response(error_message=message_of(error))


class _Unsent(NamedTuple):
    name: str
    send: Send
    response: Any
    header: Any
    since_s: float


class Responses:
    """Sends the responses of one node's services; belongs to the node's thread.

    The node's utilities warn of a response that was given up, and take the messages that arrived
    during an attempt. Observations must not be lost because a client is never discovered.
    """

    def __init__(self, utilities: NodeUtilities) -> None:
        self._utilities = utilities
        self._unsent: deque[_Unsent] = deque()  # the first is tried next
        warnings.filterwarnings("error", re.escape(UNSENT), RuntimeWarning)

    def watch(self, service: Any) -> None:
        """Let the callback of an rclpy Service return a `Future`; retry what cannot be sent."""
        send_now: Send = service.send_response

        def send(response: Any, header: Any) -> None:
            began_s = time.monotonic()
            if not _was_sent(send_now, response, header):
                unsent = _Unsent(service.service_name, send_now, response, header, began_s)
                self._retain(unsent, time.monotonic() - began_s)
                self._utilities.drain()

        def send_response(response: Any, header: Any) -> None:
            if isinstance(response, Future):
                response.add_done_callback(
                    self._utilities.guarded(
                        service.service_name, lambda done: send(done.result(), header)
                    )
                )
            else:
                send(response, header)

        service.send_response = send_response

    def go_on(self) -> None:
        """Retry responses until an attempt fails; to be called regularly.

        An attempt that fails blocks the node's thread for 0.1 s. The latest response is first, and
        a failed one goes to the end. So one that can be sent does not wait long behind others.
        """
        while self._unsent:
            one = self._unsent.popleft()
            if time.monotonic() - one.since_s >= PATIENCE_S:
                self._give_up(one, f"for {PATIENCE_S:g} s DDS has found no reader for it")
            elif not _was_sent(one.send, one.response, one.header):
                self._unsent.append(one)
                self._utilities.drain()
                return

    def _retain(self, new: _Unsent, took_s: float) -> None:
        if took_s > MAX_ATTEMPT_S:
            self._give_up(new, "it is too large to be retained")
            return
        self._unsent.appendleft(new)
        if len(self._unsent) > MAX_UNSENT:
            self._give_up(self._unsent.pop(), "too much else waits to be sent again")

    def _give_up(self, unsent: _Unsent, why: str) -> None:
        self._utilities.warn(
            ("unsent", unsent.name),
            f"gave up a response of {unsent.name}: {why}; does a client use a QoS other than the "
            "default of services?",
        )


def _was_sent(send: Send, response: Any, header: Any) -> bool:
    try:
        send(response, header)
    except (RuntimeWarning, SystemError) as error:
        # rclpy's C++ does not check for the warning, which is raised as an error. So Python raises
        # a SystemError, with the warning as its cause.
        for each in (error, error.__cause__):
            if isinstance(each, RuntimeWarning) and str(each).startswith(UNSENT):
                return False
        raise
    return True
