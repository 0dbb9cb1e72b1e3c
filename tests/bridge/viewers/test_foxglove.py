"""Foxglove's protocol: the channels of a scripted ROS, and one client of them."""

import asyncio
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

from lupin_bridge.feed.relay import TwinNames, topics_of
from lupin_bridge.feed.source import TwinUnavailableError
from lupin_bridge.viewers import foxglove as module
from lupin_bridge.viewers.foxglove import (
    MAX_LAYERS,
    MAX_SUBSCRIPTIONS,
    Channel,
    Offer,
    Session,
)
from lupin_twin.core.interfaces import Topic

LAYOUT = Path(__file__).parents[3] / "backend" / "foxglove" / "lupin-twin.json"
NAMES = TwinNames(
    *("/n/twin/state", "/n/twin/get_field", "/o", "/d", "/map", "/diag"),
    *("/n/twin/field/", "/n/twin/tags", "/n/twin/planters"),
)
OWN = ["/n/twin/state", "/o", "/d", "/map", "/diag"]
POINTS = "sensor_msgs/msg/PointCloud2"


class Source:
    """A source and its relay, which say what the test makes them say."""

    def __init__(self, published: Mapping[str, str] = {}) -> None:  # never changed
        self.relay = self
        self.now_published = dict(published)
        self.looks = 0
        self.answers = asyncio.Event()
        self.answers.set()
        self.fault: Exception | None = None
        self.has_ended = False

    @property
    def names(self) -> TwinNames:
        return NAMES

    async def published(self, is_wanted: Callable[[str, str], bool]) -> Mapping[str, str]:
        self.looks += 1
        await self.answers.wait()
        if self.fault is not None:
            raise self.fault
        if self.has_ended:
            raise TwinUnavailableError("the ROS thread has ended")
        return {name: kind for name, kind in self.now_published.items() if is_wanted(name, kind)}


@pytest.fixture(autouse=True)
def schemas(monkeypatch: pytest.MonkeyPatch) -> None:
    """The text of every type, whatever is installed."""
    monkeypatch.setattr(module, "schema_text", lambda type_name: f"# {type_name}")


def offer_of(source: Source) -> Offer:
    any_source: Any = source
    return Offer(any_source)


def topics(offer: Offer) -> list[str]:
    return [channel.topic.name for channel in offer.channels.values()]


async def test_the_topics_of_a_twin_and_the_published_layers_are_offered() -> None:
    source = Source(
        {
            "/n/twin/field/co2": POINTS,
            "/n/twin/field/odd": "std_msgs/msg/String",
            "/n/twin/scan": POINTS,
            "/twin/field/other_house": POINTS,
            "/n/twin/state": "lupin_msgs/msg/TwinState",
            "/cmd_vel": "geometry_msgs/msg/Twist",
        }
    )

    offer = offer_of(source)
    await asyncio.gather(offer.look(), offer.look())
    assert (topics(offer), source.looks) == ([*OWN, "/n/twin/field/co2"], 1)
    assert offer.channels[1].schema == "# lupin_msgs/msg/TwinState"


async def test_layers_are_bounded_and_end_with_ros(monkeypatch: pytest.MonkeyPatch) -> None:
    source = Source({f"/n/twin/field/s{n:03}": POINTS for n in range(MAX_LAYERS + 1)})
    offer = offer_of(source)
    await offer.look()
    assert len(topics(offer)) == len(OWN) + MAX_LAYERS
    source.has_ended = True
    monkeypatch.setattr(module, "FRESH_S", 0.0)
    await offer.look()
    assert topics(offer) == OWN


async def test_clients_share_a_look_that_may_fail_and_an_id_is_never_reused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    layer = "/n/twin/field/a"
    source = Source({layer: POINTS})
    offer = offer_of(source)
    for _ in range(3):
        await offer.look()
    assert source.looks == 1
    monkeypatch.setattr(module, "FRESH_S", 0.0)
    source.fault = RuntimeError("no such node")
    await offer.look()
    assert topics(offer) == [*OWN, layer]
    source.fault = None
    del source.now_published[layer]
    await offer.look()
    assert topics(offer) == OWN
    source.now_published[layer] = POINTS
    await offer.look()
    assert topics(offer) == [*OWN, layer]
    assert max(offer.channels) == len(OWN) + 2


