"""ROS messages that no healthy robot sends."""

import random
from array import array
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final

import builtin_interfaces.msg
import geometry_msgs.msg
import lupin_msgs.msg
import nav_msgs.msg
import rcl_interfaces.msg
import std_msgs.msg
import type_description_interfaces.msg
from geometry_msgs.msg import Point, Point32, Pose, Quaternion
from lupin_msgs.msg import (
    DiscoveredTag,
    DiscoveredTags,
    FlowerPoint,
    Observation,
    SensorReading,
    TwinState,
    TwinTagState,
)
from nav_msgs.msg import OccupancyGrid
from rclpy.serialization import serialize_message

# The messages of each package, for `lupin_twin.ros.message_limits`.
PACKAGES: Final[Mapping[str, Any]] = {
    module.__name__.partition(".")[0]: module
    for module in (
        builtin_interfaces.msg,
        geometry_msgs.msg,
        lupin_msgs.msg,
        nav_msgs.msg,
        rcl_interfaces.msg,
        std_msgs.msg,
        type_description_interfaces.msg,
    )
}

NAN, INF = float("nan"), float("inf")
DOUBLES: Final = (NAN, INF, -INF, 0.0, -0.0, 1e300, -1e300, 5e-324, 1.7976931348623157e308, 21.5)
FLOATS: Final = (NAN, INF, -INF, 0.0, 3.4e38, -3.4e38, 1e-45, 0.9)
TEXTS: Final = (
    *("", " ", "a", "co2", "CO2", "\x01\x02\x1b[31m\x7f", "a\nb\r\n", "</script><script>alert(1)"),
    *("\u202egnp.exe", "\ufeff\u200b", "\U0001f33a" * 64, "é\u0301", "../../etc/passwd", "%00%0a"),
    *('"', "\\", "'; DROP TABLE", "nan", "null", "0", "-1", "__proto__", "x" * 256, "x" * 257),
)
MEGABYTE: Final = "m" * 1_000_000
SECONDS: Final = (0, 1, -1, -(2**31), 2**31 - 1, 1_700_000_000)
NANOSECONDS: Final = (0, 999_999_999, 1_000_000_000, 2**32 - 1)


def any_pose(chance: random.Random) -> Any:
    """A pose with any numbers."""
    return Pose(
        position=Point(**{axis: chance.choice(DOUBLES) for axis in "xyz"}),
        orientation=Quaternion(**{axis: chance.choice(DOUBLES) for axis in "xyzw"}),
    )


def any_stamp(stamp: Any, chance: random.Random) -> None:
    """Set a stamp to any time."""
    stamp.sec, stamp.nanosec = chance.choice(SECONDS), chance.choice(NANOSECONDS)


def any_readings(chance: random.Random, count: int) -> list[Any]:
    """Readings with any names, often the same ones."""
    return [
        SensorReading(name=chance.choice(TEXTS), value=chance.choice(DOUBLES)) for _ in range(count)
    ]


def fill_flower(flower: Any, chance: random.Random) -> None:
    """Fill the fields that a FlowerObservation and a TwinTagState share."""
    flower.species = chance.choice(TEXTS)
    flower.anomaly = chance.random() < 0.5
    flower.flower_count = flower.bug_count = 65_535
    flower.flowers = [
        FlowerPoint(
            position=any_pose(chance).position,
            height_m=chance.choice(FLOATS),
            species=chance.choice(TEXTS),
            confidence=chance.choice(FLOATS),
        )
        for _ in range(chance.randrange(5))
    ]
    flower.box_footprint.points = [
        Point32(**{axis: chance.choice(FLOATS) for axis in "xyz"})
        for _ in range(chance.randrange(80))
    ]


def any_observation(chance: random.Random) -> Any:
    """An observation of any kind, with any content."""
    msg = Observation(
        kind=chance.choice((0, 0, 1, 1, 2, 255)),
        status=chance.choice((0, 0, 0, 1, 3, 255)),
        mission_id=chance.choice(TEXTS),
        source=chance.choice(TEXTS),
        status_detail=chance.choice(TEXTS),
        tag_pose_in_map=any_pose(chance),
    )
    msg.header.frame_id = chance.choice(("map", "map", "", "odom", TEXTS[5]))
    any_stamp(msg.header.stamp, chance)
    any_stamp(msg.tag_reading.stamp, chance)
    msg.tag_reading.tag_id = msg.flower.tag_id = chance.choice(TEXTS)
    msg.tag_reading.sim_time_of_day_seconds = chance.choice(DOUBLES)
    msg.tag_reading.readings = any_readings(chance, chance.randrange(12))
    msg.flower.pose.pose = any_pose(chance)
    msg.flower.confidence = chance.choice(FLOATS)
    fill_flower(msg.flower, chance)
    return msg


