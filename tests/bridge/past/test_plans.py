"""Queries of the past: they are pickled, state their cost, and honour ETags."""

import json
from dataclasses import replace
from typing import Any

from lupin_bridge.field import PNG
from lupin_bridge.judge.judging import Criteria
from lupin_bridge.past.plans import (
    Answered,
    Health,
    History,
    LatestOfTag,
    OneTag,
    Query,
    Timeline,
    WholeState,
    answered,
)
from lupin_bridge.settings import Settings
from lupin_twin.core.diagnostics import UNKNOWN_JOURNAL
from lupin_twin.core.history import LatestRequest
from lupin_twin.core.past import EVERY_TAG, SeriesPast, SeriesRequest
from lupin_twin.core.state import Attempt, Reading, TagState
from lupin_twin.field.idw import never
from lupin_twin.runtime.workers import SMALL_S
from tests.bridge.past.test_as_of import NS, SITE, requested

CRITERIA = Criteria.of(Settings(time_zone="Europe/Amsterdam"))
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
    return answered(query, has, found, never)


def found(need: Any) -> Any:
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
