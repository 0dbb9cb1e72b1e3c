"""The limits of each topic's messages, at the limit and one past it."""

from functools import reduce
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
