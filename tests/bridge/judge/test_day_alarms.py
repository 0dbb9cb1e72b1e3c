"""Alarms of daily quantities: from dawn to dawn by the clock, one value per day and tag."""

import math
import random
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import count

import pytest

from lupin_bridge.judge.alarm_fold import AlarmFold
from lupin_bridge.judge.day import COUNTS_NS, SINCE_NS, ClockDay, Day, days_of
from lupin_bridge.judge.episodes import Alarm
from lupin_bridge.judge.judging import Criteria, own_sensors
from lupin_bridge.judge.quantities import DAILY
from lupin_bridge.judge.verdict import Verdict
from lupin_twin.core.past import DAY_NS, RunSpan
from lupin_twin.core.state import Flower, Observation, Reading
from tests.support.store import logged

HOUR = 3600 * 10**9
SPANS = (RunSpan(1, 0, 2**63 - 1),)
DAWN, DUSK = 6, 18
MEAN, MINIMUM = "temperature_24h_mean", "temperature_night_minimum"


def is_day(at_ns: int) -> bool:
    return DAWN <= at_ns / HOUR % 24 < DUSK


class DawnToDusk(Criteria):
    def day(self, light: bool | None, stamp_ns: int) -> Day:
        return Day(is_day(stamp_ns) if light is None else light, "clock")

    def day_number(self, stamp_ns: int) -> int:
        return day_number(stamp_ns)


def scans(
    of: dict[str, list[float]], every_h: float = 1.0, first_h: float = DAWN
) -> list[Observation]:
    """A sensor's value on each day, from dawn to dawn, read again and again."""
    numbers = count(1)
    return [
        logged(next(numbers), 1, "a", at_ns, 0, 0, (name,), (value,))
        for name, values in of.items()
        for day, value in enumerate(values)
        for step in range(round(24 / every_h))
        if (at_ns := round((DAWN + 24 * day + step * every_h) * HOUR)) >= first_h * HOUR
    ]


def day_number(at_ns: int) -> int:
    return (at_ns - DAWN * HOUR) // DAY_NS


def new_fold() -> AlarmFold:
    return AlarmFold(DawnToDusk(own_sensors(), None, ClockDay(None)), SPANS)


def found(received: Iterable[Observation]) -> list[Alarm]:
    fold = new_fold()
    fold.take(received)
    alarms = [one for one in fold.found(40 * DAY_NS).alarms if one.reason.sensor in DAILY]
    return sorted(alarms, key=lambda one: (one.raised_at_ns, one.id))


def dawn(day: int) -> int:
    return day * DAY_NS + DAWN * HOUR


def test_a_days_mean_raises_at_the_next_dawn_and_has_no_deadband() -> None:
    [cold] = found(scans({"temperature": [20.0, 14.0, 13.0, 20.0, 20.0]}))
    assert (cold.tag_id, cold.reason.sensor, cold.reason.verdict) == ("a", MEAN, Verdict.STRESSED)
    # The last hour of that day already moved towards the next one's temperature.
    assert cold.reason.value == pytest.approx(14.0, abs=0.1)
    assert cold.worst == pytest.approx(13.0, abs=0.2)
    assert cold.reason.limit == 17.0
    assert (cold.raised_at_ns, cold.reason.since_ns) == (dawn(2), dawn(2))
    assert cold.cleared_at_ns == dawn(4)
    wobbling = found(scans({"temperature": [16.8, 17.2, 16.8, 17.4, 20.0]}))
    reported = [(one.raised_at_ns, one.cleared_at_ns) for one in wobbling]
    assert reported == [(dawn(1), dawn(2)), (dawn(3), dawn(4))]
    own = [
        replace(one, readings={"temperature": 14.0, MEAN: 20.0})
        for one in scans({"temperature": [14.0] * 3})
    ]
    assert found(own) == []


def test_the_value_equals_that_of_the_history_at_that_moment() -> None:
    chance = random.Random(4)
    received = [
        replace(one, readings={"temperature": chance.uniform(5.0, 14.0)})
        for one in scans({"temperature": [0.0] * 3}, every_h=0.2)
    ]
    readings = [(one.stamp_ns, one.readings["temperature"]) for one in received]
    alarms = found(received)
    assert {one.reason.sensor for one in alarms} == {MEAN, MINIMUM}
    for alarm in alarms:
        at_dawn = DAILY[alarm.reason.sensor].at(dawn(1), readings, is_day)
        assert alarm.raised_at_ns == dawn(1)
        assert alarm.reason.value == pytest.approx(at_dawn)