def any_discovery(chance: random.Random) -> Any:
    """Discovered tags at any positions."""
    msg = DiscoveredTags(
        tags=[
            DiscoveredTag(
                tag_id=chance.choice(TEXTS),
                pose_in_map=any_pose(chance),
                species=chance.choice(TEXTS),
                species_confidence=chance.choice(FLOATS),
                sightings=2**32 - 1,
            )
            for _ in range(chance.randrange(9))
        ]
    )
    msg.header.frame_id = chance.choice(("map", "", "odom"))
    return msg


def any_map(chance: random.Random) -> Any:
    """A map whose size, position and cells need not agree."""
    msg = OccupancyGrid()
    msg.header.frame_id = chance.choice(("map", "", "odom"))
    any_stamp(msg.header.stamp, chance)
    msg.info.resolution = chance.choice((*FLOATS, 0.05, -0.05))
    msg.info.width = chance.choice((0, 1, 3, 2**16, 2**32 - 1))
    msg.info.height = chance.choice((0, 1, 3, 2**16, 2**32 - 1))
    msg.info.origin = any_pose(chance)
    cells = chance.choice((0, 1, 3, 9, 10))
    msg.data = array("b", [chance.randrange(-128, 128) for _ in range(cells)])
    return msg


def any_state(chance: random.Random) -> Any:
    """A TwinState that no twin publishes: the same tag twice, NaN and infinity."""
    msg = TwinState(tags=[any_tag_state(chance) for _ in range(chance.randrange(20))])
    msg.header.frame_id = chance.choice(TEXTS)
    any_stamp(msg.header.stamp, chance)
    return msg


def any_tag_state(chance: random.Random) -> Any:
    """One of its tags."""
    tag = TwinTagState(
        tag_id=chance.choice(TEXTS),
        pose=any_pose(chance),
        readings=any_readings(chance, chance.randrange(12)),
        stale_seconds=chance.choice(FLOATS),
        species_confidence=chance.choice(FLOATS),
    )
    any_stamp(tag.last_observed, chance)
    fill_flower(tag, chance)
    return tag


ANY: Final[Mapping[str, Callable[[random.Random], Any]]] = {
    "/floranova/observations": any_observation,
    "/perception/discovered_tags": any_discovery,
    "/map": any_map,
}


def damaged(message: Any, chance: random.Random) -> bytes:
    """A message as bytes (CDR), some of them changed, lost or added."""
    data = bytearray(serialize_message(message))
    kind = chance.randrange(4)
    if kind == 0:
        del data[chance.randrange(len(data)) :]
    elif kind == 1:
        data += chance.randbytes(chance.randrange(100))
    else:
        # Four bytes at once are a length far beyond the end, or into the middle.
        for _ in range(chance.randrange(1, 6)):
            at = chance.randrange(0, len(data), 4)
            data[at : at + 4] = chance.choice(
                (b"\xff\xff\xff\xff", b"\x00\x00\x00\x7f", b"\xff" * 4)
            )
    return bytes(data)


def lies(data: bytes) -> Iterator[bytes]:
    """A message (CDR) with each of its words replaced by a length that its bytes do not contain."""
    for at in range(4, len(data) - 3, 4):
        for claim in claims(data, at):
            yield lie_at(data, at, claim)


def long_lies(message_type: Any) -> list[bytes]:
    """A message with half a million bytes after it, with each word claiming all of them."""
    whole = serialize_message(message_type())
    long = whole + bytes(500_000)
    return [lie_at(long, at, claims(long, at)[0]) for at in range(4, len(whole) - 3, 4)]


def claims(data: bytes, at: int) -> tuple[int, ...]:
    """Lengths that the bytes after the word at `at` do not contain.

    As many elements as there are bytes is the worst: a deserialiser that needs one byte per
    element allocates all of them.
    """
    left = len(data) - at - 4
    return (left, left // 2, left + 1, 2**31 - 1, 2**32 - 1)


def lie_at(data: bytes, at: int, claim: int) -> bytes:
    """A message (CDR, little-endian) whose word at `at` is `claim`."""
    return data[:at] + claim.to_bytes(4, "little") + data[at + 4 :]
