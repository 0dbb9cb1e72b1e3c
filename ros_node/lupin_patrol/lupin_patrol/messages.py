"""Events to ROS messages: the only module that knows both.

Every number is written as `float(...)` or `int(...)`: rclpy does not check fields by default and
serialises a wrong type as garbage.
"""

from __future__ import annotations

from array import array

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Point32, Pose, PoseStamped, Quaternion
from lupin_msgs.msg import (
    DiscoveredTag,
    DiscoveredTags,
    FlowerPoint,
    Observation,
    SensorReading,
)
from nav_msgs.msg import OccupancyGrid
from std_msgs.msg import Header

from lupin_patrol.events import FlowersSeen, MapGrown, ScanStatus, TagPose, TagScanned
from lupin_patrol.events import TagsDiscovered as TagsDiscoveredEvent
from lupin_patrol.perception import Sighting
from lupin_patrol.plants import Bloom

SOURCE = "lupin_patrol"

_STATUS = {
    ScanStatus.OK: Observation.STATUS_OK,
    ScanStatus.UNREACHABLE: Observation.STATUS_UNREACHABLE,
    ScanStatus.SCAN_FAILED: Observation.STATUS_SCAN_FAILED,
}


def tag_reading(event: TagScanned, stamp: Time, frame_id: str) -> Observation:
    """Return a KIND_TAG_READING observation; without success it has no readings and no pose."""
    message = _observation(event, stamp, frame_id)
    message.kind = Observation.KIND_TAG_READING
    message.status = _STATUS[event.status]
    message.status_detail = event.status_detail
    message.tag_reading.tag_id = event.tag_id
    message.tag_reading.stamp = stamp
    message.tag_reading.sim_time_of_day_seconds = float(event.time_of_day_s)
    message.tag_reading.readings = [
        SensorReading(name=name, value=float(value)) for name, value in event.readings
    ]
    return message


def flower(event: FlowersSeen, stamp: Time, frame_id: str) -> Observation:
    """Return a KIND_FLOWER observation."""
    message = _observation(event, stamp, frame_id)
    message.kind = Observation.KIND_FLOWER
    message.status = Observation.STATUS_OK
    seen = message.flower
    seen.tag_id = event.tag_id
    seen.pose = PoseStamped(header=message.header, pose=message.tag_pose_in_map)
    seen.species = event.look.species
    seen.confidence = float(event.look.confidence)
    seen.anomaly = event.look.anomaly
    seen.flower_count = int(event.look.flower_count)
    seen.bug_count = int(event.look.bug_count)
    seen.flowers = [_flower_point(bloom) for bloom in event.look.blooms]
    seen.box_footprint.points = [
        Point32(x=float(x), y=float(y), z=0.0) for x, y in event.box.corners
    ]
    return message


def discovered_tags(event: TagsDiscoveredEvent, stamp: Time, frame_id: str) -> DiscoveredTags:
    """Return perception's whole list."""
    return DiscoveredTags(
        header=Header(stamp=stamp, frame_id=frame_id),
        tags=[_discovered_tag(sighting) for sighting in event.sightings],
    )


def occupancy_grid(event: MapGrown, stamp: Time, frame_id: str) -> OccupancyGrid:
    """Return the map."""
    grid = event.grid
    message = OccupancyGrid(header=Header(stamp=stamp, frame_id=frame_id))
    message.info.map_load_time = stamp
    message.info.resolution = float(grid.resolution_m)
    message.info.width = int(grid.width)
    message.info.height = int(grid.height)
    message.info.origin.position = Point(x=float(grid.origin[0]), y=float(grid.origin[1]), z=0.0)
    message.data = array("b", grid.cells)
    return message


def _observation(event: TagScanned | FlowersSeen, stamp: Time, frame_id: str) -> Observation:
    return Observation(
        header=Header(stamp=stamp, frame_id=frame_id),
        mission_id=f"patrol-{event.pass_index + 1:04d}",
        source=SOURCE,
        tag_pose_in_map=_pose(event.pose),
    )


def _pose(pose: TagPose | None) -> Pose:
    if pose is None:
        # w defaults to 1 in ROS 2, which would pin the tag at the origin.
        return Pose(orientation=Quaternion(x=0.0, y=0.0, z=0.0, w=0.0))
    x, y, z, qx, qy, qz, qw = map(float, pose.numbers)
    return Pose(position=Point(x=x, y=y, z=z), orientation=Quaternion(x=qx, y=qy, z=qz, w=qw))


def _flower_point(bloom: Bloom) -> FlowerPoint:
    x, y = bloom.position
    return FlowerPoint(
        position=Point(x=float(x), y=float(y), z=float(bloom.z)),
        height_m=float(bloom.height_m),
        species=bloom.species,
        confidence=float(bloom.confidence),
        anomaly=bloom.anomaly,
    )


def _discovered_tag(sighting: Sighting) -> DiscoveredTag:
    return DiscoveredTag(
        tag_id=sighting.tag.tag_id,
        pose_in_map=_pose(TagPose(sighting.tag.position, sighting.tag.yaw)),
        species=sighting.species,
        species_confidence=float(sighting.species_confidence),
        anomaly=sighting.anomaly,
        sightings=int(sighting.sightings),
    )
