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
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import replace
from functools import partial
from typing import Any, Final, NamedTuple, Protocol

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
from lupin_twin.core.parameters import TwinParameters
from lupin_twin.core.past import (
    EVERY_TAG,
    FOREVER_NS,
    NotRemembered,
    PastRefused,
    check_moment,
    message_of,
)
from lupin_twin.core.state import Snapshot, TwinStore
from lupin_twin.estimate import engine
from lupin_twin.estimate.engine import Estimate, EstimateRequest, TagPast, moment_of
from lupin_twin.field.engine import (
    FieldCache,
    FieldRefused,
    FieldRules,
    check_request,
    compute_field,
    cost_s,
)
from lupin_twin.field.explored import OccupancyMap
from lupin_twin.journal import follow
from lupin_twin.journal.fold import STATE_S_PER_TAG, state_at
from lupin_twin.journal.queries import NEWEST_S_PER_TAG, series
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
from lupin_twin.runtime.memory import Memory
from lupin_twin.runtime.workers import SMALL_S, JobQueue, ShouldStop

Report = Callable[[str, Exception], None]
Reply = Callable[[Any], None]

# Worst-case cost of events of all tags, s of one core.
EVERY_TAG_S: Final = 1.0


class Twin(Protocol):
    """What services and layers need of the node, on its thread."""

    utilities: NodeUtilities
    parameters: TwinParameters
    store: TwinStore
    memory: Memory
    rules: FieldRules
    occupancy_map: OccupancyMap | None

    def now_ns(self) -> int:
        """Return ROS time, ns."""

    def snapshot(self) -> Snapshot:
        """Every tag as of now."""


