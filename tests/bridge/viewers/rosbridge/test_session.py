"""One rosbridge client's state: subscriptions, levels, pace; and the result of each message."""

import json
from dataclasses import replace
from typing import Any

import pytest

from lupin_bridge.feed.relay import TwinNames
from lupin_bridge.stream.frames import FrameWriter, StateFrame
from lupin_bridge.viewers.rosbridge_session import MAX_SUBSCRIPTIONS, Reaction, Session
from lupin_twin.core.state import Snapshot, TagState
from tests.support.raw_ws import frames_of

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


# --- subscriptions ----------------------------------------------------------------------------


@pytest.mark.parametrize(("message_id", "topic"), [("b", TOPIC), ("a", "/cmd_vel")])
def test_ending_an_unknown_subscription_is_worth_a_warning(
    session: Session, message_id: str, topic: str
) -> None:
    subscribe(session, "a")
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


@pytest.mark.parametrize("type_", ["lupin_msgs/msg/TwinState", "lupin_msgs/TwinState", "", None])
def test_the_type_may_be_given_in_both_forms(session: Session, type_: object) -> None:
    assert subscribe(session, type=type_) == Reaction(state_is_due=True, subscribed=TOPIC)


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


# --- the state on the wire --------------------------------------------------------------------


def test_a_topic_has_the_name_that_the_client_used(session: Session) -> None:
    subscribe(session, topic="twin/state")
    subscribe(session, "a", topic="twin/state")
    assert [text["topic"] for text in texts_of(session.wire(frame()))] == ["twin/state"]
    subscribe(session, topic="/twin/state")
    spellings = [text["topic"] for text in texts_of(session.wire(frame()))]
    assert spellings == ["twin/state", "/twin/state"]
    unsubscribe(session, topic="twin/state")
    assert [text["topic"] for text in texts_of(session.wire(frame()))] == ["/twin/state"]


# --- calls, levels and everything else --------------------------------------------------------


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
