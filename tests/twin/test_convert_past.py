from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from lupin_msgs.srv import GetHistory, GetStateAt
from rclpy.serialization import deserialize_message, serialize_message

from lupin_twin import convert_past
from lupin_twin.bounds import MAX_TAGS
from lupin_twin.convert_past import NotAnAnswerError
from lupin_twin.past import (
    DEFAULT_POINTS,
    MAX_POINTS,
    NotRemembered,
    PastRefused,
    SeriesPast,
    SeriesRequest,
)
from lupin_twin.state import Bloom, Snapshot, TwinStore
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
    store.record_look(
        look("2", 40.0, species="lupin", confidence=0.9, bug_count=3, blooms=(bloom,))
    )
    store.record_look(failed_look("4", 50.0))
    return store.snapshot(AT_NS, "map")


def test_a_state_as_of_then_survives_the_wire_with_its_times_and_ages() -> None:
    response = over_the_wire(convert_past.state_response(snapshot()))
    assert response.ok
    assert response.error_message == ""
    assert response.state.header == response.times.header
    assert [tag.stale_seconds for tag in response.state.tags] == pytest.approx(
        [math.inf, 80.0, 50.0, 40.0]
    )
    assert convert_past.snapshot_of(response, AT_NS) == snapshot()


def test_a_moment_before_everything_is_an_empty_state() -> None:
    response = over_the_wire(convert_past.state_response(Snapshot(0, "map", ())))
    assert convert_past.snapshot_of(response, 0) == Snapshot(0, "map", ())


def broken(change: str) -> Any:
    response = convert_past.state_response(snapshot())
    match change:
        case "moment":
            response.state.header.stamp.nanosec += 1
        case "times":
            response.times.header.stamp.nanosec += 1
        case "tags":
            response.times.tags.reverse()
        case "fewer":
            response.times.tags.pop()
        case "many":
            response.state.tags *= MAX_TAGS // 4 + 1
    return response


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ("moment", "a state as of 90000000008 ns, asked for was 90000000007 ns"),
        ("times", "a state as of 90000000008 ns"),
        ("tags", "its times are not those of its tags"),
        ("fewer", "its times are not those of its tags"),
        ("many", "20004 tags, the limit is 20000"),
    ],
)
def test_what_is_no_state_as_of_then_is_not_taken_for_one(change: str, says: str) -> None:
    with pytest.raises(NotAnAnswerError, match=says):
        convert_past.snapshot_of(broken(change), AT_NS)


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
    response = over_the_wire(convert_past.refused(full, error))
    assert response.ok is False
    response.error_message, message = "", response.error_message
    assert response == kind.Response()
    response.error_message = message
    asked: Any = AT_NS if kind is GetStateAt else SeriesRequest("1", "co2")
    read = convert_past.snapshot_of if kind is GetStateAt else convert_past.entries_of
    with pytest.raises(type(error), match=str(error)) as raised:
        read(response, asked)
    if isinstance(raised.value, NotRemembered):
        assert raised.value.is_lasting == getattr(error, "is_lasting", None)


def test_a_question_survives_the_wire() -> None:
    asked = SeriesRequest("1", "~scans", 5 * S + 1, 9 * S, 17)
    request = over_the_wire(convert_past.series_request_message(asked))
    assert convert_past.series_request(request) == asked
    assert convert_past.moment_message(AT_NS).at.nanosec == 7


def test_no_number_of_points_is_the_default() -> None:
    request = GetHistory.Request(tag_id="1", sensor_type="co2")
    assert convert_past.series_request(request).max_points == DEFAULT_POINTS


@pytest.mark.parametrize(
    "wrong", [{"tag_id": ""}, {"max_points": MAX_POINTS + 1}, {"max_points": 2**32 - 1}]
)
def test_a_question_past_its_limits_is_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(PastRefused):
        convert_past.series_request(
            GetHistory.Request(**({"tag_id": "1", "sensor_type": "co2"} | wrong))
        )


def test_a_time_before_zero_is_refused() -> None:
    request = GetHistory.Request(tag_id="1", sensor_type="co2")
    request.start.sec = -1
    with pytest.raises(PastRefused, match="before 0"):
        convert_past.series_request(request)


ASKED = SeriesRequest("1", "co2", 10 * S, 20 * S, 4)


