"""One client of Foxglove's protocol: what it may have, and what a slow one gets."""

import json
from typing import Any

import pytest

from lupin_bridge.feed.relay import Sample
from lupin_bridge.viewers.foxglove import (
    MAX_SUBSCRIPTIONS,
    Channel,
    Counts,
    Reaction,
    Session,
)
from lupin_twin.core.interfaces import Topic

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


def test_the_latest_message_of_each_subscription_waits_and_they_take_turns(stage: Stage) -> None:
    stage.subscribe((1, 10), (2, 20))
    for key, payload in ((1, b"a"), (2, b"b"), (1, b"c"), (9, b"nobody")):
        stage.session.put(key, Sample(payload, 5))
    assert stage.written() == [(2, b"b"), (1, b"c")]
    assert stage.counts == Counts(sent=2, skipped=1)
    stage.session.put(1, Sample(b"d", 5))
    stage.unsubscribe(1)
    assert stage.written() == [], "who has unsubscribed hears nothing more"


def test_time_goes_before_messages_and_only_the_latest(stage: Stage) -> None:
    stage.subscribe((1, 10))
    stage.session.put(1, Sample(b"a", 5))
    stage.session.time_ns = 7
    stage.session.time_ns = 8
    assert stage.session.next() == (b"\x02\x08" + bytes(7), b"")
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
