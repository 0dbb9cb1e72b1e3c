"""Bytes of messages: which are read, and up to which limits."""

import random
import struct
from functools import reduce
from typing import Any

import pytest
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import Point32, Polygon, PoseWithCovarianceStamped
from hypothesis import given, settings
from hypothesis import strategies as st
from lupin_msgs.msg import (
    DiscoveredTag,
    DiscoveredTags,
    FlowerPoint,
    Observation,
    SensorReading,
    TagReading,
    TagTimes,
    TwinState,
    TwinTagState,
    TwinTimes,
)
from nav_msgs.msg import OccupancyGrid
from rcl_interfaces.msg import ParameterEvent
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.serialization import deserialize_message, serialize_message
from std_msgs.msg import ByteMultiArray, Float64MultiArray

from lupin_twin.core.drops import (
    MAX_BLOOMS_PER_TAG,
    MAX_FOOTPRINT_POINTS,
    MAX_ITEMS,
    MAX_SENSORS_PER_TAG,
    MAX_TAGS,
)
from lupin_twin.ros import message_limits
from lupin_twin.ros.message_limits import MalformedError, MessageShape, TooManyError
from tests.support.hostile import anything, lies

OURS = (Observation, DiscoveredTags, TwinState, OccupancyGrid)
# Arrays of fixed length, sequences of texts, all sizes of number.
OTHERS = (
    PoseWithCovarianceStamped,
    ParameterEvent,
    Float64MultiArray,
    ByteMultiArray,
    Polygon,
)


def shape_of(message_type: Any, **limits: Any) -> MessageShape:
    return MessageShape(message_type, max_bytes=10_000_000, **limits)


SHAPES = {message_type: shape_of(message_type) for message_type in (*OURS, *OTHERS)}
LITTLE, BIG = b"\x00\x01\x00\x00", b"\x00\x00\x00\x00"


def plain(kind: str, chance: random.Random) -> Any:
    """A text, or a number that equals itself."""
    if kind == "string":
        return "".join(chance.choices("aé\U0001f33a", k=chance.randrange(12)))
    number = chance.randrange(128)
    made = {"octet": bytes([number]), "boolean": number > 60, "float": 0.5, "double": 0.5 * number}
    return made.get(kind, number)


@given(st.sampled_from((*OURS, *OTHERS)), st.randoms(use_true_random=False))
def test_every_message_that_ros_writes_is_accepted_to_its_last_byte(
    message_type: Any, chance: random.Random
) -> None:
    message = anything(message_type, chance, plain)
    data = serialize_message(message)
    end = SHAPES[message_type].check(data)
    # ROS reads exactly as far; after it, it leaves a few bytes with no meaning.
    assert deserialize_message(data[:end], message_type) == message
    with pytest.raises(rclpy_implementation.RMWError):
        deserialize_message(data[: end - 1], message_type)
    assert message_type not in OURS or end == len(data)


@settings(max_examples=40)  # a state has thousands of lies: some of each
@given(st.sampled_from(OURS), st.randoms(use_true_random=False))
def test_accepted_bytes_can_be_read_by_ros_and_unreadable_ones_are_refused(
    message_type: Any, chance: random.Random
) -> None:
    data = serialize_message(anything(message_type, chance, plain))
    cut = chance.randrange(SHAPES[message_type].check(data))
    with pytest.raises(MalformedError):
        SHAPES[message_type].check(data[:cut])
    longer = data + chance.randbytes(chance.randrange(20))
    assert SHAPES[message_type].check(longer) == len(data)
    told = list(lies(data))
    for lie in chance.sample(told, min(len(told), 50)):
        try:
            SHAPES[message_type].check(lie)
        except MalformedError:
            continue
        deserialize_message(lie, message_type)  # a number, not a length


