"""Foxglove's protocol as values: what is read, what is refused, what is written."""

from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lupin_bridge.viewers import foxglove_protocol as protocol
from lupin_bridge.viewers.foxglove_protocol import (
    MAX_SUBSCRIPTIONS,
    Channel,
    Refused,
    Subscribe,
    Unsubscribe,
    parse,
)

LARGEST = 2**32 - 1


def refusal(message: str | bytes) -> str:
    with pytest.raises(Refused) as caught:
        parse(message)
    return str(caught.value)


def subscribing(*pairs: Any) -> str:
    entries = [{"id": key, "channelId": channel} for key, channel in pairs]
    return json.dumps({"op": "subscribe", "subscriptions": entries})


def test_subscriptions_are_read() -> None:
    assert parse(subscribing((0, LARGEST), (7, 1))) == Subscribe(((0, LARGEST), (7, 1)))
    assert parse('{"op":"unsubscribe","subscriptionIds":[3,0]}') == Unsubscribe((3, 0))


@pytest.mark.parametrize("value", [-1, LARGEST + 1, 1.0, "1", True, None, [], {}])
def test_an_id_is_an_integer_of_32_bits(value: Any) -> None:
    said = f"expected an integer from 0 to {LARGEST}"
    assert refusal(subscribing((value, 1))).startswith("id is ")
    assert refusal(subscribing((1, value))).endswith(said)
    unsubscribing = json.dumps({"op": "unsubscribe", "subscriptionIds": [value]})
    assert refusal(unsubscribing).startswith("subscriptionIds is ")


def test_a_list_has_a_limit() -> None:
    most = [(key, 1) for key in range(MAX_SUBSCRIPTIONS)]
    request = parse(subscribing(*most))
    assert isinstance(request, Subscribe)
    assert len(request.subscriptions) == MAX_SUBSCRIPTIONS
    said = "subscriptions has 129 entries, the limit is 128"
    assert refusal(subscribing(*most, (999, 1))) == said
    one_more = json.dumps({"op": "unsubscribe", "subscriptionIds": [1] * (MAX_SUBSCRIPTIONS + 1)})
    assert refusal(one_more) == "subscriptionIds has 129 entries, the limit is 128"


REFUSED = "refused: lupin-twin only reads, expected subscribe or unsubscribe"


@pytest.mark.parametrize(
    ("message", "said"),
    [
        ("{}", "op is None, expected subscribe or unsubscribe"),
        ('{"op":["subscribe"]}', "op is an array, expected subscribe or unsubscribe"),
        ('{"op":"subscribe","subscriptions":{}}', "subscriptions is an object, expected an array"),
        (
            '{"op":"subscribe","subscriptions":[1]}',
            "an entry of subscriptions is 1, expected an object",
        ),
        ('{"op":"unsubscribe"}', "subscriptionIds is None, expected an array"),
        ('{"op":"setParameters"}', f"setParameters is {REFUSED}"),
        *((message, f"a binary message is {REFUSED}") for message in (b"", b"\x01", b"\x02\xff")),
    ],
)
def test_what_is_not_served_is_refused_by_its_name(message: str | bytes, said: str) -> None:
    assert refusal(message) == said


@given(st.one_of(st.binary(max_size=64), st.text(max_size=64)))
def test_nonsense_is_refused_and_nothing_worse(message: str | bytes) -> None:
    assert refusal(message)


def test_the_first_subprotocol_that_is_spoken_is_chosen() -> None:
    for offered, chosen in (
        (["x", "foxglove.websocket.v1", "foxglove.sdk.v1"], "foxglove.websocket.v1"),
        (["foxglove.sdk.v1"], "foxglove.sdk.v1"),
        (["foxglove.sdk.v2", ""], None),
        ([], None),
    ):
        assert protocol.chosen(offered) == chosen


def test_what_is_told_is_as_the_specification_has_it() -> None:
    assert json.loads(protocol.server_info("s", has_time=True)) == {
        "op": "serverInfo",
        "name": "lupin-twin",
        "capabilities": ["time"],
        "supportedEncodings": [],
        "sessionId": "s",
    }
    assert json.loads(protocol.server_info("s", has_time=False))["capabilities"] == []
    assert json.loads(protocol.status(protocol.ERROR, "no")) == {
        "op": "status",
        "level": 2,
        "message": "no",
    }
    channel = Channel(3, "/a", "a/msg/B", "int32 x\n").json()
    assert json.loads(protocol.advertise([channel, channel])) == {
        "op": "advertise",
        "channels": [
            {
                "id": 3,
                "topic": "/a",
                "encoding": "cdr",
                "schemaName": "a/msg/B",
                "schemaEncoding": "ros2msg",
                "schema": "int32 x\n",
            }
        ]
        * 2,
    }
    assert json.loads(protocol.advertise([])) == {"op": "advertise", "channels": []}
    assert json.loads(protocol.unadvertise({5, 3})) == {"op": "unadvertise", "channelIds": [3, 5]}
    assert protocol.message_head(258, 1) == b"\x01\x02\x01\0\0\x01\0\0\0\0\0\0\0"
    assert protocol.message_head(1, -1) == b"\x01\x01\0\0\0" + bytes(8)
    assert protocol.time(2) == b"\x02\x02\0\0\0\0\0\0\0"
    assert protocol.time(-1) == b"\x02" + bytes(8), "a time before the epoch is none"
