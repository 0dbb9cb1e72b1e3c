"""The rosbridge protocol as values: what is read, what is refused, what is written."""

from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from lupin_bridge.serving.ws_protocol import MAX_MESSAGE_LENGTH
from lupin_bridge.viewers import rosbridge_protocol as rosbridge
from lupin_bridge.viewers.rosbridge_protocol import (
    MAX_NAME_LENGTH,
    CallService,
    Refused,
    SetLevel,
    Subscribe,
    Unsubscribe,
    parse,
)

TOPIC = "/twin/state"
SERVICE = "/twin/get_field"

# What roslib 2.1.0 and roslibpy 2.0.0 send.
FROM_ROSLIB = {
    "op": "subscribe",
    "id": "subscribe:/twin/state:0b5a",
    "type": "lupin_msgs/msg/TwinState",
    "topic": TOPIC,
    "compression": "none",
    "throttle_rate": 0,
    "queue_length": 0,
}


def read(**members: Any) -> rosbridge.Request:
    return parse(json.dumps(members))


def refusal(message: str | bytes) -> Refused:
    with pytest.raises(Refused) as refused:
        parse(message)
    return refused.value


def refusal_of(**members: Any) -> Refused:
    return refusal(json.dumps(members))


# --- what is served ---------------------------------------------------------------------------


def test_a_subscription_as_roslib_sends_it() -> None:
    assert read(**FROM_ROSLIB) == Subscribe(
        "subscribe:/twin/state:0b5a", TOPIC, "lupin_msgs/msg/TwinState", 0.0, ()
    )


def test_a_subscription_needs_a_topic_alone() -> None:
    assert read(op="subscribe", topic=TOPIC) == Subscribe(None, TOPIC, "", 0.0, ())
    assert read(op="subscribe", topic=TOPIC, type=None, throttle_rate=None, id=None) == Subscribe(
        None, TOPIC, "", 0.0, ()
    )


@pytest.mark.parametrize("rate", [0, 40, 33.3, 3_600_000])
def test_a_throttle_rate_is_milliseconds(rate: float) -> None:
    request = read(op="subscribe", topic=TOPIC, throttle_rate=rate)
    assert isinstance(request, Subscribe)
    assert request.throttle_rate_ms == rate


@pytest.mark.parametrize(("length", "warned"), [(0, False), (1, False), (2, True), (1234567, True)])
def test_a_longer_queue_is_served_as_one_with_a_warning(length: int, warned: bool) -> None:
    request = read(op="subscribe", topic=TOPIC, queue_length=length)
    assert isinstance(request, Subscribe)
    expected = (f"queue_length {length} is served as 1: the newest only",) if warned else ()
    assert request.warnings == expected


@pytest.mark.parametrize("compression", ["png", "cbor-raw"])
@pytest.mark.parametrize(
    "message", [{"op": "subscribe", "topic": TOPIC}, {"op": "call_service", "service": SERVICE}]
)
def test_an_encoding_that_is_not_served_is_left_out_with_a_warning(
    message: dict[str, Any], compression: str
) -> None:
    request = read(**message, compression=compression)
    assert isinstance(request, Subscribe | CallService)
    warning = f"compression {compression!r} is not served: messages are plain JSON"
    assert request.warnings == (warning,)
    assert read(**message, compression="none", fragment_size=9) == read(**message)


def test_an_unsubscription() -> None:
    assert read(op="unsubscribe", topic=TOPIC) == Unsubscribe(None, TOPIC)
    assert read(op="unsubscribe", topic=TOPIC, id="a") == Unsubscribe("a", TOPIC)


def test_a_call_as_roslib_sends_it() -> None:
    args = {"sensor_type": "temperature", "resolution": 0.5}
    assert read(op="call_service", id="call_service:1", service=SERVICE, args=args) == CallService(
        "call_service:1", SERVICE, "", args, None, ()
    )
    assert read(op="call_service", service=SERVICE) == CallService(None, SERVICE, "", {}, None, ())


@pytest.mark.parametrize(("timeout", "expected"), [(2.5, 2.5), (0, None), (-1, None), (None, None)])
def test_a_timeout_that_is_not_positive_is_none(timeout: object, expected: float | None) -> None:
    request = read(op="call_service", service=SERVICE, timeout=timeout)
    assert isinstance(request, CallService)
    assert request.timeout_s == expected


