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
from rclpy.serialization import deserialize_message, serialize_message

from lupin_twin.core import history, ingest
from lupin_twin.core.state import (
    NANOSECONDS_PER_SECOND,
    STATUS_OK,
    Attempt,
    Bloom,
    Flower,
    Pose,
    Reading,
    Scan,
    Snapshot,
    TagState,
)
from lupin_twin.ros import convert
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
    found = convert.received(msg)
    assert (found.kind, found.frame_id) == (0, "map")
    assert found.sent == Scan(
        "1", 3 * S, (Reading("co2", 1.0),), Pose.at(1.0, 2.0), 3, "", "test", 4 * S
    )


@pytest.mark.parametrize(("own", "counts"), [("", "odom"), ("camera", "camera")])
def test_the_frame_of_a_flowers_own_pose_takes_precedence(own: str, counts: str) -> None:
    msg = messages.inspection("1", at=(1.0, 2.0), frame_id="odom", pose_frame_id=own)
    assert convert.received(msg).frame_id == counts


def test_kinds_and_status_are_those_of_the_message() -> None:
    assert history.KIND_TAG_READING == ObservationMsg.KIND_TAG_READING
    assert history.KIND_FLOWER == ObservationMsg.KIND_FLOWER
    assert ingest.KIND_ANOMALY == ObservationMsg.KIND_ANOMALY
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
