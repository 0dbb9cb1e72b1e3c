"""Foxglove's protocol: the channels of a scripted ROS, and one client of them."""

import asyncio
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

from lupin_bridge.feed.relay import Sample, TwinNames, topics_of
from lupin_bridge.feed.source import TwinUnavailableError
from lupin_bridge.viewers import foxglove as module
from lupin_bridge.viewers.foxglove import (
    MAX_LAYERS,
    MAX_SUBSCRIPTIONS,
    Channel,
    Counts,
    Offer,
    Reaction,
    Session,
)
from lupin_twin.core.interfaces import Topic
from tests.support.waiting import until

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


async def test_layers_are_bounded_and_end_with_ros() -> None:
    source = Source({f"/n/twin/field/s{n:03}": POINTS for n in range(MAX_LAYERS + 1)})
    offer = offer_of(source)
    await offer.look()
    assert len(topics(offer)) == len(OWN) + MAX_LAYERS
    source.has_ended = True
    await offer.look()
    assert topics(offer) == OWN


async def test_followers_get_only_changes_and_an_id_is_never_reused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(module, "POLL_S", 0.0)
    source = Source({"/n/twin/field/a": POINTS})
    offer = offer_of(source)
    await offer.look()
    news: list[list[str]] = []
    async with offer.followed(lambda: news.append(topics(offer))):
        looks = source.looks
        await until(lambda: source.looks > looks + 2, "some discoveries")
        assert news == []
        del source.now_published["/n/twin/field/a"]
        await until(lambda: news == [OWN], "the layer's end")
        source.now_published["/n/twin/field/a"] = POINTS
        await until(lambda: news == [OWN, [*OWN, "/n/twin/field/a"]], "the layer again")
        assert max(offer.channels) == len(OWN) + 2

    def following() -> list[str]:
        names = (task.get_name() for task in asyncio.all_tasks())
        return [name for name in names if name.startswith("foxglove")]

    await until(lambda: not following(), "an end of looking: nobody follows")


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
        self.counts = Counts()
        self.session = Session(self.counts)
        self.session.offer(CHANNELS)

    def send(self, **members: Any) -> Reaction:
        return self.session.receive(json.dumps(members))

    def subscribe(self, *pairs: tuple[int, int]) -> Reaction:
        entries = [{"id": key, "channelId": channel} for key, channel in pairs]
        return self.send(op="subscribe", subscriptions=entries)

    def unsubscribe(self, *keys: int) -> Reaction:
        return self.send(op="unsubscribe", subscriptionIds=keys)

    def written(self) -> list[tuple[int, bytes]]:
        """All that waits: subscriptions and payloads."""
        found = []
        while (parts := self.session.next()) is not None:
            found.append((parts[0][1], parts[1]))
        return found


@pytest.fixture
def stage() -> Stage:
    return Stage()


def errors(reaction: Reaction) -> list[str]:
    reported = [json.loads(reply) for reply in reaction.replies]
    assert all((status["op"], status["level"]) == ("status", 2) for status in reported)
    return [status["message"] for status in reported]


def test_each_channel_is_subscribed_once_and_each_id_used_once(stage: Stage) -> None:
    reaction = stage.subscribe((1, 10), (2, 20))
    assert reaction == Reaction(begun=((1, CHANNELS[10]), (2, CHANNELS[20])))
    reaction = stage.subscribe((1, 30), (3, 10), (4, 999), (5, 40))
    assert errors(reaction) == [
        "subscription 1 is in use; channel 10 is subscribed to already; there is no channel 999"
    ]
    assert reaction.begun == ((5, CHANNELS[40]),)
    reaction = stage.unsubscribe(1, 1, 77)
    assert (reaction.ended, errors(reaction)) == ((1,), ["there is no subscription 77"])
    assert stage.subscribe((1, 10)).begun == ((1, CHANNELS[10]),), "free again, both"


def test_subscriptions_are_limited(stage: Stage) -> None:
    most = [(n, n) for n in range(1, MAX_SUBSCRIPTIONS + 1)]
    assert len(stage.subscribe(*most).begun) == MAX_SUBSCRIPTIONS
    reaction = stage.subscribe((199, 199))
    assert (reaction.begun, errors(reaction)) == ((), ["128 subscriptions are open, the limit"])
    stage.unsubscribe(1)
    assert stage.subscribe((199, 199)).begun


def test_of_each_subscription_the_latest_message_waits_in_turn(stage: Stage) -> None:
    stage.subscribe((1, 10), (2, 20))
    for key, payload in ((1, b"a"), (2, b"b"), (1, b"c"), (9, b"nobody")):
        stage.session.put(key, Sample(payload, 5))
    assert stage.written() == [(2, b"b"), (1, b"c")]
    assert stage.counts == Counts(sent=2, skipped=1)
    stage.session.put(1, Sample(b"d", 5))
    stage.unsubscribe(1)
    assert stage.written() == [], "who has unsubscribed hears nothing more"
    stage.subscribe((1, 10))
    stage.session.put(1, Sample(b"a", 5))
    assert stage.written() == [(1, b"a")]


def test_channels_that_come_and_go_are_announced_and_their_subscriptions_end(stage: Stage) -> None:
    stage.subscribe((1, 10), (2, 20))
    stage.session.put(1, Sample(b"a", 5))
    now = {n: channel for n, channel in CHANNELS.items() if n != 10}
    now[300] = Channel(300, Topic("a/msg/B", "", "/new"), "")
    reaction = stage.session.offer(now)
    gone, new = map(json.loads, reaction.replies)
    assert gone == {"op": "unadvertise", "channelIds": [10]}
    assert [channel["topic"] for channel in new["channels"]] == ["/new"]
    assert (reaction.ended, stage.written()) == ((1,), [])
    assert not stage.session.has(1, CHANNELS[10])
    assert stage.session.has(2, CHANNELS[20])
    stage.subscribe((1, 300))
    assert stage.session.has(1, now[300])
    assert not stage.session.has(1, CHANNELS[10]), "the id is another channel's now"
    assert stage.session.offer(now) == Reaction()
