"""The node that publishes a recording: as it was offered, and anew when it begins again."""

from __future__ import annotations

from typing import Any

import pytest
import rclpy
from lupin_msgs.msg import Observation
from rclpy.context import Context
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock

from lupin_bridge.bags.choosing import INPUTS, STATE_TYPE
from lupin_bridge.bags.live_twins import LiveTwins
from lupin_bridge.bags.offered_qos import Offered
from lupin_bridge.bags.replay_node import TYPES, ReplayNode
from tests.support.messages import scan
from tests.support.recordings import OBSERVATIONS, TAGS
from tests.support.ros import Peer, latched
from tests.support.waiting import wait_for

TOPICS = {
    OBSERVATIONS: ("lupin_msgs/msg/Observation", Offered(depth=3)),
    TAGS: ("lupin_msgs/msg/DiscoveredTags", Offered(is_reliable=False, is_latched=False, depth=9)),
}


def tag_ids(observations: list[Any]) -> list[str]:
    return [it.tag_reading.tag_id for it in observations]


def test_there_is_a_message_for_each_type_that_is_published() -> None:
    assert TYPES.keys() == {*INPUTS, STATE_TYPE}


def test_it_publishes_as_it_was_offered_and_a_loop_latches_nothing_of_before(domain: int) -> None:
    context = Context()
    rclpy.init(args=[], context=context, domain_id=domain)
    node = ReplayNode(TOPICS, LiveTwins(), {OBSERVATIONS: "/again"}, context=context)
    try:
        with Peer(domain) as peer:
            heard: list[Any] = []
            clocks: list[Any] = []
            peer.node.create_subscription(Clock, "/clock", clocks.append, 1)
            for number in range(4):
                node.publish(OBSERVATIONS, serialize_message(scan(str(number))))
            # Not before: who listens meanwhile hears the first of them, too.
            peer.node.create_subscription(Observation, "/again", heard.append, latched(50))
            peer.until(lambda: "3" in tag_ids(heard), "what is latched")
            assert tag_ids(heard) == ["1", "2", "3"]

            def tell() -> list[Any]:
                node.tell_time(7_000_000_005)
                return clocks

            peer.until(tell, "the time")
            assert (clocks[0].clock.sec, clocks[0].clock.nanosec) == (7, 5)
            (weak,) = peer.until(
                lambda: peer.node.get_publishers_info_by_topic(TAGS), "the publisher of tags"
            )
            assert weak.qos_profile.reliability == ReliabilityPolicy.BEST_EFFORT
            assert weak.qos_profile.durability == DurabilityPolicy.VOLATILE

            node.begin_again()
            node.publish(OBSERVATIONS, serialize_message(scan("new")))
            late: list[Any] = []
            peer.node.create_subscription(Observation, "/again", late.append, latched(50))
            peer.until(lambda: "new" in tag_ids(late), "what came since")
            peer.until(
                lambda: peer.node.count_publishers("/again") == 1, "the end of the old publisher"
            )
            assert tag_ids(late) == ["new"]
        assert node.twin_names == frozenset()
        assert node.refusal() is None
        assert node.rivals() == []
        rival = ReplayNode({}, LiveTwins(), context=context)
        try:
            wait_for(node.rivals, "another one", meanwhile=lambda: node.listen(0.02))
            assert node.rivals() == ["/lupin_replay"]
        finally:
            rival.destroy_node()
    finally:
        node.destroy_node()
        rclpy.try_shutdown(context=context)


@pytest.mark.parametrize("is_patient", [True, False])
def test_a_twin_that_does_not_say_whether_it_keeps_a_journal(domain: int, is_patient: bool) -> None:
    """Told by what it publishes, whatever it is called; it is awaited, and then refused."""
    context = Context()
    rclpy.init(args=[], context=context, domain_id=domain)
    node = ReplayNode(TOPICS, LiveTwins(), context=context)
    try:
        with Peer(domain, "old_twin") as peer, Peer(domain, "recorder") as other:
            for each in (peer, other):
                each.node.create_subscription(Observation, OBSERVATIONS, print, latched(50))
            peer.publisher("/house/state", TYPES[STATE_TYPE], 1)
            wait_for(lambda: node.twin_names, "the twin", meanwhile=lambda: node.listen(0.1))
            assert node.twin_names == {"/old_twin"}
            assert node.without_sim_time() == ["/old_twin"]
            assert node.awaits
            assert not node.has_listeners, "nobody hears the tags"
            refusal = node.refusal(is_patient=is_patient)
            assert (refusal is None) == is_patient
    finally:
        node.destroy_node()
        rclpy.try_shutdown(context=context)
