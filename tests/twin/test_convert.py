"""Messages to values and back; with ROS messages, without a running ROS."""

from __future__ import annotations

import math
from array import array
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import Quaternion
from hypothesis import given
from hypothesis import strategies as st
from lupin_msgs.msg import Observation as ObservationMsg
from lupin_msgs.srv import GetField
from rclpy.serialization import deserialize_message, serialize_message

from lupin_twin import convert
from lupin_twin.idw import FieldGrid
from lupin_twin.state import (
    NANOSECONDS_PER_SECOND,
    Bloom,
    Flower,
    Pose,
    Reading,
    Snapshot,
    TagState,
)
from tests.support import messages

S = NANOSECONDS_PER_SECOND
PINNED = TagState(
    tag_id="7",
    pose=Pose(1.0, 2.0, 3.0, 0.0, 0.0, 0.6, 0.8),
    readings=(Reading("co2", 512.0), Reading("light", 900.0)),
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
)
UNPINNED = TagState(tag_id="8")


def test_a_state_survives_the_wire_and_back() -> None:
    snapshot = Snapshot(stamp_ns=9 * S, frame_id="map", tags=(PINNED, UNPINNED))
    msg = convert.StateMessages().build(snapshot)
    over_the_wire = deserialize_message(serialize_message(msg), type(msg))
    assert convert.snapshot_of(over_the_wire) == snapshot


def test_no_pose_is_published_as_w_zero_and_no_observation_as_infinitely_old() -> None:
    tag = convert.StateMessages().build(Snapshot(9 * S, "map", (UNPINNED,))).tags[0]
    assert tag.pose.orientation.w == 0.0
    assert (tag.last_observed.sec, tag.last_observed.nanosec) == (0, 0)
    assert math.isinf(tag.stale_seconds)


def test_only_a_changed_tag_is_built_anew_and_every_age_is_current() -> None:
    build = convert.StateMessages().build
    first = build(Snapshot(9 * S, "map", (PINNED, UNPINNED)))
    kept = list(first.tags)
    changed = TagState(tag_id="8", readings=(Reading("co2", 1.0),), last_observed_ns=10 * S)
    second = build(Snapshot(12 * S + 7, "map", (PINNED, changed)))
    assert second.tags[0] is kept[0]
    assert second.tags[1] is not kept[1]
    assert second.tags[0].stale_seconds == 7.0
    assert [r.value for r in second.tags[1].readings] == [1.0]


def test_counts_saturate_at_the_messages_range() -> None:
    tag = TagState(tag_id="1", flower=Flower(flower_count=70_000, bug_count=-3))
    msg = convert.tag_message(tag)
    assert (msg.flower_count, msg.bug_count) == (65_535, 0)


@pytest.mark.parametrize("w", [1.0, -0.5, 1e-17])
def test_a_scans_pose_counts_with_any_w_but_zero(w: float) -> None:
    pose = convert.scanned_pose(messages.pose(1.0, 2.0, w=w))
    assert pose is not None
    assert (pose.x, pose.qw) == (1.0, w)


def test_a_scans_pose_with_w_zero_or_a_broken_number_is_none() -> None:
    assert convert.scanned_pose(messages.pose(w=0.0)) is None
    assert convert.scanned_pose(messages.pose(w=-0.0)) is None
    for broken in (math.nan, math.inf):
        assert convert.scanned_pose(messages.pose(broken)) is None
        assert convert.scanned_pose(messages.pose(w=broken)) is None
        assert convert.discovered_pose(messages.pose(0.0, broken)) is None
        assert convert.discovered_pose(messages.pose(w=broken)) is None


def test_a_discoverys_w_zero_is_taken_as_one() -> None:
    for w, expected in ((0.0, 1.0), (-0.0, 1.0), (0.5, 0.5)):
        pose = convert.discovered_pose(messages.pose(w=w))
        assert pose is not None
        assert pose.qw == expected


@pytest.mark.parametrize("length", [1.0, 2.5])
def test_a_discoverys_half_turn_stays_one_and_is_told_from_no_pose(length: float) -> None:
    msg = messages.pose(1.0, 2.0)
    msg.orientation = Quaternion(x=0.6 * length, y=0.0, z=-0.8 * length, w=0.0)
    pose = convert.discovered_pose(msg)
    assert pose is not None
    assert (pose.qx, pose.qy, pose.qz) == pytest.approx((0.6, 0.0, -0.8), abs=1e-15)
    assert 0.0 < pose.qw < 1e-8
    published = convert.pose_message(pose)
    assert (
        convert.scanned_pose(deserialize_message(serialize_message(published), type(msg))) == pose
    )


