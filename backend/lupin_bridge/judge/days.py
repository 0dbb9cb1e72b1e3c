"""Quantities of a day, one value a day of a tag: from dawn to dawn by the clock. Pure."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Final, TypeVar

from lupin_bridge.judge.derived import DAILY, DAY_NS, Course, IsDay
from lupin_bridge.judge.ranges import Sensors
from lupin_twin.core.past import PastWrite
from lupin_twin.core.state import Reading

# A value counts until the next one, and no longer than this after its day was complete.
COUNTS_NS: Final = 30 * 3600 * 1_000_000_000
# Scans of so long before a moment say all of the days that count then: one is complete within two.
SINCE_NS: Final = COUNTS_NS + 2 * DAY_NS
_MINUTE_NS: Final = 60 * 1_000_000_000
ValueT = TypeVar("ValueT")
# The number of the day, from dawn to dawn, that a moment of ROS time (ns) belongs to.
DayNumber = Callable[[int], int]


@dataclass(slots=True)
class TagDays:
    """A tag's days; `step` takes the readings of each sensor in the order of time."""

    sensors: Sensors
    is_day: IsDay
    number: DayNumber
    # By quantity, its value of the last whole day, if that is known.
    values: dict[str, Reading] = field(default_factory=dict)
    _courses: dict[str, tuple[int, Course]] = field(default_factory=dict)

    def copy(self) -> TagDays:
        """The same, to go on from here apart."""
        return replace(self, values=dict(self.values), _courses=dict(self._courses))

    def step(self, name: str, value: float, stamp_ns: int) -> Sequence[Reading]:
        """The next reading of a sensor; what the first of a day says of the day before."""
        quantities = self.sensors.judged_by_the_day.get(name)
        if quantities is None:
            return ()
        by_day, number = self.is_day(stamp_ns), self.number(stamp_ns)
        known = self._courses.get(name)
        if known is not None:
            course = known[1].after(stamp_ns, value, self.is_day)
            if known[0] == number:
                self._courses[name] = number, course
                return ()
        self._courses[name] = number, Course.begin(stamp_ns, value, is_day=by_day)
        if known is None:
            return ()
        found = []
        for quantity in quantities:
            self.values.pop(quantity, None)
            of_day = DAILY[quantity].of(course) if number == known[0] + 1 else math.nan
            if math.isfinite(of_day):
                self.values[quantity] = Reading(quantity, of_day, stamp_ns)
                found.append(self.values[quantity])
        return found


def _by_the_minute(of: Callable[[int], ValueT]) -> Callable[[int], ValueT]:
    """The same for many moments: day and night begin on whole minutes."""
    known = cache(lambda minute: of(minute * _MINUTE_NS))
    return lambda at_ns: known(at_ns // _MINUTE_NS)


def days_of(
    scans: Iterable[PastWrite], sensors: Sensors, is_day: IsDay, number: DayNumber
) -> Mapping[str, Sequence[Reading]]:
    """By tag, what its scans of `SINCE_NS` up to a moment, oldest first, say of its last day."""
    every: dict[str, dict[str, dict[int, float]]] = {}
    for scan in scans:
        for name, value in zip(scan.sensors, scan.values, strict=True):
            # Of one moment, what was received last.
            every.setdefault(scan.tag_id, {}).setdefault(name, {})[scan.stamp_ns] = value
    is_day, number = _by_the_minute(is_day), _by_the_minute(number)
    found = {}
    for tag_id, by_name in every.items():
        days = TagDays(sensors, is_day, number)
        for name in sensors.judged_by_the_day.keys() & by_name.keys():
            is_plausible = sensors.named(name).is_plausible
            for stamp_ns, value in by_name[name].items():
                if is_plausible(value):
                    days.step(name, value, stamp_ns)
        found[tag_id] = tuple(days.values.values())
    return found