def test_the_layout_shows_offered_topics_and_each_of_its_panels_has_a_place() -> None:
    layout = json.loads(LAYOUT.read_text(encoding="utf-8"))
    named: set[str] = set()
    for panel in layout["configById"].values():
        named |= {panel.get("topicPath"), panel.get("topicToRender"), *panel.get("topics", ())}
    names = TwinNames("/twin/state", "/twin/get_field")
    known = {topic.name for topic in topics_of(names)} | {names.tags_layer, names.planters_layer}
    layers = {name for name in named - {None} if name.startswith(names.field_layers)}
    assert named - {None} - layers <= known
    assert len(layers) == 1

    def placed(node: Any) -> set[str]:
        return {node} if isinstance(node, str) else placed(node["first"]) | placed(node["second"])

    assert placed(layout["layout"]) == set(layout["configById"])


CHANNELS = {n: Channel(n, Topic("a/msg/B", "", f"/topic{n}"), "int32 x\n") for n in range(1, 201)}


class Stage:
    """A session that knows the channels."""

    def __init__(self) -> None:
        self.session = Session()
        self.session.offer(CHANNELS)

    def send(self, **members: Any) -> list[str]:
        """The errors that a message leads to."""
        reported = [json.loads(reply) for reply in self.session.receive(json.dumps(members))]
        assert all((status["op"], status["level"]) == ("status", 2) for status in reported)
        return [status["message"] for status in reported]

    def subscribe(self, *pairs: tuple[int, int]) -> list[str]:
        entries = [{"id": key, "channelId": channel} for key, channel in pairs]
        return self.send(op="subscribe", subscriptions=entries)

    def unsubscribe(self, *keys: int) -> list[str]:
        return self.send(op="unsubscribe", subscriptionIds=keys)

    @property
    def open(self) -> dict[object, str]:
        """The topics of the open subscriptions."""
        return {feed.name: feed.topic.name for feed in self.session.feeds}


@pytest.fixture
def stage() -> Stage:
    return Stage()


def test_each_channel_is_subscribed_once_and_each_id_used_once(stage: Stage) -> None:
    assert stage.subscribe((1, 10), (2, 20)) == []
    assert stage.open == {1: "/topic10", 2: "/topic20"}
    assert stage.subscribe((1, 30), (3, 10), (4, 999), (5, 40)) == [
        "subscription 1 is in use; channel 10 is subscribed to already; there is no channel 999"
    ]
    assert stage.open == {1: "/topic10", 2: "/topic20", 5: "/topic40"}
    assert stage.unsubscribe(1, 1, 77) == ["there is no subscription 77"]
    assert stage.open == {2: "/topic20", 5: "/topic40"}
    assert stage.subscribe((1, 10)) == [], "free again, both"


def test_subscriptions_are_limited(stage: Stage) -> None:
    assert stage.subscribe(*((n, n) for n in range(1, MAX_SUBSCRIPTIONS + 1))) == []
    assert stage.subscribe((199, 199)) == ["128 subscriptions are open, the limit"]
    assert len(stage.open) == MAX_SUBSCRIPTIONS
    stage.unsubscribe(1)
    assert stage.subscribe((199, 199)) == []


def test_channels_that_come_and_go_are_announced_and_their_subscriptions_end(stage: Stage) -> None:
    stage.subscribe((1, 10), (2, 20))
    now = {n: channel for n, channel in CHANNELS.items() if n != 10}
    now[300] = Channel(300, Topic("a/msg/B", "", "/new"), "")
    gone, new = map(json.loads, stage.session.offer(now))
    assert gone == {"op": "unadvertise", "channelIds": [10]}
    assert [channel["topic"] for channel in new["channels"]] == ["/new"]
    assert stage.open == {2: "/topic20"}
    stage.subscribe((1, 300))
    assert stage.open == {1: "/new", 2: "/topic20"}
    assert stage.session.offer(now) == ()
