"""Makes estimates of a sensor from a day of the journal, and reports how good they are.

Pure, except for `readings_at`. A report compares each tag's latest reading with its prediction from
all others, and leaves out what sensors have read since they changed. It counts how many of the new
scans lie where they were predicted without nearby tags. Metres in the map frame, times ns of ROS
time.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from lupin_twin.core.state import FLOAT32_MAX, NANOSECONDS_PER_SECOND
from lupin_twin.estimate.engine import (
    HALF_WIDTH_SDS,
    Estimate,
    EstimateRequest,
    Grades,
    Record,
    TagPast,
    Tally,
    readings_of,
    unchanged,
)
from lupin_twin.estimate.kernel import MAX_PER_TAG, Readings
from lupin_twin.estimate.model import FitFailed, Model, fit
from lupin_twin.estimate.posterior import Posterior
from lupin_twin.estimate.solution import Change, Place
from lupin_twin.field.engine import FieldRefused, check_sensor_type
from lupin_twin.field.explored import OccupancyMap, floor, free_of
from lupin_twin.field.idw import never
from lupin_twin.journal.fold import state_at
from lupin_twin.journal.queries import newest
from lupin_twin.runtime.workers import in_turns

# With fewer readings in a day, there is little to learn, and estimates are not judged.
FIRST_FIT: Final = 10
# Cost of an estimate relative to its grid: it also takes a fit, and a posterior to find changes.
AS_OF: Final = 3.0
# Readings read from the journal, for all tags together; with few tags, all of a day.
_MAX_READINGS: Final = 20_000


def readings_at(
    log: sqlite3.Connection, sensor: str, at_ns: int, day_length_s: float
) -> list[TagPast]:
    """Read a sensor's readings of the day up to a moment; of equal stamps, the last received.

    Answers are in float32, so a reading beyond its range does not count.
    """
    places = {
        tag.tag_id: tag.pose
        for tag in state_at(log, at_ns, "").tags
        if tag.pose is not None and any(reading.name == sensor for reading in tag.readings)
    }
    start_ns = max(1, at_ns - int(day_length_s * NANOSECONDS_PER_SECOND))
    each = max(_MAX_READINGS // max(len(places), 1), MAX_PER_TAG)
    found = newest(log, sensor, start_ns, at_ns + 1, each)
    return [
        TagPast(
            tag_id,
            pose.x,
            pose.y,
            tuple(one for one in dict(found[tag_id]).items() if abs(one[1]) <= FLOAT32_MAX),
        )
        for tag_id, pose in places.items()
        if tag_id in found
    ]


def are_enough(pasts: Sequence[TagPast]) -> bool:
    """Whether there are enough readings to make and judge estimates."""
    return sum(len(past.readings) for past in pasts) >= FIRST_FIT


@dataclass(frozen=True, slots=True)
class TagCheck:
    """A tag's latest reading, and what was expected of it; see `solution.Change`."""

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
    """A sensor's model and readings as of `at_ns`, without readings since a tag's sensor changed.

    The posterior is not cached: it takes megabytes, and can be made again in tenths of a second.
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


def load(
    pasts: Sequence[TagPast],
    at_ns: int,
    day_length_s: float,
    should_stop: Callable[[], bool] = never,
) -> tuple[Loaded, Posterior]:
    """Fit a model to readings up to a moment; returns it with the posterior at that moment.

    Raises:
        lupin_twin.field.idw.Abandoned: `should_stop`, called every few milliseconds, was true.
        lupin_twin.estimate.model.FitFailed: no model can be fitted.
        lupin_twin.field.engine.FieldRefused: see `readings_of`.
        numpy.linalg.LinAlgError: the readings cannot be computed with.

    """
    readings = readings_of(pasts, at_ns, day_length_s)
    model = fit(readings, day_length_s=day_length_s, should_stop=should_stop)
    posterior = model.posterior(readings, 0.0, should_stop)
    checks = tuple(
        _check(past, change, at_ns)
        for past, change in in_turns(zip(pasts, posterior.changes(), strict=True))
        if change is not None
    )
    loaded = Loaded(at_ns, model, posterior.readings, checks)
    if loaded.changed:
        rest = readings_of(unchanged(pasts, loaded.changed), at_ns, day_length_s)
        # Readings since a change are no good for the model either.
        model = fit(rest, day_length_s=day_length_s, should_stop=should_stop)
        posterior = model.posterior(rest, 0.0, should_stop)
        loaded = Loaded(at_ns, model, rest, checks)
    return loaded, posterior


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


def estimate_at(
    request: EstimateRequest,
    pasts: Sequence[TagPast],
    day_length_s: float,
    should_stop: Callable[[], bool] = never,
) -> Estimate:
    """Make the estimate as of a moment from readings up to then alone, its model included.

    Raises:
        FieldRefused: see `readings_of`; or these readings cannot be computed with.
        lupin_twin.field.idw.Abandoned: `should_stop`, called every few milliseconds, was true.

    """
    try:
        loaded, posterior = load(pasts, request.at_ns, day_length_s, should_stop)
        grid = posterior.grid(**request.box.cells)
    except (FitFailed, np.linalg.LinAlgError) as error:
        raise FieldRefused(f"these readings cannot be computed with: {error}") from error
    return Estimate(grid, len(np.unique(loaded.readings.tag)), len(loaded.readings))


DEFAULT_PLACES: Final = 5
MAX_PLACES: Final = 20


@dataclass(frozen=True, slots=True)
class ReportRequest:
    """Request for a report on a sensor, with `max_places` places for other tags; None: none.

    Places are expensive to find. The ROS service has no way to request none.

    Raises:
        FieldRefused: a value is invalid; the message names the field, the value and the limit.

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
    """How good a sensor's estimates are as of `at_ns`.

    `fitted_at_ns` is when the current model was fitted, None if there is none. `fit_problem` is
    what is wrong with the last fit, empty if nothing is. `tags` are the latest readings with what
    was expected of them, `places` where another tag helps most, the best first.
    """

    at_ns: int
    fitted_at_ns: int | None
    fit_problem: str
    record: Record
    tags: tuple[TagCheck, ...] = ()
    places: tuple[Place, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class LastResult:
    """The last result for a sensor; `failed` counts the models that could not be fitted.

    `loaded` is None if there are too few readings.
    """

    report: Report
    grades: Grades
    loaded: Loaded | None = None
    failed: int = 0


def find(
    before: LastResult | None, pasts: Sequence[TagPast], at_ns: int, day_length_s: float
) -> LastResult:
    """Judge a sensor's estimates as of now; scans since `before` are compared with predictions.

    If the readings cannot be computed with, the earlier result stays, with the reason.
    """
    grades = Grades(day_length_s) if before is None else copy(before.grades)
    nothing = LastResult(
        Report(at_ns, None, "", grades.record(at_ns)), grades, failed=before.failed if before else 0
    )
    if not are_enough(pasts):
        return nothing
    try:
        loaded, posterior = load(pasts, at_ns, day_length_s)
    except (FitFailed, FieldRefused, np.linalg.LinAlgError) as error:
        known = before or nothing
        report = replace(known.report, fit_problem=str(error) or repr(error))
        return replace(known, report=report, failed=known.failed + 1)
    if before is not None and before.loaded is not None:
        grades.add(_graded(loaded, posterior, pasts, before.loaded.at_ns), at_ns)
    report = Report(at_ns, at_ns, "", grades.record(at_ns), loaded.checks)
    return LastResult(report, grades, loaded, nothing.failed)


def _graded(loaded: Loaded, posterior: Posterior, pasts: Sequence[TagPast], since_ns: int) -> Tally:
    """Count the tags' latest scans since then, and how many lay where they were predicted.

    Changed sensors do not count, nor do scans that were received late.
    """
    fresh = [
        row
        for row, past in enumerate(pasts)
        if past.tag_id not in loaded.changed
        and past.readings
        and since_ns < max(past.readings)[0] <= loaded.at_ns
    ]
    if not fresh:
        return Tally()
    held = posterior.left_out(np.array(fresh))
    inside = [abs(measured - mean) <= HALF_WIDTH_SDS * sd for measured, mean, sd in held]
    return Tally(len(inside), sum(inside))


def advice(loaded: Loaded, occupancy: OccupancyMap | None, count: int) -> tuple[Place, ...]:
    """Where other tags help most, over all the free floor; empty if no place is free."""
    tags = loaded.readings.xy
    over = floor(tags, occupancy)
    places = free_of(tags, over)
    if not len(places):
        return ()
    posterior = loaded.model.posterior(loaded.readings, 0.0)
    return tuple(posterior.advice(places, count, over=over))
