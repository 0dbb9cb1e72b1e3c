"""The limits of each topic's messages, at the limit and one past it."""

from collections.abc import Callable
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import Point32
from lupin_msgs.msg import (
    DiscoveredTag,
    DiscoveredTags,
    FlowerPoint,
    Observation,
    SensorReading,
    TagTimes,
    TwinState,
    TwinTagState,
    TwinTimes,
)
from rclpy.serialization import serialize_message

from lupin_twin.core.drops import (
    MAX_BLOOMS_PER_TAG,
    MAX_FOOTPRINT_POINTS,
    MAX_ITEMS,
    MAX_SENSORS_PER_TAG,
    MAX_TAGS,
)
from lupin_twin.ros import message_limits
from lupin_twin.ros.message_limits import MessageShape, TooManyError


def readings(count: int) -> Any:
    msg = Observation()
    msg.tag_reading.readings = [SensorReading()] * count
    return msg


def flowers(count: int) -> Any:
    msg = Observation()
    msg.flower.flowers = [FlowerPoint()] * count
    return msg


def corners(count: int) -> Any:
    msg = Observation()
    msg.flower.box_footprint.points = [Point32()] * count
    return msg


@pytest.mark.parametrize(
    ("shape", "message", "limit", "name"),
    [
        (message_limits.OBSERVATION, readings, MAX_SENSORS_PER_TAG, "tag_reading.readings"),
        (message_limits.OBSERVATION, flowers, MAX_BLOOMS_PER_TAG, "flower.flowers"),
        (message_limits.OBSERVATION, corners, MAX_FOOTPRINT_POINTS, "flower.box_footprint.points"),
        (
            message_limits.DISCOVERED_TAGS,
            lambda count: DiscoveredTags(tags=[DiscoveredTag()] * count),
            MAX_TAGS,
            "tags",
        ),
        (
            message_limits.STATE,
            lambda count: TwinState(tags=[TwinTagState()] * count),
            MAX_TAGS,
            "tags",
        ),
        (
            message_limits.TIMES,
            lambda count: TwinTimes(tags=[TagTimes()] * count),
            MAX_TAGS,
            "tags",
        ),
        (
            message_limits.DIAGNOSTICS,
            lambda count: DiagnosticArray(status=[DiagnosticStatus()] * count),
            message_limits.MAX_STATUSES,
            "status",
        ),
    ],
)
def test_as_many_as_can_be_stored_are_accepted_and_not_one_more(
    shape: MessageShape, message: Callable[[int], Any], limit: int, name: str
) -> None:
    assert shape.check(serialize_message(message(limit)))
    with pytest.raises(TooManyError, match=rf"^{name}: {limit + 1}, the limit is {limit}$"):
        shape.check(serialize_message(message(limit + 1)))


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
