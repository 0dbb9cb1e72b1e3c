"""What of a recording a twin is to hear: its inputs and the map, by their types."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from lupin_bridge.bags.offered_qos import Offered
from lupin_bridge.bags.recording import RecordingError, Topic
from lupin_bridge.bags.topics import MESSAGE_ENCODING

# In the order in which a twin takes what waits; and how it asks for them, where nobody says how
# they were offered (README, "Ask it over ROS").
INPUTS: Final[Mapping[str, Offered]] = {
    "lupin_msgs/msg/Observation": Offered(depth=50),
    "lupin_msgs/msg/DiscoveredTags": Offered(depth=50),
    "nav_msgs/msg/OccupancyGrid": Offered(depth=1),
}
# The parameter of a twin that names its topic of each.
TWIN_PARAMETERS: Final[Mapping[str, str]] = {
    "lupin_msgs/msg/Observation": "observations_topic",
    "lupin_msgs/msg/DiscoveredTags": "discovered_tags_topic",
    "nav_msgs/msg/OccupancyGrid": "map_topic",
}
MAP_TYPE: Final = "nav_msgs/msg/OccupancyGrid"
STATE_TYPE: Final = "lupin_msgs/msg/TwinState"


def inputs_of(topics: Sequence[Topic], file: str) -> list[Topic]:
    """The topics that a twin hears, in the order in which it takes what waits on them.

    Of several grids, costmaps most likely, those alone that are called `map`, if there is one.

    Raises:
        RecordingError: there are none, or they are of another encoding.

    """
    found = [topic for kind in INPUTS for topic in topics if topic.type_name == kind]
    grids = [topic for topic in found if topic.type_name == MAP_TYPE]
    maps = [topic for topic in grids if topic.name.rpartition("/")[2] == "map"]
    chosen = [topic for topic in found if not maps or topic not in grids or topic in maps]
    if all(topic.type_name == MAP_TYPE for topic in chosen):
        there = ", ".join(f"{topic.name} ({topic.type_name})" for topic in topics[:20])
        raise RecordingError(
            f"{file} has nothing that a twin hears: expected a topic of lupin_msgs/msg/Observation "
            f"or lupin_msgs/msg/DiscoveredTags, it has {there or 'no topics'}"
        )
    return [checked(topic, file) for topic in chosen]


def state_of(topics: Sequence[Topic], file: str) -> Topic:
    """The states that a twin published.

    Raises:
        RecordingError: there are none, or they are of another encoding.

    """
    for topic in topics:
        if topic.type_name == STATE_TYPE:
            return checked(topic, file)
    raise RecordingError(f"{file} has no {STATE_TYPE}, which --state-as is about")


def checked(topic: Topic, file: str) -> Topic:
    """The topic, if it can be published as it is.

    Raises:
        RecordingError: it is of another encoding.

    """
    if topic.encoding != MESSAGE_ENCODING:
        raise RecordingError(
            f"{file}: {topic.name} is encoded as {topic.encoding!r}, must be "
            f"{MESSAGE_ENCODING!r}, which is what ROS 2 publishes"
        )
    return topic