def test_both_byte_orders_are_read() -> None:
    def reading(order: str) -> bytes:
        text = struct.pack(f"{order}I4s ii d", 4, b"tag\0", 1, 2, 3.0)
        return text + struct.pack(f"{order}I I8s d", 1, 8, b"a value\0", 4.0)

    for header, order in ((LITTLE, "<"), (BIG, ">")):
        data = header + reading(order)
        msg = deserialize_message(data, TagReading)
        assert (msg.tag_id, msg.readings[0].name, msg.readings[0].value) == ("tag", "a value", 4.0)
        assert shape_of(TagReading).check(data) == len(data)
    with pytest.raises(MalformedError, match=r"tag_id claims 67108864 bytes, 44 bytes are left"):
        shape_of(TagReading).check(LITTLE + reading(">"))


@pytest.mark.parametrize(
    "header", [b"", b"\x00", b"\x00\x01\x00", b"\x00\x03\x00\x00", b"\x01\x01\0\0"]
)
def test_only_plain_cdr_is_read(header: bytes) -> None:
    data = bytes(serialize_message(Time()))
    with pytest.raises(MalformedError, match="not plain CDR's"):
        shape_of(Time).check(header + (data[4:] if len(header) == 4 else b""))


def test_a_sequence_holds_as_many_as_fit_into_its_bytes_and_not_one_more() -> None:
    shape = shape_of(Polygon)
    data = bytearray(serialize_message(Polygon()))
    data[4:] = struct.pack("<I", 3) + bytes(3 * 12)
    assert shape.check(bytes(data)) == len(data)
    data[4:8] = struct.pack("<I", 4)
    with pytest.raises(
        MalformedError, match="points: 4 of at least 12 bytes are claimed, 36 bytes are left"
    ):
        shape.check(bytes(data))


@pytest.mark.parametrize(
    ("shape", "message_type", "path", "element", "limit"),
    [
        (
            *(message_limits.OBSERVATION, Observation, "tag_reading.readings", SensorReading),
            MAX_SENSORS_PER_TAG,
        ),
        (
            *(message_limits.OBSERVATION, Observation, "flower.flowers", FlowerPoint),
            MAX_BLOOMS_PER_TAG,
        ),
        (
            *(message_limits.OBSERVATION, Observation, "flower.box_footprint.points", Point32),
            MAX_FOOTPRINT_POINTS,
        ),
        (message_limits.DISCOVERED_TAGS, DiscoveredTags, "tags", DiscoveredTag, MAX_TAGS),
        (message_limits.STATE, TwinState, "tags", TwinTagState, MAX_TAGS),
        (message_limits.TIMES, TwinTimes, "tags", TagTimes, MAX_TAGS),
        (
            *(message_limits.DIAGNOSTICS, DiagnosticArray, "status", DiagnosticStatus),
            message_limits.MAX_STATUSES,
        ),
    ],
)
def test_as_many_as_can_be_stored_are_accepted_and_not_one_more(
    shape: MessageShape, message_type: Any, path: str, element: Any, limit: int
) -> None:
    def message(count: int) -> bytes:
        made = message_type()
        *parts, name = path.split(".")
        setattr(reduce(getattr, parts, made), name, [element()] * count)
        return bytes(serialize_message(made))

    assert shape.check(message(limit))
    with pytest.raises(TooManyError, match=rf"^{path}: {limit + 1}, the limit is {limit}$"):
        shape.check(message(limit + 1))


def test_a_state_holds_as_many_items_as_a_twin_stores_and_not_one_more() -> None:
    # One tag with all of them: their kind and their tag do not matter.
    empty = serialize_message(TwinState(tags=[TwinTagState()]))
    for count, is_taken in ((MAX_ITEMS + MAX_TAGS - 1, True), (MAX_ITEMS + MAX_TAGS, False)):
        # The last sequence of the message: points of three float32.
        data = empty[:-4] + count.to_bytes(4, "little") + bytes(12 * count)
        if is_taken:
            assert message_limits.STATE.check(data) == len(data)
        else:
            with pytest.raises(TooManyError, match=r"^tags.box_footprint.points: more elements"):
                message_limits.STATE.check(data)
