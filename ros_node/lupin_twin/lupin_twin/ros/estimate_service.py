"""The services of the estimate: requests in, responses made off the node's thread.

Scans are learnt from in rounds, one at a time, and behind each is a rest: so that they cost no more
than a tenth of a core, however many come.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Final

import numpy as np
from lupin_msgs.srv import GetEstimate, GetEstimateReport

from lupin_twin.core.diagnostics import Estimates
from lupin_twin.core.interfaces import GET_ESTIMATE, GET_ESTIMATE_REPORT
from lupin_twin.core.state import Reading, Scan, TwinStore
from lupin_twin.estimate import FitFailed
from lupin_twin.estimate.engine import (
    MAX_TAGS,
    Estimate,
    EstimateJob,
    EstimateRequest,
    RecentReadings,
    TagPast,
    cost_s,
)
from lupin_twin.field.engine import FieldRefused
from lupin_twin.field.explored import OccupancyMap
from lupin_twin.field.idw import never
from lupin_twin.journal.fold import STATE_S_PER_TAG
from lupin_twin.journal.queries import SERIES_S
from lupin_twin.ros import convert_field
from lupin_twin.ros.base_node import SERVICE_QOS, NodeUtilities
from lupin_twin.ros.responses import answer_later
from lupin_twin.runtime.estimate_rounds import (
    ADVICE_S,
    AS_OF,
    Done,
    Report,
    ReportRequest,
    Round,
    Watch,
    advice,
    estimate_at,
    readings_at,
)
from lupin_twin.runtime.journal_queries import Recall
from lupin_twin.runtime.workers import JobQueue, Query, ShouldStop, Workers, in_turns

# A round, s of one core at worst: everything small passes it.
_ROUND_S: Final = 2.0
# After a round none for so many times as long: all of them take a tenth of a core.
REST_FACTOR: Final = 9.0
# What gathering a tag's scans takes, roughly and at worst.
_GATHER_TAG_S: Final = 50e-6

Gather = Callable[[str], Sequence[TagPast]]


@dataclass(frozen=True, slots=True)
class Task:
    """A requested estimate, and about what making it takes, `cost_s` s of one core.

    `look_up()`, on the node's thread, begins the search for what `make`, on any, makes it of.
    """

    cost_s: float
    look_up: Callable[[], Future[Sequence[TagPast]]]
    make: Callable[[Sequence[TagPast], ShouldStop], Estimate]


@dataclass(slots=True)
class EstimateService:
    """The services of one node, and its models; belongs to the node's thread.

    Estimates are made of recent readings, or of what the journal has; `occupancy()`
    is the latest map, where another tag could stand. `day_length_s` is s of ROS time. Its threads
    are its own: no field waits for a round. `wake()` is called in one of them when `deliver` has
    something to do.
    """

    utilities: NodeUtilities
    store: TwinStore
    recall: Recall
    occupancy: Callable[[], OccupancyMap | None]
    day_length_s: float
    max_grid_cells: int
    now_ns: Callable[[], int]
    wake: Callable[[], None]
    watch: Watch = field(init=False)
    _recent: RecentReadings = field(init=False)
    _queue: JobQueue = field(init=False)
    # Rounds have a queue of their own: no estimate waits behind one.
    _rounds: JobQueue = field(init=False)
    _workers: Workers = field(default_factory=lambda: Workers("estimate"))
    _is_working: bool = False
    _rests_until_s: float = -math.inf
    # Sensors whose estimates were reported as too narrow, and have not been better since.
    _warned: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        """Nothing is known, and nothing asked for."""
        self.watch = Watch(self.day_length_s)
        self._recent = RecentReadings(self.day_length_s)
        self._queue, self._rounds = (
            JobQueue(self._workers, self.wake, lambda: self.utilities.is_behind) for _ in range(2)
        )

    def offer(self, node: Any, group: Any) -> None:
        """Have `node` offer the services, by names relative to its namespace; some answer later."""
        for kind, name, callback in (
            (GetEstimate, GET_ESTIMATE.name, self._on_get_estimate),
            (GetEstimateReport, GET_ESTIMATE_REPORT.name, self._on_get_report),
        ):
            node.create_service(kind, name, callback, qos_profile=SERVICE_QOS, callback_group=group)

    def restore(self) -> None:
        """What the journal holds is known again: rounds can begin before a scan comes."""
        sensors: set[str] = set()
        for tag in self.store.snapshot(self.now_ns(), "").tags:
            for reading in tag.readings:
                sensors.add(reading.name)
                if reading.observed_at_ns is not None:
                    stamp_ns = reading.observed_at_ns
                    self._recent.add(tag.tag_id, reading.name, stamp_ns, reading.value)
        for sensor in sorted(sensors):
            self._as_of(sensor)

    def _as_of(self, sensor: str) -> None:
        def remember(found: Sequence[TagPast] | Exception) -> None:
            if isinstance(found, Exception):
                return  # without a journal that can be read, the latest readings are all there is
            for tag in found:
                for stamp_ns, value in tag.readings:
                    self._recent.add(tag.tag_id, sensor, stamp_ns, value)
                    scan = Scan(tag.tag_id, stamp_ns, (Reading(sensor, value),))
                    self.watch.add(scan, is_new=False)
            self.go_on()

        look_up = self._from_journal(sensor, self.now_ns())
        self._rounds.ask(Query(look_up, remember, cost_s=_ROUND_S))

    def hold_to(self, now_ns: int) -> None:
        """Follow a clock that has gone back."""
        self._recent.hold_to(now_ns)

    def add(self, write: object) -> None:
        """Something was observed and accepted."""
        if isinstance(write, Scan):
            for reading in write.readings:
                self._recent.add(write.tag_id, reading.name, write.stamp_ns, reading.value)
            if self.watch.add(write):
                self.go_on()

    def go_on(self) -> None:
        """Begin the round whose turn it is, on a worker; to be called once a second.

        A first model is awaited, and does not wait for the end of a rest.
        """
        self._queue.go_on()
        self._rounds.go_on()
        now_s = time.monotonic()
        due = None if self._is_working else self.watch.due(now_s)
        if due is None:
            return
        if now_s < self._rests_until_s and self.watch.fit(due.sensor).model is not None:
            return
        gather, now_ns = self._gather(), self.now_ns()
        self.watch.begin(due, now_s)
        self._begin(
            lambda stop: due.run(gather(due.sensor), now_ns, stop), partial(self._ended, due)
        )

    def _ended(self, round_: Round, outcome: Done | Exception) -> None:
        now_ns, sensor = self.now_ns(), round_.sensor
        self.watch.end(round_, outcome, time.monotonic(), now_ns)
        if isinstance(outcome, FitFailed | np.linalg.LinAlgError):
            self.utilities.warn(("estimate", sensor), f"no new model of {sensor}: {outcome}")
        elif isinstance(outcome, Exception) and not isinstance(outcome, FieldRefused):
            self.utilities.report("the estimate's round", outcome)
        record = self.watch.record(sensor, now_ns)
        if record.is_trusted is not False:
            self._warned.discard(sensor)
        elif sensor not in self._warned:
            # Once: for as long as it lasts, /diagnostics and the page say so.
            self._warned.add(sensor)
            self.utilities.warn(
                ("trust", sensor),
                f"the estimate of {sensor} is too sure of itself: of {record.week.scans} scans, "
                f"{record.week.inside} came to lie where 9 of 10 were predicted",
            )
        self.go_on()

    def _begin(self, work: Callable[[ShouldStop], Any], reply: Callable[[Any], None]) -> None:
        worked_s = 0.0

        def timed(should_stop: ShouldStop) -> Any:
            nonlocal worked_s
            begun_s = time.thread_time()
            try:
                return work(should_stop)
            finally:
                worked_s = time.thread_time() - begun_s

        def rest(outcome: Any) -> None:
            self._is_working = False
            self._rests_until_s = time.monotonic() + REST_FACTOR * worked_s
            reply(outcome)

        self._is_working = True
        self._rounds.ask(
            Query(lambda: self._workers.submit(timed, _ROUND_S), rest, cost_s=_ROUND_S)
        )

    def _gather(self) -> Gather:
        """What memory holds now of a sensor, to be called on any thread."""
        tags, recent = self.store.snapshot(self.now_ns(), "").tags, self._recent

        def gather(sensor: str) -> list[TagPast]:
            return [
                TagPast(tag.tag_id, tag.pose.x, tag.pose.y, readings)
                for tag in in_turns(tags)
                if tag.pose is not None and (readings := recent.of(tag.tag_id, sensor))
            ]

        return gather

    def prepare(self, request: EstimateRequest) -> Task:
        """What is to be done for an estimate.

        Raises:
            FieldRefused: a bad request.

        """
        now_ns = self.now_ns()
        request.check(now_ns, self.max_grid_cells)
        sensor, day_s = request.box.sensor_type, self.day_length_s
        cost = cost_s(request, min(MAX_TAGS, self.store.size[0]), self.max_grid_cells)
        if request.at_ns:
            look_up = self._from_journal(sensor, request.at_ns)
            return Task(
                AS_OF * cost, look_up, lambda found, stop: estimate_at(request, found, day_s, stop)
            )
        loaded = self.watch.loaded(sensor)
        changed = {} if loaded is None else loaded.changed
        job = EstimateJob(request, self.watch.fit(sensor).model, day_s, changed)
        return Task(
            cost, self._from_memory(sensor), lambda found, stop: job.compute(found, now_ns, stop)
        )

    def report(self, request: ReportRequest) -> Callable[[], Report]:
        """What makes the report, on a worker: working out places for other tags takes a while."""
        sensor, now_ns = request.sensor_type, self.now_ns()
        fit, loaded = self.watch.fit(sensor), self.watch.loaded(sensor)
        record = self.watch.record(sensor, now_ns)
        if loaded is None:
            bare = Report(now_ns, fit.at_ns, fit.problem, record)
            return lambda: bare
        known = Report(loaded.at_ns, fit.at_ns, fit.problem, record, loaded.checks)
        max_places = request.max_places
        if max_places is None:
            return lambda: known
        occupancy = self.occupancy()
        return lambda: replace(known, places=advice(loaded, occupancy, max_places))

    def state(self) -> Estimates:
        """How they do, for the twin's diagnostics."""
        return Estimates(
            self.watch.problems(),
            tuple(self.watch.distrusted(self.now_ns())),
            self.watch.failed,
        )

    def deliver(self) -> None:
        """Hand out what was made."""
        self._queue.deliver()
        self._rounds.deliver()

    def close(self) -> None:
        """End the threads; what they make is for nobody then."""
        self._workers.close()

    def _on_get_estimate(self, request: Any, response: Any) -> Any:
        def prepare(reply: Callable[[Any], None]) -> Query:
            task = self.prepare(convert_field.estimate_request_of(request))
            return Query(
                task.look_up,
                reply,
                lambda found: convert_field.response_of(task.make(found, never)),
                task.cost_s,
            )

        return answer_later(self._queue, prepare, response, self.utilities.report)

    def _on_get_report(self, request: Any, response: Any) -> Any:
        def prepare(reply: Callable[[Any], None]) -> Query:
            report = self.report(convert_field.report_request_of(request))
            return Query(
                lambda: self._workers.submit(lambda _: report(), ADVICE_S),
                reply,
                convert_field.report_response,
                ADVICE_S,
            )

        return answer_later(self._queue, prepare, response, self.utilities.report)

    def _from_memory(self, sensor: str) -> Callable[[], Future[Sequence[TagPast]]]:
        tags = self.store.size[0]

        def look_up() -> Future[Sequence[TagPast]]:
            gather = self._gather()
            return self._workers.submit(lambda _: gather(sensor), tags * _GATHER_TAG_S)

        return look_up

    def _from_journal(self, sensor: str, at_ns: int) -> Callable[[], Future[Sequence[TagPast]]]:
        return lambda: self.recall.query(
            lambda log, _: readings_at(log, sensor, at_ns, self.day_length_s),
            self.store.size[0] * (STATE_S_PER_TAG + SERIES_S),
        )
