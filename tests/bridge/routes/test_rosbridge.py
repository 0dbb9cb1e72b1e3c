"""`/rosbridge` of a real `lupin-twin serve`: by hand over a WebSocket, ROS on the other side."""

from collections.abc import Iterator

import pytest
from lupin_msgs.msg import TwinTagState

from tests.support import messages
from tests.support.processes import limits
from tests.support.rosbridge import FIELD, FIELD_ARGS, TOPIC, Ros, ros_at, tags
from tests.support.web import Bridge, bridge


@pytest.fixture(scope="module")
def house() -> Iterator[Bridge]:
    """A twin with two tags, 1 and 2."""
    with bridge(afresh=True) as running:
        running.peer.wait_for_twin()
        running.peer.until(lambda: running.peer.node.count_publishers(TOPIC), "its publisher")
        running.peer.observe(
            messages.scan("1", {"temperature": 20.0}, at=(0.0, 0.0)),
            messages.scan("2", {"temperature": 30.0, "co2": 400.0}, at=(1.0, 0.0)),
        )
        running.peer.spin_briefly()
        with running.listen() as listener:
            listener.until_tag("2")
        yield running


@pytest.fixture
def ros(house: Bridge) -> Iterator[Ros]:
    with ros_at(house.url) as client:
        yield client


def observed(house: Bridge, tag_id: str) -> None:
    """Let the robot see one more tag, and wait until the bridge has shown it to everybody."""
    with house.listen() as listener:
        house.peer.observe(messages.scan(tag_id, {"temperature": 20.0}))
        house.peer.spin_briefly()
        listener.until_tag(tag_id)


# --- the state --------------------------------------------------------------------------------


def test_who_subscribes_gets_the_current_state_at_once_and_then_every_change(
    house: Bridge, ros: Ros
) -> None:
    ros.subscribe()
    first = ros.next()
    assert (first["op"], first["topic"]) == ("publish", TOPIC)
    assert {"1", "2"} <= set(tags(first))
    served = house.json("/api/state")["tags"]
    told = {tag["tag_id"]: tag for tag in first["msg"]["tags"]}
    for tag in served:
        message = told[tag["tag_id"]]
        assert list(message) == list(TwinTagState.get_fields_and_field_types())
        as_told = {name: tag[name] for name in message} | {
            "readings": [{"name": r["name"], "value": r["value"]} for r in tag["readings"]]
        }
        assert message | {"stale_seconds": 0} == as_told | {"stale_seconds": 0}
    observed(house, "next")
    ros.until_tag("next")


def test_before_a_subscription_and_after_its_end_no_state_comes(house: Bridge, ros: Ros) -> None:
    observed(house, "before")
    assert ros.is_quiet()
    ros.subscribe("a")
    ros.until_tag("before")
    ros.send(op="unsubscribe", topic=TOPIC, id="a")
    ros.drain()
    observed(house, "after")
    assert ros.is_quiet()
    ros.subscribe("a")
    assert "after" in tags(ros.next())


def test_a_throttled_subscription_gets_the_latched_state_and_waits(house: Bridge, ros: Ros) -> None:
    ros.subscribe("slow", throttle_rate=3_600_000)
    assert ros.next()["op"] == "publish"
    observed(house, "unseen")
    assert ros.is_quiet()
    ros.subscribe("quick")
    assert "unseen" in tags(ros.next()), "each subscription begins with the current state"
    observed(house, "seen")
    ros.until_tag("seen")


def test_a_relative_name_is_answered_as_it_was_asked(ros: Ros) -> None:
    ros.subscribe(topic="twin/state")
    assert ros.next()["topic"] == "twin/state"


def test_no_status_of_the_bridge_comes_between(ros: Ros) -> None:
    """They are `/ws/state`'s own; roslib could not read them."""
    ros.subscribe()
    assert {ros.next()["op"] for _ in range(2)} == {"publish"}


# --- the field --------------------------------------------------------------------------------


# --- refusals ---------------------------------------------------------------------------------


def test_a_binary_frame_is_refused_and_the_connection_stays(ros: Ros) -> None:
    ros.connection.send(b"\x00\xff")
    assert ros.next()["msg"] == "a binary frame is refused, expected JSON text"
    assert ros.is_quiet()


# --- set-ups of their own ---------------------------------------------------------------------


def test_names_are_the_ones_that_ros_knows() -> None:
    remapping = ("--ros-args", "-r", "/twin/state:=/house/state", "-p", "field_service_name:=field")
    with bridge(*remapping) as house, ros_at(house.url) as ros:
        topics = ros.call("/rosapi/topics")["values"]
        assert (topics["topics"][0], topics["types"][0]) == (
            "/house/state",
            "lupin_msgs/msg/TwinState",
        )
        assert ros.call("/rosapi/services")["values"]["services"][0] == "/field"
        ros.subscribe(topic="/house/state")
        assert ros.next()["topic"] == "/house/state"
        ros.subscribe()
        assert "expected one of /house/state, /flor" in ros.first("status")["msg"]


def test_the_limits_of_fields_hold_here_too() -> None:
    with bridge(*limits(answers_per_s=0.01)) as house, ros_at(house.url) as ros:
        assert ros.call(FIELD, args=FIELD_ARGS)["result"] is True
        assert ros.call(FIELD, args=FIELD_ARGS)["result"] is True, "what is kept costs nothing"
        other = {**FIELD_ARGS, "resolution": 0.125}
        response = ros.call(FIELD, args=other)
        assert response["result"] is False
        assert response["values"] == (
            "127.0.0.1 requests more than 0.01 computed answers a second, the limit"
        )
        assert house.get("/api/field", **other).status_code == 429, "of one client, together"
