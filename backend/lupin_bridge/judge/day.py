"""Whether it is day in the greenhouse: by its own light, else by the clock. Pure.

Recently measured light decides: lamps make day in winter, and screens make night in summer. The
whole greenhouse has day if at least half of its light sensors say so. Each counts by its newest
reading, unless scans have left it out for long.

Also the daily quantities of a tag: one value for each day, from dawn to dawn by the clock.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime, time, timedelta, tzinfo
from functools import cache
from operator import itemgetter
from typing import Final, Literal, TypeVar

from lupin_bridge.judge.quantities import DAILY, Course, IsDay, Sensors
from lupin_twin.core.past import DAY_NS
from lupin_twin.core.state import Observation, Reading

# The name of the light sensor.
LIGHT: Final = "light"
# The dullest day gives a greenhouse some hundred lx; the moon and lamps outside, less than ten.
DAY_FROM_LX: Final = 50.0
# A light sensor that the scans of its tag have left out for longer than this no longer counts.
LEFT_OUT_NS: Final = 2 * 3600 * 1_000_000_000

Source = Literal["light", "clock", "assumed"]


@dataclass(frozen=True, slots=True)
class Day:
    """Whether it is day, and what decided that: light, clock, or nothing (then it is day)."""

    is_day: bool
    source: Source


@dataclass(frozen=True, slots=True)
class ClockDay:
    """The hours of day by wall-clock time; zone None: this machine's.

    If `begins` equals `ends`, it is always day.
    """

    zone: tzinfo | None
    begins: time = time(6)
    ends: time = time(20)

    def is_day(self, now_s: float) -> bool:
        """Whether it is day at `now_s`, Unix time; a day may end after midnight."""
        wall = datetime.fromtimestamp(now_s, self.zone).time()
        if self.begins < self.ends:
            return self.begins <= wall < self.ends
        return wall >= self.begins or wall < self.ends

    def nights(self, from_s: float, to_s: float) -> Iterator[tuple[float, float]]:
        """Yield (dusk, dawn) of the nights that overlap a period, Unix time, oldest first."""
        if self.begins == self.ends:
            return
        # A day that ends after midnight is followed by a dawn of the same date.
        later = timedelta(days=self.begins < self.ends)
        evening = datetime.fromtimestamp(from_s, self.zone).date() - timedelta(days=1)
        while True:
            dusk_s = datetime.combine(evening, self.ends, self.zone).timestamp()
            dawn_s = datetime.combine(evening + later, self.begins, self.zone).timestamp()
            if dusk_s >= to_s:
                return
            if dawn_s > from_s:
                yield dusk_s, dawn_s
            evening += timedelta(days=1)

    def number(self, now_s: float) -> int:
        """Which day it is, counted from dawn to dawn."""
        wall = datetime.fromtimestamp(now_s, self.zone)
        return wall.toordinal() - (wall.time() < self.begins)


def says_day(light_lx: float | None) -> bool | None:
    """Whether a reading of light says that it is day; None: there is none, or it is not finite."""
    if light_lx is None or not math.isfinite(light_lx):
        return None
    return light_lx >= DAY_FROM_LX


def light_after(
    said: bool | None, light_ns: int, stamp_ns: int, light_lx: float | None
) -> tuple[bool | None, int]:
    """What a tag's light sensor says after one more scan, and the stamp of its last reading.

    Before, it said `said`, by a reading of `light_ns`. `light_lx` None: the scan left it out.
    """
    if light_lx is not None:
        return says_day(light_lx), stamp_ns
    return None if stamp_ns - light_ns > LEFT_OUT_NS else said, light_ns


def nights_by_light(
    readings: Iterable[tuple[int, float]], end_ns: int
) -> Sequence[tuple[int, int]] | None:
    """The (dusk, dawn) of a period's nights by readings of light; None: there is no such reading.

    Readings are (stamp in ns, lx), oldest first. What one says holds until the next.
    """
    says = [(at_ns, is_day) for at_ns, lx in readings if (is_day := says_day(lx)) is not None]
    turns = [
        turn
        for turn, before in zip(says, [(0, True), *says], strict=False)
        if turn[1] is not before[1]
    ]
    moments = [at_ns for at_ns, _ in turns]
    return list(zip(moments[::2], [*moments[1::2], end_ns], strict=False)) if says else None


class Light:
    """What the light sensor of each tag says, and how many say that it is day."""

    def __init__(self) -> None:
        self._is_bright: dict[str, bool] = {}
        self._bright = 0

    def put(self, tag_id: str, says: bool | None) -> None:
        """Set what a tag's sensor says now; None: nothing."""
        self._bright -= self._is_bright.pop(tag_id, False)
        if says is not None:
            self._is_bright[tag_id] = says
            self._bright += says

    @property
    def is_day(self) -> bool | None:
        """Whether at least half of the sensors say that it is day; None: there are none."""
        return 2 * self._bright >= len(self._is_bright) if self._is_bright else None