class Services:
    """The services of a twin; belongs to the node's thread.

    Every request gets a response; if there is no answer, it says why. Fields are computed off the
    node's thread unless they are cached. Estimates and reports on them are made from the journal.
    They share a queue with the past, and fields have another, so that no field waits for them.
    `wake()` is called in another thread when there is something to `deliver`.
    """

    def __init__(self, twin: Twin, wake: Callable[[], None]) -> None:
        self._twin = twin
        # Apart, because threads that read the journal may wait for a disk that hangs.
        self.fields = JobQueue("field", wake)
        self._past = JobQueue("past", wake, lambda: twin.utilities.is_behind, large_threads=1)
        self._cache = FieldCache(twin.parameters.field_cache_mb * 1e6)

    def offer(self, group: Any) -> None:
        """Create the services, with names relative to the node's namespace.

        Raises:
            ParameterError: the name of the service of fields is invalid in ROS.

        """
        name = self._twin.parameters.field_service_name
        with naming("field_service_name", name):
            for kind, service, begin in (
                (GetField, name, self._field),
                (GetEstimate, GET_ESTIMATE.name, self._estimate),
                (GetEstimateReport, GET_ESTIMATE_REPORT.name, self._report),
                (GetStateAt, GET_STATE_AT.name, self._state_at),
                (GetHistory, GET_HISTORY.name, self._history),
                (GetWrites, GET_WRITES.name, self._writes),
            ):
                self._twin.utilities.node.create_service(
                    kind,
                    service,
                    partial(self._answer, kind, begin),
                    qos_profile=SERVICE_QOS,
                    callback_group=group,
                )

    def deliver(self) -> None:
        """Send responses that were made meanwhile."""
        self.fields.deliver()
        self._past.deliver()

    def close(self) -> None:
        """End the workers; their current work is abandoned."""
        self.fields.close()
        self._past.close()

    def _answer(
        self, kind: Any, begin: Callable[[Any, Reply], None], request: Any, _: Any
    ) -> Future[Any]:
        """Return the future of a response; `begin(request, reply)` has it made."""
        later: Future[Any] = Future()

        def reply(found: Any) -> None:
            is_error = isinstance(found, Exception)
            report = self._twin.utilities.report
            later.set_result(refusal(kind, found, report) if is_error else found)

        try:
            begin(request, reply)
        except Exception as error:  # noqa: BLE001  # no client may wait forever
            reply(error)
        return later

    def _field(self, request: Any, reply: Reply) -> None:
        twin, wanted = self._twin, convert_services.field_request_of(request)
        rules, occupancy = twin.rules, twin.occupancy_map
        check_request(wanted, rules.max_grid_cells)
        is_clipped = occupancy is not None and rules.clip_to_explored
        revision = occupancy.revision if occupancy is not None and is_clipped else None
        # The count stands for the store's whole content.
        key = wanted, twin.store.observation_count, revision, rules
        if (found := self._cache.get(key)) is not None:
            reply(convert_services.field_response(found))
            return
        samples = twin.store.samples_for_sensor(wanted.sensor_type)
        compute = partial(compute_field, wanted, samples, occupancy, rules)
        cost = cost_s(wanted, len(samples), rules)

        def keep(grid: Any) -> None:
            if not isinstance(grid, Exception):
                self._cache.put(key, grid)
                grid = convert_services.field_response(grid)
            reply(grid)

        self.fields.ask(compute, keep, cost)

    # --- the past: its size is estimated from the current state ---------------------------------

    def _state_at(self, request: Any, reply: Reply) -> None:
        at_ns, frame_id = convert.nanoseconds(request.at), self._twin.parameters.frame_id
        check_moment(at_ns, self._twin.now_ns())
        tags, items = self._twin.store.size
        cost = tags * (STATE_S_PER_TAG + convert_services.TAG_S) + items * convert_services.ITEM_S
        make = convert_services.state_response
        self._of_log(lambda log: state_at(log, at_ns, frame_id), make, reply, cost)

    def _history(self, request: Any, reply: Reply) -> None:
        query, now_ns = convert_services.series_request(request), self._twin.now_ns()
        cost = EVERY_TAG_S if query.tag_id == EVERY_TAG else SMALL_S
        make = convert_services.series_response
        self._of_log(lambda log: series(log, query, now_ns), make, reply, cost)

    def _writes(self, request: Any, reply: Reply) -> None:
        after = min(int(request.after), FOREVER_NS)
        # A copy must not wait for estimates, so this counts as small.
        make = convert_services.rows_response
        self._of_log(lambda log: follow.read(log, after), make, reply, SMALL_S)

    def _of_log(
        self,
        search: Callable[[sqlite3.Connection], Any],
        make: Callable[[Any], Any],
        reply: Reply,
        cost: float,
    ) -> None:
        """Have `make` make the response of what is found in the journal."""
        self._past.ask(lambda stop: make(self._search(search, stop)), reply, cost)

    def _search(self, search: Callable[[sqlite3.Connection], Any], stop: ShouldStop) -> Any:
        return self._twin.memory.recall.answer(lambda log, _: search(log), stop)

    # --- estimates ------------------------------------------------------------------------------

    def readings(
        self, sensor: str, at_ns: int, stop: ShouldStop, days: float = 1.0
    ) -> list[TagPast]:
        """Read a sensor's readings of some days up to a moment, in any thread."""
        day_s = self._twin.parameters.day_length_s
        found: list[TagPast] = self._search(
            lambda log: readings_at(log, sensor, at_ns, day_s, days), stop
        )
        return found

    def estimate(
        self,
        request: EstimateRequest,
        now_ns: int,
        found: Sequence[TagPast],
        should_stop: ShouldStop,
    ) -> Estimate:
        """Make an estimate of the readings found, in any thread."""
        day_s = self._twin.parameters.day_length_s
        at_ns = request.at_ns or moment_of(found, now_ns, day_s)
        return estimate_at(replace(request, at_ns=at_ns), found, day_s, should_stop)

    def _estimate(self, request: Any, reply: Reply) -> None:
        twin, wanted = self._twin, convert_services.estimate_request_of(request)
        now_ns = twin.now_ns()
        check_moment(wanted.at_ns, now_ns)
        sensor, at_ns = wanted.box.sensor_type, wanted.at_ns or now_ns
        tags = min(engine.MAX_TAGS, twin.store.size[0])

        def work(stop: ShouldStop) -> Any:
            found = self.readings(sensor, at_ns, stop)
            return convert_services.response_of(self.estimate(wanted, now_ns, found, stop))

        cost = AS_OF * engine.cost_s(wanted, tags, twin.parameters.max_grid_cells)
        self._past.ask(work, reply, self._readings_s(1.0) + cost)

    def _report(self, request: Any, reply: Reply) -> None:
        wanted, now_ns = convert_services.report_request_of(request), self._twin.now_ns()
        day_s, occupancy = self._twin.parameters.day_length_s, self._twin.occupancy_map

        def work(stop: ShouldStop) -> Any:
            found = self.readings(wanted.sensor_type, now_ns, stop, REPORT_DAYS)
            report = report_of(wanted, found, now_ns, day_s, occupancy=occupancy, should_stop=stop)
            return convert_services.report_response(report)

        self._past.ask(work, reply, self._readings_s(REPORT_DAYS) + REPORT_S)

    def _readings_s(self, days: float) -> float:
        """Approximate cost of readings, s of one core."""
        return days * self._twin.store.size[0] * (STATE_S_PER_TAG + NEWEST_S_PER_TAG)


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
