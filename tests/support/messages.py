"""Messages as a robot sends them, with short calls."""

from array import array
from collections.abc import Mapping, Sequence
from typing import Any

from geometry_msgs.msg import Point, Point32, Pose, Quaternion
from lupin_msgs.msg import DiscoveredTag, DiscoveredTags, FlowerPoint, Observation, SensorReading
from nav_msgs.msg import OccupancyGrid


def pose(x: float = 0.0, y: float = 0.0, z: float = 0.0, w: float = 1.0) -> Any:
    """A pose, m; `w=0` is none."""
    return Pose(
        position=Point(x=float(x), y=float(y), z=float(z)), orientation=Quaternion(w=float(w))
    )


NO_POSE = pose(w=0.0)

# ROS's information about a message, here of one that arrived at once.
INFO = {"source_timestamp": 0, "received_timestamp": 0, "publication_sequence_number": None}


def scan(
    tag_id: str,
    readings: Mapping[str, float] | None = None,
    at: tuple[float, float] | None = None,
    *,
    status: int = Observation.STATUS_OK,
    frame_id: str = "map",
    stamp_s: float = 0.0,
) -> Any:
    """An observation of a tag's sensors; `at` is the tag's position, none by default."""
    msg = Observation(kind=Observation.KIND_TAG_READING, status=status, source="test")
    msg.header.frame_id = frame_id
    set_stamp(msg.header, stamp_s)
    msg.tag_reading.tag_id = tag_id
    msg.tag_reading.readings = [
        SensorReading(name=name, value=float(value)) for name, value in (readings or {}).items()
    ]
    msg.tag_pose_in_map = NO_POSE if at is None else pose(*at)
    return msg


def inspection(
    tag_id: str,
    species: str = "lupin",
    at: tuple[float, float] | None = None,
    *,
    anomaly: bool = False,
    flower_count: int = 0,
    bug_count: int = 0,
    blooms: Sequence[tuple[float, float]] = (),
    footprint: Sequence[tuple[float, float]] = (),
    frame_id: str = "map",
    pose_frame_id: str = "",
    stamp_s: float = 0.0,
) -> Any:
    msg = Observation(kind=Observation.KIND_FLOWER, source="test")
    msg.header.frame_id = frame_id
    set_stamp(msg.header, stamp_s)
    flower = msg.flower
    flower.tag_id = tag_id
    flower.species = species
    flower.confidence = 0.9
    flower.anomaly = anomaly
    flower.flower_count = flower_count
    flower.bug_count = bug_count
    flower.pose.header.frame_id = pose_frame_id
    flower.pose.pose = NO_POSE if at is None else pose(*at)
    flower.flowers = [
        FlowerPoint(
            position=Point(x=float(x), y=float(y)), height_m=0.4, species=species, confidence=0.8
        )
        for x, y in blooms
    ]
    flower.box_footprint.points = [Point32(x=float(x), y=float(y)) for x, y in footprint]
    return msg


def set_stamp(header: Any, stamp_s: float) -> None:
    """Set a header's stamp, s of ROS time."""
    header.stamp.sec = int(stamp_s)
    header.stamp.nanosec = round((stamp_s % 1) * 1e9)


def discovered(tags: Mapping[str, Any], frame_id: str = "map") -> Any:
    """Discovered tags: tag_id to pose."""
    msg = DiscoveredTags(
        tags=[
            DiscoveredTag(tag_id=tag_id, pose_in_map=p, sightings=1) for tag_id, p in tags.items()
        ]
    )
    msg.header.frame_id = frame_id
    return msg


def occupancy_grid(
    rows: Sequence[Sequence[int]],
    resolution: float = 1.0,
    origin: Any = None,
    frame_id: str = "map",
    stamp_s: int = 0,
) -> Any:
    """A map from its rows, the first at the origin (smallest y)."""
    msg = OccupancyGrid()
    msg.header.stamp.sec = stamp_s
    msg.header.frame_id = frame_id
    msg.info.resolution = float(resolution)
    msg.info.height = len(rows)
    msg.info.width = len(rows[0]) if rows else 0
    msg.info.origin = pose() if origin is None else origin
    msg.data = array("b", [cell for row in rows for cell in row])
    return msg
