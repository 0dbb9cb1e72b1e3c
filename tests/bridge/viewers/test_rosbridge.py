"""rosbridge's protocol: one client's state, messages in JSON, and feeds over a scripted relay."""

import asyncio
import json
import math
from array import array
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
import orjson
import pytest

from lupin_bridge.feed.relay import Feed, NotRelayedError, Sample, TwinNames
from lupin_bridge.routes.sockets import Feeds
from lupin_bridge.stream.frames import FrameWriter, StateFrame, text_frame
from lupin_bridge.viewers.rosbridge_protocol import json_of
from lupin_bridge.viewers.rosbridge_session import (
    MAX_SUBSCRIPTIONS,
    Reaction,
    Session,
    Writer,
)
from lupin_twin.core.interfaces import Topic
from lupin_twin.core.state import Snapshot, TagState
from lupin_twin.runtime.workers import Workers
from tests.support.raw_ws import frames_of
from tests.support.waiting import until

TOPIC = "/twin/state"
NAMES = TwinNames(TOPIC, "/twin/get_field")
SERVED = "/twin/state, /floranova/observations, /perception/discovered_tags, /map, /diagnostics"


@pytest.fixture
def session() -> Session:
    return Session(NAMES)


def send(session: Session, **members: Any) -> Reaction:
    return session.receive(json.dumps(members))


def replies(reaction: Reaction) -> list[Any]:
    return [json.loads(reply) for reply in reaction.replies]


def subscribe(session: Session, message_id: object = None, **options: Any) -> Reaction:
    return send(session, **{"op": "subscribe", "topic": TOPIC, "id": message_id, **options})


def unsubscribe(session: Session, message_id: object = None, topic: str = TOPIC) -> Reaction:
    return send(session, op="unsubscribe", topic=topic, id=message_id)


def texts_of(wire: bytes) -> list[Any]:
    """The JSON of every text frame on the wire."""
    return [json.loads(data) for _, data in frames_of(wire)]


def frame(*tag_ids: str) -> StateFrame:
    return FrameWriter().state(Snapshot(0, "map", tuple(TagState(t) for t in tag_ids)), "r")


def test_the_type_may_be_given_in_both_forms_and_ending_an_unknown_one_is_worth_a_warning(
    session: Session,
) -> None:
    for type_ in ("lupin_msgs/msg/TwinState", "lupin_msgs/TwinState", "", None):
        reaction = subscribe(session, "a", type=type_)
        assert reaction == Reaction(state_is_due=True, subscribed=TOPIC)
    for message_id, topic in (("b", TOPIC), ("a", "/cmd_vel")):
        (status,) = replies(unsubscribe(session, message_id, topic))
        assert (status["level"], status["id"]) == ("warning", message_id)
        assert status["msg"] == f"there is no such subscription to topic {topic!r}"
        assert session.is_subscribed


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"topic": "/cmd_vel"}, f"topic '/cmd_vel' is not served, expected one of {SERVED}"),
        ({"topic": "/map/"}, f"topic '/map/' is not served, expected one of {SERVED}"),
        (
            {"type": "std_msgs/String"},
            "type is 'std_msgs/String', expected lupin_msgs/msg/TwinState",
        ),
        ({"throttle_rate": -1}, "throttle_rate is -1: input should be greater than or equal to 0"),
        ({"throttle_rate": True}, "throttle_rate is True: input should be a valid number"),
        (
            {"throttle_rate": 3_600_001},
            "throttle_rate is 3600001: input should be less than or equal to 3600000",
        ),
        ({"topic": 5}, "topic is 5: input should be a valid string"),
        ({"topic": None}, "topic: field required"),
    ],
)
def test_a_refused_subscription_changes_nothing(
    session: Session, options: dict[str, Any], text: str
) -> None:
    reaction = subscribe(session, "a", **options)
    assert replies(reaction) == [{"op": "status", "level": "error", "msg": text, "id": "a"}]
    assert not reaction.state_is_due
    assert not session.is_subscribed


def test_subscriptions_are_limited(session: Session) -> None:
    for number in range(MAX_SUBSCRIPTIONS):
        assert not subscribe(session, number).replies
    (status,) = replies(subscribe(session, "one more"))
    assert status["msg"] == f"{MAX_SUBSCRIPTIONS} subscriptions are open, the limit"
    assert not subscribe(session, 0, throttle_rate=1).replies, "replacing one is no new one"
    unsubscribe(session, 0)
    assert not subscribe(session, "one more").replies


def test_a_topic_is_fed_by_the_options_of_its_last_subscription(session: Session) -> None:
    assert subscribe(session, topic="map", throttle_rate=500) == Reaction(subscribed="map")
    assert not session.is_subscribed
    feed = session.feeds["map"]
    assert (feed.topic.name, feed.topic.type_name) == ("/map", "nav_msgs/msg/OccupancyGrid")
    assert (feed.name, feed.min_interval_s) == ("map", 0.5)
    subscribe(session, "b", topic="map", throttle_rate=100)
    assert session.feeds == {"map": replace(feed, min_interval_s=0.1)}
    unsubscribe(session, "b", topic="map")
    assert session.feeds == {"map": feed}
    unsubscribe(session, topic="map")
    assert session.feeds == {}


