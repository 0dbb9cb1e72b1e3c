"""Events to ROS messages, with rclpy's field checks on."""

from math import cos, pi, sin
from typing import Any

import pytest
from lupin_msgs.msg import Observation
from rclpy.serialization import deserialize_message, serialize_message

from lupin_patrol import node as messages
from lupin_patrol.greenhouse import Rect
from lupin_patrol.mission import ScanStatus, Visited, pose_of
from lupin_twin.core.state import Bloom, Flower, Inspection, Scan

STAMP_NS = 12_000_000_034
POSE = pose_of((1.5, 2.5), pi / 2)
# Numbers that a float32 holds exactly: sent and received values are equal.
BLOOM = Bloom(1.5, 2.2, 0.6, 0.25, "lupin", 0.875, anomaly=True)
BOX = Rect(1.0, 2.0, 2.0, 2.25)
CORNERS = tuple((x, y, 0.0) for x, y in BOX.corners)
FLOWER = Flower("lupin", 0.75, True, 12, 3, (BLOOM,), CORNERS)
FLOWERS = Visited(3.2, 4, 0.0, Inspection("7", 0, FLOWER, POSE))


def over_the_wire(message: Any) -> Any:
    """The received message; a value of the wrong type does not survive this."""
    received = deserialize_message(serialize_message(message), type(message))
    assert received == message
    return received


@pytest.mark.parametrize(
    ("status", "expected"),
    [
        (ScanStatus.UNREACHABLE, Observation.STATUS_UNREACHABLE),
        (ScanStatus.SCAN_FAILED, Observation.STATUS_SCAN_FAILED),
    ],
)
def test_a_failed_scan_has_a_reason_and_no_pose(status: ScanStatus, expected: int) -> None:
    failed = Visited(3.0, 0, 0.0, Scan("7", 0, (), None, status, "the way is blocked"))
    message = over_the_wire(messages.observation(failed, STAMP_NS, "map"))
    assert message.status == expected
    assert message.status_detail == "the way is blocked"
    assert message.tag_reading.tag_id == "7"
    assert len(message.tag_reading.readings) == 0
    # Quaternion.w is 1 by default, which would put the tag at the origin.
    assert message.tag_pose_in_map.orientation.w == 0.0


def test_a_flower_observation() -> None:
    message = over_the_wire(messages.observation(FLOWERS, STAMP_NS, "map"))
    assert message.kind == Observation.KIND_FLOWER
    assert message.status == Observation.STATUS_OK
    assert message.mission_id == "patrol-0005"
    flower = message.flower
    assert (flower.tag_id, flower.species) == ("7", "lupin")
    assert flower.confidence == 0.75
    assert (flower.anomaly, flower.flower_count, flower.bug_count) == (True, 12, 3)
    assert (flower.pose.header, flower.pose.pose) == (message.header, message.tag_pose_in_map)
    # The tag's x axis turns into the aisle.
    turned = message.tag_pose_in_map.orientation
    assert (turned.z, turned.w) == pytest.approx((sin(pi / 4), cos(pi / 4)))
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
