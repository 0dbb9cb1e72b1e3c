"""Real topics, relayed raw in both roles: the bytes of the message, unchanged."""

from collections.abc import Iterator
from contextlib import nullcontext
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from lupin_msgs.msg import Observation, TwinState
from nav_msgs.msg import OccupancyGrid
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import PointCloud2

from lupin_bridge.feed.local import LocalTwin
from lupin_bridge.feed.relay import NotRelayedError, Relay, Sample, topics_of
from lupin_bridge.feed.source import TwinUnavailableError
from lupin_bridge.feed.web import WebTwin
from lupin_twin.core.interfaces import Topic
from lupin_twin.ros import convert
from tests.support.inprocess import started
from tests.support.messages import occupancy_grid, scan
from tests.support.processes import OFTEN, twin_node
from tests.support.ros import Peer
from tests.support.waiting import until, until_answered


@pytest.fixture
def peer(domain: int) -> Iterator[Peer]:
    with Peer(domain) as robot:
        yield robot


@pytest.fixture(params=[LocalTwin, WebTwin])
def source_type(request: pytest.FixtureRequest, domain: int) -> Iterator[type]:
    """A kind of source. For `WebTwin`, with a twin in a process of its own."""
    with twin_node(domain, *OFTEN) if request.param is WebTwin else nullcontext():
        yield request.param


async def only_the_expected_type_counts(relay: Relay, topic: Topic, domain: int) -> None:
    """Another type under the same name hides nothing, and a subscriber is no publisher."""

    def published_as(kind: str) -> Any:
        return relay.published(lambda *topic_and_type: topic_and_type == (topic.name, kind))

    assert await published_as(topic.type_name) == {}
    cloud = "sensor_msgs/msg/PointCloud2"
    with Peer(domain, "stranger") as stranger:
        stranger.publisher(topic.name, PointCloud2)
        found = await until_answered(lambda: published_as(cloud), "the stranger")
        assert found == {topic.name: cloud}
        assert await published_as(topic.type_name) == {}


async def test_a_twins_topics_are_relayed_byte_for_byte(
    domain: int, source_type: Any, peer: Peer
) -> None:
    async with started(source_type, *OFTEN) as (source, reported):
        relay: Relay = source.relay
        relay.linger_s = 0.0
        state, observations, discovered, map_, diagnostics = topics_of(source.names)
        grid, seen = occupancy_grid([[0, 100]]), scan("1", {"co2": 400.0}, stamp_s=5.0)
        peer.publish_map(grid)
        peer.observe(seen)
        await until(lambda: reported and reported[-1].snapshot.tags, "the tag")
        assert len(relay) == 0, "nobody has subscribed"

        received: dict[str, list[Sample]] = {}
        listening = [
            await relay.listen(topic, received.setdefault(topic.name, []).append)
            for topic in (state, observations, map_, diagnostics)
        ]
        await until(lambda: all(received.values()), "a sample of each")

        def first(topic: Topic, message_type: Any) -> Any:
            return deserialize_message(received[topic.name][0].data, message_type)

        # Latched, and published before the subscription.
        assert first(observations, Observation) == seen
        assert first(map_, OccupancyGrid) == grid
        # And as a message, whose lengths are checked before it is decoded.
        assert relay.read(observations, received[observations.name][0]) == seen
        for data in (received[map_.name][0].data[:-1], b"\0" * (map_.max_bytes + 1)):
            with pytest.raises(ValueError, match="bytes"):
                relay.read(map_, Sample(data, 0))

        def latest() -> Any:
            message: Any = deserialize_message(received[state.name][-1].data, TwinState)
            return message if message.tags else None

        last = await until(latest, "a state with the tag")
        assert [tag.tag_id for tag in last.tags] == ["1"]
        assert first(diagnostics, DiagnosticArray).status
        came_ns = received[state.name][-1].stamp_ns
        assert 0 <= came_ns - convert.nanoseconds(last.header.stamp) < 60e9

        def count(node: Any) -> int:
            return len(list(node.subscriptions))

        thread = source.thread
        before = await thread.call(count)
        for each in listening:
            each()
        left = before - len(listening)
        await until_answered(lambda: thread.call(count), "its leaving", lambda it: it == left)
        assert (len(relay), source.thread.callback_errors) == (0, 0)

        names = source.names
        assert (names.field_layers, names.tags_layer, names.planters_layer) == (
            "/twin/field/",
            "/twin/tags",
            "/twin/planters",
        )
        assert await relay.published(lambda name, _: name.endswith(("/state", "/times"))) == {
            "/twin/state": "lupin_msgs/msg/TwinState",
            "/twin/times": "lupin_msgs/msg/TwinTimes",
        }
        await only_the_expected_type_counts(relay, discovered, domain)
        now = await relay.time()
        assert (now.is_simulated, abs(now.now_ns - came_ns) < 60e9) == (False, True)
        for topic, text in (
            (Topic("sensor_smsgs/msg/A", "", "/a"), "is not installed here"),
            (Topic("lupin_msgs/msg/TwinState", "", "/a b"), "topic name"),
        ):
            for _ in range(2):
                with pytest.raises(NotRelayedError, match=f"{topic.name} cannot be .*{text}"):
                    await relay.listen(topic, lambda _: None)
        assert len(relay) == 0
    # A thread that has not ended in time is left behind, and ends by itself.
    await until(lambda: not source.thread.is_alive, "its end")
    with pytest.raises(TwinUnavailableError):
        await source.robot(None)