def test_a_topic_has_the_name_that_the_client_used(session: Session) -> None:
    subscribe(session, topic="twin/state")
    subscribe(session, "a", topic="twin/state")
    assert [text["topic"] for text in texts_of(session.wire(frame()))] == ["twin/state"]
    subscribe(session, topic="/twin/state")
    spellings = [text["topic"] for text in texts_of(session.wire(frame()))]
    assert spellings == ["twin/state", "/twin/state"]
    unsubscribe(session, topic="twin/state")
    assert [text["topic"] for text in texts_of(session.wire(frame()))] == ["/twin/state"]


@pytest.mark.parametrize(
    "members",
    [
        {"service": "/reboot"},
        {"service": "/twin/get_field", "args": {"x": 1}},
        {"service": "/twin/get_field", "args": ["co2"]},
        {"service": "/twin/get_field", "args": {"resolution": "x"}},
        {"service": "/twin/get_field", "type": "std_srvs/srv/Trigger"},
        {"service": "/twin/get_field", "timeout": "soon"},
    ],
)
def test_a_refused_call_gets_a_response(session: Session, members: dict[str, Any]) -> None:
    (response,) = replies(send(session, op="call_service", id="a", **members))
    assert (response["op"], response["id"]) == ("service_response", "a")
    assert response["result"] is False
    assert isinstance(response["values"], str)


@pytest.mark.parametrize("message_id", [True, 1.5, 2.0**70, [], {}, "i" * 257])
def test_an_id_of_a_wrong_type_is_refused_and_not_repeated(
    session: Session, message_id: object
) -> None:
    [reply] = replies(send(session, op="unsubscribe", topic=TOPIC, id=message_id))
    assert reply["msg"].startswith("id is ")
    assert "id" not in reply


class Stamp:
    sec, nanosec = 5, 6

    @staticmethod
    def get_fields_and_field_types() -> dict[str, str]:
        return {"sec": "int32", "nanosec": "uint32"}


class Everything:
    """A message with every kind of field, as rclpy gives it."""

    FIELDS: ClassVar[dict[str, tuple[str, Any]]] = {
        "stamp": ("builtin_interfaces/Time", Stamp()),
        "text": ("string", "é"),
        "flag": ("boolean", True),
        "level": ("octet", b"\x02"),
        "ratio": ("double", math.nan),
        "cells": ("sequence<int8>", array("b", [-1, 0, 100])),
        "points": ("sequence<float, 9>", array("f", [0.5, math.inf])),
        "matrix": ("double[2]", np.array([1.0, 2.0])),
        "names": ("sequence<string>", ["a", "b"]),
        "stamps": ("sequence<builtin_interfaces/Time>", [Stamp()]),
    }

    def __getattr__(self, name: str) -> Any:
        return self.FIELDS[name][1]

    @classmethod
    def get_fields_and_field_types(cls) -> dict[str, str]:
        return {name: kind for name, (kind, _) in cls.FIELDS.items()}


def test_json_has_lists_and_null_for_what_is_not_finite() -> None:
    assert json.loads(json_of(Everything())) == {
        "stamp": {"sec": 5, "nanosec": 6},
        "text": "é",
        "flag": True,
        "level": 2,
        "ratio": None,
        "cells": [-1, 0, 100],
        "points": [0.5, None],
        "matrix": [1.0, 2.0],
        "names": ["a", "b"],
        "stamps": [{"sec": 5, "nanosec": 6}],
    }


@pytest.mark.parametrize("length", [0, 1, 65_536, 65_537])
def test_a_list_of_any_length_is_complete(monkeypatch: pytest.MonkeyPatch, length: int) -> None:
    cells = array("b", [number % 101 - 1 for number in range(length)])
    monkeypatch.setitem(Everything.FIELDS, "cells", ("sequence<int8>", cells))
    assert json.loads(json_of(Everything()))["cells"] == cells.tolist()


INPUT = Topic("a/msg/B", "", "/in", depth=3)


class Relay:
    """Receives what the test says, and counts reads."""

    def __init__(self) -> None:
        self.ears: list[Callable[[Sample], None]] = []
        self.read_count = self.skipped = 0
        self.refuses = False

    async def listen(self, topic: Topic, take: Callable[[Sample], None]) -> Any:
        if self.refuses:
            raise NotRelayedError("no such type")
        self.ears.append(take)
        return lambda: self.ears.remove(take)

    def read(self, topic: Topic, sample: Sample) -> Any:
        self.read_count += 1
        if sample.data == b"bad":
            raise ValueError("not a message")
        if sample.data == b"odd":
            raise ZeroDivisionError
        return SimpleMessage(sample.data.decode())

    def publish(self, *texts: str) -> None:
        for text in texts:
            sample = Sample(text.encode(), 5_000_000_006)
            for ear in list(self.ears):
                ear(sample)


