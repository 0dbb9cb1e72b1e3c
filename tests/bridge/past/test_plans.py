"""Answers as of a moment, their cost and their ETags; and the past of derived sensors."""

import json
import math
from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC
from functools import partial
from typing import Any

import pytest

from lupin_bridge.field import FORMATS, JSON, PNG, EstimateQuery, FieldFormat, FieldQuery
from lupin_bridge.judge.day import ClockDay
from lupin_bridge.judge.judging import Criteria, own_sensors
from lupin_bridge.judge.quantities import DAILY, vapour_pressure_deficit_kpa
from lupin_bridge.judge.quantities import vapour_pressure_deficit_kpa as vpd
from lupin_bridge.past import plans as derived
from lupin_bridge.past.fields import Estimated, Field
from lupin_bridge.past.plans import (
    Answered,
    Health,
    History,
    OneTag,
    Plan,
    Query,
    Timeline,
    WholeState,
    answered,
)
from lupin_bridge.query_string import read
from lupin_bridge.stream import schema
from lupin_twin.core.diagnostics import UNKNOWN_JOURNAL
from lupin_twin.core.past import (
    DAY_NS,
    EVERY_TAG,
    MAX_POINTS,
    MAX_READINGS,
    PastRefused,
    SeriesPast,
    SeriesRequest,
    grid,
)
from lupin_twin.core.state import Pose, Reading, Snapshot, TagState
from lupin_twin.estimate.engine import TagPast
from lupin_twin.field.engine import FieldRefused, FieldRules
from lupin_twin.journal.counts import Buckets, individually
from lupin_twin.runtime.workers import SMALL_S
from tests.support.past import MadeUp
from tests.support.store import logged

NS = 10**9
SENSORS = own_sensors()
CRITERIA = Criteria(SENSORS, None, ClockDay(UTC))
RULES = FieldRules(2.0, 1.5, 1.5, max_grid_cells=10_000, clip_to_explored=True)