@pytest.mark.parametrize("level", ["none", "error", "warning", "info"])
def test_a_level(level: Any) -> None:
    assert read(op="set_level", level=level) == SetLevel(level)


@pytest.mark.parametrize("message_id", ["", "a", "\x00\n", 0, -1, 2**63, "i" * MAX_NAME_LENGTH])
def test_an_id_is_a_string_or_an_integer(message_id: str | int) -> None:
    assert read(op="unsubscribe", topic=TOPIC, id=message_id) == Unsubscribe(message_id, TOPIC)


def test_members_that_are_not_known_are_passed_over() -> None:
    assert read(**FROM_ROSLIB, qos={"depth": 7}) == read(**FROM_ROSLIB)


# --- what is refused --------------------------------------------------------------------------


EXPECTED = "expected subscribe, unsubscribe, call_service or set_level"


@pytest.mark.parametrize("op", ["advertise", "publish", "send_action_goal", "png", "reboot"])
def test_what_writes_is_refused_by_name(op: str) -> None:
    refused = refusal_of(op=op, id="a", topic=TOPIC, type="std_msgs/String", msg={"data": "x"})
    assert (str(refused), refused.id) == (
        f"{op} is refused: lupin-twin only reads, {EXPECTED}",
        "a",
    )


@pytest.mark.parametrize(
    ("message", "text"),
    [
        (b'{"op":"subscribe","topic":"/twin/state"}', "a binary frame is refused"),
        (b"\xff\x00", "a binary frame is refused"),
        ("", "the message is not JSON"),
        ("{", "the message is not JSON"),
        ('{"op":"subscribe"} trailing', "the message is not JSON"),
        ('{"op":"unsubscribe","topic":NaN}', "the message is not JSON"),
        ('{"op":"unsubscribe","topic":"\\ud800"}', "the message is not JSON"),
        ("[]", "the message is an array, expected an object"),
        ("null", "the message is None, expected an object"),
        ('"subscribe"', "the message is 'subscribe', expected an object"),
        ("{}", "op is missing, expected a string"),
        ('{"op":null}', "op is missing, expected a string"),
        ('{"op":["subscribe"]}', "op is an array, expected a string"),
        ('{"op":{}}', "op is an object, expected a string"),
        ('{"op":"subscribe"}', "topic is missing, expected a string"),
        ('{"op":"unsubscribe"}', "topic is missing, expected a string"),
        ('{"op":"unsubscribe","topic":5}', "topic is 5, expected a string"),
        ('{"op":"call_service"}', "service is missing, expected a string"),
        ('{"op":"call_service","service":true}', "service is True, expected a string"),
        ('{"op":"set_level"}', "level is missing, expected a string"),
        ('{"op":"set_level","level":"all"}', "level is 'all', expected none, error, warning, info"),
    ],
)
def test_what_cannot_be_read_is_refused(message: str | bytes, text: str) -> None:
    refused = refusal(message)
    assert str(refused).startswith(text)
    assert refused.service is None


@pytest.mark.parametrize(
    ("option", "text"),
    [
        ({"type": 1}, "type is 1, expected a string"),
        ({"throttle_rate": -1}, "throttle_rate is -1, must not be less than 0"),
        ({"throttle_rate": "9"}, "throttle_rate is '9', expected a number"),
        ({"throttle_rate": True}, "throttle_rate is True, expected a number"),
        ({"throttle_rate": 3_600_001}, "throttle_rate is 3600001, expected 0 to 3600000 ms"),
        ({"queue_length": -1}, "queue_length is -1, must not be less than 0"),
        ({"queue_length": []}, "queue_length is an array, expected a number"),
        ({"compression": 0}, "compression is 0, expected a string"),
    ],
)
def test_a_subscription_with_a_wrong_option_is_refused(option: dict[str, Any], text: str) -> None:
    refused = refusal_of(op="subscribe", topic=TOPIC, id="a", **option)
    assert (str(refused), refused.id) == (text, "a")


