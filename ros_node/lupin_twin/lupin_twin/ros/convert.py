"""Converts ROS messages to dataclasses and back; only this and `convert_services` know both.

Everything that comes in is copied into immutable values. Everything that goes out is a fresh
message or, for the state, one that is cached per tag, and rebuilt only when the tag has changed.
There are no rules here: what was received becomes plain values, and `ingest` decides what counts.

Numbers go into messages as plain Python `float` and `int`: rclpy does not check fields by default
and would serialise a NumPy scalar as garbage.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterable, Iterator, Mapping
from functools import partial
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Point, Point32, Polygon, PoseStamped, Quaternion
from geometry_msgs.msg import Pose as PoseMsg
from lupin_msgs.msg import (
    DiscoveredTag,
    DiscoveredTags,
    FlowerObservation,
    FlowerPoint,
    SensorReading,
    TagReading,
    TagTimes,
    TwinState,
    TwinTagState,
    TwinTimes,
)
from lupin_msgs.msg import (
    Observation as ObservationMsg,
)
from std_msgs.msg import Header

from lupin_twin.core.diagnostics import STATE_TOPIC, Finding
from lupin_twin.core.ingest import ReceivedTags, scanned_pose
from lupin_twin.core.state import (
    KIND_FLOWER,
    KIND_TAG_READING,
    NANOSECONDS_PER_SECOND,
    NO_FLOWER,
    Attempt,
    Bloom,
    Flower,
    Observation,
    Pose,
    Reading,
    Snapshot,
    TagState,
    same_tags,
)
from lupin_twin.field.explored import OccupancyMap


def diagnostics(findings: Iterable[Finding], node: str, now_ns: int) -> Any:
    """Findings as diagnostic_msgs/DiagnosticArray; `node` is the node's full name."""
    return DiagnosticArray(
        header=Header(stamp=time_msg(now_ns)),
        status=[
            DiagnosticStatus(
                level=bytes([finding.level]),
                name=f"{node}: {finding.name}",
                message=finding.message,
                hardware_id=node,
                values=[KeyValue(key=key, value=value) for key, value in finding.values.items()],
            )
            for finding in findings
        ],
    )


def findings_of(msg: Any, state_topic: str) -> Iterator[Finding]:
    """The findings of the twin that publishes `state_topic`, a name from the root on."""
    mark = KeyValue(key=STATE_TOPIC, value=state_topic)
    node = next((str(it.hardware_id) for it in msg.status if mark in it.values), None)
    begin = f"{node}: "
    for status in msg.status:
        if status.hardware_id == node and status.name.startswith(begin):
            yield Finding(
                name=status.name.removeprefix(begin),
                level=status.level[0],
                message=status.message,
                values={each.key: each.value for each in status.values},
            )


UINT16_MAX: Final = 65_535
INT32_MAX: Final = 2_147_483_647


# --- time -----------------------------------------------------------------------------------


def nanoseconds(stamp: Any) -> int:
    """builtin_interfaces/Time as nanoseconds of ROS time."""
    return int(stamp.sec) * NANOSECONDS_PER_SECOND + int(stamp.nanosec)


def time_msg(stamp_ns: int) -> Time:
    """Nanoseconds of ROS time as builtin_interfaces/Time; clamped to the message's range."""
    sec, nanosec = divmod(max(0, stamp_ns), NANOSECONDS_PER_SECOND)
    return Time(sec=min(sec, INT32_MAX), nanosec=nanosec)


# --- numbers --------------------------------------------------------------------------------


def shortest(value: float) -> float:
    """A float32 field's value as the shortest decimal that is the same float32.

    0.9, not 0.8999999761581421, which would go out to every browser in every frame.
    """
    return float(str(np.float32(value)))


def floats(cells: npt.NDArray[np.float32]) -> array[float]:
    """Cells in the type that a message accepts fastest; copied, because the grid may be cached.

    0.4 ms for a million; assigning the NumPy array itself takes 72 ms, and a list 15 ms.
    """
    return array("f", cells.tobytes())


def _saturated(value: int) -> int:
    return min(max(0, int(value)), UINT16_MAX)


# --- what comes in --------------------------------------------------------------------------


def pose_of(pose: Any) -> Pose:
    """geometry_msgs/Pose as it was sent; `ingest` decides whether it counts."""
    position, orientation = pose.position, pose.orientation
    return Pose(
        x=float(position.x),
        y=float(position.y),
        z=float(position.z),
        qx=float(orientation.x),
        qy=float(orientation.y),
        qz=float(orientation.z),
        qw=float(orientation.w),
    )


