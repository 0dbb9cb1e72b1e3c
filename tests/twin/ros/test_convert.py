"""Messages to values and back; with ROS messages, without a running ROS."""

import math
from dataclasses import replace
from decimal import Decimal
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import Quaternion
from hypothesis import given
from hypothesis import strategies as st
from lupin_msgs.msg import Observation as ObservationMsg
from lupin_msgs.srv import GetEstimateReport
from rclpy.serialization import deserialize_message, serialize_message

from lupin_twin.core import state
from lupin_twin.core.diagnostics import ERROR, OK, Finding
from lupin_twin.core.state import (
    NANOSECONDS_PER_SECOND,
    STATUS_OK,
    Attempt,
    Bloom,
    Flower,
    Observation,
    Pose,
    Reading,
    Snapshot,
    TagState,
)
from lupin_twin.estimate.grading import Record, Tally
from lupin_twin.estimate.solution import Place
from lupin_twin.field.engine import FieldRefused
from lupin_twin.journal.follow import Lot, NotALotError
from lupin_twin.ros import convert, convert_services
from lupin_twin.ros.convert import diagnostics, findings_of
from lupin_twin.ros.convert_services import lot_of, rows_response
from lupin_twin.runtime.estimates import DEFAULT_PLACES, Report, ReportRequest, TagCheck
from tests.support import messages

S = NANOSECONDS_PER_SECOND
PINNED = TagState(
    tag_id="7",
    pose=Pose(1.0, 2.0, 3.0, 0.0, 0.0, 0.6, 0.8),
    readings=(Reading("co2", 512.0, 3 * S), Reading("light", 900.0, 5 * S + 7)),
    last_observed_ns=5 * S + 7,
    flower=Flower(
        species="rose",
        confidence=0.9,
        anomaly=True,
        flower_count=3,
        bug_count=1,
        blooms=(Bloom(1.1, 2.2, 0.5, 0.25, "rose", 0.75, anomaly=True),),
        footprint=((0.0, 0.0, 0.0), (1.5, 0.0, 0.0), (1.5, 0.25, 0.0)),
    ),
    looked_at_ns=4 * S,
    last_try=Attempt(6 * S, 2, "not decoded"),
)
UNPINNED = TagState(tag_id="8")


def test_a_state_survives_the_wire_and_back() -> None:
    snapshot = Snapshot(stamp_ns=9 * S, frame_id="map", tags=(PINNED, UNPINNED))
    state = over_the_wire(convert.StateMessages().build(snapshot))
    times = over_the_wire(convert.StateMessages().times(snapshot))
    assert convert.snapshot_of(state, None, times) == snapshot


def test_without_times_only_the_last_observation_is_known() -> None:
    snapshot = Snapshot(stamp_ns=9 * S, frame_id="map", tags=(PINNED, UNPINNED))
    back = convert.snapshot_of(over_the_wire(convert.StateMessages().build(snapshot)))
    [pinned, unpinned] = back.tags
    assert pinned.readings == tuple(replace(r, observed_at_ns=None) for r in PINNED.readings)
    assert (pinned.last_observed_ns, pinned.looked_at_ns, pinned.last_try) == (
        PINNED.last_observed_ns,
        None,
        None,
    )
    assert unpinned == UNPINNED


def test_a_state_and_its_times_of_the_same_tags_reuse_the_same_objects() -> None:
    snapshot = Snapshot(stamp_ns=9 * S, frame_id="map", tags=(PINNED, UNPINNED))
    state = over_the_wire(convert.StateMessages().build(snapshot))
    times = over_the_wire(convert.StateMessages().times(snapshot))
    first = convert.snapshot_of(state, None, times)
    second = convert.snapshot_of(state, first, times)
    assert all(one is other for one, other in zip(first.tags, second.tags, strict=True))
    times.tags[0].looked_at.sec += 1
    third = convert.snapshot_of(state, second, times)
    assert third.tags[0] is not second.tags[0]
    assert third.tags[1] is second.tags[1]


def over_the_wire(msg: Any) -> Any:
    return deserialize_message(serialize_message(msg), type(msg))


def test_only_a_changed_tag_is_built_anew_and_every_age_is_current() -> None:
    build = convert.StateMessages().build
    first = build(Snapshot(9 * S, "map", (PINNED, UNPINNED)))
    stored = list(first.tags)
    changed = TagState(tag_id="8", readings=(Reading("co2", 1.0),), last_observed_ns=10 * S)
    second = build(Snapshot(12 * S + 7, "map", (PINNED, changed)))
    assert second.tags[0] is stored[0]
    assert second.tags[1] is not stored[1]
    assert second.tags[0].stale_seconds == 7.0
    assert [r.value for r in second.tags[1].readings] == [1.0]


def test_a_tag_reading_is_received_field_by_field() -> None:
    msg = messages.scan(
        "1", {"co2": 1.0}, at=(1.0, 2.0), status=ObservationMsg.STATUS_SKIPPED, stamp_s=4.0
    )
    msg.tag_reading.stamp.sec = 3
    frame_id, sent = convert.received(msg)
    assert frame_id == "map"
    assert sent == Observation("1", 3 * S, {"co2": 1.0}, Pose.at(1.0, 2.0), 3, "", "test", 4 * S)


@pytest.mark.parametrize(("own", "counts"), [("", "odom"), ("camera", "camera")])
def test_the_frame_of_a_flowers_own_pose_takes_precedence(own: str, counts: str) -> None:
    msg = messages.inspection("1", at=(1.0, 2.0), frame_id="odom", pose_frame_id=own)
    assert convert.received(msg)[0] == counts