@pytest.mark.parametrize(
    ("option", "text"),
    [
        ({"args": ["temperature"]}, "args is an array, expected an object"),
        ({"args": "temperature"}, "args is 'temperature', expected an object"),
        ({"timeout": "soon"}, "timeout is 'soon', expected a number"),
        ({"type": {}}, "type is an object, expected a string"),
        ({"compression": 7}, "compression is 7, expected a string"),
    ],
)
def test_a_refused_call_names_its_service_for_the_one_who_waits(
    option: dict[str, Any], text: str
) -> None:
    refused = refusal_of(op="call_service", service=SERVICE, id=3, **option)
    assert (str(refused), refused.id, refused.service) == (text, 3, SERVICE)


@pytest.mark.parametrize("message_id", [True, 1.5, 2.0**70, [], {}, ["a"]])
def test_an_id_of_another_kind_is_refused_and_not_repeated(message_id: object) -> None:
    refused = refusal_of(op="unsubscribe", topic=TOPIC, id=message_id)
    assert str(refused).endswith("expected a string or an integer")
    assert refused.id is None


@pytest.mark.parametrize("name", ["id", "topic", "type", "op"])
def test_a_long_name_is_refused_and_not_repeated(name: str) -> None:
    message = {"op": "subscribe", "topic": TOPIC, name: "x" * (MAX_NAME_LENGTH + 1)}
    assert str(refusal_of(**message)) == f"{name} has 257 characters, the limit is 256"


def test_a_message_past_a_limit_is_refused() -> None:
    text = str(refusal(" " * (MAX_MESSAGE_LENGTH + 1)))
    assert text == "the message has 16385 characters, the limit is 16384"


# --- what is written --------------------------------------------------------------------------


def test_a_status_carries_the_id_of_what_it_is_about() -> None:
    assert json.loads(rosbridge.status("error", "no", "a")) == {
        "op": "status",
        "id": "a",
        "level": "error",
        "msg": "no",
    }
    assert "id" not in json.loads(rosbridge.status("warning", "hm"))
    assert json.loads(rosbridge.status("error", "no", 0))["id"] == 0


def test_a_published_message() -> None:
    message = rosbridge.publish('/a"b', b'{"tags":[]}')
    assert json.loads(message) == {"op": "publish", "topic": '/a"b', "msg": {"tags": []}}


def test_a_service_response() -> None:
    response = rosbridge.service_response("a", SERVICE, b'{"ok":true}', result=True)
    assert json.loads(response) == {
        "op": "service_response",
        "id": "a",
        "service": SERVICE,
        "values": {"ok": True},
        "result": True,
    }
    failure = json.loads(rosbridge.service_failure(None, SERVICE, 'no "x"'))
    assert failure == {
        "op": "service_response",
        "service": SERVICE,
        "values": 'no "x"',
        "result": False,
    }


# --- anything at all --------------------------------------------------------------------------

SCALARS = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20)
VALUES = st.recursive(
    SCALARS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner),
    max_leaves=8,
)
OPS = st.sampled_from(["subscribe", "unsubscribe", "call_service", "set_level", "publish", "auth"])
NAMES = st.sampled_from(
    [
        *("id", "topic", "type", "service", "args", "level"),
        *("throttle_rate", "queue_length", "compression", "timeout"),
    ]
)
MESSAGES = st.builds(
    lambda op, members: json.dumps({**members, "op": op}),
    OPS,
    st.dictionaries(NAMES, VALUES | st.sampled_from([TOPIC, SERVICE, "none", "cbor"])),
)


@given(st.text() | st.binary() | MESSAGES | VALUES.map(json.dumps))
@example("[" * 60_000)
@example('{"op":"subscribe","topic":"/twin/state","throttle_rate":1e308}')
def test_any_message_is_read_or_refused_with_a_reply_that_is_json(message: str | bytes) -> None:
    outcome = outcome_of(message)
    if isinstance(outcome, Refused):
        assert 0 < len(str(outcome)) < 1000
        reply = json.loads(rosbridge.status("error", str(outcome), outcome.id))
        assert reply["msg"] == str(outcome)
    else:
        assert isinstance(outcome, Subscribe | Unsubscribe | CallService | SetLevel)


def outcome_of(message: str | bytes) -> rosbridge.Request | Refused:
    try:
        return parse(message)
    except Refused as refused:
        return refused
