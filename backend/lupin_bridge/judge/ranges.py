"""The sensors: what each is called, how it is drawn, and which values are good for plants. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from math import ceil, log10

from lupin_bridge.judge.derived import DAILY, DERIVED


@dataclass(frozen=True, slots=True)
class Span:
    """From `low` to `high`, both included, in the sensor's unit."""

    low: float
    high: float

    @property
    def width(self) -> float:
        """How wide it is, in the sensor's unit; more than 0."""
        return self.high - self.low


@dataclass(frozen=True, slots=True)
class Ranges:
    """What a sensor should read: ideal, and critical outside the wider `critical`.

    None: outside of it nothing is wrong. Without `ideal` nothing is judged.
    """

    ideal: Span | None = None
    critical: Span | None = None


@dataclass(frozen=True, slots=True)
class Sensor:
    """One sensor. Hue in degrees, lightness in percent (HSL); `unit` is empty where not known.

    What lies outside `plausible` no sensor reads that works: it is no reading; None: anything may
    be.
    """

    name: str
    label: str
    unit: str
    hue: float
    lightness: float
    day: Ranges = Ranges()
    night: Ranges = Ranges()
    species: Mapping[str, tuple[Ranges, Ranges]] = field(default_factory=dict)
    plausible: Span | None = None

    def is_plausible(self, value: float) -> bool:
        """Whether a sensor that works can read this: a finite number within `plausible`."""
        span = self.plausible
        is_finite = value - value == 0.0
        return is_finite and (span is None or span.low <= value <= span.high)

    @property
    def ideals(self) -> tuple[Span, ...]:
        """All ideal ranges, of day, night and species."""
        ranges = (self.day, self.night, *(one for both in self.species.values() for one in both))
        return tuple(each.ideal for each in ranges if each.ideal is not None)

    def ranges(self, *, is_day: bool, species: str = "") -> Ranges:
        """What holds at a tag with such plants; of an unknown species, what holds for all."""
        day, night = self.species.get(species.lower(), (self.day, self.night))
        return day if is_day else night


@dataclass(frozen=True)
class Sensors:
    """The whole file, `text` as it stands, for whoever asks for it."""

    by_name: Mapping[str, Sensor]
    fallback: Sensor
    saturation: float
    max_alpha: float
    text: str

    def named(self, name: str) -> Sensor:
        """A sensor; one that the file does not know has neither unit nor ranges."""
        known = self.by_name.get(name)
        if known is not None:
            return known
        other = self.fallback
        return Sensor(name, other.label or name, other.unit, other.hue, other.lightness)

    def digits(self, name: str) -> int | None:
        """How many a value has after the point, as the page writes it; None: as its size deserves.

        So many that the largest limit has about three figures: of the sensor itself, or of what it
        is computed of.
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
        """By sensor, the quantities of a day that are made of it and have a range."""
        found: dict[str, tuple[str, ...]] = {}
        for daily in DAILY.values():
            if self.named(daily.name).ideals:
                found[daily.sensor] = (*found.get(daily.sensor, ()), daily.name)
        return found
