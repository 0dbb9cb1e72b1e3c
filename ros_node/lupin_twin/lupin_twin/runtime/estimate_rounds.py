"""What becomes of scans: learnt from in rounds, and compared with their neighbours.

Pure. A round takes all readings of one sensor: it fits a model where that is due, leaves out what
sensors have read since they changed, and counts how many of the new scans lie where all but the
tags nearby say. `Watch` belongs to the node's thread; a `Round` that was handed out is immutable,
and any thread may run it. Metres in the map frame, times ns of ROS time.
"""

from __future__ import annotations

import math
import sqlite3
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from lupin_twin.core.state import NANOSECONDS_PER_SECOND, Scan
from lupin_twin.estimate import (
    MAX_PER_TAG,
    Change,
    FitFailed,
    Model,
    Place,
    Posterior,
    Readings,
    fit,
)
from lupin_twin.estimate.engine import (
    Estimate,
    EstimateRequest,
    TagPast,
    is_usable,
    readings_of,
    unchanged,
)
from lupin_twin.estimate.grading import HALF_WIDTH_SDS, Grades, Record, Tally
from lupin_twin.field.engine import FieldRefused, check_sensor_type
from lupin_twin.field.explored import OccupancyMap, floor, free_of
from lupin_twin.field.idw import never
from lupin_twin.journal.fold import recent_readings
from lupin_twin.runtime.workers import in_turns

# With fewer readings there is little to learn: each answer is fitted by itself.
FIRST_FIT: Final = 10
# A sensor's round comes as often, s, where anything was received since: tags are scanned minutes
# apart. A model is fitted anew as often. Both come at once where half as much again was received.
ROUND_REST_S: Final = 30.0
FIT_PERIOD_S: Final = 300.0
GROWN: Final = 1.5


@dataclass(frozen=True, slots=True)
class TagCheck:
    """A tag's newest reading beside what is expected of it; see `estimate.Change`."""

    tag_id: str
    measured: float
    observed_at_ns: int
    expected: float
    expected_sd: float
    z: float
    offset: float
    changed_since_ns: int | None


@dataclass(frozen=True, slots=True, eq=False)
class Loaded:
    """What a sensor's readings say as of `at_ns`; without what changed sensors have read.

    Not their posterior: it takes megabytes a sensor, and tenths of a second to make again.
    """

    at_ns: int
    model: Model
    readings: Readings
    checks: tuple[TagCheck, ...]

    @property
    def changed(self) -> Mapping[str, int]:
        """The tags whose sensor has changed, and since when."""
        return {
            one.tag_id: one.changed_since_ns
            for one in self.checks
            if one.changed_since_ns is not None
        }


@dataclass(frozen=True, slots=True)
class Done:
    """What a round came to: the scans that were graded, and what was loaded."""

    graded: Tally
    loaded: Loaded


@dataclass(frozen=True, slots=True)
class Round:
    """A round that is not run yet; `model` None: one is to be fitted.

    `received` are the tags with scans since the round before, by the newest one's stamp, ns;
    `changed` those whose sensor had changed then.
    """

    sensor: str
    day_length_s: float
    model: Model | None
    received: Mapping[str, int]
    changed: Mapping[str, int]

    def run(
        self, pasts: Sequence[TagPast], now_ns: int, should_stop: Callable[[], bool] = never
    ) -> Done:
        """`pasts` is what memory holds, of these scans too.

        Raises:
            lupin_twin.field.idw.Abandoned: `should_stop`, called every few milliseconds, was true.
            lupin_twin.estimate.FitFailed: no model can be fitted.
            lupin_twin.field.engine.FieldRefused: see `readings_of`.
            numpy.linalg.LinAlgError: numbers that nothing can be made of.

        """
        day_s = self.day_length_s
        model = self.model
        if model is None:
            known = readings_of(unchanged(pasts, self.changed), now_ns, day_s)
            model = fit(known, day_length_s=day_s, should_stop=should_stop)
        posterior = model.posterior(readings_of(pasts, now_ns, day_s), 0.0, should_stop)
        checks = tuple(
            _check(past, change, now_ns)
            for past, change in in_turns(zip(pasts, posterior.changes(), strict=True))
            if change is not None
        )
        loaded = Loaded(now_ns, model, posterior.readings, checks)
        if loaded.changed:
            rest = readings_of(unchanged(pasts, loaded.changed), now_ns, day_s)
            posterior = model.posterior(rest, 0.0, should_stop)
            loaded = Loaded(now_ns, model, rest, checks)
        return Done(self._graded(loaded, posterior, pasts), loaded)

    def _graded(self, loaded: Loaded, posterior: Posterior, pasts: Sequence[TagPast]) -> Tally:
        """Of a sensor that has changed nothing is counted, nor of a scan that was received late."""
        fresh = [
            row
            for row, past in enumerate(pasts)
            if past.tag_id in self.received
            and past.tag_id not in loaded.changed
            and max(past.readings)[0] == self.received[past.tag_id]
        ]
        if not fresh:
            return Tally()
        held = posterior.left_out(np.array(fresh))
        inside = [abs(measured - mean) <= HALF_WIDTH_SDS * sd for measured, mean, sd in held]
        return Tally(len(inside), sum(inside))


