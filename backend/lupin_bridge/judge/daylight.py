"""Whether it is day in the house: by its own light, else by the clock. Pure.

Light decides where it was measured lately, for lamps make day in winter and screens make night in
summer. The house is one: what most of its sensors say.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, time, tzinfo
from typing import Final, Literal

# The sensor that tells, by its name.
LIGHT: Final = "light"
# The dullest day gives a house some hundred lx, moon and lamps outside less than ten.
DAY_FROM_LX: Final = 50.0
# A light that the scans of its tag have left out for longer says nothing of their day any more.
LEFT_OUT_NS: Final = 2 * 3600 * 1_000_000_000

Source = Literal["light", "clock", "assumed"]


@dataclass(frozen=True, slots=True)
class Day:
    """Whether it is day, and what says so: the light, the clock, or nothing (then it is day)."""

    is_day: bool
    source: Source


@dataclass(frozen=True, slots=True)
class ClockDay:
    """From when to when it is day by the clock on the wall; the zone None is this machine's.

    From an hour to the same hour it is always day.
    """

    zone: tzinfo | None
    begins: time = time(6)
    ends: time = time(20)

    def is_day(self, now_s: float) -> bool:
        """`now_s` is Unix time; a day may end after midnight."""
        wall = datetime.fromtimestamp(now_s, self.zone).time()
        if self.begins < self.ends:
            return self.begins <= wall < self.ends
        return wall >= self.begins or wall < self.ends


class Light:
    """The house's light, tag by tag: the finite readings, and how many of them are of day."""

    def __init__(self) -> None:
        self._is_bright: dict[str, bool] = {}
        self._bright = 0

    def put(self, tag_id: str, light_lx: float | None) -> None:
        """What a tag's sensor reads now; None or not finite: it says nothing."""
        self._bright -= self._is_bright.pop(tag_id, False)
        if light_lx is not None and light_lx - light_lx == 0.0:
            self._is_bright[tag_id] = light_lx >= DAY_FROM_LX
            self._bright += self._is_bright[tag_id]

    @property
    def is_day(self) -> bool | None:
        """What half of the sensors say or more; None without any."""
        return 2 * self._bright >= len(self._is_bright) if self._is_bright else None


def judge_day(light: bool | None, clock: ClockDay | None, now_s: float | None) -> Day:
    """By what the light says; where that is nothing, by the clock at `now_s` (Unix time)."""
    if light is not None:
        return Day(light, "light")
    if clock is not None and now_s is not None:
        return Day(clock.is_day(now_s), "clock")
    return Day(True, "assumed")
