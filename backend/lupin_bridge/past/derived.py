"""The past of a derived quantity, made of its parts reading by reading. Pure.

A bucket is of such readings too: a mean of what is derived does not follow from means of its parts.
A quantity of a day is made of buckets too, of an hour at most.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Final

from lupin_bridge.judge.quantities import DAILY, DAY_NS, DERIVED, Daily, Derived, IsDay, Sensors
from lupin_twin.core.past import (
    HOUR_NS,
    MAX_POINTS,
    MAX_READINGS,
    PastRefused,
    SeriesPast,
    SeriesRequest,
    grid,
    seconds,
)
from lupin_twin.core.state import NANOSECONDS_PER_SECOND, Reading, TagState
from lupin_twin.journal.buckets import Buckets, individually

# From when to when, ns.
Period = tuple[int, int]
# Buckets of a day are of a minute at least.
_POINTS_A_DAY: Final = DAY_NS // (60 * NANOSECONDS_PER_SECOND)
# (ns of ROS time, value), oldest first.
Readings = list[tuple[int, float]]
# Looks a series up.
Find = Callable[[SeriesRequest], SeriesPast]


def series(request: SeriesRequest, sensors: Sensors, is_day: IsDay, find: Find) -> SeriesPast:
    """The series of a request; a derived one, unless a sensor has its name, of its parts.

    Raises:
        PastRefused: more readings of the parts than one request may have, or too long a period.

    """
    measured = find(request)
    derived, daily = DERIVED.get(request.sensor_type), DAILY.get(request.sensor_type)
    if measured.stamps_ns:
        return measured
    # Now is the same for all parts.
    request = replace(request, end_ns=measured.end_ns)
    if derived is not None:
        read = partial(_readings, derived, find)
    elif daily is not None:
        read = partial(_of_days, daily, sensors, is_day, find)
    else:
        return measured
    period, readings = read(request)
    if len(readings) <= request.max_points:
        return individually(readings, *period)
    wide = grid(*period, request.max_points)
    _, readings = read(replace(request, start_ns=wide.start_ns, end_ns=wide.end_ns))
    buckets = Buckets(wide)
    for stamp_ns, value in readings:
        buckets.add_value(stamp_ns, value)
    return buckets.past()


def with_daily(
    tags: Sequence[TagState],
    daily: Daily,
    at_ns: int,
    *,
    sensors: Sensors,
    is_day: IsDay,
    find: Find,
) -> list[TagState]:
    """The tags as of a moment, those of which it is known with a reading of the quantity too."""
    found = []
    for tag in tags:
        names = {reading.name for reading in tag.readings}
        if daily.sensor not in names or daily.name in names:
            found.append(tag)
            continue
        start_ns = max(1, at_ns - DAY_NS)
        part_request = SeriesRequest(tag.tag_id, daily.sensor, start_ns, at_ns + 1, _POINTS_A_DAY)
        part = find(part_request)
        value = daily.at(at_ns, _readings_of(daily, sensors, part, at_ns), is_day)
        if math.isfinite(value):
            readings = (*tag.readings, Reading(daily.name, value, at_ns))
            tag = replace(tag, readings=readings)  # noqa: PLW2901
        found.append(tag)
    return found


def _of_days(
    daily: Daily, sensors: Sensors, is_day: IsDay, find: Find, request: SeriesRequest
) -> tuple[Period, Readings]:
    """The period, and a value at the last reading of each hour in it."""
    first_ns = max(1, request.start_ns - DAY_NS) if request.start_ns else 0
    part_request = replace(
        request, sensor_type=daily.sensor, start_ns=first_ns, max_points=MAX_POINTS
    )
    part = find(part_request)
    start_ns = request.start_ns or part.start_ns
    every = _readings_of(daily, sensors, part, request.end_ns)
    last = {at_ns // HOUR_NS: at_ns for at_ns, _ in every if at_ns >= start_ns}
    readings = []
    for at_ns in last.values():
        value = daily.at(at_ns, every, is_day)
        if math.isfinite(value):
            readings.append((at_ns, value))
    return (start_ns, part.end_ns), readings


def _readings_of(daily: Daily, sensors: Sensors, part: SeriesPast, until_ns: int) -> Readings:
    """The readings of a series that count, of one stamp the last.

    A bucket that has ended counts as its minimum and maximum at its start, and its mean throughout.
    """
    is_plausible = sensors.named(daily.sensor).is_plausible
    if part.bucket_ns is None:
        latest = dict(zip(part.stamps_ns, part.means, strict=True))
        return [(at_ns, value) for at_ns, value in latest.items() if is_plausible(value)]
    if part.bucket_ns > HOUR_NS:
        raise PastRefused(
            f"{daily.name} is made of {daily.sensor} by the hour or shorter, and from"
            f" {seconds(part.start_ns)} s to {seconds(part.end_ns)} s there are more than"
            f" {MAX_POINTS} hours, the limit: ask for a shorter period"
        )
    readings = []
    for at_ns, low, high, mean in zip(
        part.stamps_ns, part.minima, part.maxima, part.means, strict=True
    ):
        last_ns = at_ns + part.bucket_ns - 1
        if last_ns <= until_ns and is_plausible(low) and is_plausible(high):
            readings += [(at_ns, low), (at_ns, high), (at_ns, mean), (last_ns, mean)]
    return readings


def _readings(derived: Derived, find: Find, request: SeriesRequest) -> tuple[Period, Readings]:
    """The period, and what can be derived in it: of readings of one moment, one scan."""
    parts: list[SeriesPast] = []
    for name in derived.sources:
        part = find(replace(request, sensor_type=name, max_points=MAX_READINGS))
        if part.is_bucketed:
            raise PastRefused(
                f"{derived.name} is derived of {' and '.join(derived.sources)}, reading by reading:"
                f" from {seconds(part.start_ns)} s to {seconds(part.end_ns)} s {name} has more than"
                f" {MAX_READINGS} of them, the limit, or hours alone: ask for a shorter period"
            )
        parts.append(part)
    first, second = parts
    # Of equal stamps, what was received last.
    ones = dict(zip(first.stamps_ns, first.means, strict=True))
    others = dict(zip(second.stamps_ns, second.means, strict=True))
    readings = [
        (stamp_ns, value)
        for stamp_ns, one in ones.items()
        if stamp_ns in others and math.isfinite(value := derived.formula(one, others[stamp_ns]))
    ]
    return (min(first.start_ns, second.start_ns), first.end_ns), readings
