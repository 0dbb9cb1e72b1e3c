"""The past of a quantity that nobody measured: of what it is made of, reading by reading. Pure.

A bucket is of such readings too: of means, no mean of what is derived can be made.
"""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import replace
from statistics import fmean
from typing import Any

from lupin_bridge.judge.derived import DERIVED, Derived
from lupin_twin.past import MAX_POINTS, PastRefused, SeriesPast, SeriesRequest, grid, seconds

# (ns of ROS time, value), oldest first.
Readings = list[tuple[int, float]]


def series(request: SeriesRequest) -> Generator[SeriesRequest, Any, SeriesPast]:
    """The series that is asked for; a derived one, unless a sensor has its name, of its parts.

    Raises:
        PastRefused: more readings of the parts than can be asked for at once.

    """
    measured: SeriesPast = yield request
    derived = DERIVED.get(request.sensor_type)
    if derived is None or measured.stamps_ns:
        return measured
    period, readings = yield from _readings(derived, request)
    if len(readings) > request.max_points:
        told = grid(period.start_ns, period.end_ns, request.max_points)
        wider = replace(request, start_ns=told.start_ns, end_ns=told.end_ns)
        _, readings = yield from _readings(derived, wider)
        buckets: dict[int, list[float]] = {}
        for stamp_ns, value in readings:
            buckets.setdefault((stamp_ns - told.start_ns) // told.bucket_ns, []).append(value)
        return SeriesPast(
            told.start_ns,
            told.end_ns,
            told.bucket_ns,
            tuple(told.start_ns + number * told.bucket_ns for number in buckets),
            tuple(map(len, buckets.values())),
            tuple(map(fmean, buckets.values())),
            tuple(map(min, buckets.values())),
            tuple(map(max, buckets.values())),
        )
    stamps = tuple(stamp_ns for stamp_ns, _ in readings)
    values = tuple(value for _, value in readings)
    ones = (1,) * len(readings)
    return replace(
        period, stamps_ns=stamps, counts=ones, means=values, minima=values, maxima=values
    )


def _readings(
    derived: Derived, request: SeriesRequest
) -> Generator[SeriesRequest, Any, tuple[SeriesPast, Readings]]:
    """The period, empty, and what can be derived in it: of readings of one moment, one scan."""
    asked = replace(request, max_points=MAX_POINTS)
    parts: list[SeriesPast] = []
    for name in derived.sources:
        part: SeriesPast = yield replace(asked, sensor_type=name)
        if part.is_bucketed:
            raise PastRefused(
                f"{derived.name} is derived of {' and '.join(derived.sources)}, reading by reading:"
                f" from {seconds(part.start_ns)} s to {seconds(part.end_ns)} s {name} has more than"
                f" {MAX_POINTS} of them, the limit, or hours alone: ask for a shorter period"
            )
        parts.append(part)
        asked = replace(asked, end_ns=part.end_ns)  # now is the same for both
    first, second = parts
    others = dict(zip(second.stamps_ns, second.means, strict=True))
    readings = [
        (stamp_ns, value)
        for stamp_ns, one in zip(first.stamps_ns, first.means, strict=True)
        if stamp_ns in others and math.isfinite(value := derived.formula(one, others[stamp_ns]))
    ]
    return SeriesPast(min(first.start_ns, second.start_ns), first.end_ns), readings
