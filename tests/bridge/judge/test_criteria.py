"""By what is judged: day and night, and the settings."""

import math
import re
from collections.abc import Sequence
from datetime import UTC, datetime, time, timedelta, timezone
from pathlib import Path
from typing import Any

import pytest

from lupin_bridge.judge.day import DAY_FROM_LX, ClockDay, Day, Light, judge_day, says_day
from lupin_bridge.judge.judging import MAX_FILE_BYTES, Criteria, own_sensors, unix_s
from lupin_bridge.settings import SettingError, Settings

NOON_S = datetime(2026, 6, 1, 12, tzinfo=UTC).timestamp()
MIDNIGHT_S = datetime(2026, 6, 1, tzinfo=UTC).timestamp()
CLOCK = ClockDay(UTC)


def light_of(*readings_lx: float) -> bool | None:
    light = Light()
    for number, reading in enumerate(readings_lx):
        light.put(f"tag_{number}", says_day(reading))
    return light.is_day


def test_the_majority_of_the_working_light_sensors_takes_precedence_over_the_clock() -> None:
    assert judge_day(light_of(900.0, 800.0), CLOCK, MIDNIGHT_S) == Day(True, "light")
    assert judge_day(light_of(0.0, 0.0), CLOCK, NOON_S) == Day(False, "light")
    assert judge_day(light_of(0.0, 900.0, 900.0), None, None).is_day
    assert not judge_day(light_of(0.0, 0.0, 900.0), None, None).is_day
    assert judge_day(light_of(math.nan, math.inf, 900.0), None, None) == Day(True, "light")
    assert judge_day(light_of(math.nan), CLOCK, MIDNIGHT_S) == Day(False, "clock")
    # Exactly the limit is day.
    assert judge_day(light_of(DAY_FROM_LX), None, None).is_day
    assert not judge_day(light_of(DAY_FROM_LX - 0.1), None, None).is_day


@pytest.mark.parametrize(
    ("hour", "is_day"), [(5, False), (6, True), (19, True), (20, False), (23, False)]
)
def test_by_the_clock_a_day_begins_and_ends(hour: int, is_day: bool) -> None:
    at_s = datetime(2026, 6, 1, hour, tzinfo=UTC).timestamp()
    assert judge_day(light_of(), CLOCK, at_s) == Day(is_day, "clock")


def test_the_clock_is_that_of_the_greenhouse() -> None:
    east = ClockDay(timezone(timedelta(hours=9)))
    assert judge_day(light_of(), east, MIDNIGHT_S).is_day
    assert not judge_day(light_of(), east, NOON_S).is_day


@pytest.mark.parametrize(
    ("clock", "from_h", "to_h", "nights"),
    [
        (CLOCK, 0, 24, [(-4, 6), (20, 30)]),
        (CLOCK, 6, 20, []),
        # The real length, beyond the end of the period.
        (CLOCK, 22, 23, [(20, 30)]),
        (CLOCK, 1, 50, [(-4, 6), (20, 30), (44, 54)]),
        (ClockDay(UTC, time(14), time(2)), 0, 48, [(2, 14), (26, 38)]),
        (ClockDay(UTC, time(6), time(6)), 0, 48, []),
        (ClockDay(timezone(timedelta(hours=-9))), 0, 24, [(5, 15)]),
    ],
)
def test_the_nights_of_a_period(
    clock: ClockDay, from_h: int, to_h: int, nights: list[tuple[int, int]]
) -> None:
    found = clock.nights(MIDNIGHT_S + from_h * 3600, MIDNIGHT_S + to_h * 3600)
    reported = [tuple((at_s - MIDNIGHT_S) / 3600 for at_s in night) for night in found]
    assert reported == nights
    for hour in range(from_h, to_h):
        is_night = any(dusk <= hour < dawn for dusk, dawn in nights)
        assert clock.is_day(MIDNIGHT_S + hour * 3600) is not is_night


# --- settings -------------------------------------------------------------------------------------


def criteria(**settings: Any) -> Criteria:
    return Criteria.of(Settings(**settings))


def test_the_default_is_our_own_file_and_a_mistake_in_another_is_reported_with_its_line(
    tmp_path: Path,
) -> None:
    chosen = criteria()
    assert chosen.sensors == own_sensors()
    assert chosen.recent_s is None
    assert criteria(reading_validity_s=900.0).recent_s == 900.0
    file = tmp_path / "mine.json"
    file.write_text(own_sensors().text.replace('"ideal": [18, 26]', '"ideal": [26, 18]'), "utf-8")
    says = f"--sensors {file}: sensors.temperature: ideal is [26.0, 18.0], and low must be"
    with pytest.raises(SettingError, match=re.escape(says)):
        criteria(sensors=str(file))


def test_a_file_is_not_read_past_its_limit(tmp_path: Path) -> None:
    file = tmp_path / "long.json"
    text = own_sensors().text
    file.write_text(text + " " * (MAX_FILE_BYTES - len(text.encode())), "utf-8")
    criteria(sensors=str(file))
    with file.open("a") as more:
        more.write(" ")
    with pytest.raises(SettingError, match="has more than 1000000 bytes, the limit"):
        criteria(sensors=str(file))


def test_the_hours_of_the_day_are_those_of_the_greenhouse_and_simulated_time_has_none() -> None:
    clock = criteria(time_zone="Europe/Amsterdam", day_hours="07:30-19:00").clock
    summer = datetime(2026, 7, 1, 5, 29, tzinfo=UTC).timestamp()
    assert not clock.is_day(summer)
    assert clock.is_day(summer + 60)
    winter = datetime(2026, 1, 1, 6, 29, tzinfo=UTC).timestamp()
    assert not clock.is_day(winter)
    assert clock.is_day(winter + 60)
    assert unix_s(3_600 * 10**9) is None
    assert unix_s(1_790_000_000 * 10**9) == 1_790_000_000


@pytest.mark.parametrize(
    ("name", "values", "says"),
    [
        ("time_zone", ("Mars/Olympus", "../../etc/passwd", "Europe"), "which this machine"),
        (
            "day_hours",
            ("", "6-20", "06:00-24:00", "06:60-20:00", "06:00–20:00", "day"),
            "expected HH:MM-HH:MM",
        ),
    ],
)
def test_an_unknown_time_zone_and_invalid_hours_are_refused(
    name: str, values: Sequence[str], says: str
) -> None:
    for value in values:
        text = re.escape(f"--{name.replace('_', '-')} is '{value}', {says}")
        with pytest.raises(SettingError, match=text):
            criteria(**{name: value})