def received(msg: Any) -> tuple[str, Observation]:
    """The frame and the content of lupin_msgs/Observation, as sent.

    A flower's pose counts in its own frame, if it has one.
    """
    frame_id, pose = msg.header.frame_id, msg.tag_pose_in_map
    tag_id, stamp_ns, flower = "", 0, None
    values: dict[str, float] = {}
    if msg.kind == KIND_TAG_READING:
        reading = msg.tag_reading
        tag_id, stamp_ns = reading.tag_id, nanoseconds(reading.stamp)
        values = {each.name: float(each.value) for each in reading.readings}
    elif msg.kind == KIND_FLOWER:
        seen = msg.flower
        tag_id, flower = seen.tag_id, _flower(seen, shortest(seen.confidence))
        frame_id, pose = seen.pose.header.frame_id or frame_id, seen.pose.pose
    return frame_id, Observation(
        tag_id,
        stamp_ns,
        values,
        pose_of(pose),
        int(msg.status),
        msg.status_detail,
        msg.source,
        nanoseconds(msg.header.stamp),
        msg.mission_id,
        kind=int(msg.kind),
        flower=flower,
    )


def received_tags(msg: Any) -> ReceivedTags:
    """The tags of lupin_msgs/DiscoveredTags as values."""
    return ((tag.tag_id, partial(pose_of, tag.pose_in_map)) for tag in msg.tags)


def _flower(msg: Any, confidence: float) -> Flower:
    """`msg` is a FlowerObservation or a TwinTagState: they share these field names."""
    return Flower(
        species=msg.species,
        confidence=confidence,
        anomaly=bool(msg.anomaly),
        flower_count=_saturated(msg.flower_count),
        bug_count=_saturated(msg.bug_count),
        blooms=tuple(
            Bloom(
                x=float(bloom.position.x),
                y=float(bloom.position.y),
                z=float(bloom.position.z),
                height_m=shortest(bloom.height_m),
                species=bloom.species,
                confidence=shortest(bloom.confidence),
                anomaly=bool(bloom.anomaly),
            )
            for bloom in msg.flowers
        ),
        footprint=tuple(
            (shortest(point.x), shortest(point.y), shortest(point.z))
            for point in msg.box_footprint.points
        ),
    )


def map_of(msg: Any, revision: int) -> OccupancyMap:
    """nav_msgs/OccupancyGrid as an immutable map.

    Raises:
        ValueError: the map is malformed; the message names the defect.

    """
    info = msg.info
    orientation = info.origin.orientation
    return OccupancyMap(
        frame_id=msg.header.frame_id,
        stamp_ns=nanoseconds(msg.header.stamp),
        width=int(info.width),
        height=int(info.height),
        resolution=shortest(info.resolution),
        origin_x=float(info.origin.position.x),
        origin_y=float(info.origin.position.y),
        origin_yaw=yaw(orientation),
        cells=np.frombuffer(msg.data, dtype=np.int8),
        revision=revision,
    )


def yaw(orientation: Any) -> float:
    """Rotation about z in radians (the ZYX Euler angle, REP 103); 0 for an all-zero quaternion."""
    x, y, z, w = orientation.x, orientation.y, orientation.z, orientation.w
    return math.atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)


def snapshot_of(msg: Any, before: Snapshot | None = None, times: Any = None) -> Snapshot:
    """lupin_msgs/TwinState as a snapshot: the inverse of `StateMessages`.

    `times` is the lupin_msgs/TwinTimes of the same stamp; without it, the only time known is that
    of each tag's last observation. A tag that is as it was in `before` is the same object.
    """
    of_tag = {} if times is None else {each.tag_id: each for each in times.tags}
    tags = (tag_state(each, of_tag.get(each.tag_id)) for each in msg.tags)
    return Snapshot(
        nanoseconds(msg.header.stamp),
        msg.header.frame_id,
        same_tags(before, tags),
    )


def tag_state(tag: Any, times: Any) -> TagState:
    """lupin_msgs/TwinTagState as a value, with its lupin_msgs/TagTimes if there is one."""
    never_observed = math.isinf(tag.stale_seconds)  # NaN is an age that is not known
    observed_at: dict[str, int | None] = {}
    looked_at_ns, last_try = None, None
    if times is not None:
        observed_at = dict(zip(times.sensors, map(_moment, times.observed_at), strict=False))
        looked_at_ns = _moment(times.looked_at)
        attempted_ns = _moment(times.last_try)
        if attempted_ns is not None:
            last_try = Attempt(attempted_ns, int(times.last_try_status), times.last_try_detail)
    return TagState(
        tag_id=tag.tag_id,
        pose=scanned_pose(pose_of(tag.pose)),
        readings=tuple(
            Reading(reading.name, float(reading.value), observed_at.get(reading.name))
            for reading in tag.readings
        ),
        last_observed_ns=None if never_observed else nanoseconds(tag.last_observed),
        flower=_flower(tag, shortest(tag.species_confidence)),
        looked_at_ns=looked_at_ns,
        last_try=last_try,
    )


def _moment(stamp: Any) -> int | None:
    """builtin_interfaces/Time as nanoseconds of ROS time; 0 is never."""
    return nanoseconds(stamp) or None


# --- what goes out --------------------------------------------------------------------------


