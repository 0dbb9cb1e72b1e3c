"""The relay: who receives what, how much is buffered, and for how long; and real topics."""

import asyncio
import weakref
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from lupin_msgs.msg import Observation, TwinState
from nav_msgs.msg import OccupancyGrid
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import PointCloud2

from lupin_bridge.feed.local import LocalTwin
from lupin_bridge.feed.relay import NotRelayedError, Relay, Sample, schema_text, topics_of
from lupin_bridge.feed.source import TwinUnavailableError
from lupin_bridge.feed.web import WebTwin
from lupin_twin.core import interfaces
from lupin_twin.core.interfaces import Topic
from lupin_twin.ros import convert
from tests.support.inprocess import started
from tests.support.messages import occupancy_grid, scan
from tests.support.processes import OFTEN, twin_node
from tests.support.ros import Peer
from tests.support.waiting import until, until_answered

STATE = replace(interfaces.STATE, name="/twin/state", depth=2, max_bytes=10)
LIVE = replace(interfaces.DIAGNOSTICS, depth=1, max_bytes=10)


class Ros:
    """A ROS thread on the loop, which does what the test says."""

    def __init__(self) -> None:
        self.takes: dict[str, Callable[[Sample], None]] = {}
        self.subscribed: list[str] = []
        self.wake_ups = 0
        self.has_ended = False
        self.gate = asyncio.Event()
        self.gate.set()
        self.calls = 0
        self.on_the_way = 0
        self.nothing_on_the_way = asyncio.Event()

    async def call(self, work: Callable[[Any], Any]) -> Any:
        self.calls += 1
        await self.gate.wait()
        if self.has_ended:
            raise TwinUnavailableError("the ROS thread is not running")
        return work(None)

    def to_loop(self, callback: Callable[..., None], *args: Any) -> None:
        def run() -> None:
            callback(*args)
            self.on_the_way -= 1
            if not self.on_the_way:
                self.nothing_on_the_way.set()

        self.wake_ups += 1
        self.on_the_way += 1
        self.nothing_on_the_way.clear()
        asyncio.get_running_loop().call_soon(run)

    def subscribe(
        self, node: Any, topic: Topic, take: Callable[[Sample], None]
    ) -> Callable[[], None]:
        self.subscribed.append(topic.name)
        self.takes[topic.name] = take
        return lambda: self.takes.__delitem__(topic.name)

    async def publish(self, *samples: bytes, topic: Topic = STATE) -> None:
        """Until the loop has delivered what it was woken for."""
        for data in samples:
            self.takes[topic.name](Sample(data, len(data)))
        await self.nothing_on_the_way.wait()


class Ear:
    def __init__(self) -> None:
        self.received: list[bytes] = []

    def __call__(self, sample: Sample) -> None:
        self.received.append(sample.data)


@pytest.fixture
def ros() -> Ros:
    return Ros()


@pytest.fixture
def relay(ros: Ros) -> Relay:
    found = Relay(lambda: ros, ros)
    found.linger_s = 3600.0
    return found


async def all_has_ended(ros: Ros, relay: Relay) -> None:
    """Until every subscription without listeners has ended: the last to be closed ends last."""
    (await relay.listen(LIVE, Ear()))()
    await until(lambda: LIVE.name not in ros.takes, "the end of the last that was closed")


async def test_all_listeners_share_one_subscription(ros: Ros, relay: Relay) -> None:
    assert (ros.subscribed, len(relay.topics)) == ([], 0)
    ears = [Ear() for _ in range(3)]
    await asyncio.gather(*(relay.listen(STATE, ear) for ear in ears))
    await ros.publish(b"1", b"2")
    assert [ear.received for ear in ears] == [[b"1", b"2"]] * 3
    assert (ros.subscribed, ros.wake_ups, len(relay.topics)) == (["/twin/state"], 2, 1)


async def test_a_late_listener_receives_the_last_latched_message_and_nothing_else(
    ros: Ros, relay: Relay
) -> None:
    for topic, expected in ((STATE, [b"2", b"3"]), (LIVE, [])):
        await relay.listen(topic, Ear())
        for data in (b"1", b"2", b"3"):
            await ros.publish(data, topic=topic)
        late = Ear()
        await relay.listen(topic, late)
        assert late.received == expected


async def test_depth_and_bytes_drop_the_oldest_and_a_too_large_message_is_never_sent(
    ros: Ros, relay: Relay
) -> None:
    ear = Ear()
    await relay.listen(STATE, ear)
    await ros.publish(b"1", b"2", b"3")
    assert (ear.received, relay.skipped) == ([b"2", b"3"], 1)
    for samples, stored in (
        ((b"four", b"fivefi"), [b"four", b"fivefi"]),  # 10 bytes: both
        ((b"four", b"fivefiv"), [b"fivefiv"]),  # 11
        ((b"0123456789", b"0123456789a"), [b"0123456789"]),
    ):
        await ros.publish(*samples)
        late = Ear()
        await relay.listen(STATE, late)
        assert late.received == stored
    assert relay.skipped == 2, "the oldest, and the one that is too large"


async def test_a_subscription_ends_with_its_last_listener(ros: Ros, relay: Relay) -> None:
    relay.linger_s = 0.0
    ear = Ear()
    first = await relay.listen(STATE, Ear())
    second = await relay.listen(STATE, ear)
    first()
    first()
    await all_has_ended(ros, relay)
    await ros.publish(b"1")
    assert ear.received == [b"1"], "however often the first one closes"
    second()
    await ros.publish(b"2")
    await until(lambda: not ros.takes, "the end of the subscription")
    assert (ear.received, len(relay.topics)) == ([b"1"], 0)
    await relay.listen(STATE, Ear())
    assert ros.subscribed == ["/twin/state", "/diagnostics", "/twin/state"]


