import pytest
import yaml
from rosbags.rosbag2.metadata import parse_qos

from lupin_bridge.bags.journal_export import offered_qos
from lupin_bridge.feed.relay import Topic


@pytest.mark.parametrize(
    ("latched", "depth", "durability"), [(True, 50, "TRANSIENT_LOCAL"), (False, 10, "VOLATILE")]
)
def test_others_read_how_a_topic_is_published(latched: bool, depth: int, durability: str) -> None:
    topic = Topic("/map", "nav_msgs/msg/OccupancyGrid", latched, depth)
    [read] = parse_qos(offered_qos(topic))
    assert (read.reliability.name, read.durability.name) == ("RELIABLE", durability)
    assert (read.history.name, read.depth) == ("KEEP_LAST", depth)


def test_all_that_rosbag2_reads_is_there() -> None:
    [profile] = yaml.safe_load(
        offered_qos(Topic("/clock", "rosgraph_msgs/msg/Clock", latched=False, depth=10))
    )
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