def tag(tag_id: str, x: float, value: float, at_ns: int = NS) -> TagState:
    pose = Pose(x, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    return TagState(tag_id, pose, (Reading("co2", value, at_ns),), at_ns)


SITE = Snapshot(5 * NS, "map", (tag("a", 0.0, 400.0), tag("b", 1.0, 500.0)))


def log_of(snapshot: Snapshot, **more: Any) -> Any:
    return MadeUp(9 * NS, snapshot=snapshot, **more)


def requested(rules: FieldRules = RULES, **parameters: Any) -> Field:
    values = {"sensor_type": "co2", **parameters}
    query = read(FieldQuery, [(name, str(value)) for name, value in values.items()])
    return Field(None, query, None, rules, CRITERIA)


def field_of(greenhouse: Snapshot, field: Field, field_format: FieldFormat | None = None) -> Plan:
    return replace(field, field_format=field_format).plan(greenhouse)


def body(plan: Plan) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(plan.write(lambda: False).body)
    return found


def test_a_tag_pinned_far_away_by_a_lost_robot_is_left_out_and_named() -> None:
    lost = replace(SITE, tags=(*SITE.tags, tag("c", 0.5, 450.0), tag("lost", 5_000.0, 40.0)))
    written = field_of(lost, requested(), JSON).write(lambda: False)
    found = json.loads(written.body)
    assert (found["origin_x"], found["width"], found["value_min"]) == (-1.5, 40, 400.0)
    assert body(field_of(lost, requested()))["far_off_tags"] == ["lost"]
    there = requested(
        resolution=0.5, bbox_min_x=4_999, bbox_min_y=-1, bbox_max_x=5_001, bbox_max_y=1
    )
    assert set(body(field_of(lost, there, JSON))["values"]) == {40.0}


def test_a_broken_sensor_is_used_for_no_field_and_no_estimate() -> None:
    broken = replace(SITE, tags=(*SITE.tags, tag("c", 0.5, -1.0)))
    values, plain = (body(field_of(it, requested(), JSON))["values"] for it in (broken, SITE))
    assert values == plain
    assert body(field_of(broken, requested())) == body(field_of(SITE, requested()))
    query = read(EstimateQuery, [("sensor_type", "co2")])
    estimated = Estimated(5 * NS, query, JSON, RULES, CRITERIA, 86_400.0)

    def made_of(*readings: tuple[int, float]) -> str:
        past = TagPast("a", 0.0, 0.0, readings)
        return estimated.look(log_of(SITE, pasts=[past])).etag

    good = (NS, 400.0), (2 * NS, 410.0)
    assert made_of(*good, (3 * NS, -1.0)) == made_of(*good)
    assert made_of(*good, (3 * NS, 0.0)) != made_of(*good)


def test_a_derived_reading_uses_the_readings_of_one_scan() -> None:
    def air(tag_id: str, x: float, humidity_at_ns: int) -> TagState:
        dry = tag(tag_id, x, 0.0)
        humidity = Reading("humidity", 60.0, humidity_at_ns)
        return replace(dry, readings=(Reading("temperature", 25.0, NS), humidity))

    greenhouse = Snapshot(5 * NS, "map", (air("a", 0.25, NS), air("b", 9.0, 2 * NS)))
    box = {"bbox_min_x": 0, "bbox_min_y": 0, "bbox_max_x": 0.5, "bbox_max_y": 0.5}
    query: dict[str, Any] = {"sensor_type": "vpd", "resolution": 0.5, **box}
    found = body(field_of(greenhouse, requested(**query), JSON))
    assert found["values"] == [pytest.approx(vapour_pressure_deficit_kpa(25.0, 60.0), rel=1e-6)]
    assert found["sample_count"] == 1
    quality = body(field_of(greenhouse, requested(**query)))
    assert (quality["sensor_type"], quality["unit"], quality["sample_count"]) == ("vpd", "kPa", 1)


def test_before_the_first_observation_state_and_field_are_empty() -> None:
    nothing = Snapshot(1, "map", ())
    assert body(WholeState(1, SENSORS).look(log_of(nothing)))["tags"] == []
    found = body(field_of(nothing, requested(), JSON))
    assert (found["sample_count"], set(found["values"])) == (0, {None})


def judged_at(at_s: float, *tags: TagState, before_s: Sequence[float] = ()) -> Plan:
    """Where tag a was also scanned some seconds before its own second."""
    at_ns = int(at_s * NS)
    recent = tuple(
        logged(number, 1, "a", int((1 - second) * NS), 0, 0, ("temperature",), (22.0,))
        for number, second in enumerate(before_s)
    )
    log = log_of(Snapshot(at_ns, "map", tags), scanned=recent)
    return Health(at_ns, CRITERIA).look(log)


def verdict_of(plan: Plan) -> tuple[str, str]:
    found = body(plan)
    schema.Judgement.model_validate(found)
    return found["house"]["verdict"], found["house"]["day"]["source"]


def test_a_moment_is_judged_by_the_light_of_its_time_else_by_its_clock() -> None:
    def cool_at(at_s: float, *more: Reading) -> Plan:
        at_ns = int(at_s * NS)
        cool = Reading("temperature", 16.0, at_ns)
        return judged_at(at_s, TagState("a", readings=(cool, *more)))

    noon = 1_795_262_400.0
    assert verdict_of(cool_at(noon)) == ("stressed", "clock")
    assert verdict_of(cool_at(noon + 12 * 3600)) == ("healthy", "clock")
    dark = Reading("light", 0.0, int(noon * NS))
    assert verdict_of(cool_at(noon, dark)) == ("healthy", "light")
    assert verdict_of(cool_at(100.0)) == ("stressed", "assumed"), "a simulation has no hours"


def test_readings_hold_as_long_as_the_earlier_scans_imply() -> None:
    old = TagState("a", readings=(Reading("temperature", 22.0, NS),))
    assert verdict_of(judged_at(601, old, before_s=[1.0]))[0] == "healthy"
    assert verdict_of(judged_at(602, old, before_s=[1.0]))[0] == "unknown"
    assert verdict_of(judged_at(602, old, before_s=[240.0]))[0] == "healthy"


def test_too_large_a_past_field_is_refused() -> None:
    limit = replace(RULES, max_grid_cells=40 * 30)
    field_of(SITE, requested(limit), JSON)
    with pytest.raises(FieldRefused, match="the limit is 1199"):
        field_of(SITE, requested(replace(RULES, max_grid_cells=1_199), resolution=0.1), JSON)
    # Without a resolution in the query, the cells get wider.
    field_of(SITE, requested(replace(RULES, max_grid_cells=1_199)), JSON)
    field_of(SITE, requested(replace(RULES, max_grid_cells=4_800), scale=2), PNG)
    with pytest.raises(FieldRefused, match="4800 pixels, the limit is 4799"):
        field_of(SITE, requested(replace(RULES, max_grid_cells=4_799), scale=2), PNG)


@pytest.mark.parametrize(
    "other",
    [
        requested(sensor_type="light"),
        requested(resolution=0.2),
        requested(bbox_min_x=0, bbox_min_y=0, bbox_max_x=1, bbox_max_y=1),
        requested(replace(RULES, idw_power=3.0)),
    ],
)
def test_another_field_has_another_etag(other: Field) -> None:
    def etags(field: Field) -> set[str]:
        return {field_of(SITE, field, it).etag for it in (None, *FORMATS)}

    assert not etags(other) & etags(requested())


QUERIES: tuple[Query, ...] = (
    WholeState(5 * NS, SENSORS),
    OneTag(5 * NS, "b", SENSORS),
    Health(5 * NS, CRITERIA),
    replace(requested(sensor_type="co2_dose"), at_ns=5 * NS, field_format=PNG),
    replace(requested(), at_ns=5 * NS, field_format=PNG),
    replace(requested(), at_ns=5 * NS),
    History(SeriesRequest("a", "co2"), 9 * NS, CRITERIA, UNKNOWN_JOURNAL),
    Timeline(0, 9 * NS, 5, EVERY_TAG, UNKNOWN_JOURNAL),
)


def answer(query: Query, has: str = "") -> Answered:
    """The answer for this greenhouse, and for series without an entry."""
    return answered(query, has, log_of(SITE))


def test_a_large_greenhouse_and_a_large_field_cost_more_than_small_ones() -> None:
    for query in QUERIES:
        assert query.cost_s(10_000) >= query.cost_s(30)
    assert QUERIES[0].cost_s(30) < SMALL_S < QUERIES[0].cost_s(10_000)
    fine = replace(requested(resolution=0.001), at_ns=0, field_format=PNG)
    assert fine.cost_s(30) > SMALL_S, "one that will be refused is no small one"
    # Everything that is read counts, not only the first of it.
    history = History(SeriesRequest("a", "co2"), None, CRITERIA, UNKNOWN_JOURNAL)
    assert history.cost_s(30) < SMALL_S
    assert Timeline(0, 0, 1, "a", UNKNOWN_JOURNAL).cost_s(30) > SMALL_S


S = 10**9
NOW_NS = 1_000 * S
Known = dict[str, dict[int, float]]
CLIMATE: Known = {
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


def answer_of(request: SeriesRequest, known: Known) -> tuple[SeriesPast, list[SeriesRequest]]:
    """The answer for a greenhouse with these readings, and the queries that it made."""
    requested: list[SeriesRequest] = []

    def find(need: SeriesRequest) -> SeriesPast:
        requested.append(need)
        return found_in(need, known, NOW_NS + len(requested))  # time goes on

    return derived.derived_series(request, own_sensors(), is_day, find), requested


def test_only_possible_readings_of_one_scan_are_paired_and_a_real_sensor_takes_precedence() -> None:
    past, requested = answer_of(REQUESTED, CLIMATE)
    assert past.stamps_ns == (10 * S,)
    assert past.means == past.minima == past.maxima == (vpd(20.0, 50.0),)
    assert (past.counts, past.is_bucketed, past.start_ns) == ((1,), False, 10 * S)
    assert [it.sensor_type for it in requested] == ["vpd", "temperature", "humidity"]
    assert {it.end_ns for it in requested[1:]} == {past.end_ns}, "one now for all"
    for name in ("vpd", "co2"):
        past, requested = answer_of(
            replace(REQUESTED, sensor_type=name), {**CLIMATE, name: {5 * S: 1.0}}
        )
        assert (past.means, len(requested)) == ((1.0,), 1)
    past, requested = answer_of(replace(REQUESTED, sensor_type="co2"), CLIMATE)
    assert (past.stamps_ns, len(requested)) == ((), 1)


def test_too_many_derived_readings_come_in_buckets() -> None:
    stamps = [n * 60 * S for n in range(60)]
    known: Known = {
        "temperature": {at: 20.0 + n % 10 for n, at in enumerate(stamps)},
        "humidity": {at: 40.0 + n % 10 for n, at in enumerate(stamps)},
    }
    # Buckets of five minutes begin on whole ones, also before the period.
    past, _ = answer_of(SeriesRequest("a", "vpd", 301 * S, 3_300 * S, 9), known)
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
    past, requested = answer_of(REQUESTED, known)
    assert sum(past.counts) == count - 1
    assert len(requested) < 40
    every = [vpd(20.0 + n % 10, 40.0 + n % 7) for n in range(count - 1)]
    assert (past.minima[0], past.maxima[0]) == pytest.approx((min(every), max(every)), rel=1e-11)


def test_too_many_to_read_one_by_one_are_refused_by_name_and_limit() -> None:
    known: Known = {"temperature": dict.fromkeys(range(S, S + MAX_READINGS + 1), 20.0)}
    with pytest.raises(PastRefused) as refused:
        answer_of(REQUESTED, known)
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
    past, requested = answer_of(request, COURSE)
    assert [(it.sensor_type, it.start_ns // HOUR_NS) for it in requested] == [
        ("daily_light_integral", 30),
        ("light", 6),
    ]
    assert [at_ns / HOUR_NS for at_ns in past.stamps_ns] == [hour + 0.5 for hour in range(30, 60)]
    assert (past.start_ns, past.end_ns) == (30 * HOUR_NS, 60 * HOUR_NS)
    readings = list(COURSE["light"].items())
    daily = DAILY["daily_light_integral"]
    assert past.means[5] == daily.at(past.stamps_ns[5], readings, is_day)
    few, _ = answer_of(replace(request, max_points=4), COURSE)
    assert (few.is_bucketed, sum(few.counts)) == (True, 30)


def test_a_daily_quantity_uses_buckets_where_there_are_many_readings() -> None:
    # A peak in one reading, and a dip at night: both count.
    warm = {n * 10 * S: 20.0 + 5.0 * is_day(n * 10 * S) for n in range(1, 3 * 8_640)}
    warm |= {40 * HOUR_NS + 10 * S: 33.0, 61 * HOUR_NS + 10 * S: 4.0}
    # Many noisy readings at each visit of a robot, and none between: the mean is not their lowest.
    visits = {n * 600 * S + k * S: 18.0 + 4.0 * (k % 2) for n in range(1, 400) for k in range(20)}
    until_ns = 62 * HOUR_NS + 3 * S
    tag = TagState("a", readings=(Reading("temperature", 20.0, until_ns),))
    for course, name, tolerance in (
        (visits, "temperature_24h_mean", 1e-2),
        (warm, "temperature_24h_mean", 1e-2),
        (warm, "temperature_night_minimum", 0.0),
        (warm, "growing_degree_days", 0.0),
    ):
        daily = DAILY[name]
        exact = daily.at(until_ns, list(course.items()), is_day)
        [found] = derived.with_daily(
            [tag],
            daily,
            until_ns,
            sensors=own_sensors(),
            is_day=is_day,
            find=partial(found_in, known={"temperature": course}),
        )
        assert found.readings[-1].value == pytest.approx(exact, abs=tolerance), name
        request = SeriesRequest("a", name, until_ns - 30 * HOUR_NS, until_ns)
        past, _ = answer_of(request, {"temperature": course})
        assert past.means[-1] == pytest.approx(exact, abs=tolerance), name
        assert past.stamps_ns[-1] <= until_ns
    years: Known = {"temperature": dict.fromkeys(range(S, 10**17, 10**13), 20.0)}
    with pytest.raises(PastRefused, match="5000 hours, the limit: ask for a shorter period"):
        answer_of(replace(request, start_ns=S, end_ns=10**17), years)


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
