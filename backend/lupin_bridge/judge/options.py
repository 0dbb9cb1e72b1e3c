"""What the operator chose: the file of sensors, how long readings hold, when it is day."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import time
from importlib.resources import files
from typing import Final
from zoneinfo import ZoneInfo

from lupin_bridge.judge.day import ClockDay, Day, judge_day
from lupin_bridge.judge.quantities import DAY_NS, Sensors
from lupin_bridge.judge.scans import holds_ns, interval_ns
from lupin_bridge.settings import SettingError, Settings, read_text

# Nobody writes this much.
MAX_FILE_BYTES: Final = 1_000_000
_HOUR: Final = r"((?:[01]\d|2[0-3]):[0-5]\d)"
_HOURS: Final = re.compile(f"{_HOUR}-{_HOUR}")


@dataclass(frozen=True, slots=True)
class Criteria:
    """What readings are judged by."""

    sensors: Sensors
    recent_s: float | None
    clock: ClockDay

    @classmethod
    def of(cls, settings: Settings) -> Criteria:
        """As the settings have it.

        Raises:
            SettingError: a file that cannot be read or says what cannot be, a zone nobody knows,
                hours that are none.

        """
        return cls(_sensors(settings), settings.reading_validity_s or None, _clock(settings))

    def holds_ns(self, scans_ns: Sequence[int]) -> int:
        """How long readings hold after scans, oldest first; a fixed time goes before that."""
        if self.recent_s is not None:
            return int(self.recent_s * 1e9)
        return holds_ns(interval_ns(scans_ns))

    def day(self, light: bool | None, stamp_ns: int) -> Day:
        """Whether it was day at a moment of ROS time at which the light said so, or None."""
        return judge_day(light, self.clock, unix_s(stamp_ns))

    def is_day(self, stamp_ns: int) -> bool:
        """Whether it was day by the clock alone."""
        return self.day(None, stamp_ns).is_day

    def nights(self, start_ns: int, end_ns: int) -> Sequence[tuple[int, int]] | None:
        """The nights by the clock that meet a period; None: simulated, or very long."""
        from_s, to_s = unix_s(start_ns), unix_s(end_ns)
        if from_s is None or to_s is None or to_s - from_s > _LONGEST_S:
            return None
        nights = self.clock.nights(from_s, to_s)
        return [(round(dusk_s * 1e9), round(dawn_s * 1e9)) for dusk_s, dawn_s in nights]

    def day_number(self, stamp_ns: int) -> int:
        """Which day it was by the clock, from dawn to dawn; a simulation's are of 24 hours."""
        now_s = unix_s(stamp_ns)
        return stamp_ns // DAY_NS if now_s is None else self.clock.number(now_s)


def own_sensors() -> Sensors:
    """The file that comes with the bridge."""
    from lupin_bridge.judge.sensors_file import parse  # noqa: PLC0415  # nothing of the past needs it

    return parse(files("lupin_bridge").joinpath("sensors.json").read_text(encoding="utf-8"))


def _sensors(settings: Settings) -> Sensors:
    if not settings.sensors:
        return own_sensors()
    from lupin_bridge.judge.sensors_file import SensorsError, parse  # noqa: PLC0415  # as above

    called = settings.called("sensors")
    try:
        return parse(read_text(settings.sensors, called, MAX_FILE_BYTES))
    except SensorsError as error:
        raise SettingError(f"{called} {settings.sensors}: {error}") from error


def _clock(settings: Settings) -> ClockDay:
    hours = _HOURS.fullmatch(settings.day_hours)
    if hours is None:
        raise SettingError(
            f"{settings.called('day_hours')} is {settings.day_hours!r}, not such as 06:00-20:00"
        )
    begins, ends = (time.fromisoformat(hour) for hour in hours.groups())
    # None: this machine's, which changes with summer and winter.
    zone = zone_of(settings.time_zone) if settings.time_zone else None
    if settings.time_zone and zone is None:
        raise SettingError(
            f"{settings.called('time_zone')} is {settings.time_zone!r}, which this machine does "
            "not know"
        )
    return ClockDay(zone, begins, ends)


def zone_of(name: str) -> ZoneInfo | None:
    """The time zone of a name; None: this machine does not know it."""
    try:
        return ZoneInfo(name)
    except (KeyError, OSError, ValueError):
        return None


def unix_s(stamp_ns: int) -> float | None:
    """The wall's time of a moment in ROS time; None: that is simulated, and has no such hours."""
    seconds = stamp_ns / 1e9
    return seconds if seconds > _OLDEST_S else None


# Nights of a longer period are narrower than a line.
_LONGEST_S: Final = 400 * 86_400
# No robot drove before; simulations begin at 0.
_OLDEST_S: Final = 1.4e9
