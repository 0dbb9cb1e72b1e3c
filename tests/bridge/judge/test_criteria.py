"""By what is judged: day and night, the settings, and quantities derived from readings."""

import math
import re
from collections.abc import Callable, Sequence
from datetime import UTC, datetime, time, timedelta, timezone
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lupin_bridge.judge.day import DAY_FROM_LX, ClockDay, Day, Light, says_day
from lupin_bridge.judge.judging import MAX_FILE_BYTES, Criteria, own_sensors, unix_s
from lupin_bridge.judge.quantities import (
    BASE_C,
    DAILY,
    DERIVED,
    LX_PER_UMOL,
    MAX_GAP_NS,
    dew_point_c,
    saturation_kpa,
    vapour_pressure_deficit_kpa,
)
from lupin_bridge.settings import SettingError, Settings
from lupin_twin.core.past import DAY_NS

NOON_S = datetime(2026, 6, 1, 12, tzinfo=UTC).timestamp()
MIDNIGHT_S = datetime(2026, 6, 1, tzinfo=UTC).timestamp()
CLOCK = ClockDay(UTC)


def light_of(*readings_lx: float) -> bool | None:
    light = Light()
    for number, reading in enumerate(readings_lx):
        light.put(f"tag_{number}", says_day(reading))
    return light.is_day


def test_the_majority_of_the_working_light_sensors_takes_precedence_over_the_clock() -> None:
    def day(at_s: float, *readings_lx: float) -> Day:
        return Criteria(own_sensors(), None, CLOCK).day(light_of(*readings_lx), round(at_s * 1e9))

    assert day(MIDNIGHT_S, 900.0, 800.0) == Day(True, "light")
    assert day(NOON_S, 0.0, 0.0) == Day(False, "light")
    assert day(0.0, 0.0, 900.0, 900.0).is_day
    assert not day(0.0, 0.0, 0.0, 900.0).is_day
    assert day(0.0, math.nan, math.inf, 900.0) == Day(True, "light")
    assert day(MIDNIGHT_S, math.nan) == Day(False, "clock")
    assert day(NOON_S) == Day(True, "clock")
    assert day(0.0) == Day(True, "assumed")
    # Exactly the limit is day.
    assert day(0.0, DAY_FROM_LX).is_day
    assert not day(0.0, DAY_FROM_LX - 0.1).is_day


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


@pytest.mark.parametrize(
    ("temperature_c", "kpa"),
    # FAO Irrigation and Drainage Paper 56, annex 2, table 2.3.
    [(1.0, 0.657), (10.0, 1.228), (15.0, 1.705), (20.0, 2.338), (25.0, 3.168), (30.0, 4.243)],
)
def test_saturation_matches_the_published_table(temperature_c: float, kpa: float) -> None:
    assert saturation_kpa(temperature_c) == pytest.approx(kpa, abs=0.001)


def test_the_deficit_is_what_the_air_can_still_take_up() -> None:
    assert vapour_pressure_deficit_kpa(20.0, 100.0) == 0.0
    assert vapour_pressure_deficit_kpa(20.0, 0.0) == saturation_kpa(20.0)
    assert vapour_pressure_deficit_kpa(25.0, 60.0) == pytest.approx(0.4 * 3.168, abs=0.001)


@given(st.floats(-39, 79), st.floats(0.5, 100))
def test_air_at_its_dew_point_is_saturated(temperature_c: float, humidity: float) -> None:
    dew_c = dew_point_c(temperature_c, humidity)
    assert dew_c <= temperature_c + 1e-9
    assert saturation_kpa(dew_c) == pytest.approx(saturation_kpa(temperature_c) * humidity / 100)


