"""Rows of the journal as the messages that made them, serialised.

What the journal does not keep is left at its default: where the robot saw a tag at each scan (its
place comes as a discovered tag), the hour of the simulated day. The stamp is the one by which it
counts; the frame is empty, which is the one that the twin expects.
"""

from __future__ import annotations

from collections.abc import Iterable

from geometry_msgs.msg import Point, Point32, Quaternion
from geometry_msgs.msg import Pose as PoseMsg
from lupin_msgs.msg import (
    DiscoveredTag,
    DiscoveredTags,
    FlowerObservation,
    FlowerPoint,
    Observation,
    SensorReading,
)
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock

from lupin_twin.convert import time_msg
from lupin_twin.journal.rows import KIND_FLOWER, LookRow, PinRow, ScanRow
from lupin_twin.state import Flower, Pose


def observation(row: ScanRow | LookRow) -> bytes:
    """lupin_msgs/Observation."""
    stamp = time_msg(row.stamp_ns)
    msg = Observation(mission_id=row.mission, source=row.source)
    msg.header.stamp = stamp
    msg.tag_pose_in_map.orientation.w = 0.0
    msg.flower.pose.pose.orientation.w = 0.0
    if isinstance(row, ScanRow):
        msg.kind, msg.status, msg.status_detail = row.kind, row.status, row.detail
        if row.kind == KIND_FLOWER:
            msg.flower.tag_id = row.tag_id
        else:
            msg.tag_reading.tag_id = row.tag_id
            msg.tag_reading.stamp = stamp
            msg.tag_reading.readings = [
                SensorReading(name=reading.name, value=float(reading.value))
                for reading in row.readings
            ]
    else:
        msg.kind = KIND_FLOWER
        msg.flower.tag_id = row.tag_id
        _fill(msg.flower, row.flower)
    return bytes(serialize_message(msg))


def discovered(pins: Iterable[PinRow]) -> bytes:
    """lupin_msgs/DiscoveredTags."""
    pins = list(pins)
    tags = [DiscoveredTag(tag_id=pin.tag_id, pose_in_map=_pose(pin.pose)) for pin in pins]
    msg = DiscoveredTags(tags=tags)
    msg.header.stamp = time_msg(max((pin.stamp_ns for pin in pins), default=0))
    return bytes(serialize_message(msg))


def clock(now_ns: int) -> bytes:
    """rosgraph_msgs/Clock."""
    return bytes(serialize_message(Clock(clock=time_msg(now_ns))))


def _fill(msg: FlowerObservation, flower: Flower) -> None:
    msg.species = flower.species
    msg.confidence = float(flower.confidence)
    msg.anomaly = flower.anomaly
    msg.flower_count = flower.flower_count
    msg.bug_count = flower.bug_count
    msg.flowers = [
        FlowerPoint(
            position=Point(x=bloom.x, y=bloom.y, z=bloom.z),
            height_m=float(bloom.height_m),
            species=bloom.species,
            confidence=float(bloom.confidence),
            anomaly=bloom.anomaly,
        )
        for bloom in flower.blooms
    ]
    msg.box_footprint.points = [
        Point32(x=float(x), y=float(y), z=float(z)) for x, y, z in flower.footprint
    ]


def _pose(pose: Pose) -> PoseMsg:
    return PoseMsg(
        position=Point(x=pose.x, y=pose.y, z=pose.z),
        orientation=Quaternion(x=pose.qx, y=pose.qy, z=pose.qz, w=pose.qw),
    )
