"""The read-only part of Foxglove's WebSocket protocol: what came in, what goes out. Pure.

A client may `subscribe` and `unsubscribe`. Whatever else the protocol has (to publish, parameters,
services, assets, the graph) is refused with a `status` message of level error, and changes nothing:
none of it is among the capabilities that `serverInfo` names. Payloads are CDR, schemas `ros2msg`.

https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import orjson

from lupin_bridge.feed.relay import Topic
from lupin_bridge.serving.ws_protocol import members_of, shown

# Of the same content. The newer one is what Foxglove asks for today, the older one what Lichtblick
# does; a client that offers both gets the first that it names.
SUBPROTOCOLS: Final = ("foxglove.sdk.v1", "foxglove.websocket.v1")

MAX_SUBSCRIPTIONS: Final = 128
_MAX_ID: Final = 2**32 - 1

WARNING: Final = 1
ERROR: Final = 2

_MESSAGE_DATA: Final = 1
_TIME: Final = 2

_REFUSED: Final = "refused: lupin-twin only reads, expected subscribe or unsubscribe"


class Refused(ValueError):
    """A message that is not served; the text names the member, the value and the limit."""


@dataclass(frozen=True, slots=True)
class Channel:
    """A topic as it is offered; `id` never stands for another topic or type."""

    id: int
    topic: Topic
    schema: str

    @property
    def json(self) -> dict[str, Any]:
        """As in `advertise`."""
        return {
            "id": self.id,
            "topic": self.topic.name,
            "encoding": "cdr",
            "schemaName": self.topic.type_name,
            "schemaEncoding": "ros2msg",
            "schema": self.schema,
        }


def chosen(offered: Iterable[str]) -> str | None:
    """The first of the subprotocols that a client offers that is served here."""
    return next((name for name in offered if name in SUBPROTOCOLS), None)


# --- incoming ---------------------------------------------------------------------------------


def parse(message: str | bytes) -> tuple[list[tuple[int, int]], list[int]]:
    """Read one message: subscriptions to begin (the client's own id, the channel's), or to end.

    Raises:
        Refused: it is none that is served.

    """
    if isinstance(message, bytes):
        raise Refused(f"a binary message is {_REFUSED}")
    try:
        members = members_of(message)
    except ValueError as error:
        raise Refused(str(error)) from None
    op = members.get("op")
    if op == "subscribe":
        return [_subscription(value) for value in _list(members, "subscriptions")], []
    if op == "unsubscribe":
        ids = _list(members, "subscriptionIds")
        return [], [_id("subscriptionIds", value) for value in ids]
    if isinstance(op, str):
        raise Refused(f"{op[:64]} is {_REFUSED}")
    raise Refused(f"op is {shown(op)}, expected subscribe or unsubscribe")


def _list(members: Mapping[str, Any], name: str) -> list[Any]:
    value = members.get(name)
    if not isinstance(value, list):
        raise Refused(f"{name} is {shown(value)}, expected an array")
    if len(value) > MAX_SUBSCRIPTIONS:
        raise Refused(f"{name} has {len(value)} entries, the limit is {MAX_SUBSCRIPTIONS}")
    return value


def _subscription(value: Any) -> tuple[int, int]:
    if not isinstance(value, dict):
        raise Refused(f"an entry of subscriptions is {shown(value)}, expected an object")
    return _id("id", value.get("id")), _id("channelId", value.get("channelId"))


def _id(name: str, value: Any) -> int:
    if type(value) is not int or not 0 <= value <= _MAX_ID:
        raise Refused(f"{name} is {shown(value)}, expected an integer from 0 to {_MAX_ID}")
    return value


# --- outgoing ---------------------------------------------------------------------------------


def server_info(session_id: str, *, has_time: bool) -> bytes:
    """The first message; `session_id` is another one after a restart."""
    return orjson.dumps(
        {
            "op": "serverInfo",
            "name": "lupin-twin",
            "capabilities": ["time"] if has_time else [],
            "supportedEncodings": [],
            "sessionId": session_id,
        }
    )


def status(level: int, text: str) -> bytes:
    """A message about a message, or about a channel."""
    return orjson.dumps({"op": "status", "level": level, "message": text})


def advertise(channels: Iterable[Channel]) -> bytes:
    """Channels that are offered now."""
    return orjson.dumps({"op": "advertise", "channels": [channel.json for channel in channels]})


def unadvertise(ids: Iterable[int]) -> bytes:
    """Channels that are offered no more."""
    return orjson.dumps({"op": "unadvertise", "channelIds": sorted(ids)})


def message_head(subscription_id: int, stamp_ns: int) -> bytes:
    """What stands before the payload of a message; the payload follows in the same frame."""
    return struct.pack("<BIQ", _MESSAGE_DATA, subscription_id, max(0, stamp_ns))


def time(stamp_ns: int) -> bytes:
    """Simulated time."""
    return struct.pack("<BQ", _TIME, max(0, stamp_ns))