def test_impossible_readings_derive_nothing_and_slightly_high_ones_count_as_saturated() -> None:
    for temperature_c, humidity in (
        *((20.0, -0.1), (20.0, 105.1), (-40.1, 50.0)),
        *((80.1, 50.0), (math.nan, 50.0), (20.0, math.nan)),
    ):
        for derived in DERIVED.values():
            assert math.isnan(derived.formula(temperature_c, humidity))
    for humidity in (0.0, 5e-324, 2e-322):
        assert math.isnan(dew_point_c(20.0, humidity)), "dry air has none"
    assert vapour_pressure_deficit_kpa(20.0, 100.4) == 0.0
    assert dew_point_c(20.0, 105.0) == pytest.approx(20.0)


# --- of a day -------------------------------------------------------------------------------------


HOUR = 3600 * 10**9
AT = 100 * DAY_NS


def is_day(at_ns: int) -> bool:
    """Daylight from 6 to 18."""
    return 6 <= at_ns % DAY_NS / HOUR < 18


def value(name: str, of: Callable[[float], float], hours: float = 24.0, step: float = 0.5) -> float:
    """The quantity at midnight of a sensor whose value over the hours of the day is `of`."""
    count = round(hours / step)
    readings = [
        (AT - round(step * HOUR * back), of(24.0 - step * back)) for back in range(count, -1, -1)
    ]
    return DAILY[name].at(AT, readings, is_day)


def test_a_daily_light_integral_and_a_dose_of_co2_are_sums() -> None:
    # 10 h of 54,000 lx are 10 h of 1000 umol/m2/s.
    lit = value("daily_light_integral", lambda hour: 54_000.0 * (7.0 <= hour <= 17.0), step=0.01)
    assert lit == pytest.approx(36.0, rel=2e-3)
    # Half a sine of 12 h: its mean is 2 / pi of its maximum.
    sun = value("daily_light_integral", lambda hour: max(0.0, math.sin((hour - 6) * math.pi / 12)))
    assert sun == pytest.approx(12 * 3600 * 2 / math.pi / LX_PER_UMOL / 1e6, rel=5e-3)
    dose = value("co2_dose", lambda hour: 800.0 if 6.0 <= hour <= 18.0 else 5000.0, step=0.01)
    assert dose == pytest.approx(12 * 800.0, rel=5e-3)


def test_temperature_over_a_day() -> None:
    def course(hour: float) -> float:
        return 24.0 if 6.0 <= hour < 18.0 else 16.0

    assert value("temperature_24h_mean", course, step=0.01) == pytest.approx(20.0, abs=0.02)
    assert value("day_night_difference", course, step=0.01) == pytest.approx(8.0, abs=0.02)
    assert value("temperature_night_minimum", lambda hour: 5.0 if hour == 12.0 else hour) == 0.0
    assert value("growing_degree_days", course) == (24.0 + 16.0) / 2 - BASE_C
    assert value("growing_degree_days", lambda _: 4.0) == 0.0


@pytest.mark.parametrize("name", DAILY)
def test_too_little_of_a_day_has_no_value(name: str) -> None:
    assert math.isfinite(value(name, lambda _: 20.0, hours=22.0))
    assert math.isnan(value(name, lambda _: 20.0, hours=21.0))
    # Between readings that are too far apart nothing is known.
    far = 2.0 * MAX_GAP_NS / HOUR
    assert math.isnan(value(name, lambda _: 20.0, step=far))
    assert math.isnan(DAILY[name].at(AT, [], is_day))
    # Without its noon, a day's light would be half of the real one.
    noon = range(11, 15)
    readings = [(AT + (h - 24) * HOUR, 20_000.0) for h in range(25) if h not in noon]
    assert math.isnan(DAILY[name].at(AT, readings, is_day))


def test_other_days_do_not_count_and_without_a_night_there_is_no_difference_and_no_minimum() -> (
    None
):
    daily = DAILY["temperature_24h_mean"]
    readings = [(AT + hour * HOUR, 20.0 if -24 <= hour <= 0 else 99.0) for hour in range(-30, 4)]
    assert daily.at(AT, readings, is_day) == 20.0
    readings = [(AT + hour * HOUR, 20.0) for hour in range(-24, 1)]
    for name in ("day_night_difference", "temperature_night_minimum"):
        assert math.isnan(DAILY[name].at(AT, readings, lambda _: True))