def _check(past: TagPast, change: Change, at_ns: int) -> TagCheck:
    observed_at_ns, measured = max(one for one in past.readings if one[0] <= at_ns)
    since_s = change.since_s
    return TagCheck(
        past.tag_id,
        measured,
        observed_at_ns,
        change.expected,
        change.expected_sd,
        change.z,
        change.offset,
        None if since_s is None else at_ns + round(since_s * NANOSECONDS_PER_SECOND),
    )


# An estimate of a moment costs so many times as much as one of now, whose model is there.
AS_OF: Final = 3.0
# Readings that are looked up in the log, of all tags together: of few tags all of a day.
_MAX_READINGS: Final = 20_000


def readings_at(
    log: sqlite3.Connection, sensor: str, at_ns: int, day_length_s: float
) -> list[TagPast]:
    """What the log has of the day up to a moment, for `estimate_at`."""
    reach_ns = int(day_length_s * NANOSECONDS_PER_SECOND)
    return [
        TagPast(tag_id, x, y, tuple(one for one in found if is_usable(one[1])))
        for tag_id, x, y, found in recent_readings(
            log, sensor, at_ns, reach_ns, _MAX_READINGS, MAX_PER_TAG
        )
    ]


def estimate_at(
    request: EstimateRequest,
    pasts: Sequence[TagPast],
    day_length_s: float,
    should_stop: Callable[[], bool] = never,
) -> Estimate:
    """The estimate as of a moment, of readings up to then alone: model, changed sensors and all.

    Raises:
        FieldRefused: see `readings_of`; or nothing can be made of these readings.
        lupin_twin.field.idw.Abandoned: `should_stop`, called every few milliseconds, was true.

    """
    round_ = Round(request.box.sensor_type, day_length_s, None, {}, {})
    try:
        loaded = round_.run(pasts, request.at_ns, should_stop).loaded
        posterior = loaded.model.posterior(loaded.readings, 0.0, should_stop)
        grid = posterior.grid(**request.box.cells)
    except (FitFailed, np.linalg.LinAlgError) as error:
        raise FieldRefused(f"these readings cannot be computed with: {error}") from error
    return Estimate(grid, len(np.unique(loaded.readings.tag)), len(loaded.readings))


@dataclass(frozen=True, slots=True)
class Fit:
    """The model that serves, and when it was fitted, ns of ROS time; None: there is none.

    `problem` is why the last round came to nothing; empty: it did not.
    """

    model: Model | None = None
    at_ns: int | None = None
    problem: str = ""


@dataclass(slots=True)
class _Sensor:
    grades: Grades
    count: int = 0
    count_of_round: int = 0
    fitted_count: int = 0
    fitted_s: float = -math.inf
    rested_s: float = -math.inf
    fit: Fit = Fit()
    received: dict[str, int] = field(default_factory=dict)
    loaded: Loaded | None = None

    def needs_round(self, now_s: float) -> bool:
        if self.count < FIRST_FIT or self.count == self.count_of_round:
            return False
        has_grown = self.count >= GROWN * self.count_of_round
        return has_grown or now_s - self.rested_s >= ROUND_REST_S

    def needs_fit(self, now_s: float) -> bool:
        has_grown = self.count >= GROWN * self.fitted_count
        return has_grown or now_s - self.fitted_s >= FIT_PERIOD_S