@pytest.mark.parametrize(
    ("stamp_s", "now_s", "expected_s"),
    [
        (60.0, 100.0, 60.0),  # latched earlier: as old as it says
        (100.0, 100.0, 100.0),
        (130.0, 100.0, 100.0),  # from the future: no younger than now
        (0.0, 100.0, 100.0),  # no stamp: now
        (60.0, 0.0, 60.0),  # simulated time has not started
        (0.0, 0.0, 1e-9),  # of neither: not 0, which stands for never
    ],
)
def test_when_an_observation_was_made(stamp_s: float, now_s: float, expected_s: float) -> None:
    header = messages.scan("1", stamp_s=stamp_s).header
    assert convert.observed_at(header.stamp, round(now_s * S)) == round(expected_s * S)


def test_a_scan_that_is_not_ok_has_no_pose() -> None:
    ok = messages.scan("1", {"co2": 1.0}, at=(1.0, 2.0))
    failed = messages.scan("1", {"co2": 1.0}, at=(1.0, 2.0), status=ObservationMsg.STATUS_SKIPPED)
    assert convert.scan(ok, S).pose is not None
    assert convert.scan(ok, S).succeeded
    assert convert.scan(failed, S).pose is None
    assert not convert.scan(failed, S).succeeded
    assert convert.scan(failed, S).readings == (Reading("co2", 1.0),)


def test_a_scan_without_a_stamp_was_made_when_its_sensors_were_read() -> None:
    msg = messages.scan("1", {"co2": 1.0})
    msg.tag_reading.stamp.sec = 3
    assert convert.scan(msg, 10 * S).stamp_ns == 3 * S
    messages.set_stamp(msg.header, 4.0)
    assert convert.scan(msg, 10 * S).stamp_ns == 4 * S


def test_a_look_carries_everything() -> None:
    msg = messages.look(
        "1", "rose", at=(1.0, 2.0), anomaly=True, flower_count=4, bug_count=2,
        blooms=[(0.5, 0.5)], footprint=[(0.0, 0.0), (1.0, 0.0)], stamp_s=3.0,
    )  # fmt: skip
    look = convert.flower_look(msg, 10 * S)
    assert (look.tag_id, look.stamp_ns) == ("1", 3 * S)
    assert look.pose is not None
    assert look.flower == Flower(
        species="rose",
        confidence=0.9,
        anomaly=True,
        flower_count=4,
        bug_count=2,
        blooms=(Bloom(0.5, 0.5, 0.0, 0.4, "rose", 0.8, anomaly=False),),
        footprint=((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),
    )


@given(st.floats(width=32))
def test_the_shortest_decimal_is_the_same_float32(value: float) -> None:
    short = convert.shortest(float(np.float32(value)))
    assert np.array_equal(np.float32(short), np.float32(value), equal_nan=True)
    assert len(repr(short)) <= len(repr(float(np.float32(value))))


def test_times_at_the_ends_of_the_messages_range() -> None:
    assert convert.time_msg(-5).sec == 0
    assert convert.time_msg(10**20).sec == 2_147_483_647
    assert convert.nanoseconds(convert.time_msg(3 * S + 4)) == 3 * S + 4


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


def test_a_malformed_map_is_refused() -> None:
    for breakage in ({"width": 3}, {"resolution": 0.0}, {"resolution": math.nan}):
        msg = messages.occupancy_grid([[0, 0]])
        for name, value in breakage.items():
            setattr(msg.info, name, value)
        with pytest.raises(ValueError, match="map"):
            convert.map_of(msg, 1)


def test_a_response_is_filled_from_a_grid_and_shares_nothing_with_it() -> None:
    values = np.array([1.0, np.nan, 3.0, 4.0], dtype=np.float32)
    grid = FieldGrid(2, 2, 0.5, -1.5, 0.25, values, 1.0, 4.0, 9)
    response: Any = convert.fill_field_response(GetField.Response(), grid)
    values[0] = 99.0
    assert isinstance(response.values, array)
    assert response.ok
    assert np.array_equal(response.values, [1.0, np.nan, 3.0, 4.0], equal_nan=True)
    assert (response.width, response.height, response.sample_count) == (2, 2, 9)
    assert (response.origin_x, response.origin_y, response.resolution_used) == (0.5, -1.5, 0.25)
    assert (response.value_min, response.value_max) == (1.0, 4.0)


def test_a_field_request_is_read_field_by_field() -> None:
    request = convert.field_request(
        GetField.Request(
            sensor_type="co2",
            resolution=0.5,
            bbox_min_x=1.0,
            bbox_min_y=2.0,
            bbox_max_x=3.0,
            bbox_max_y=4.0,
        )
    )
    assert (request.sensor_type, request.resolution) == ("co2", 0.5)
    assert (request.bbox_min_x, request.bbox_min_y) == (1.0, 2.0)
    assert (request.bbox_max_x, request.bbox_max_y) == (3.0, 4.0)