class SimpleMessage:
    def __init__(self, text: str) -> None:
        self.text = text

    @staticmethod
    def get_fields_and_field_types() -> dict[str, str]:
        return {"text": "string"}


class Client:
    """What a client has received; it reads only while its gate is open."""

    def __init__(self, relay: Any, writer: Writer) -> None:
        self.frames: list[bytes] = []
        self.refused: list[str] = []
        self.gate = asyncio.Event()
        self.gate.set()
        self.feeding = Feeds(relay, self._send, self._refuse)
        self._writer = writer

    async def _send(self, feed: Feed, sample: Sample) -> None:
        self.frames.append(await self._writer.frame(feed, sample))
        await self.gate.wait()

    async def _refuse(self, _feed: Feed, why: str) -> None:
        self.refused.append(why)


def json_frame(text: str) -> bytes:
    return text_frame(orjson.dumps({"op": "publish", "topic": "in", "msg": {"text": text}}))


def feed(**options: Any) -> Feed:
    return replace(Feed(INPUT, "in", 0.0), **options)


@pytest.fixture
def relay() -> Relay:
    return Relay()


@pytest.fixture
def writer(relay: Relay) -> Iterator[Writer]:
    workers = Workers("work")
    yield Writer(relay, workers)  # type: ignore[arg-type]
    workers.close()


async def test_a_message_is_serialised_once_for_all_clients_with_equal_options(
    relay: Relay, writer: Writer
) -> None:
    clients = [Client(relay, writer) for _ in range(3)]
    for client in clients:
        client.feeding.follow([feed()])
    await until(lambda: len(relay.ears) == 3, "the clients to listen")
    relay.publish("a")
    await until(lambda: all(client.frames for client in clients), "the message")
    assert [client.frames for client in clients] == [[json_frame("a")]] * 3
    assert relay.read_count == 1
    for client in clients:
        client.feeding.follow(())
    await until(lambda: not relay.ears, "nobody to listen")


async def test_what_waits_for_a_slow_client_is_limited_by_the_topics_depth(
    relay: Relay, writer: Writer
) -> None:
    slow = Client(relay, writer)
    slow.gate.clear()
    slow.feeding.follow([feed()])
    await until(lambda: bool(relay.ears), "it to listen")
    relay.publish("0")
    await until(lambda: bool(slow.frames), "the first")
    relay.publish("1", "2", "3", "4")
    slow.gate.set()
    await until(lambda: len(slow.frames) == 4, "the rest")
    assert slow.frames == [json_frame(text) for text in "0234"]
    assert relay.skipped == 1


async def test_a_throttled_client_gets_the_latest_message_and_not_before_its_time(
    relay: Relay, writer: Writer
) -> None:
    quick, often, rare = (Client(relay, writer) for _ in range(3))
    quick.feeding.follow([feed()])
    often.feeding.follow([feed(min_interval_s=0.001)])
    rare.feeding.follow([feed(min_interval_s=3600.0)])
    await until(lambda: len(relay.ears) == 3, "them to listen")
    often.gate.clear()
    relay.publish("0")
    await until(lambda: all(c.frames for c in (quick, often, rare)), "the first")
    relay.publish("1", "2", "3")
    await until(lambda: len(quick.frames) == 4, "the rest")
    often.gate.set()
    await until(lambda: len(often.frames) == 2, "the latest")
    assert often.frames == [json_frame("0"), json_frame("3")]
    assert rare.frames == [json_frame("0")]


async def test_an_unserialisable_message_is_an_error_for_the_client(
    relay: Relay, writer: Writer, caplog: pytest.LogCaptureFixture
) -> None:
    client = Client(relay, writer)
    client.feeding.follow([feed()])
    await until(lambda: bool(relay.ears), "it to listen")
    relay.publish("odd", "odd", "bad")
    await until(lambda: len(client.frames) == 3, "all of them")
    relay.publish("good")
    await until(lambda: len(client.frames) == 4, "the next one")
    odd, _, bad, good = client.frames
    assert b"an internal error" in odd
    assert b"a message of topic 'in' is left out: not a message" in bad
    assert good == json_frame("good")
    assert caplog.text.count("Traceback") == 1, "what persists is logged once"
    relay.refuses = True
    client.feeding.follow([feed()], "in")
    await until(lambda: client.refused == ["no such type"], "the refusal")
    relay.refuses = False
    client.feeding.follow([feed()])
    await until(lambda: bool(relay.ears), "it to listen again")
    client.feeding.follow(())
    await until(lambda: not relay.ears, "its end")
