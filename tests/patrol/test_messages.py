"""Events to ROS messages, with rclpy's field checks on."""

from __future__ import annotations

from math import cos, pi, sin
from typing import Any

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from lupin_msgs.msg import DiscoveredTags, Observation
from nav_msgs.msg import OccupancyGrid
from rclpy.serialization import deserialize_message, serialize_message

from lupin_patrol import node as messages
from lupin_patrol.greenhouse import TAG_HEIGHT_M, Rect, Table, Tag
from lupin_patrol.mission import (
    FlowersSeen,
    MapGrown,
    ScanStatus,
    TagScanned,
    TagsDiscovered,
    pose_of,
)
from lupin_patrol.perception import Grid, Sighting
from lupin_twin.core.state import Bloom, Flower

STAMP = Time(sec=12, nanosec=34)
POSE = pose_of((1.5, 2.5), pi / 2)
SCAN = TagScanned(
    at_s=3.0,
    pass_index=0,
    tag_id="7",
    status=ScanStatus.OK,
    status_detail="",
    time_of_day_s=32_400.0,
    readings=(("temperature", 21.5), ("soil_moisture", 55.0)),
    pose=POSE,
)
# Numbers that a float32 holds exactly: what was sent equals what comes.
BLOOM = Bloom(1.5, 2.2, 0.6, 0.25, "lupin", 0.875, anomaly=True)
BOX = Rect(1.0, 2.0, 2.0, 2.25)
CORNERS = tuple((x, y, 0.0) for x, y in BOX.corners)
FLOWERS = FlowersSeen(3.2, 4, "7", POSE, Flower("lupin", 0.75, True, 12, 3, (BLOOM,), CORNERS))


@pytest.fixture(autouse=True)
def _field_checks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_PYTHON_CHECK_FIELDS", "1")


def over_the_wire(message: Any) -> Any:
    """What a subscriber gets; a value of the wrong type does not survive this."""
    received = deserialize_message(serialize_message(message), type(message))
    assert received == message
    return received


def test_a_tag_reading() -> None:
    message = over_the_wire(messages.tag_reading(SCAN, STAMP, "map"))
    assert message.kind == Observation.KIND_TAG_READING
    assert message.status == Observation.STATUS_OK
    assert message.status_detail == ""
    assert (message.header.stamp, message.header.frame_id) == (STAMP, "map")
    assert (message.mission_id, message.source) == ("patrol-0001", "lupin_patrol")
    assert message.tag_reading.tag_id == "7"
    assert message.tag_reading.stamp == STAMP
    assert message.tag_reading.sim_time_of_day_seconds == 32_400.0
    assert [(r.name, r.value) for r in message.tag_reading.readings] == list(SCAN.readings)


def test_a_pose_turns_the_tags_x_axis_into_the_aisle() -> None:
    pose = messages.tag_reading(SCAN, STAMP, "map").tag_pose_in_map
    assert (pose.position.x, pose.position.y, pose.position.z) == (1.5, 2.5, TAG_HEIGHT_M)
    q = pose.orientation
    assert (q.x, q.y) == (0.0, 0.0)
    assert (q.z, q.w) == pytest.approx((sin(pi / 4), cos(pi / 4)))


@pytest.mark.parametrize(
    ("status", "expected"),
    [
        (ScanStatus.UNREACHABLE, Observation.STATUS_UNREACHABLE),
        (ScanStatus.SCAN_FAILED, Observation.STATUS_SCAN_FAILED),
    ],
)
def test_a_failed_scan_says_why_and_has_no_pose(status: ScanStatus, expected: int) -> None:
    failed = TagScanned(3.0, 0, "7", status, "the way is blocked", 0.0, (), None)
    message = over_the_wire(messages.tag_reading(failed, STAMP, "map"))
    assert message.status == expected
    assert message.status_detail == "the way is blocked"
    assert message.tag_reading.tag_id == "7"
    assert len(message.tag_reading.readings) == 0
    # Quaternion.w is 1 by default, which would put the tag at the origin.
    assert message.tag_pose_in_map.orientation.w == 0.0


def test_a_flower_observation() -> None:
    message = over_the_wire(messages.inspection(FLOWERS, STAMP, "map"))
    assert message.kind == Observation.KIND_FLOWER
    assert message.status == Observation.STATUS_OK
    assert message.mission_id == "patrol-0005"
    flower = message.flower
    assert (flower.tag_id, flower.species) == ("7", "lupin")
    assert flower.confidence == 0.75
    assert (flower.anomaly, flower.flower_count, flower.bug_count) == (True, 12, 3)
    assert (flower.pose.header, flower.pose.pose) == (message.header, message.tag_pose_in_map)
    assert [(p.x, p.y, p.z) for p in flower.box_footprint.points] == [
        (1.0, 2.0, 0.0),
        (2.0, 2.0, 0.0),
        (2.0, 2.25, 0.0),
        (1.0, 2.25, 0.0),
    ]
    [bloom] = flower.flowers
    assert (bloom.position.x, bloom.position.y) == (BLOOM.x, BLOOM.y)
    assert bloom.position.z == BLOOM.z
    assert bloom.height_m == 0.25
    assert (bloom.species, bloom.anomaly) == ("lupin", True)
    assert bloom.confidence == 0.875


def test_the_list_of_discovered_tags() -> None:
    table = Table("one", BOX)
    tag = Tag("7", (1.5, 2.5), ("co2",), table, (1.5, 2.25), (0.0, 1.0), (1.5, 2.65))
    event = TagsDiscovered(1.0, (Sighting(tag, "tulip", 0.625, anomaly=False, sightings=4),))
    message = over_the_wire(messages.discovered_tags(event, STAMP, "hall"))
    assert isinstance(message, DiscoveredTags)
    assert (message.header.stamp, message.header.frame_id) == (STAMP, "hall")
    [discovered] = message.tags
    assert (discovered.tag_id, discovered.species, discovered.sightings) == ("7", "tulip", 4)
    assert discovered.species_confidence == 0.625
    assert discovered.anomaly is False
    assert discovered.pose_in_map == messages.tag_reading(SCAN, STAMP, "map").tag_pose_in_map


def test_the_map() -> None:
    cells = np.array([-1, 0, 100, 0, 0, -1], dtype=np.int8)
    event = MapGrown(1.0, Grid(3, 2, 0.0625, (-0.05, -0.1), cells.tobytes()))
    message = over_the_wire(messages.occupancy_grid(event, STAMP, "map"))
    assert isinstance(message, OccupancyGrid)
    assert (message.info.width, message.info.height) == (3, 2)
    assert message.info.resolution == 0.0625
    origin = message.info.origin
    assert (origin.position.x, origin.position.y, origin.position.z) == (-0.05, -0.1, 0.0)
    assert origin.orientation.w == 1.0
    assert list(message.data) == cells.tolist()


def test_numpy_numbers_survive() -> None:
    # A float32 in a float64 field is garbage on the wire, unless it is converted.
    reading: Any = np.float32(412.0)
    event = TagScanned(3.0, 0, "7", ScanStatus.OK, "", 1.0, (("co2", reading),), POSE)
    message = over_the_wire(messages.tag_reading(event, STAMP, "map"))
    assert message.tag_reading.readings[0].value == 412.0
