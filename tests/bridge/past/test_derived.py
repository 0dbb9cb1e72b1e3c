"""The past of derived sensors: only readings of one scan are paired."""

import math
from dataclasses import replace

import pytest

from lupin_bridge.judge.judging import own_sensors
from lupin_bridge.judge.quantities import DAILY
from lupin_bridge.judge.quantities import vapour_pressure_deficit_kpa as vpd
from lupin_bridge.past import plans as derived
from lupin_twin.core.past import (
    DAY_NS,
    MAX_POINTS,
    MAX_READINGS,
    PastRefused,
    SeriesPast,
    SeriesRequest,
    grid,
)
from lupin_twin.core.state import Reading, TagState
from lupin_twin.journal.buckets import Buckets, individually

S = 10**9
NOW_NS = 1_000 * S
Known = dict[str, dict[int, float]]
SITE: Known = {
    "temperature": {10 * S: 20.0, 20 * S: 30.0, 30 * S: 25.0, 40 * S: 26.0},
    # From another moment, impossible, failed.
    "humidity": {10 * S: 50.0, 20 * S + 1: 50.0, 30 * S: 120.0, 40 * S: math.nan, 50 * S: 9.0},
}
REQUESTED = SeriesRequest("a", "vpd", 0, 0, 100)


def is_day(at_ns: int) -> bool:
    return at_ns % DAY_NS < DAY_NS // 2


def found_in(need: SeriesRequest, known: Known, now_ns: int = NOW_NS) -> SeriesPast:
    """The derived readings of a greenhouse with these readings."""
    end_ns = need.end_ns or now_ns
    of = known.get(need.sensor_type, {})
    of = {at: value for at, value in sorted(of.items()) if need.start_ns <= at < end_ns}
    start_ns = need.start_ns or min(of, default=end_ns)
    if len(of) <= need.max_points:
        return individually(list(of.items()), start_ns, end_ns)
    buckets = Buckets(grid(start_ns, end_ns, need.max_points))
    for at_ns, value in of.items():
        buckets.add_value(at_ns, value)
    return buckets.past()


def answer(request: SeriesRequest, known: Known) -> tuple[SeriesPast, list[SeriesRequest]]:
    """The answer for a greenhouse with these readings, and the queries that it made."""
    requested: list[SeriesRequest] = []

    def find(need: SeriesRequest) -> SeriesPast:
        requested.append(need)
        return found_in(need, known, NOW_NS + len(requested))  # time goes on

    return derived.derived_series(request, own_sensors(), is_day, find), requested


def test_only_possible_readings_of_one_scan_are_paired_and_a_real_sensor_takes_precedence() -> None:
    past, requested = answer(REQUESTED, SITE)
    assert past.stamps_ns == (10 * S,)
    assert past.means == past.minima == past.maxima == (vpd(20.0, 50.0),)
    assert (past.counts, past.is_bucketed, past.start_ns) == ((1,), False, 10 * S)
    assert [it.sensor_type for it in requested] == ["vpd", "temperature", "humidity"]
    assert {it.end_ns for it in requested[1:]} == {past.end_ns}, "one now for all"
    for name in ("vpd", "co2"):
        past, requested = answer(replace(REQUESTED, sensor_type=name), {**SITE, name: {5 * S: 1.0}})
        assert (past.means, len(requested)) == ((1.0,), 1)
    past, requested = answer(replace(REQUESTED, sensor_type="co2"), SITE)
    assert (past.stamps_ns, len(requested)) == ((), 1)


def test_too_many_derived_readings_come_in_buckets() -> None:
    stamps = [n * 60 * S for n in range(60)]
    known: Known = {
        "temperature": {at: 20.0 + n % 10 for n, at in enumerate(stamps)},
        "humidity": {at: 40.0 + n % 10 for n, at in enumerate(stamps)},
    }
    # Buckets of five minutes begin on whole ones, also before the period.
    past, _ = answer(SeriesRequest("a", "vpd", 301 * S, 3_300 * S, 9), known)
    assert past.bucket_ns == 600 * S
    assert past.stamps_ns == tuple(range(300 * S, 3_300 * S, 600 * S))
    first = [vpd(20.0 + n % 10, 40.0 + n % 10) for n in range(5, 15)]
    # To the twelve digits of every bucket.
    assert (past.minima[0], past.maxima[0]) == pytest.approx((min(first), max(first)), rel=1e-11)
    assert past.counts[0] == 10
    assert past.means[0] == pytest.approx(sum(first) / 10)


