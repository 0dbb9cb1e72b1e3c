import math
from datetime import UTC, datetime, time, timedelta, timezone

import pytest

from lupin_bridge.judge.day import DAY_FROM_LX, ClockDay, Day, Light, judge_day, says_day

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
