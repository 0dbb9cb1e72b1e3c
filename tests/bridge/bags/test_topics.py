from __future__ import annotations

import pytest
import yaml
from rosbags.rosbag2.metadata import parse_qos

from lupin_bridge.bags.topics import Topic


@pytest.mark.parametrize(("latched", "durability"), [(50, "TRANSIENT_LOCAL"), (0, "VOLATILE")])
def test_others_read_how_a_topic_is_published(latched: int, durability: str) -> None:
    text = Topic("/map", "nav_msgs/msg/OccupancyGrid", latched).offered_qos
    [read] = parse_qos(text)
    assert (read.reliability.name, read.durability.name) == ("RELIABLE", durability)
    assert (read.history.name, read.depth) == ("KEEP_LAST", latched or 10)


def test_all_that_rosbag2_reads_is_there() -> None:
    [profile] = yaml.safe_load(Topic("/clock", "rosgraph_msgs/msg/Clock").offered_qos)
    for_ever = {"sec": 9223372036, "nsec": 854775807}
    assert profile == {
        "history": "keep_last",
        "depth": 10,
        "reliability": "reliable",
        "durability": "volatile",
        "deadline": for_ever,
        "lifespan": for_ever,
        "liveliness": "automatic",
        "liveliness_lease_duration": for_ever,
        "avoid_ros_namespace_conventions": False,
    }