def test_more_readings_than_a_history_may_have_are_still_read() -> None:
    count = 3 * MAX_POINTS
    stamps = [n * S // 20 for n in range(1, count)]
    known: Known = {
        "temperature": {at: 20.0 + n % 10 for n, at in enumerate(stamps)},
        "humidity": {at: 40.0 + n % 7 for n, at in enumerate(stamps)},
    }
    past, requested = answer(REQUESTED, known)
    assert sum(past.counts) == count - 1
    assert len(requested) < 40
    every = [vpd(20.0 + n % 10, 40.0 + n % 7) for n in range(count - 1)]
    assert (past.minima[0], past.maxima[0]) == pytest.approx((min(every), max(every)), rel=1e-11)


def test_too_many_to_read_one_by_one_are_refused_by_name_and_limit() -> None:
    known: Known = {"temperature": dict.fromkeys(range(S, S + MAX_READINGS + 1), 20.0)}
    with pytest.raises(PastRefused) as refused:
        answer(REQUESTED, known)
    assert str(refused.value) == (
        "vpd is derived of temperature and humidity, reading by reading: from 1.000000000 s to "
        "1000.000000001 s temperature has more than 40000 of them, the limit, or hours alone: ask "
        "for a shorter period"
    )


HOUR_NS = 3_600 * S
COURSE: Known = {
    "light": {n * HOUR_NS // 2: 1000.0 * is_day(n * HOUR_NS // 2) for n in range(1, 160)}
}


def test_a_daily_quantity_has_a_value_for_every_hour_of_the_day_so_far() -> None:
    request = SeriesRequest("a", "daily_light_integral", 30 * HOUR_NS, 60 * HOUR_NS, 100)
    past, requested = answer(request, COURSE)
    assert [(it.sensor_type, it.start_ns // HOUR_NS) for it in requested] == [
        ("daily_light_integral", 30),
        ("light", 6),
    ]
    assert [at_ns / HOUR_NS for at_ns in past.stamps_ns] == [hour + 0.5 for hour in range(30, 60)]
    assert (past.start_ns, past.end_ns) == (30 * HOUR_NS, 60 * HOUR_NS)
    readings = list(COURSE["light"].items())
    daily = DAILY["daily_light_integral"]
    assert past.means[5] == daily.at(past.stamps_ns[5], readings, is_day)
    few, _ = answer(replace(request, max_points=4), COURSE)
    assert (few.is_bucketed, sum(few.counts)) == (True, 30)


def test_a_daily_quantity_uses_buckets_where_there_are_many_readings() -> None:
    # A peak in one reading, and a dip at night: both count.
    warm = {n * 10 * S: 20.0 + 5.0 * is_day(n * 10 * S) for n in range(1, 3 * 8_640)}
    warm |= {40 * HOUR_NS + 10 * S: 33.0, 61 * HOUR_NS + 10 * S: 4.0}
    until_ns = 62 * HOUR_NS + 3 * S
    tag = TagState("a", readings=(Reading("temperature", 20.0, until_ns),))
    for name, tolerance in (
        ("temperature_24h_mean", 1e-2),
        ("temperature_night_minimum", 0.0),
        ("growing_degree_days", 0.0),
    ):
        daily = DAILY[name]
        exact = daily.at(until_ns, list(warm.items()), is_day)
        [found] = derived.with_daily(
            [tag],
            daily,
            until_ns,
            sensors=own_sensors(),
            is_day=is_day,
            find=lambda need: found_in(need, {"temperature": warm}),
        )
        assert found.readings[-1].value == pytest.approx(exact, abs=tolerance), name
        request = SeriesRequest("a", name, until_ns - 30 * HOUR_NS, until_ns)
        past, _ = answer(request, {"temperature": warm})
        assert past.means[-1] == pytest.approx(exact, abs=tolerance), name
        assert past.stamps_ns[-1] <= until_ns
    years: Known = {"temperature": dict.fromkeys(range(S, 10**17, 10**13), 20.0)}
    with pytest.raises(PastRefused, match="5000 hours, the limit: ask for a shorter period"):
        answer(replace(request, start_ns=S, end_ns=10**17), years)


def test_tags_as_of_a_moment_get_the_quantity_of_the_day_so_far() -> None:
    at_ns = 60 * HOUR_NS
    lit = TagState("a", readings=(Reading("light", 0.0, at_ns), Reading("co2", 1.0, at_ns)))
    other = TagState("b", readings=(Reading("co2", 1.0, at_ns),))
    own = TagState("c", readings=(Reading("light", 1.0, 1), Reading("daily_light_integral", 7.0)))
    needs: list[SeriesRequest] = []

    def find(need: SeriesRequest) -> SeriesPast:
        needs.append(need)
        return found_in(need, COURSE)

    daily = DAILY["daily_light_integral"]
    found = derived.with_daily(
        (lit, other, own), daily, at_ns, sensors=own_sensors(), is_day=is_day, find=find
    )
    [need] = needs
    assert (need.tag_id, need.sensor_type, need.start_ns) == ("a", "light", 36 * HOUR_NS)
    assert found[1:] == [other, own]
    reading = found[0].readings[-1]
    expected = daily.at(at_ns, list(COURSE["light"].items()), is_day)
    assert reading == Reading("daily_light_integral", expected, at_ns)


def test_a_broken_sensor_does_not_count_and_of_one_moment_the_last_reading_does() -> None:
    good = [(n * HOUR_NS, 20.0) for n in range(1, 26)]
    # A DS18B20 without supply reads -127; and one moment was received twice.
    bad = [(12 * HOUR_NS + 1, -127.0), (13 * HOUR_NS, 5.0)]
    every = sorted((*good, *bad), key=lambda each: each[0])
    every.remove((13 * HOUR_NS, 5.0))
    every.insert(every.index((13 * HOUR_NS, 20.0)), (13 * HOUR_NS, 5.0))

    def find(need: SeriesRequest) -> SeriesPast:
        readings = every if need.sensor_type == "temperature" else []
        stamps, values = [at for at, _ in readings], tuple(value for _, value in readings)
        ones = (1,) * len(readings)
        end_ns = 25 * HOUR_NS + 1
        return SeriesPast(1, end_ns, None, tuple(stamps), ones, values, values, values)

    for name, value in (("temperature_24h_mean", 20.0), ("temperature_night_minimum", 20.0)):
        request = SeriesRequest("a", name, 25 * HOUR_NS, 25 * HOUR_NS + 1, 100)
        past = derived.derived_series(request, own_sensors(), is_day, find)
        assert past.means == (value,)