async def test_listeners_that_come_and_go_cause_no_work_in_ros(ros: Ros, relay: Relay) -> None:
    gone: list[weakref.ref[Callable[[], None]]] = []
    for _ in range(100):
        close = await relay.listen(STATE, Ear())
        close()
        gone.append(weakref.ref(close))
    del close
    await ros.publish(b"1")
    assert not any(ref() for ref in gone), "they leave nothing"
    ear = Ear()
    await relay.listen(STATE, ear)
    assert ear.received == [b"1"], "it was received all the while"
    assert (ros.subscribed, ros.calls, len(relay.topics)) == (["/twin/state"], 1, 1)


async def test_a_listener_just_in_time_reuses_the_subscription(ros: Ros, relay: Relay) -> None:
    relay.linger_s = 0.0
    (await relay.listen(STATE, Ear()))()
    ear = Ear()
    await relay.listen(STATE, ear)
    await all_has_ended(ros, relay)
    await ros.publish(b"1")
    assert (ear.received, ros.subscribed) == ([b"1"], ["/twin/state", "/diagnostics"])


async def test_a_listener_may_leave_while_a_subscription_opens(ros: Ros, relay: Relay) -> None:
    ros.gate.clear()
    ear = Ear()
    leaving = asyncio.create_task(relay.listen(STATE, Ear()))
    staying = asyncio.create_task(relay.listen(STATE, ear))
    await until(lambda: ros.calls, "the subscription on its way, for both")
    leaving.cancel()
    await until(leaving.done, "its end")
    ros.gate.set()
    await staying
    await ros.publish(b"1")
    assert ear.received == [b"1"]


async def test_without_the_thread_nothing_is_received_and_nothing_breaks(
    ros: Ros, relay: Relay
) -> None:
    relay.linger_s = 0.0
    close = await relay.listen(STATE, Ear())
    ros.has_ended = True
    close()
    await until(lambda: len(relay.topics) == 0, "its end")
    with pytest.raises(TwinUnavailableError):
        await relay.listen(LIVE, Ear())


def package(prefix: Path, name: str, **messages: str) -> None:
    folder = prefix / "share" / name / "msg"
    folder.mkdir(parents=True)
    for message, text in messages.items():
        (folder / f"{message}.msg").write_text(text, encoding="utf-8")


def test_the_prefixes_of_a_sourced_ros_come_first(tmp_path: Path) -> None:
    package(tmp_path / "overlay", "here_msgs", One="Two[<=3] twos  # of them\nuint8 X=1\n")
    package(tmp_path / "overlay", "std_msgs", Header="string<=5 mine\n")
    package(tmp_path / "ros", "here_msgs", One="", Two="std_msgs/msg/Header header 'x'")
    sourced = {"AMENT_PREFIX_PATH": f"{tmp_path}/nowhere:{tmp_path}/overlay::{tmp_path}/ros"}
    rule = "=" * 80
    assert schema_text("here_msgs/msg/One", sourced) == (
        "Two[<=3] twos  # of them\nuint8 X=1\n\n"
        f"{rule}\nMSG: here_msgs/Two\nstd_msgs/msg/Header header 'x'\n"
        f"{rule}\nMSG: std_msgs/Header\nstring<=5 mine\n"
    )
    # Packages in none of them are found where Python installs them.
    assert "sec" in schema_text("builtin_interfaces/msg/Time", sourced)


@pytest.mark.parametrize(
    ("type_name", "wording"),
    [
        ("nobody_msgs/msg/Thing", "nobody_msgs/msg/Thing is not installed"),
        ("lupin_msgs/msg/Nothing", "lupin_msgs/msg/Nothing is not installed"),
        ("lupin_msgs/Observation", "'lupin_msgs/Observation' is not a message type"),
        ("../msg/Observation", "'../msg/Observation' is not a message type"),
        ("", "'' is not a message type"),
    ],
)
def test_a_type_that_is_not_installed_is_named(type_name: str, wording: str) -> None:
    with pytest.raises(LookupError, match=wording):
        schema_text(type_name)


def test_a_nested_type_that_is_not_installed_is_named_with_the_whole(tmp_path: Path) -> None:
    package(tmp_path, "here_msgs", One="gone_msgs/Two two\n")
    with pytest.raises(LookupError, match="gone_msgs/msg/Two, a part of here_msgs/msg/One, is not"):
        schema_text("here_msgs/msg/One", {"AMENT_PREFIX_PATH": str(tmp_path)})


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
        assert len(relay.topics) == 0, "nobody has subscribed"

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
        assert (len(relay.topics), source.thread.callback_errors) == (0, 0)

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
        for topic, text in (
            (Topic("sensor_smsgs/msg/A", "", "/a"), "is not installed here"),
            (Topic("lupin_msgs/msg/TwinState", "", "/a b"), "topic name"),
        ):
            for _ in range(2):
                with pytest.raises(NotRelayedError, match=f"{topic.name} cannot be .*{text}"):
                    await relay.listen(topic, lambda _: None)
        assert len(relay.topics) == 0
    # A thread that has not ended in time is left behind, and ends by itself.
    await until(lambda: not source.thread.is_alive, "its end")
    with pytest.raises(TwinUnavailableError):
        await source.robot(None)