def series(bucket_ns: int | None = None, **changes: Any) -> SeriesPast:
    entries: dict[str, Any] = {
        "stamps_ns": (10 * S, 12 * S + 5, 19 * S),
        "counts": (1, 1, 1) if bucket_ns is None else (3, 1, 2**40),
        "means": (1.0, 2.0, 3.0),
        "minima": (1.0, 2.0, 3.0),
        "maxima": (1.0, 2.0, 3.0),
    }
    return SeriesPast(10 * S, 20 * S, bucket_ns, **(entries | changes))


def received(past: SeriesPast, asked: SeriesRequest = ASKED) -> convert_past.Entries:
    return convert_past.entries_of(over_the_wire(convert_past.series_response(past)), asked)


def test_readings_survive_the_wire_those_that_are_no_number_too() -> None:
    values = (1.0, math.nan, math.inf)
    entries = received(series(means=values, minima=values, maxima=values))
    assert not entries.is_bucketed
    assert entries.stamps_ns == (10 * S, 12 * S + 5, 19 * S)
    assert str(entries.means) == str(entries.minima) == "(1.0, nan, inf)"


def test_buckets_survive_the_wire_their_counts_as_far_as_the_message_has_room() -> None:
    entries = received(series(5 * S))
    assert entries.is_bucketed
    assert entries.counts == (3, 1, 2**32 - 1)


@pytest.mark.parametrize(
    ("past", "says"),
    [
        (series(counts=(1, 1)), "arrays of [2, 3] entries"),
        (series(maxima=()), "arrays of [0, 3] entries"),
        (series(stamps_ns=(10 * S, 9 * S, 19 * S)), "do not ascend"),
        (series(5 * S, stamps_ns=(10 * S, 10 * S, 19 * S)), "do not ascend"),
        (series(stamps_ns=(10 * S - 1, 12 * S, 19 * S)), "not of the period"),
        (series(stamps_ns=(10 * S, 12 * S, 20 * S)), "not of the period"),
        (series(counts=(1, 2, 1)), "counts more than one"),
        (series(5 * S, counts=(1, 0, 1)), "a bucket of nothing"),
        (series(5 * S, minima=(1.0, 2.5, 3.0)), "or of no range"),
        (series(5 * S, minima=(1.0, math.nan, 3.0)), "or of no range"),
    ],
)
def test_what_is_no_series_is_not_taken_for_one(past: SeriesPast, says: str) -> None:
    with pytest.raises(NotAnAnswerError, match=says.replace("[", r"\[")):
        received(past)


def test_more_entries_than_asked_for_are_not_taken() -> None:
    fewer = SeriesRequest("1", "co2", 10 * S, 20 * S, 3)
    assert len(received(series(), fewer).stamps_ns) == 3
    with pytest.raises(NotAnAnswerError, match="3 entries, the limit is 2"):
        received(series(), SeriesRequest("1", "co2", 10 * S, 20 * S, 2))


def test_runs_are_told_all_of_them() -> None:
    asked = SeriesRequest("*", "~runs", 10 * S, 20 * S, 1)
    assert len(received(series(), asked).stamps_ns) == 3


@given(
    st.lists(st.tuples(st.integers(0, 2**31 * S - 1), st.floats()), max_size=50),
)
def test_any_readings_survive_the_wire(found: list[tuple[int, float]]) -> None:
    found.sort(key=lambda entry: entry[0])
    stamps = tuple(stamp_ns for stamp_ns, _ in found)
    values = tuple(value for _, value in found)
    past = SeriesPast(0, 2**31 * S, None, stamps, (1,) * len(found), values, values, values)
    entries = received(past, SeriesRequest("1", "co2", max_points=MAX_POINTS))
    assert entries.stamps_ns == stamps
    assert list(map(repr, entries.means)) == list(map(repr, values))


def test_a_large_state_is_estimated_as_more_than_a_small_one() -> None:
    store = TwinStore()
    estimates = [convert_past.building_s(store)]
    for write in (look("1"), look("2", blooms=(Bloom(0.0, 0.0, 0.0, 0.0, "", 0.0, False),) * 9)):
        store.record_look(write)
        estimates.append(convert_past.building_s(store))
    assert estimates[0] == 0.0
    assert estimates[1] - estimates[0] < estimates[2] - estimates[1]
