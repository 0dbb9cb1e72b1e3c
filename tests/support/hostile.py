"""ROS messages that no healthy robot sends."""

import random
import re
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
from lupin_msgs.msg import DiscoveredTags, Observation
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
VALUES: Final[Mapping[str, Any]] = {
    "string": TEXTS,
    "double": DOUBLES,
    "float": FLOATS,
    "boolean": (True, False),
    "uint8": (0, 0, 0, 1, 1, 2, 3, 255),
    "uint16": (0, 65_535),
    "int32": (0, 1, -1, -(2**31), 2**31 - 1, 1_700_000_000),  # seconds
    "uint32": (0, 999_999_999, 1_000_000_000, 2**32 - 1),  # nanoseconds
}
Leaf = Callable[[str, random.Random], Any]


def extreme(kind: str, chance: random.Random) -> Any:
    """A number or a text that no healthy robot sends."""
    return chance.choice(VALUES[kind])


def anything(message_type: Any, chance: random.Random, leaf: Leaf = extreme) -> Any:
    """A message of any type, with any content that its types allow."""
    message = message_type()
    for name, kind in message_type.get_fields_and_field_types().items():
        setattr(message, name, _any_value(kind, chance, leaf))
    return message


def _any_value(kind: str, chance: random.Random, leaf: Leaf) -> Any:
    if sequence := re.fullmatch(r"sequence<(.+?)(?:, (\d+))?>", kind):
        count = chance.randrange(min(int(sequence[2] or 12), 12) + 1)
        return [_any_value(sequence[1], chance, leaf) for _ in range(count)]
    if fixed := re.fullmatch(r"(.+)\[(\d+)\]", kind):
        return [_any_value(fixed[1], chance, leaf) for _ in range(int(fixed[2]))]
    if "/" in kind:
        package, _, name = kind.partition("/")
        return anything(getattr(PACKAGES[package], name), chance, leaf)
    return leaf(kind, chance)


def any_observation(chance: random.Random) -> Any:
    """An observation of any kind, with any content, often in the right frame."""
    msg = anything(Observation, chance)
    msg.header.frame_id = chance.choice(("map", "map", "", "odom", TEXTS[5]))
    msg.flower.pose.header.frame_id = ""
    return msg


def any_discovery(chance: random.Random) -> Any:
    """Discovered tags at any positions."""
    msg = anything(DiscoveredTags, chance)
    msg.header.frame_id = chance.choice(("map", "", "odom"))
    return msg


def any_map(chance: random.Random) -> Any:
    """A map whose size, position and cells need not agree."""
    msg = OccupancyGrid(info=anything(nav_msgs.msg.MapMetaData, chance))
    msg.header.frame_id = chance.choice(("map", "", "odom"))
    msg.info.resolution = chance.choice((*FLOATS, 0.05, -0.05))
    msg.info.width, msg.info.height = (chance.choice((0, 1, 3, 2**16, 2**32 - 1)) for _ in "xy")
    cells = chance.choice((0, 1, 3, 9, 10))
    msg.data = array("b", [chance.randrange(-128, 128) for _ in range(cells)])
    return msg


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
