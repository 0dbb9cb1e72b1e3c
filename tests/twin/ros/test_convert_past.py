from __future__ import annotations

import math
from typing import Any

import pytest
from lupin_msgs.srv import GetHistory, GetStateAt
from rclpy.serialization import deserialize_message, serialize_message

from lupin_twin.core.past import (
    DEFAULT_POINTS,
    NotRemembered,
    PastRefused,
    SeriesPast,
    error_of,
)
from lupin_twin.core.state import Bloom, Snapshot, TwinStore
from lupin_twin.ros import convert, convert_past
from lupin_twin.ros.responses import refusal
from tests.support.store import S, at, failed_look, look, scan

AT_NS = 90 * S + 7


def over_the_wire(message: Any) -> Any:
    return deserialize_message(serialize_message(message), type(message))


def snapshot() -> Snapshot:
    store = TwinStore()
    store.pin("3", at(5.0))
    store.record(scan("1", 10.0, at(1.0, 2.0), co2=400.0, light=math.inf))
    store.record(scan("1", 20.0, succeeded=False))
    store.record(scan("2", 30.0, temperature=21.5))
    bloom = Bloom(1.0, 2.0, 3.0, 0.4, "lupin", 0.8, True)
    store.record_inspection(
        look("2", 40.0, species="lupin", confidence=0.9, bug_count=3, blooms=(bloom,))
    )
    store.record_inspection(failed_look("4", 50.0))
    return store.snapshot(AT_NS, "map")


def received(response: Any) -> Snapshot:
    return convert.snapshot_of(response.state, None, response.times)


def test_a_state_as_of_then_survives_the_wire_with_its_times_and_ages() -> None:
    response = over_the_wire(convert_past.state_response(snapshot()))
    assert response.ok
    assert response.error_message == ""
    assert response.state.header == response.times.header
    assert [tag.stale_seconds for tag in response.state.tags] == pytest.approx(
        [math.inf, 80.0, 50.0, 40.0]
    )
    assert received(response) == snapshot()


def unexpected(what: str, error: Exception) -> None:
    raise AssertionError(what) from error


@pytest.mark.parametrize("kind", [GetStateAt, GetHistory])
@pytest.mark.parametrize(
    "error",
    [
        PastRefused("at is 3 s"),
        NotRemembered("no journal", is_lasting=True),
        NotRemembered("busy", is_lasting=False),
    ],
)
def test_a_refusal_is_empty_but_for_why_and_is_read_again(kind: Any, error: Exception) -> None:
    full = kind.Response(ok=True)
    response = over_the_wire(refusal(full, error, unexpected))
    assert response.ok is False
    response.error_message, message = "", response.error_message
    assert response == kind.Response()
    read = error_of(message)
    assert str(error) in str(read)
    assert getattr(read, "is_lasting", None) == getattr(error, "is_lasting", None)


def test_no_number_of_points_is_the_default() -> None:
    request = GetHistory.Request(tag_id="1", sensor_type="co2")
    assert convert_past.series_request(request).max_points == DEFAULT_POINTS


def test_readings_survive_the_wire_those_that_are_no_number_too() -> None:
    values = (1.0, math.nan, math.inf)
    past = SeriesPast(0, 9 * S, None, (S, 2 * S, 2 * S), (1, 1, 1), values, values, values)
    response = over_the_wire(convert_past.series_response(past))
    assert (response.ok, response.is_bucketed) == (True, False)
    assert [stamp.sec for stamp in response.stamps] == [1, 2, 2]
    for found in (response.means, response.minima, response.maxima):
        assert list(found) == pytest.approx(values, nan_ok=True)


def test_buckets_survive_the_wire_their_counts_as_far_as_the_message_has_room() -> None:
    past = SeriesPast(0, 9 * S, S, (S, 3 * S), (2, 2**40), (2.0, 4.0), (1.0, 3.0), (3.0, 5.0))
    response = over_the_wire(convert_past.series_response(past))
    assert response.is_bucketed
    assert list(response.counts) == [2, 2**32 - 1]
    assert (list(response.minima), list(response.maxima)) == ([1.0, 3.0], [3.0, 5.0])