def test_kinds_and_status_are_those_of_the_message() -> None:
    assert state.KIND_TAG_READING == ObservationMsg.KIND_TAG_READING
    assert state.KIND_FLOWER == ObservationMsg.KIND_FLOWER
    assert state.KIND_ANOMALY == ObservationMsg.KIND_ANOMALY
    assert STATUS_OK == ObservationMsg.STATUS_OK


@given(st.floats(width=32))
def test_the_shortest_decimal_is_the_same_float32(value: float) -> None:
    short = convert.shortest(float(np.float32(value)))
    assert np.array_equal(np.float32(short), np.float32(value), equal_nan=True)
    if math.isfinite(value):
        assert significant_digits(short) <= min(9, significant_digits(float(np.float32(value))))


def significant_digits(value: float) -> int:
    return len(Decimal(repr(value)).normalize().as_tuple().digits)


@pytest.mark.parametrize("yaw", [0.0, 0.5, math.pi / 2, -2.0])
def test_a_maps_yaw_comes_from_its_quaternion_normalised_or_not(yaw: float) -> None:
    for length in (1.0, 2.0):
        origin = messages.pose(1.0, 2.0)
        origin.orientation = Quaternion(z=length * math.sin(yaw / 2), w=length * math.cos(yaw / 2))
        occupancy = convert.map_of(messages.occupancy_grid([[0, 100]], 0.05, origin), 3)
        assert occupancy.origin_yaw == pytest.approx(yaw)
        assert (occupancy.origin_x, occupancy.origin_y, occupancy.revision) == (1.0, 2.0, 3)
        assert occupancy.resolution == 0.05
        assert occupancy.cells.tolist() == [[0, 100]]


REPORT = Report(
    5 * S,
    True,
    "why",
    Record(3 * S, Tally(10, 9), Tally(70, 60)),
    (
        TagCheck("a", 20.0, 2 * S, 21.0, 0.5, -2.0, -1.0, None),
        TagCheck("b", 30.0, S, 21.0, 0.5, 9.0, 9.0, S),
    ),
    (Place(1.0, 2.0, 0.75),),
)


def test_a_report_has_its_counts_tags_and_places_in_columns() -> None:
    response = convert_services.report_response(REPORT)
    assert (response.ok, response.at.sec, response.fitted_at.sec) == (True, 5, 5)
    assert (response.fit_problem, response.graded_since.sec) == ("why", 3)
    assert (response.day_scans, response.day_inside) == (10, 9)
    assert (response.week_scans, response.week_inside) == (70, 60)
    assert (response.tag_ids, [*response.measured], [*response.z]) == (
        ["a", "b"],
        [20.0, 30.0],
        [-2.0, 9.0],
    )
    assert [at.sec for at in response.changed_since] == [0, 1]
    assert [*response.left_out] == [False, True]
    assert [*response.error_ratio] == [0.75]
    bare = convert_services.report_response(Report(S))
    assert (bare.fitted_at.sec, bare.graded_since.sec, bare.tag_ids) == (0, 0, [])


def test_a_report_query_without_a_number_of_places_gets_five() -> None:
    message = GetEstimateReport.Request(sensor_type="co2")
    assert convert_services.report_request_of(message) == ReportRequest("co2", DEFAULT_PLACES)
    message.max_places = 7
    assert convert_services.report_request_of(message) == ReportRequest("co2", 7)
    message.max_places = 21
    with pytest.raises(FieldRefused, match="max_places is 21, the limits are 1 and 20"):
        convert_services.report_request_of(message)


LOT = Lot("0123456789abcdef" * 2, ('["run",1,0,1,1,1,null,null]', '["meta","ä","5"]'), 9, True)


@pytest.mark.parametrize(
    "lot",
    [
        LOT._replace(last=7),
        LOT._replace(last=8, is_all=False),
        LOT._replace(journal="../../home"),
        LOT._replace(journal=""),
        LOT._replace(rows=("[]",) * 500_001),
    ],
)
def test_a_batch_without_a_next_number_or_a_journal_is_invalid(lot: Lot) -> None:
    with pytest.raises(NotALotError):
        lot_of(rows_response(lot), 8)


MESSAGE = [
    Finding("clock", OK, "it runs", {"state": "running"}),
    Finding("drops", ERROR, "", {}),
    Finding("twins", OK, "", {"state topic": "/gh1/twin/state"}),
]


def test_findings_become_statuses_of_their_node_and_back() -> None:
    msg = diagnostics(MESSAGE, "/gh1/lupin_twin", 7 * S)
    assert msg.header.stamp.sec == 7
    assert [status.name for status in msg.status] == [
        "/gh1/lupin_twin: clock",
        "/gh1/lupin_twin: drops",
        "/gh1/lupin_twin: twins",
    ]
    assert list(findings_of(msg, "/gh1/twin/state")) == MESSAGE


def test_a_twin_is_identified_by_the_state_that_it_publishes() -> None:
    msg = diagnostics(MESSAGE, "/gh1/lupin_twin", 7 * S)
    others = diagnostics(MESSAGE[:2], "/gh2/lupin_twin", 7 * S).status
    msg.status = [*others, *msg.status, *others]
    assert list(findings_of(msg, "/gh1/twin/state")) == MESSAGE
    assert not list(findings_of(msg, "/gh2/twin/state"))