def observation_message(write: Observation, frame_id: str) -> Any:
    """A scan, an inspection, or an attempt that failed, as lupin_msgs/Observation."""
    header = Header(stamp=time_msg(write.stamp_ns), frame_id=frame_id)
    pose = pose_message(write.pose)
    message = ObservationMsg(
        header=header,
        mission_id=write.mission,
        source=write.source,
        kind=write.kind,
        status=int(write.status),
        status_detail=write.status_detail,
        tag_pose_in_map=pose,
    )
    if write.kind == KIND_TAG_READING:
        message.tag_reading = TagReading(
            tag_id=write.tag_id,
            stamp=header.stamp,
            readings=_readings_message(write.readings.items()),
        )
    else:
        flower = write.flower or NO_FLOWER
        message.flower = FlowerObservation(
            tag_id=write.tag_id,
            pose=PoseStamped(header=header, pose=pose),
            confidence=float(flower.confidence),
            **flower_fields(flower),
        )
    return message


def discovered_tags_message(places: Mapping[str, Pose], header: Any) -> Any:
    """Where tags are, as lupin_msgs/DiscoveredTags."""
    tags = (
        DiscoveredTag(tag_id=tag_id, pose_in_map=pose_message(at)) for tag_id, at in places.items()
    )
    return DiscoveredTags(header=header, tags=list(tags))


def _readings_message(readings: Iterable[tuple[str, float]]) -> list[Any]:
    return [SensorReading(name=name, value=float(number)) for name, number in readings]


class StateMessages:
    """Builds TwinState and TwinTimes from snapshots; caches a tag's parts until the tag changes.

    The messages handed out are the builder's own: publish them at once and do not keep them.
    """

    def __init__(self) -> None:
        self._cache: dict[str, tuple[TagState, Any, Any]] = {}

    def build(self, snapshot: Snapshot) -> Any:
        """The snapshot as lupin_msgs/TwinState; only tags that changed are built anew."""
        tags = []
        for tag in snapshot.tags:
            _, msg, _ = self.parts(tag)
            msg.stale_seconds = tag.stale_seconds(snapshot.now_ns)
            tags.append(msg)
        return TwinState(header=_header(snapshot), tags=tags)

    def times(self, snapshot: Snapshot) -> Any:
        """The snapshot's times as lupin_msgs/TwinTimes, with the same stamp."""
        times = [self.parts(tag)[2] for tag in snapshot.tags]
        return TwinTimes(header=_header(snapshot), tags=times)

    def parts(self, tag: TagState) -> tuple[TagState, Any, Any]:
        """The tag, its TwinTagState without the age, and its TagTimes."""
        cached = self._cache.get(tag.tag_id)
        if cached is None or cached[0] is not tag:
            cached = self._cache[tag.tag_id] = tag, tag_message(tag), times_message(tag)
        return cached


def _header(snapshot: Snapshot) -> Any:
    return Header(stamp=time_msg(snapshot.stamp_ns), frame_id=snapshot.frame_id)


def times_message(tag: TagState) -> Any:
    """One tag as lupin_msgs/TagTimes."""
    last_try = tag.last_try or Attempt(0)
    return TagTimes(
        tag_id=tag.tag_id,
        sensors=[reading.name for reading in tag.readings],
        observed_at=[time_msg(reading.observed_at_ns or 0) for reading in tag.readings],
        looked_at=time_msg(tag.looked_at_ns or 0),
        last_try=time_msg(last_try.stamp_ns),
        last_try_status=last_try.status,
        last_try_detail=last_try.detail,
    )


def tag_message(tag: TagState) -> Any:
    """One tag as lupin_msgs/TwinTagState, its age left for the publisher to fill in."""
    return TwinTagState(
        tag_id=tag.tag_id,
        pose=pose_message(tag.pose),
        readings=_readings_message((r.name, r.value) for r in tag.readings),
        last_observed=time_msg(tag.last_observed_ns or 0),
        species_confidence=float(tag.flower.confidence),
        **flower_fields(tag.flower),
    )


def flower_fields(flower: Flower) -> dict[str, Any]:
    """The fields that TwinTagState and FlowerObservation share."""
    return {
        "species": flower.species,
        "anomaly": flower.anomaly,
        "flower_count": _saturated(flower.flower_count),
        "bug_count": _saturated(flower.bug_count),
        "flowers": [_bloom_message(bloom) for bloom in flower.blooms],
        "box_footprint": _polygon_message(flower.footprint),
    }


def _bloom_message(bloom: Bloom) -> Any:
    return FlowerPoint(
        position=Point(x=float(bloom.x), y=float(bloom.y), z=float(bloom.z)),
        height_m=float(bloom.height_m),
        species=bloom.species,
        confidence=float(bloom.confidence),
        anomaly=bloom.anomaly,
    )


def _polygon_message(footprint: Iterable[tuple[float, float, float]]) -> Any:
    return Polygon(points=[Point32(x=float(x), y=float(y), z=float(z)) for x, y, z in footprint])


def pose_message(pose: Pose | None) -> Any:
    """A pose as geometry_msgs/Pose; no pose is `w == 0`, while ROS's default is 1."""
    if pose is None:
        return PoseMsg(orientation=Quaternion(w=0.0))
    return PoseMsg(
        position=Point(x=pose.x, y=pose.y, z=pose.z),
        orientation=Quaternion(x=pose.qx, y=pose.qy, z=pose.qz, w=pose.qw),
    )
