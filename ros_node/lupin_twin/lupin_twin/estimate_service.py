"""The services of the estimate: questions in, answers made off the node's thread.

Scans are learnt from in rounds, one at a time, and behind each is a rest: so that they cost no more
than a tenth of a core, however many come.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Final

import numpy as np
from lupin_msgs.srv import GetEstimate, GetEstimateReport

from lupin_twin import convert_estimate
from lupin_twin.diagnostics import Estimates
from lupin_twin.estimate import MAX_PER_TAG, FitFailed, Place
from lupin_twin.estimate_report import ADVICE_S, Report, ReportRequest, advice
from lupin_twin.estimate_rounds import Done, Loaded, Round, Watch
from lupin_twin.estimates import (
    MAX_TAGS,
    Day,
    Estimate,
    EstimateJob,
    EstimateRequest,
    TagPast,
    cost_s,
    is_usable,
    past_of,
)
from lupin_twin.explored import OccupancyMap
from lupin_twin.fields import FieldRefused
from lupin_twin.habits import SERVICE_QOS, Habits
from lupin_twin.history import History, TagHistory
from lupin_twin.idw import never
from lupin_twin.interfaces import GET_ESTIMATE, GET_ESTIMATE_REPORT
from lupin_twin.journal.fold import STATE_S_PER_TAG
from lupin_twin.journal.lately import lately
from lupin_twin.journal.queries import SERIES_S
from lupin_twin.past import NotRemembered, PastRefused, message_of
from lupin_twin.past_desk import PastDesk, Question
from lupin_twin.recall import Recall
from lupin_twin.responses import Later
from lupin_twin.state import NANOSECONDS_PER_SECOND, Scan, TwinStore
from lupin_twin.workers import ShouldStop, Workers, in_turns

# A round, s of one core at worst: everything small passes it.
_ROUND_S: Final = 2.0
# After a round none for so many times as long: all of them take a tenth of a core.
REST_FACTOR: Final = 9.0
# What gathering a tag's scans takes, roughly and at worst.
_GATHER_TAG_S: Final = 50e-6
# Readings that are looked up in the journal, of all tags together: of few tags all of a day.
_LOOKED_UP: Final = 20_000
# Places for other tags that are kept, each until its sensor's next round.
_MAX_ADVISED: Final = 64

Gather = Callable[[str], Sequence[TagPast]]


@dataclass(frozen=True, slots=True)
class Known:
    """What estimates are made of: the newest, the last scans, and what the journal remembers.

    `occupancy` tells the newest map: where another tag could stand.
    """

    store: TwinStore
    history: History
    recall: Recall
    occupancy: Callable[[], OccupancyMap | None]


@dataclass(frozen=True, slots=True)
class EstimateRules:
    """How long a day takes, s of ROS time, and how many cells an estimate may have."""

    day_length_s: float
    max_grid_cells: int


@dataclass(frozen=True, slots=True)
class Task:
    """An estimate that was asked for, and about what making it takes, `cost_s` s of one core.

    `look_up()`, on the node's thread, begins the search for what `make`, on any, makes it of.
    """

    job: EstimateJob
    now_ns: int
    cost_s: float
    look_up: Callable[[], Future[Sequence[TagPast]]]

    def make(self, found: Sequence[TagPast], should_stop: ShouldStop = never) -> Estimate:
        """See `EstimateJob.compute`."""
        return self.job.compute(found, self.now_ns, should_stop)


class EstimateService:
    """The services of one node, and its models; belongs to the node's thread.

    Its threads are its own: no field waits for a round. `wake()` is called in one of them when
    `deliver` has something to do.
    """

    def __init__(
        self,
        habits: Habits,
        known: Known,
        rules: EstimateRules,
        now_ns: Callable[[], int],
        wake: Callable[[], None],
    ) -> None:
        self.watch = Watch(rules.day_length_s)
        self._habits = habits
        self._known = known
        self._rules = rules
        self._now_ns = now_ns
        self._workers = Workers("estimate")
        # Rounds have a desk of their own: no estimate waits behind one.
        self._desk, self._rounds = (
            PastDesk(self._workers, wake, lambda: habits.is_behind) for _ in range(2)
        )
        self._day = Day(rules.day_length_s)
        self._is_working = False
        self._rests_until_s = -math.inf
        self._gathered: Gather | None = None
        # Of these the log has said so, and nothing has been better since.
        self._told_distrusted: set[str] = set()
        self._advised: dict[
            tuple[str, int], tuple[Loaded, OccupancyMap | None, tuple[Place, ...]]
        ] = {}

    def offer(self, node: Any, group: Any) -> None:
        """Have `node` offer the services, by names relative to its namespace; some answer later."""
        for kind, name, callback in (
            (GetEstimate, GET_ESTIMATE.name, self._on_get_estimate),
            (GetEstimateReport, GET_ESTIMATE_REPORT.name, self._on_get_report),
        ):
            node.create_service(kind, name, callback, qos_profile=SERVICE_QOS, callback_group=group)

    def restore(self) -> None:
        """What the journal holds is known again: rounds can begin before a scan comes."""
        self._gathered = None
        sensors: set[str] = set()
        for tag_id, past in self._known.history.all_later()().items():
            for scan in past.scans:
                one = Scan(tag_id, scan.stamp_ns, scan.readings, None)
                self.watch.hear(one, is_new=False)
                self._day.hear(one)
                sensors.update(reading.name for reading in scan.readings)
        for sensor in sorted(sensors):
            self._look_back(sensor)
        self.go_on()

    def _look_back(self, sensor: str) -> None:
        """A history is short: what was read throughout the day is in the journal."""

        def remember(found: list[TagPast] | Exception) -> None:
            if isinstance(found, Exception):
                return  # without a journal that can be read, the history is all there is
            for tag in found:
                for stamp_ns, value in tag.readings:
                    self._day.add(tag.tag_id, sensor, stamp_ns, value)
            self._gathered = None

        asked = self._from_journal(sensor, self._now_ns())
        self._rounds.ask(Question(asked, lambda found: found, _ROUND_S, remember))

    def hold_to(self, now_ns: int) -> None:
        """Follow a clock that has gone back."""
        self._day.hold_to(now_ns)
        self._gathered = None

    def hear(self, write: object) -> None:
        """Something was observed and accepted."""
        self._gathered = None
        if isinstance(write, Scan):
            self._day.hear(write)
            if self.watch.hear(write):
                self.go_on()

    def go_on(self) -> None:
        """Begin the round whose turn it is, on a worker; to be called once a second.

        A first model is awaited, and does not wait for the end of a rest.
        """
        self._desk.go_on()
        self._rounds.go_on()
        now_s = time.monotonic()
        due = None if self._is_working else self.watch.due(now_s)
        if due is None:
            return
        if now_s < self._rests_until_s and self.watch.fit(due.sensor).model is not None:
            return
        gather, now_ns = self._gather(), self._now_ns()
        self.watch.begin(due, now_s)
        self._begin(
            lambda stop: due.run(gather(due.sensor), now_ns, stop), partial(self._ended, due)
        )

    def _ended(self, round_: Round, outcome: Done | Exception) -> None:
        now_ns, sensor = self._now_ns(), round_.sensor
        self.watch.end(round_, outcome, time.monotonic(), now_ns)
        if isinstance(outcome, FitFailed | np.linalg.LinAlgError):
            self._habits.warn(("estimate", sensor), f"no new model of {sensor}: {outcome}")
        elif isinstance(outcome, Exception) and not isinstance(outcome, FieldRefused):
            self._habits.report("the estimate's round", outcome)
        record = self.watch.record(sensor, now_ns)
        if record.is_trusted is not False:
            self._told_distrusted.discard(sensor)
        elif sensor not in self._told_distrusted:
            # Once: for as long as it lasts, /diagnostics and the page say so.
            self._told_distrusted.add(sensor)
            self._habits.warn(
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
            Question(
                lambda: self._workers.submit(timed, _ROUND_S), lambda made: made, _ROUND_S, rest
            )
        )

    def _gather(self) -> Gather:
        """What memory holds now, for any thread to gather the past of a sensor from.

        As long as nothing is heard it is gathered once: who asks often has nothing copied.
        """
        if self._gathered is None:
            tags = self._known.store.snapshot(self._now_ns(), "").tags
            kept = self._known.history.all_later()
            known: dict[str, list[TagPast]] = {}
            day = self._day

            def gather(sensor: str) -> list[TagPast]:
                if sensor not in known:
                    histories = kept()
                    found = (
                        past_of(
                            tag,
                            histories.get(tag.tag_id, TagHistory()).scans,
                            sensor,
                            day.of(tag.tag_id, sensor),
                        )
                        for tag in in_turns(tags)
                    )
                    pasts = [past for past in found if past is not None]
                    if not pasts:
                        return pasts
                    known[sensor] = pasts
                return known[sensor]

            self._gathered = gather
        return self._gathered

    def prepare(self, asked: EstimateRequest) -> Task:
        """What is to be done for an estimate.

        Raises:
            FieldRefused: a bad request.

        """
        now_ns = self._now_ns()
        asked.check(now_ns, self._rules.max_grid_cells)
        sensor = asked.box.sensor_type
        loaded = self.watch.loaded(sensor)
        changed = {} if loaded is None else loaded.changed
        job = EstimateJob(asked, self.watch.fit(sensor).model, self._rules.day_length_s, changed)
        tags = min(MAX_TAGS, self._known.store.size[0])
        cost = cost_s(asked, tags, self._rules.max_grid_cells)
        return Task(job, now_ns, cost, self._look_up(asked))

    def report(self, asked: ReportRequest) -> Callable[[], Report]:
        """What makes the report, on a worker: working out places for other tags takes a while."""
        sensor, now_ns = asked.sensor_type, self._now_ns()
        fit, loaded = self.watch.fit(sensor), self.watch.loaded(sensor)
        record = self.watch.record(sensor, now_ns)
        if loaded is None:
            bare = Report(now_ns, fit.at_ns, fit.problem, record)
            return lambda: bare
        known = Report(loaded.at_ns, fit.at_ns, fit.problem, record, loaded.checks)
        max_places = asked.max_places
        if max_places is None:
            return lambda: known
        occupancy = self._known.occupancy()
        key = (sensor, max_places)

        def with_places() -> Report:
            kept = self._advised.get(key)
            if kept is None or kept[0] is not loaded or kept[1] is not occupancy:
                kept = loaded, occupancy, advice(loaded, occupancy, max_places)
                if len(self._advised) >= _MAX_ADVISED:
                    self._advised.clear()
                self._advised[key] = kept
            return replace(known, places=kept[2])

        return with_places

    def state(self) -> Estimates:
        """How they do, for the twin's diagnostics."""
        return Estimates(
            self.watch.problems(),
            tuple(self.watch.distrusted(self._now_ns())),
            self.watch.failed,
        )

    def deliver(self) -> None:
        """Hand out what was made."""
        self._desk.deliver()
        self._rounds.deliver()

    def close(self) -> None:
        """End the threads; what they make is for nobody then."""
        self._workers.close()

    def _on_get_estimate(self, request: Any, response: Any) -> Any:
        later = Later()
        try:
            task = self.prepare(convert_estimate.request_of(request))
            self._desk.ask(
                Question(
                    task.look_up,
                    lambda found: convert_estimate.response_of(task.make(found)),
                    task.cost_s,
                    lambda answer: later.answer(self._answer(response, answer)),
                )
            )
        except Exception as error:  # noqa: BLE001  # the caller must not wait for ever
            return self._answer(response, error)
        return later

    def _on_get_report(self, request: Any, response: Any) -> Any:
        later = Later()
        try:
            with_places = self.report(convert_estimate.report_request_of(request))
            self._desk.ask(
                Question(
                    lambda: self._workers.submit(lambda _: with_places(), ADVICE_S),
                    convert_estimate.report_response,
                    ADVICE_S,
                    lambda answer: later.answer(self._answer(response, answer)),
                )
            )
        except Exception as error:  # noqa: BLE001  # the caller must not wait for ever
            return self._answer(response, error)
        return later

    def _look_up(self, asked: EstimateRequest) -> Callable[[], Future[Any]]:
        sensor, at_ns = asked.box.sensor_type, asked.at_ns
        tags = self._known.store.size[0]
        if not at_ns:

            def from_memory() -> Future[Sequence[TagPast]]:
                gather = self._gather()
                return self._workers.submit(lambda _: gather(sensor), tags * _GATHER_TAG_S)

            return from_memory
        return self._from_journal(sensor, at_ns)

    def _from_journal(self, sensor: str, at_ns: int) -> Callable[[], Future[list[TagPast]]]:
        reach_ns = int(self._rules.day_length_s * NANOSECONDS_PER_SECOND)
        tags = self._known.store.size[0]
        most = max(_LOOKED_UP, tags * MAX_PER_TAG)
        return lambda: self._known.recall.ask(
            lambda connection, _: [
                TagPast(tag_id, x, y, tuple(one for one in found if is_usable(one[1])))
                for tag_id, x, y, found in lately(connection, sensor, at_ns, reach_ns, most)
            ],
            tags * (STATE_S_PER_TAG + SERIES_S),
        )

    def _answer(self, response: Any, answer: Any) -> Any:
        if not isinstance(answer, Exception):
            return answer
        if isinstance(answer, FieldRefused):
            response.error_message = str(answer)
        elif isinstance(answer, PastRefused | NotRemembered):
            response.error_message = message_of(answer)
        else:
            self._habits.report("the estimate", answer)
            response.error_message = f"the twin failed to estimate: {answer}"
        return response
