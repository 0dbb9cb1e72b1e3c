"""What of a recording a twin is to hear."""

from __future__ import annotations

from dataclasses import replace

import pytest

from lupin_bridge.bags.choosing import INPUTS, TWIN_PARAMETERS, inputs_of, state_of
from lupin_bridge.bags.offered_qos import Offered
from lupin_bridge.bags.recording import RecordingError, Topic
from lupin_bridge.twin.names import TwinNames, topics_of

SCANS = Topic("/gh1/seen", "lupin_msgs/msg/Observation", "cdr", 3, "")
TAGS = Topic("/tags", "lupin_msgs/msg/DiscoveredTags", "cdr", 3, "")
MAP = Topic("/gh1/map", "nav_msgs/msg/OccupancyGrid", "cdr", 3, "")
COSTS = replace(MAP, name="/local_costmap/costmap")
STATE = Topic("/twin/state", "lupin_msgs/msg/TwinState", "cdr", 3, "")
IMAGES = Topic("/camera", "sensor_msgs/msg/Image", "cdr", 3, "")


def test_inputs_are_told_by_their_types_in_the_order_in_which_a_twin_takes_them() -> None:
    topics = [IMAGES, MAP, TAGS, COSTS, STATE, SCANS]
    assert inputs_of(topics, "a.mcap") == [SCANS, TAGS, MAP]
    assert inputs_of([COSTS, SCANS], "a.mcap") == [SCANS, COSTS]
    assert INPUTS.keys() == TWIN_PARAMETERS.keys()
    assert state_of(topics, "a.mcap") == STATE


def test_inputs_are_offered_as_a_twin_asks_for_them_where_a_recording_does_not_say() -> None:
    heard = {topic.type_name: topic for topic in topics_of(TwinNames("/twin/state", "/twin/f"))}
    for kind, offered in INPUTS.items():
        asked = heard[kind]
        assert offered == Offered(asked.latched, asked.latched, asked.depth)


@pytest.mark.parametrize("topics", [[], [IMAGES, STATE], [MAP]])
def test_a_file_without_inputs_is_refused_with_what_it_has(topics: list[Topic]) -> None:
    with pytest.raises(RecordingError, match=r"^a.mcap has nothing that a twin hears") as refused:
        inputs_of(topics, "a.mcap")
    assert all(topic.name in str(refused.value) for topic in topics)


def test_another_encoding_is_refused_by_its_name() -> None:
    with pytest.raises(RecordingError, match="/gh1/seen is encoded as 'ros1', must be 'cdr'"):
        inputs_of([replace(SCANS, encoding="ros1")], "a.mcap")
    with pytest.raises(RecordingError, match="'json'"):
        state_of([replace(STATE, encoding="json")], "a.mcap")
    with pytest.raises(RecordingError, match="no lupin_msgs/msg/TwinState"):
        state_of([SCANS], "a.mcap")
