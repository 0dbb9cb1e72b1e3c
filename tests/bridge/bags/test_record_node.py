from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest
import rclpy
from rclpy.context import Context

from lupin_bridge.bags.bag_writer import Heard
from lupin_bridge.bags.record_node import RecordNode
from lupin_twin.parameters import ParameterError


@contextmanager
def node_with(domain: int, *ros_args: str) -> Iterator[RecordNode]:
    context = Context()
    rclpy.init(args=["--ros-args", *ros_args], context=context, domain_id=domain)
    try:
        node = RecordNode(context=context)
        yield node
        node.destroy_node()
    finally:
        rclpy.try_shutdown(context=context)


def test_it_hears_what_the_twin_hears_and_says_and_the_clock(domain: int) -> None:
    with node_with(domain) as node:
        assert [(topic.name, topic.type_name, topic.latched) for topic in node.topics] == [
            ("/floranova/observations", "lupin_msgs/msg/Observation", 50),
            ("/perception/discovered_tags", "lupin_msgs/msg/DiscoveredTags", 50),
            ("/map", "nav_msgs/msg/OccupancyGrid", 1),
            ("/twin/state", "lupin_msgs/msg/TwinState", 1),
            ("/clock", "rosgraph_msgs/msg/Clock", 0),
        ]
    names = ("-r", "__ns:=/house", "-r", "map:=slam/map", "-p", "state_topic:=/state")
    with node_with(domain, *names) as node:
        assert [topic.name for topic in node.topics] == [
            "/house/floranova/observations",
            "/house/perception/discovered_tags",
            "/house/slam/map",
            "/state",
            "/clock",
        ]


def test_a_message_is_handed_on_with_both_its_times_and_what_was_lost_is_counted(
    domain: int,
) -> None:
    heard: list[Heard] = []
    lost: list[int] = []
    with node_with(domain) as node:
        hear = {each.topic_name: each.callback for each in node.subscriptions}
        node.hand_to(heard.append, lost.append)
        for number in (1, 2, 5):
            info = {
                "received_timestamp": 20,
                "source_timestamp": 10,
                "publication_sequence_number": number,
            }
            hear["/map"](b"map", info)
            hear["/clock"](b"clock", info)
    assert heard == [Heard(2, 20, 10, b"map"), Heard(4, 20, 10, b"clock")] * 3
    assert lost == [2], "of what is latched; of the clock the newest counts"


def test_a_name_that_is_none_is_told_with_its_parameter(domain: int) -> None:
    with (
        pytest.raises(ParameterError, match=r"map_topic is 'a b'"),
        node_with(domain, "-p", "map_topic:='a b'"),
    ):
        pass
