"""The sensors: their names, colours and ranges; and quantities derived from readings. Pure.

Derived from one scan. Saturation vapour pressure: Tetens in the form of FAO Irrigation and Drainage
Paper 56 (Allen et al., 1998), equation 11: es = 0.6108 exp(17.27 T / (T + 237.3)) kPa, T in °C.
Deficit: equations 19 and 26, for one place and moment. Dew point: equation 11 solved for T.

Derived from one sensor's readings of 24 hours. Between two readings at most `MAX_GAP_NS` apart,
values are interpolated linearly; over longer gaps, nothing is known. If less than `LEAST_COVERED`
of the 24 hours is known, there is no value (NaN).

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
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import ROUND_HALF_UP, Decimal
from functools import cached_property
from math import ceil, log10
from operator import itemgetter
from typing import Annotated, Any, Final, Literal, NamedTuple

from annotated_types import Interval, MaxLen, MinLen

from lupin_twin.core.past import DAY_NS, HOUR_NS

_A: Final = 17.27
_B_C: Final = 237.3
_E0_KPA: Final = 0.6108
# The formula is not valid beyond these limits, and no greenhouse is beyond them.
_COLDEST_C, _HOTTEST_C = -40.0, 80.0
# A sensor in saturated air reads up to this, which counts as 100 %.
_SATURATED_PERCENT: Final = 105.0


def saturation_kpa(temperature_c: float) -> float:
    """Vapour pressure (kPa) of saturated air at a temperature (°C)."""
    return _E0_KPA * math.exp(_A * temperature_c / (temperature_c + _B_C))


def vapour_pressure_deficit_kpa(temperature_c: float, humidity_percent: float) -> float:
    """Vapour pressure deficit, kPa; NaN for impossible air (humidity outside 0 to 105 %)."""
    if not _is_air(temperature_c, humidity_percent):
        return math.nan
    return saturation_kpa(temperature_c) * (1.0 - min(humidity_percent, 100.0) / 100.0)


def dew_point_c(temperature_c: float, humidity_percent: float) -> float:
    """The temperature (°C) at which dew forms; NaN for impossible air, and for dry air."""
    share = min(humidity_percent, 100.0) / 100.0
    # Test the share, not the percentage: the smallest positive percentage gives a share of 0.
    if not _is_air(temperature_c, humidity_percent) or share == 0.0:
        return math.nan
    over = math.log(share) + _A * temperature_c / (temperature_c + _B_C)
    return _B_C * over / (_A - over)


def _is_air(temperature_c: float, humidity_percent: float) -> bool:
    is_humid = 0.0 <= humidity_percent <= _SATURATED_PERCENT
    return _COLDEST_C <= temperature_c <= _HOTTEST_C and is_humid


@dataclass(frozen=True, slots=True)
class Derived:
    """One derived quantity; its `sources` are in the order of `formula`'s arguments."""

    name: str
    sources: tuple[str, str]
    formula: Callable[[float, float], float]


def condensation_margin_k(temperature_c: float, humidity_percent: float) -> float:
    """By how much air may cool (K) before dew forms; NaN for impossible air, and for dry air.

    On a surface that is colder than the air by more than this, water condenses.
    """
    return temperature_c - dew_point_c(temperature_c, humidity_percent)


DERIVED: Final[Mapping[str, Derived]] = {
    name: Derived(name, ("temperature", "humidity"), formula)
    for name, formula in (
        ("vpd", vapour_pressure_deficit_kpa),
        ("dew_point", dew_point_c),
        ("condensation_margin", condensation_margin_k),
    )
}


MAX_GAP_NS: Final = 3 * HOUR_NS
LEAST_COVERED: Final = 0.9
LX_PER_UMOL: Final = 54.0
BASE_C: Final = 10.0

# (ns of ROS time, value) of a sensor, oldest first, finite.
Readings = Sequence[tuple[int, float]]
# Whether it is day at a moment of ROS time, ns.
IsDay = Callable[[int], bool]
# Length of the pieces into which the line from a reading by day to one by night is cut.
_PIECE_NS: Final = 600 * 1_000_000_000


