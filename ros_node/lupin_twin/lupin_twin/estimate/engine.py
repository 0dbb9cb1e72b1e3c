"""GetEstimate without ROS: which readings count, and what an answer is.

Pure. Metres in the map frame, times ns of ROS time.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from lupin_twin.core.state import NANOSECONDS_PER_SECOND
from lupin_twin.estimate.kernel import MAX_PER_TAG, Readings
from lupin_twin.estimate.posterior import EstimateGrid
from lupin_twin.estimate.solution import MAX_EXACT, PER_TAG
from lupin_twin.field.engine import FieldRefused, FieldRequest, check_request

MAX_TAGS: Final = 10_000
# An estimate of now is made for the last whole minute, or for the latest reading if that is later.
MINUTES_A_DAY: Final = 1_440
# Rough worst-case cost of an answer, s of one core: for each cell, and for each pair of readings
# or, with many tags, for each tag.
_PAIR_S: Final = 0.3e-6
_TAG_S: Final = 500e-6
_CELL_S: Final = 0.1e-6


@dataclass(frozen=True, slots=True)
class EstimateRequest:
    """A sensor over a box, as in GetField, as of a moment; `at_ns` 0 is now."""

    box: FieldRequest
    at_ns: int = 0


@dataclass(frozen=True, slots=True)
class TagPast:
    """A tag's position, and its readings of one sensor: (ns, value), in any order."""

    tag_id: str
    x: float
    y: float
    readings: tuple[tuple[int, float], ...]


@dataclass(frozen=True, slots=True)
class Estimate:
    """An answer: the grid, and how many tags and readings it was made from."""

    grid: EstimateGrid
    sample_count: int
    reading_count: int


def moment_of(tags: Sequence[TagPast], now_ns: int, day_length_s: float) -> int:
    """The moment for which an estimate of now is made, not later than `now_ns`.

    Rounding to a minute changes nothing visible, and for a whole minute the same readings give the
    same estimate, to the last bit.
    """
    minute_ns = int(day_length_s / MINUTES_A_DAY * NANOSECONDS_PER_SECOND)
    stamps_ns = (ns for tag in tags for ns, _ in tag.readings if ns <= now_ns)
    return max(now_ns - now_ns % minute_ns, max(stamps_ns, default=0))


def all_readings(tags: Sequence[TagPast], at_ns: int) -> Readings:
    """All readings, their times s from `at_ns` on; tag numbers are indices of `tags`."""
    return Readings(
        np.array([(ns - at_ns) / NANOSECONDS_PER_SECOND for tag in tags for ns, _ in tag.readings]),
        np.array([index for index, tag in enumerate(tags) for _ in tag.readings], dtype=np.int64),
        np.array([value for tag in tags for _, value in tag.readings]),
        np.array([(tag.x, tag.y) for tag in tags]).reshape(-1, 2),
    )


def readings_of(tags: Sequence[TagPast], at_ns: int, day_length_s: float) -> Readings:
    """Select the readings that count as of `at_ns`: those of a day, see `thinned`.

    Raises:
        FieldRefused: there is no reading within a day, or there are too many tags.

    """
    those = thinned(all_readings(tags, at_ns), 0.0, day_length_s)
    present = len(np.unique(those.tag))
    if present > MAX_TAGS:
        raise FieldRefused(
            f"{present} tags have this sensor, an estimate is made of {MAX_TAGS} at most"
        )
    if not present:
        raise FieldRefused(
            f"no tag has a reading of this sensor_type in the {day_length_s:g} s before that moment"
        )
    return those


def thinned(readings: Readings, at_s: float, day_length_s: float) -> Readings:
    """Select a day's readings: as many of each tag as can be solved at once, or a few of each."""
    age_s = at_s - readings.time_s
    tags = len(np.unique(readings.tag[(age_s >= 0.0) & (age_s <= day_length_s)]))
    per_tag = max(MAX_EXACT // max(tags, 1), PER_TAG)
    return readings.recent(at_s, day_length_s=day_length_s, per_tag=min(per_tag, MAX_PER_TAG))


def within(tags: Sequence[TagPast], after_ns: int, until_ns: int) -> tuple[TagPast, ...]:
    """The tags that have readings after one moment up to another, with only these."""
    found = (
        replace(tag, readings=tuple(one for one in tag.readings if after_ns < one[0] <= until_ns))
        for tag in tags
    )
    return tuple(tag for tag in found if tag.readings)


def unchanged(tags: Sequence[TagPast], changed: Mapping[str, int]) -> list[TagPast]:
    """The tags without their readings since the sensor changed (tag id → ns)."""
    return [
        replace(
            tag,
            readings=tuple(
                one for one in tag.readings if one[0] < changed.get(tag.tag_id, math.inf)
            ),
        )
        for tag in tags
    ]


def cost_s(request: EstimateRequest, tags: int, max_grid_cells: int) -> float:
    """Approximate cost of an estimate from `tags` tags, s of one core."""
    width, height = check_request(request.box, max_grid_cells)
    readings = min(MAX_EXACT, MAX_PER_TAG * tags)
    is_exact = tags * PER_TAG <= MAX_EXACT
    return (readings**2 * _PAIR_S if is_exact else tags * _TAG_S) + width * height * _CELL_S