def test_too_little_of_a_day_gives_no_value_and_a_day_without_scans_not_that_before() -> None:
    assert found(scans({"temperature": [14.0, 14.0]}, first_h=DAWN + 5)) == []
    assert found(scans({"temperature": [14.0] * 4}, every_h=4.0)) == []
    assert found(scans({"temperature": [14.0]})) == []  # its dawn is still to come
    received = scans({"temperature": [14.0] * 4})
    gone = [one for one in received if one.stamp_ns < dawn(1) + HOUR]
    [alarm] = found(gone)
    assert alarm.is_active
    late = [one for one in received if not dawn(1) <= one.stamp_ns < dawn(2)]
    assert [one.raised_at_ns for one in found(late)] == [dawn(3)]


def test_a_late_scan_corrects_its_day() -> None:
    received = scans({"temperature": [14.0, 14.0, 14.0]})
    late = [one for one in received if dawn(0) + 4 * HOUR < one.stamp_ns < dawn(0) + 15 * HOUR]
    early = [one for one in received if one not in late]
    assert [one.raised_at_ns for one in found(early)] == [dawn(2)]
    fold = new_fold()
    fold.take(early)
    fold.found(40 * DAY_NS)
    fold.take(late)
    after = fold.found(40 * DAY_NS).alarms
    assert [one for one in after if one.reason.sensor in DAILY] == found(received)
    assert [one.raised_at_ns for one in found(received)] == [dawn(1)]


def test_a_range_of_light_belongs_to_a_crop_and_without_a_clock_a_day_is_24_hours() -> None:
    received = scans({"light": [4_000.0, 4_000.0]})
    assert found(received) == []
    inspection = logged(10_000, 1, "a", HOUR, 1, 0, flower=Flower("Lettuce", 1.0))
    [dim] = found([inspection, *received])
    assert dim.reason.sensor == "daily_light_integral"
    assert dim.reason.value == pytest.approx(24 * 3600 * 4_000.0 / 54.0 / 1e6)
    assert dim.reason.limit == 12.0
    fold = AlarmFold(Criteria(own_sensors(), None, ClockDay(None)), SPANS)
    fold.take(scans({"temperature": [14.0] * 3}, first_h=DAWN + 5))
    [cold] = [one for one in fold.found(40 * DAY_NS).alarms if one.reason.sensor in DAILY]
    assert (cold.reason.sensor, cold.raised_at_ns) == (MEAN, 2 * DAY_NS)


@pytest.mark.parametrize("seed", range(6))
def test_at_any_moment_the_recent_window_gives_the_days_that_the_whole_log_gives(seed: int) -> None:
    chance = random.Random(seed)
    # Some days lack their last hours and much of the next day.
    gaps = [(dawn(day) + 20 * HOUR, dawn(day) + 44 * HOUR) for day in range(seed % 3, 7, 3)]
    received = [
        replace(
            one, readings={"temperature": chance.choice([*3 * [5.0, 14.0, 20.0], math.nan, 1e9])}
        )
        for one in scans({"temperature": [0.0] * 7}, every_h=chance.choice([0.5, 1.0]))
        if not any(start < one.stamp_ns < end for start, end in gaps)
    ]
    known = 0
    for at_ns in [*(end + COUNTS_NS for _, end in gaps), *range(dawn(1), 8 * DAY_NS, 11 * HOUR)]:
        by_then = [one for one in received if one.stamp_ns <= at_ns]
        last = [one for one in by_then if at_ns - SINCE_NS <= one.stamp_ns]
        past = days_of(last, own_sensors(), is_day, day_number)
        fold = new_fold()
        chance.shuffle(by_then)
        fold.take(by_then)
        assert counting(past, at_ns) == counting(fold.found(at_ns).days, at_ns)
        known += len(counting(past, at_ns))
    assert known


def counting(days: Mapping[str, Sequence[Reading]], at_ns: int) -> set[Reading]:
    """The alarms that count at a moment."""
    every = [day for of_tag in days.values() for day in of_tag]
    return {day for day in every if at_ns - (day.observed_at_ns or 0) <= COUNTS_NS}


def test_the_last_whole_days_value_holds_until_the_next_scan_after_a_dawn() -> None:
    received = scans({"temperature": [14.0, 20.0, 20.0]})

    def mean(at_ns: int) -> float | None:
        fold = new_fold()
        fold.take(one for one in received if one.stamp_ns <= at_ns)
        days = fold.found(at_ns).days.get("a", ())
        return next((day.value for day in days if day.name == MEAN), None)

    assert mean(dawn(1) - 1) is None
    assert mean(dawn(1)) == mean(dawn(2) - 1) == pytest.approx(14.0, abs=0.2)
    assert mean(dawn(2)) == pytest.approx(20.0, abs=0.2)