@dataclass(slots=True)
class Course:
    """Integrals and extremes of a sensor's readings, added one by one in the order of time.

    `lengths` are ns, `sums` the sensor's unit times ns; each is a pair: by night, by day.
    """

    last_ns: int
    last: float
    is_day: bool
    low: float
    high: float
    night_low: float
    lengths: tuple[int, int] = (0, 0)
    sums: tuple[float, float] = (0.0, 0.0)

    @classmethod
    def begin(cls, at_ns: int, value: float, *, is_day: bool) -> Course:
        """The course of one reading."""
        return cls(at_ns, value, is_day, value, value, math.inf if is_day else value)

    def after(self, at_ns: int, value: float, is_day: IsDay) -> Course:
        """The course with one more reading."""
        gap_ns, now = at_ns - self.last_ns, is_day(at_ns)
        lengths, sums = [*self.lengths], [*self.sums]
        # Between two readings by day it was day; between day and night the line is cut into pieces.
        count = 1 if now is self.is_day else -(-gap_ns // _PIECE_NS)
        for index in range(count if 0 < gap_ns <= MAX_GAP_NS else 0):
            from_ns, to_ns = (gap_ns * (index + more) // count for more in (0, 1))
            middle = (from_ns + to_ns) // 2
            by_day = now if count == 1 else is_day(self.last_ns + middle)
            lengths[by_day] += to_ns - from_ns
            sums[by_day] += (self.last + (value - self.last) * middle / gap_ns) * (to_ns - from_ns)
        return Course(
            at_ns,
            value,
            now,
            min(self.low, value),
            max(self.high, value),
            self.night_low if now else min(self.night_low, value),
            (lengths[0], lengths[1]),
            (sums[0], sums[1]),
        )

    def mean(self, *of_day: bool) -> float:
        """The mean over time by night (False), by day (True), or both; NaN: nothing is known."""
        length_ns = sum(self.lengths[by_day] for by_day in of_day)
        return sum(self.sums[by_day] for by_day in of_day) / length_ns if length_ns else math.nan


@dataclass(frozen=True, slots=True)
class Daily:
    """One daily quantity: its sensor, its unit and its formula."""

    name: str
    sensor: str
    unit: str
    formula: Callable[[Course], float]

    def of(self, course: Course) -> float:
        """Its value over a course; NaN: too little of a day is known."""
        return self.formula(course) if sum(course.lengths) >= LEAST_COVERED * DAY_NS else math.nan

    def at(self, at_ns: int, readings: Readings, is_day: IsDay) -> float:
        """Its value at a moment, from the readings of the 24 hours before; NaN: not known."""
        first = bisect_left(readings, at_ns - DAY_NS, key=itemgetter(0))
        recent = readings[first : bisect_right(readings, at_ns, key=itemgetter(0))]
        if not recent:
            return math.nan
        course = Course.begin(*recent[0], is_day=is_day(recent[0][0]))
        for stamp_ns, value in recent[1:]:
            course = course.after(stamp_ns, value, is_day)
        return self.of(course)


def _daily_light_integral(course: Course) -> float:
    return sum(course.sums) / 1e9 / LX_PER_UMOL / 1e6


def _night_minimum(course: Course) -> float:
    return course.night_low if course.night_low < math.inf else math.nan


DAILY: Final[Mapping[str, Daily]] = {
    each.name: each
    for each in (
        Daily("daily_light_integral", "light", "mol/m²/d", _daily_light_integral),
        Daily("temperature_24h_mean", "temperature", "°C", lambda it: it.mean(False, True)),
        Daily("temperature_night_minimum", "temperature", "°C", _night_minimum),
        Daily(
            "day_night_difference", "temperature", "K", lambda it: it.mean(True) - it.mean(False)
        ),
        Daily(
            "growing_degree_days",
            "temperature",
            "°C·d",
            lambda it: max(0.0, (it.high + it.low) / 2.0 - BASE_C),
        ),
        Daily("co2_dose", "co2", "ppm·h", lambda it: it.sums[True] / HOUR_NS),
    )
}


# --- sensors --------------------------------------------------------------------------------------


# What pydantic accepts in a file: limits in the sensor's unit, shares in percent, short texts.
Limit = Annotated[float, Interval(ge=-1e9, le=1e9)]
Share = Annotated[float, Interval(ge=0, le=100)]
Name = Annotated[str, MaxLen(64)]
# The page's languages other than English, whose text is `label`.
Language = Literal["de", "es", "nl"]


class Span(NamedTuple):
    """From `low` to `high`, both included, in the sensor's unit."""

    low: Limit
    high: Limit

    @classmethod
    def __get_pydantic_core_schema__(cls, _: Any, handler: Callable[[Any], Any]) -> Any:
        """In a file it is a list: pydantic would take an object too, and texts for numbers."""
        from pydantic import AfterValidator  # noqa: PLC0415  # only for a file that is read

        return handler(Annotated[tuple[Limit, Limit], AfterValidator(cls._make)])

    @property
    def width(self) -> float:
        """How wide it is, in the sensor's unit; more than 0."""
        return self.high - self.low


@dataclass(frozen=True, slots=True)
class Ranges:
    """The ranges of a sensor: `ideal`, and the wider `critical`; values outside that are critical.

    `critical` None: no value is critical. `ideal` None: no value is judged.
    """

    ideal: Span | None
    critical: Span | None = None

    def __post_init__(self) -> None:
        """Refuse impossible ranges."""
        for name in ("ideal", "critical", "plausible"):
            span = getattr(self, name, None)
            if span is not None and not span.low < span.high:
                raise ValueError(f"{name} is {[*span]}, and low must be less than high")
        if self.critical is not None:
            if self.ideal is None:
                raise ValueError("critical is given, but no ideal range")
            if not self.critical.low <= self.ideal.low <= self.ideal.high <= self.critical.high:
                raise ValueError(f"critical is {[*self.critical]}, inside ideal {[*self.ideal]}")


@dataclass(frozen=True, slots=True)
class DayAndNight(Ranges):
    """The ranges of the day, and those of the night; None: those of the day."""

    night: Ranges | None = None

    def by(self, *, is_day: bool) -> Ranges:
        """The ranges of day or night."""
        return self if is_day or self.night is None else self.night


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensor(DayAndNight):
    """One sensor as the file has it. Hue in degrees, lightness in percent (HSL).

    `unit` is empty where not known. A working sensor never reads a value outside `plausible`, so
    such a value is not a reading; None: any value may be one. `source` is that of these numbers.
    `derived` names the sensors that it is computed from. `name` is that of its entry, and
    `species` has lower-case names, once `sensors_file` has read them.
    """

    name: Annotated[str, MaxLen(0)] = ""
    label: Name
    unit: Name
    hue: Annotated[float, Interval(ge=0, le=360)]
    lightness: Share
    labels: dict[Language, Annotated[Name, MinLen(1)]] = field(default_factory=dict)
    derived: tuple[Name, ...] = ()
    plausible: Span | None = None
    source: str = ""
    species: dict[str, DayAndNight] = field(default_factory=dict)

    def is_plausible(self, value: float) -> bool:
        """Whether a working sensor can read this: a finite number within `plausible`."""
        span = self.plausible
        is_finite = value - value == 0.0
        return is_finite and (span is None or span.low <= value <= span.high)

    @property
    def ideals(self) -> tuple[Span, ...]:
        """All ideal ranges, of day, night and species."""
        every = (self, *self.species.values())
        ranges = (it.by(is_day=is_day) for it in every for is_day in (True, False))
        return tuple(each.ideal for each in ranges if each.ideal is not None)

    def ranges(self, *, is_day: bool, species: str = "") -> Ranges:
        """The ranges at a tag with this species; for an unknown one, the general ranges."""
        return self.species.get(species.lower(), self).by(is_day=is_day)


@dataclass(frozen=True)
class Sensors:
    """All sensors of a file; `text` is the file itself, which the bridge also serves.

    `areas` are bays, rows or zones, with the ids of their tags; `A*`: a prefix.
    """

    by_name: Mapping[str, Sensor]
    fallback: Sensor
    saturation: float
    max_alpha: float
    text: str
    areas: Mapping[str, Sequence[str]]

    def area_of(self, tag_id: str) -> str:
        """The area that names a tag, as on the page; empty: none."""
        begins = (f"{tag_id[:end]}*" for end in range(len(tag_id) + 1))
        found = (
            area for name in (tag_id, *begins) for area, tags in self.areas.items() if name in tags
        )
        return next(found, "")

    def named(self, name: str) -> Sensor:
        """A sensor by name; one that is not in the file looks like `fallback`, without ranges."""
        known = self.by_name.get(name)
        if known is not None:
            return known
        other = self.fallback
        no_ranges: dict[str, Any] = {"ideal": None, "critical": None, "night": None, "species": {}}
        return replace(
            other, name=name, label=other.label or name, labels={}, plausible=None, **no_ranges
        )

    def text_of(self, name: str, value: float) -> str:
        """A value as the page writes it in English, without its unit; empty: it is not finite.

        Half is rounded away from zero, as browsers do. From 1,000 on, there are no decimals.
        """
        size = abs(value)
        if not size < 1e6:
            return f"{value:.2e}".replace("e+0", "e+") if math.isfinite(value) else ""
        whole, digits = Decimal(1), self._digits(name)
        if digits is None:
            # About two digits.
            digits = 0 if size >= 100 else 1 if size >= 1 or not size else 1 + ceil(-log10(size))
        found = Decimal(value).quantize(whole.scaleb(-min(6, digits)), ROUND_HALF_UP)
        if abs(found) >= 1000:
            found = Decimal(value).quantize(whole, ROUND_HALF_UP)
        return f"{found or abs(found):,f}"

    def _digits(self, name: str) -> int | None:
        """Decimal places of a sensor's values; None: they depend on the value's size.

        The largest ideal limit, of the sensor or else of its sources, gets about three digits.
        """
        sources: tuple[str, ...] = DERIVED[name].sources if name in DERIVED else ()
        if name in DAILY:
            sources = (DAILY[name].sensor,)
        for names in ((name,), sources):
            ideals = (span for each in names for span in self.named(each).ideals)
            most = max((abs(end) for span in ideals for end in (span.low, span.high)), default=0)
            if most > 0:
                return max(0, min(6, 3 - ceil(log10(most))))
        return None

    @cached_property
    def judged_by_the_day(self) -> Mapping[str, tuple[str, ...]]:
        """By sensor, the daily quantities that are derived from it and have an ideal range."""
        found: dict[str, tuple[str, ...]] = {}
        for daily in DAILY.values():
            if self.named(daily.name).ideals:
                found[daily.sensor] = (*found.get(daily.sensor, ()), daily.name)
        return found