class Watch:
    """Each sensor's scans since its last round, its model and grades, and whose turn it is.

    Seconds are of a clock that never jumps. Until a round comes to something, what the one before
    it loaded serves; `failed` counts those that came to nothing.
    """

    def __init__(self, day_length_s: float) -> None:
        self.failed = 0
        self._day_length_s = day_length_s
        self._sensors: dict[str, _Sensor] = {}
        self._running: str | None = None

    def add(self, scan: Scan, *, is_new: bool = True) -> bool:
        """A scan was accepted, or restored; whether a sensor has just got enough for a model."""
        is_enough = False
        for reading in scan.readings:
            if not is_usable(reading.value):
                continue
            one = self._sensors.setdefault(reading.name, _Sensor(Grades(self._day_length_s)))
            one.count += 1
            is_enough = is_enough or one.count == FIRST_FIT
            if is_new and one.fit.model is not None:
                one.received[scan.tag_id] = max(one.received.get(scan.tag_id, 0), scan.stamp_ns)
        return is_enough

    def due(self, now_s: float) -> Round | None:
        """The round to be run now, of the sensor that waits longest; None: nobody's turn."""
        if self._running is not None:
            return None
        waiting = [
            (one.rested_s, name) for name, one in self._sensors.items() if one.needs_round(now_s)
        ]
        if not waiting:
            return None
        name = min(waiting)[1]
        one = self._sensors[name]
        model = None if one.needs_fit(now_s) else one.fit.model
        changed = {} if one.loaded is None else one.loaded.changed
        return Round(name, self._day_length_s, model, dict(one.received), changed)

    def begin(self, round_: Round, now_s: float) -> None:
        """It has begun."""
        self._running = round_.sensor
        one = self._sensors[round_.sensor]
        one.count_of_round, one.received = one.count, {}
        if round_.model is None:
            one.fitted_s, one.fitted_count = now_s, one.count

    def end(self, round_: Round, outcome: Done | Exception, now_s: float, now_ns: int) -> None:
        """It has ended; one that came to nothing leaves what was loaded before."""
        self._running = None
        one = self._sensors[round_.sensor]
        one.rested_s = now_s
        if isinstance(outcome, Exception):
            self.failed += 1
            one.fit = Fit(one.fit.model, one.fit.at_ns, str(outcome) or repr(outcome))
            return
        fitted_ns = one.fit.at_ns if round_.model is not None else now_ns
        one.fit, one.loaded = Fit(outcome.loaded.model, fitted_ns), outcome.loaded
        one.grades.add(outcome.graded, now_ns)

    def fit(self, sensor: str) -> Fit:
        """What serves; without a model, too little was received, or nothing was fitted yet."""
        one = self._sensors.get(sensor)
        return Fit() if one is None else one.fit

    def loaded(self, sensor: str) -> Loaded | None:
        """What was loaded last; None: nothing yet."""
        one = self._sensors.get(sensor)
        return None if one is None else one.loaded

    def record(self, sensor: str, now_ns: int) -> Record:
        """How a sensor's estimates have done."""
        one = self._sensors.get(sensor)
        return Record(None, Tally(), Tally()) if one is None else one.grades.record(now_ns)

    def problems(self) -> dict[str, str]:
        """What is wrong with rounds, by sensor."""
        return {name: one.fit.problem for name, one in self._sensors.items() if one.fit.problem}

    def distrusted(self, now_ns: int) -> list[str]:
        """The sensors whose intervals are too narrow, by their record."""
        return [
            name
            for name, one in self._sensors.items()
            if one.grades.record(now_ns).is_trusted is False
        ]


DEFAULT_PLACES: Final = 5
MAX_PLACES: Final = 20
# What advice takes, roughly and at worst, s of one core.
ADVICE_S: Final = 0.3


@dataclass(frozen=True, slots=True)
class ReportRequest:
    """A sensor, and how many places for other tags are wanted; None: none.

    Working them out is dear. By the service there is no asking for none.

    Raises:
        FieldRefused: names the field, the value and the limit.

    """

    sensor_type: str
    max_places: int | None = None

    def __post_init__(self) -> None:
        """Refuse what cannot be answered."""
        check_sensor_type(self.sensor_type)
        if self.max_places is not None and not 1 <= self.max_places <= MAX_PLACES:
            raise FieldRefused(
                f"max_places is {self.max_places}, the limits are 1 and {MAX_PLACES}"
            )


@dataclass(frozen=True, slots=True)
class Report:
    """What a sensor's estimates are worth as of `at_ns`.

    `fitted_at_ns` is when the model was fitted that serves, None: none yet; `fit_problem` what is
    wrong with fits or with the day's length, empty: nothing. `tags` are the newest readings beside
    what is expected of them, `places` where another tag helps most, the best first.
    """

    at_ns: int
    fitted_at_ns: int | None
    fit_problem: str
    record: Record
    tags: tuple[TagCheck, ...] = ()
    places: tuple[Place, ...] = ()


def advice(loaded: Loaded, occupancy: OccupancyMap | None, count: int) -> tuple[Place, ...]:
    """Where other tags help most, over all the free floor; nowhere, where none is free."""
    tags = loaded.readings.xy
    over = floor(tags, occupancy)
    places = free_of(tags, over)
    if not len(places):
        return ()
    posterior = loaded.model.posterior(loaded.readings, 0.0)
    return tuple(posterior.advice(places, count, over=over))
