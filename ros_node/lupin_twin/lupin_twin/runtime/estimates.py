"""Makes estimates of a sensor from the log up to a moment, and reports how good they are.

Pure functions of the readings that `readings_at` finds, and of the map. A report compares each
tag's latest reading with its prediction from all others, and says how many scans of a week lay
where they were predicted. Metres in the map frame, times ns of ROS time.
"""

from __future__ import annotations

import math
import sqlite3
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from lupin_twin.core.state import FLOAT32_MAX, NANOSECONDS_PER_SECOND, Snapshot
from lupin_twin.estimate.engine import (
    Estimate,
    EstimateRequest,
    TagPast,
    readings_of,
    unchanged,
    within,
)
from lupin_twin.estimate.grading import (
    DAYS_A_WEEK,
    LEAST_READINGS,
    NOT_GRADED,
    Record,
    record_of,
)
from lupin_twin.estimate.kernel import MAX_PER_TAG
from lupin_twin.estimate.model import fit
from lupin_twin.estimate.posterior import Posterior
from lupin_twin.estimate.solution import Change, Place
from lupin_twin.field.engine import FieldRefused, check_sensor_type
from lupin_twin.field.explored import OccupancyMap, floor, free_of
from lupin_twin.field.idw import never
from lupin_twin.journal.fold import state_at
from lupin_twin.journal.queries import newest
from lupin_twin.runtime.workers import in_turns

# Cost of an estimate relative to its grid: it also takes a fit, and a posterior to find changes.
AS_OF: Final = 3.0
# Readings of a day that are read from the log, for all tags together; with few tags, all.
_MAX_READINGS: Final = 20_000
# A greenhouse has a handful of sensors; past this limit, the alphabetically first ones are taken.
MAX_SENSORS: Final = 32


def sensors_of(snapshot: Snapshot) -> list[str]:
    """The sensors that can be estimated, at most `MAX_SENSORS`; 2 ms for 10,000 tags."""
    names = {
        reading.name
        for tag in snapshot.tags
        if tag.pose is not None
        for reading in tag.readings
        if reading.name and math.isfinite(reading.value)
    }
    return sorted(names)[:MAX_SENSORS]


def readings_at(
    log: sqlite3.Connection,
    sensor: str,
    at_ns: int,
    day_length_s: float,
    days: float = 1.0,
) -> list[TagPast]:
    """Read a sensor's readings of days up to a moment; of equal stamps, the last received.

    Answers are in float32, so a reading beyond its range does not count.
    """
    places = {
        tag.tag_id: tag.pose
        for tag in state_at(log, at_ns, "").tags
        if tag.pose is not None and any(reading.name == sensor for reading in tag.readings)
    }
    start_ns = max(1, at_ns - int(days * day_length_s * NANOSECONDS_PER_SECOND))
    each = max(int(days * _MAX_READINGS) // max(len(places), 1), MAX_PER_TAG)
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
    """Whether a day has enough readings to make and judge estimates."""
    return sum(len(past.readings) for past in pasts) >= LEAST_READINGS


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


def load(
    pasts: Sequence[TagPast],
    at_ns: int,
    day_length_s: float,
    should_stop: Callable[[], bool] = never,
) -> tuple[Posterior, tuple[TagCheck, ...]]:
    """Fit a model to a day's readings; returns the posterior, and a check of each tag.

    The posterior is that of the moment `at_ns`, made without readings since a tag's sensor changed.

    Raises:
        lupin_twin.field.idw.Abandoned: `should_stop`, called every few milliseconds, was true.
        lupin_twin.field.engine.FieldRefused: see `readings_of`.
        numpy.linalg.LinAlgError: the readings cannot be computed with.

    """

    def fitted(those: Sequence[TagPast]) -> Posterior:
        readings = readings_of(those, at_ns, day_length_s)
        model = fit(readings, day_length_s=day_length_s, should_stop=should_stop)
        return model.posterior(readings, 0.0, should_stop)

    posterior = fitted(pasts)
    checks = tuple(
        _check(past, change, at_ns)
        for past, change in in_turns(zip(pasts, posterior.changes(), strict=True))
        if change is not None
    )
    # Readings since a change are no good for the model either.
    changed = changed_of(checks)
    return fitted(unchanged(pasts, changed)) if changed else posterior, checks


def changed_of(checks: Sequence[TagCheck]) -> dict[str, int]:
    """The tags whose sensor has changed, and since when."""
    since = ((one.tag_id, one.changed_since_ns) for one in checks)
    return {tag_id: at_ns for tag_id, at_ns in since if at_ns is not None}


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
        posterior, _ = load(pasts, request.at_ns, day_length_s, should_stop)
        grid = posterior.grid(**request.box.cells)
    except np.linalg.LinAlgError as error:
        raise FieldRefused(f"these readings cannot be computed with: {error}") from error
    readings = posterior.readings
    return Estimate(grid, len(np.unique(readings.tag)), len(readings))


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

    `is_fitted` is whether there is a model. `fit_problem` is why there is none although there are
    readings; empty: nothing is wrong. `tags` are the latest readings with what was expected of
    them, `places` where another tag helps most, the best first.
    """

    at_ns: int
    is_fitted: bool = False
    fit_problem: str = ""
    record: Record = NOT_GRADED
    tags: tuple[TagCheck, ...] = ()
    places: tuple[Place, ...] = ()


# A report reads the readings of a week, and of the day before that.
REPORT_DAYS: Final = DAYS_A_WEEK + 1
# Rough worst-case cost of a report, s of one core: what is graded is the same for an hour.
REPORT_S: Final = 2.0


def report_of(
    request: ReportRequest,
    pasts: Sequence[TagPast],
    at_ns: int,
    day_length_s: float,
    *,
    occupancy: OccupancyMap | None = None,
    should_stop: Callable[[], bool] = never,
) -> Report:
    """Report on a sensor's estimates as of a moment, from the readings of `REPORT_DAYS`.

    Readings since a sensor has changed are not graded.

    Raises:
        lupin_twin.field.idw.Abandoned: `should_stop`, called every now and then, was true.

    """
    today = within(pasts, at_ns - int(day_length_s * NANOSECONDS_PER_SECOND), at_ns)
    if not are_enough(today):
        return Report(at_ns, record=record_of(pasts, at_ns, day_length_s, should_stop))
    try:
        posterior, checks = load(today, at_ns, day_length_s, should_stop)
    except (FieldRefused, np.linalg.LinAlgError) as error:
        record = record_of(pasts, at_ns, day_length_s, should_stop)
        return Report(at_ns, fit_problem=str(error) or repr(error), record=record)
    record = record_of(unchanged(pasts, changed_of(checks)), at_ns, day_length_s, should_stop)
    count = request.max_places
    places = () if count is None else advice(posterior, occupancy, count)
    return Report(at_ns, True, "", record, checks, places)


def advice(posterior: Posterior, occupancy: OccupancyMap | None, count: int) -> tuple[Place, ...]:
    """Where other tags help most, over all the free floor; empty if no place is free."""
    tags = posterior.readings.xy
    over = floor(tags, occupancy)
    places = free_of(tags, over)
    return tuple(posterior.advice(places, count, over=over)) if len(places) else ()
