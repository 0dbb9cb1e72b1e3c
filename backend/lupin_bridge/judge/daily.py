"""Quantities of a day that growers steer by, each of one sensor's readings of 24 hours. Pure.

A value at a moment is of the 24 hours up to it. Between two readings that are no farther apart than
`MAX_GAP_NS` the course is a straight line; farther apart, nothing is known of the time between. Of
less than `LEAST_COVERED` of the hours that count, there is no value (NaN).

- Daily light integral, mol/m²/d: the sum of the photons of 400 to 700 nm. In sunlight 54 lx are
  1 umol/m²/s (Thimijan and Heins, HortScience 18, 1983, 818-822); lamps have other factors.
- Mean temperature of 24 hours, °C, and the least of the night: Heuvelink (ed.), Tomatoes, 2nd
  edition, 2018, on temperature integration.
- Day-night difference (DIF), K: mean by day less mean by night. Erwin, Heins and Karlsson, American
  Journal of Botany 76, 1989, 47-52.
- Growing degree days, °C·d, above 10 °C: (highest + lowest) / 2 - base, never below 0. McMaster and
  Wilhelm, Agricultural and Forest Meteorology 87, 1997, 291-300, method 1.
- CO2 dose, ppm·h: the sum of the concentration over the hours of day, in which plants take it up.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

DAY_NS: Final = 86_400 * 1_000_000_000
MAX_GAP_NS: Final = 3 * 3600 * 1_000_000_000
LEAST_COVERED: Final = 0.8
LX_PER_UMOL: Final = 54.0
BASE_C: Final = 10.0

# (ns of ROS time, value) of a sensor, oldest first, finite.
Readings = Sequence[tuple[int, float]]
# Whether it is day at a moment of ROS time, ns.
IsDay = Callable[[int], bool]
_HOUR_NS: Final = 3600 * 1_000_000_000
# So long are the pieces that a straight line is cut to: of each it is day, or night.
_PIECE_NS: Final = 600 * 1_000_000_000


@dataclass(frozen=True, slots=True)
class Daily:
    """One quantity: what it is made of, its unit, and how."""

    name: str
    sensor: str
    unit: str
    formula: Callable[[_Course], float]

    def at(self, at_ns: int, readings: Readings, is_day: IsDay) -> float:
        """Its value at a moment, of the readings of the 24 hours up to then; NaN: not known."""
        recent = [each for each in readings if at_ns - DAY_NS <= each[0] <= at_ns]
        return self.formula(_Course(recent, is_day))


class _Course:
    """The course of a sensor over a day: pieces of (length ns, mean value, whether it was day)."""

    def __init__(self, readings: Readings, is_day: IsDay) -> None:
        self.readings, self.is_day = readings, is_day
        self._pieces: list[tuple[int, float, bool]] = []
        for (start_ns, first), (end_ns, last) in pairwise(readings):
            gap_ns = end_ns - start_ns
            if not 0 < gap_ns <= MAX_GAP_NS:
                continue
            count = -(-gap_ns // _PIECE_NS)
            for index in range(count):
                from_ns, to_ns = (gap_ns * (index + more) // count for more in (0, 1))
                middle = (from_ns + to_ns) / 2
                value = first + (last - first) * middle / gap_ns
                self._pieces.append((to_ns - from_ns, value, is_day(start_ns + int(middle))))

    def is_covered(self) -> bool:
        """Whether enough of the 24 hours is known."""
        return sum(length for length, *_ in self._pieces) >= LEAST_COVERED * DAY_NS

    def total(self, of_day: bool | None = None) -> float:
        """The sum of value times hours; of day or night alone, where asked."""
        return math.fsum(v * n for n, v, day in self._pieces if of_day in (None, day)) / _HOUR_NS

    def mean(self, of_day: bool | None = None) -> float:
        """The mean over time; NaN where there was none."""
        hours = sum(n for n, _, day in self._pieces if of_day in (None, day)) / _HOUR_NS
        return self.total(of_day) / hours if hours else math.nan


def _daily_light_integral(course: _Course) -> float:
    return course.total() * 3600.0 / LX_PER_UMOL / 1e6 if course.is_covered() else math.nan


def _mean_24h(course: _Course) -> float:
    return course.mean() if course.is_covered() else math.nan


def _night_minimum(course: _Course) -> float:
    if not course.is_covered():
        return math.nan
    night = (value for at_ns, value in course.readings if not course.is_day(at_ns))
    return min(night, default=math.nan)


def _day_night_difference(course: _Course) -> float:
    return course.mean(of_day=True) - course.mean(of_day=False) if course.is_covered() else math.nan


def _growing_degree_days(course: _Course) -> float:
    if not course.is_covered():
        return math.nan
    values = [value for _, value in course.readings]
    return max(0.0, (max(values) + min(values)) / 2.0 - BASE_C)


def _co2_dose(course: _Course) -> float:
    return course.total(of_day=True) if course.is_covered() else math.nan


DAILY: Final[Mapping[str, Daily]] = {
    each.name: each
    for each in (
        Daily("daily_light_integral", "light", "mol/m²/d", _daily_light_integral),
        Daily("temperature_24h_mean", "temperature", "°C", _mean_24h),
        Daily("temperature_night_minimum", "temperature", "°C", _night_minimum),
        Daily("day_night_difference", "temperature", "K", _day_night_difference),
        Daily("growing_degree_days", "temperature", "°C·d", _growing_degree_days),
        Daily("co2_dose", "co2", "ppm·h", _co2_dose),
    )
}