# From a moment on (ns of ROS time), a tag's light sensor says day, night, or nothing.
Turn = tuple[int, bool | None]


class DayLine:
    """The days and nights of a greenhouse over time, by the light of all its tags."""

    def __init__(self) -> None:
        self._turns: dict[str, tuple[Turn, ...]] = {}
        self._light = Light()
        self._newest_ns = -1
        self._since_ns = 0
        self._at: list[int] = []
        self._is_day: list[bool | None] = []

    def forget(self, before_ns: int, turns: Mapping[str, Sequence[Turn]]) -> None:
        """Forget what was before a moment; `turns` are all that is left, by tag."""
        self._since_ns = before_ns
        self._turns = {tag_id: tuple(of_tag) for tag_id, of_tag in turns.items()}
        self._rebuild()

    def put(self, tag_id: str, turns: Sequence[Turn]) -> int | None:
        """Set all turns of a tag; returns from when on the greenhouse's may differ; None: never."""
        before, now = self._turns.get(tag_id, ()), tuple(turns)
        if now == before:
            return None
        self._turns[tag_id] = now
        is_appended = now[: len(before)] == before
        if is_appended and now[len(before)][0] > self._newest_ns:
            known = len(self._at)
            for turn in now[len(before) :]:
                self._turn(tag_id, turn)
            return self._at[known] if len(self._at) > known else None
        return self._rebuild()

    def is_day(self, at_ns: int) -> bool | None:
        """Whether it was day by the light at that moment; None: none had been measured."""
        index = bisect_right(self._at, at_ns)
        return self._is_day[index - 1] if index else None

    def _rebuild(self) -> int | None:
        before = self._line()
        self._light, self._newest_ns = Light(), -1
        self._at, self._is_day = [], []
        every = [(at_ns, tag_id, says) for tag_id, of in self._turns.items() for at_ns, says in of]
        for at_ns, tag_id, says in sorted(every, key=itemgetter(0, 1)):
            self._turn(tag_id, (at_ns, says))
        now = self._line()
        same = next(
            (n for n, (one, other) in enumerate(zip(before, now, strict=False)) if one != other),
            min(len(before), len(now)),
        )
        changed = [at_ns for at_ns, _ in (*before[same : same + 1], *now[same : same + 1])]
        return min(changed, default=None)

    def _line(self) -> list[Turn]:
        """The greenhouse's turns of day and night, back to `_since_ns`."""
        known = zip(self._at, self._is_day, strict=True)
        first = (self._since_ns, self.is_day(self._since_ns))
        return [first, *(turn for turn in known if turn[0] > self._since_ns)]

    def _turn(self, tag_id: str, turn: Turn) -> None:
        at_ns, says = turn
        self._newest_ns = max(self._newest_ns, at_ns)
        self._light.put(tag_id, says)
        is_day = self._light.is_day
        if self._at and self._at[-1] == at_ns:
            self._at.pop()
            self._is_day.pop()
        if (self._is_day[-1] if self._is_day else None) is not is_day:
            self._at.append(at_ns)
            self._is_day.append(is_day)


# --- daily quantities -----------------------------------------------------------------------------

# A value counts until the next one, and no longer than this after its day was complete.
COUNTS_NS: Final = 30 * 3600 * 1_000_000_000
# Scans of this long before a moment give all days that count then: a day is complete within two.
SINCE_NS: Final = COUNTS_NS + 2 * DAY_NS
_MINUTE_NS: Final = 60 * 1_000_000_000
ValueT = TypeVar("ValueT")
# The number of the day, from dawn to dawn, that a moment of ROS time (ns) belongs to.
DayNumber = Callable[[int], int]


@dataclass(slots=True)
class TagDays:
    """A tag's daily quantities; `step` takes the readings of each sensor in the order of time."""

    sensors: Sensors
    is_day: IsDay
    number: DayNumber
    # By quantity, its value of the last whole day, if that is known.
    values: dict[str, Reading] = field(default_factory=dict)
    _courses: dict[str, tuple[int, Course]] = field(default_factory=dict)

    def copy(self) -> TagDays:
        """An independent copy."""
        return replace(self, values=dict(self.values), _courses=dict(self._courses))

    def step(self, name: str, value: float, stamp_ns: int) -> Sequence[Reading]:
        """Take a sensor's next reading; the first of a day returns the values of the day before."""
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
    """The function, cached by the minute: day and night begin on whole minutes."""
    known = cache(lambda minute: of(minute * _MINUTE_NS))
    return lambda at_ns: known(at_ns // _MINUTE_NS)


def days_of(
    scans: Iterable[Observation], sensors: Sensors, is_day: IsDay, number: DayNumber
) -> Mapping[str, Sequence[Reading]]:
    """By tag, the daily quantities of its last day; `scans`: the last `SINCE_NS`, oldest first."""
    every: dict[str, dict[str, dict[int, float]]] = {}
    for scan in scans:
        for name, value in scan.readings.items():
            # For one moment, the value received last counts.
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
