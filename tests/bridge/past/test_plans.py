"""Answers as of a moment: their content, their cost, and ETags that identify exactly that."""

import json
from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC
from typing import Any

import pytest

from lupin_bridge.field import FORMATS, JSON, PNG, EstimateQuery, FieldFormat, FieldQuery
from lupin_bridge.judge.day import ClockDay
from lupin_bridge.judge.judging import Criteria, own_sensors
from lupin_bridge.judge.quantities import vapour_pressure_deficit_kpa
from lupin_bridge.past.fields import Estimated, Field
from lupin_bridge.past.plans import (
    Answered,
    Health,
    History,
    LatestOfTag,
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
from lupin_twin.core.history import LatestRequest
from lupin_twin.core.past import EVERY_TAG, PastWrite, RecentRequest, SeriesPast, SeriesRequest
from lupin_twin.core.state import Attempt, Pose, Reading, Snapshot, TagState
from lupin_twin.estimate.engine import TagPast
from lupin_twin.field.engine import FieldRefused, FieldRules
from lupin_twin.field.idw import never
from lupin_twin.runtime.workers import SMALL_S

NS = 10**9
CRITERIA = Criteria(own_sensors(), None, ClockDay(UTC))
RULES = FieldRules(2.0, 1.5, 1.5, max_grid_cells=10_000, clip_to_explored=True)


def tag(tag_id: str, x: float, value: float, at_ns: int = NS) -> TagState:
    pose = Pose(x, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    return TagState(tag_id, pose, (Reading("co2", value, at_ns),), at_ns)


SITE = Snapshot(5 * NS, "map", (tag("a", 0.0, 400.0), tag("b", 1.0, 500.0)))


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
    assert written.headers["X-Field-Far-Off-Count"] == "1"
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
        return estimated.look(lambda need: SITE if need == 5 * NS else [past]).etag

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
    assert body(WholeState(1).look(lambda _: nothing))["tags"] == []
    found = body(field_of(nothing, requested(), JSON))
    assert (found["sample_count"], set(found["values"])) == (0, {None})


def judged_at(at_s: float, *tags: TagState, before_s: Sequence[float] = ()) -> Plan:
    """Where tag a was also scanned some seconds before its own second."""
    at_ns = int(at_s * NS)
    recent = [
        PastWrite(number, 1, "a", int((1 - second) * NS), 0, 0, ("temperature",), (22.0,))
        for number, second in enumerate(before_s)
    ]
    log: dict[Any, Any] = {at_ns: Snapshot(at_ns, "map", tags), RecentRequest(at_ns): tuple(recent)}
    return Health(at_ns, CRITERIA).look(lambda need: log.get(need, ()))


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
    WholeState(5 * NS),
    OneTag(5 * NS, "b"),
    Health(5 * NS, CRITERIA),
    replace(requested(sensor_type="co2_dose"), at_ns=5 * NS, field_format=PNG),
    replace(requested(), at_ns=5 * NS, field_format=PNG),
    replace(requested(), at_ns=5 * NS),
    History(SeriesRequest("a", "co2"), 9 * NS, CRITERIA, UNKNOWN_JOURNAL),
    Timeline(0, 9 * NS, 5, EVERY_TAG, UNKNOWN_JOURNAL),
)


def answer(query: Query, has: str = "") -> Answered:
    """The answer for this greenhouse, and for series without an entry."""
    return answered(query, has, in_site, never)


def in_site(need: Any) -> Any:
    if isinstance(need, SeriesRequest):
        return SeriesPast(0, 9 * NS)
    return SITE if isinstance(need, int) else ()


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


def test_a_tags_data_that_are_not_in_the_log_yet_come_from_its_state() -> None:
    tag = TagState("a", None, (Reading("co2", 7.0, 5 * NS),), 5 * NS, last_try=Attempt(5 * NS))
    for latest, values in ((tag, [7.0]), (None, [])):
        log: dict[Any, Any] = {LatestRequest("a", 3): []}
        body = LatestOfTag("a", latest, 3).look(log.__getitem__).write(never).body
        reported = json.loads(body)
        assert [
            each["value"] for sensor in reported["sensors"] for each in sensor["values"]
        ] == values
        assert len(reported["tries"]) == len(values)
