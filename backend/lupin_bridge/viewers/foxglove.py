"""The read-only part of Foxglove's WebSocket protocol: its messages, channels and sessions.

A client may `subscribe` and `unsubscribe`. All else in the protocol (publishing, parameters,
services, assets, the graph) is refused with a `status` message of level error, and changes nothing:
none of it is among the capabilities that `serverInfo` names. Payloads are CDR, schemas `ros2msg`.

https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md

Channels are a twin's topics, and the layers that are published now. They are looked up while there
are clients, once for all of them.
"""

from __future__ import annotations

import asyncio
import math
import struct
import time
import uuid
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import count
from typing import Annotated, Final

import orjson
from pydantic import BaseModel, ConfigDict, Field

from lupin_bridge.feed.relay import Feed, Sample, TwinNames, schema_text, topics_of
from lupin_bridge.feed.source import TwinSource, TwinUnavailableError
from lupin_bridge.feed.tasks import Guard, Shared
from lupin_bridge.serving.ws_protocol import members_of, model_of, shown
from lupin_twin.core import interfaces
from lupin_twin.core.interfaces import Topic

# Both have the same content. Foxglove requests the newer one today, Lichtblick the older one; a
# client that offers both gets the first that it names.
SUBPROTOCOLS: Final = ("foxglove.sdk.v1", "foxglove.websocket.v1")

MAX_SUBSCRIPTIONS: Final = 128
_MAX_ID: Final = 2**32 - 1

_ERROR: Final = 2

_MESSAGE_DATA: Final = 1

_REFUSED: Final = "refused: lupin-twin only reads, expected subscribe or unsubscribe"


@dataclass(frozen=True, slots=True)
class Channel:
    """A topic as it is offered; `id` never stands for another topic or type."""

    id: int
    topic: Topic
    schema: str


# --- incoming ---------------------------------------------------------------------------------

_Id = Annotated[int, Field(ge=0, le=_MAX_ID)]


class _Subscription(BaseModel):
    model_config = ConfigDict(strict=True)

    id: _Id
    channel_id: _Id = Field(alias="channelId")


class _Subscribe(BaseModel):
    model_config = ConfigDict(strict=True)

    subscriptions: list[_Subscription] = Field(max_length=MAX_SUBSCRIPTIONS)


class _Unsubscribe(BaseModel):
    model_config = ConfigDict(strict=True)

    ids: list[_Id] = Field(alias="subscriptionIds", max_length=MAX_SUBSCRIPTIONS)


def parse(message: str | bytes) -> tuple[list[tuple[int, int]], list[int]]:
    """Read one message: subscriptions to begin (the client's own id, the channel's), or to end.

    Raises:
        ValueError: it is not served; the text names the member, the value and the limit.

    """
    if isinstance(message, bytes):
        raise ValueError(f"a binary message is {_REFUSED}")  # noqa: TRY004
    members = members_of(message)
    op = members.get("op")
    if op == "subscribe":
        return [(it.id, it.channel_id) for it in model_of(_Subscribe, members).subscriptions], []
    if op == "unsubscribe":
        return [], model_of(_Unsubscribe, members).ids
    raise ValueError(f"op {shown(op)} is {_REFUSED}")


# --- outgoing ---------------------------------------------------------------------------------


def message_head(feed: Feed, sample: Sample) -> bytes:
    """What comes before a sample's payload in a binary message."""
    return struct.pack("<BIQ", _MESSAGE_DATA, feed.name, max(0, sample.stamp_ns))


def server_info(session_id: str) -> bytes:
    """The first message; `session_id` changes with a restart."""
    return orjson.dumps(
        {
            "op": "serverInfo",
            "name": "lupin-twin",
            "capabilities": [],
            "supportedEncodings": [],
            "sessionId": session_id,
        }
    )


def error_status(text: str) -> bytes:
    """A status message: a request that failed, and why."""
    return orjson.dumps({"op": "status", "level": _ERROR, "message": text})


def advertise(channels: Iterable[Channel]) -> bytes:
    """The message that offers channels."""
    entries = [
        {
            "id": channel.id,
            "topic": channel.topic.name,
            "encoding": "cdr",
            "schemaName": channel.topic.type_name,
            "schemaEncoding": "ros2msg",
            "schema": channel.schema,
        }
        for channel in channels
    ]
    return orjson.dumps({"op": "advertise", "channels": entries})


def unadvertise(ids: Iterable[int]) -> bytes:
    """The message that withdraws channels."""
    return orjson.dumps({"op": "unadvertise", "channelIds": sorted(ids)})


# --- one client's session -------------------------------------------------------------------------


class Session:
    """The state of one connection."""

    def __init__(self) -> None:
        self._subscriptions: dict[int, Channel] = {}
        self._advertised: dict[int, Channel] = {}

    @property
    def feeds(self) -> list[Feed]:
        """What the client is subscribed to; their names are its own ids."""
        return [Feed(channel.topic, key) for key, channel in self._subscriptions.items()]

    def receive(self, message: str | bytes) -> tuple[bytes, ...]:
        """Take one message from the client; returns the replies."""
        try:
            begun, ended = parse(message)
        except ValueError as error:
            return (error_status(str(error)),)
        return self._unsubscribe(ended) if ended else self._subscribe(begun)

    def offer(self, channels: Mapping[int, Channel]) -> tuple[bytes, ...]:
        """Take the current channels; the replies offer new ones, and withdraw old ones.

        Subscriptions to withdrawn channels end.
        """
        gone = self._advertised.keys() - channels.keys()
        new = [it for channel_id, it in channels.items() if channel_id not in self._advertised]
        replies = []
        if gone:
            replies.append(unadvertise(gone))
        if new:
            replies.append(advertise(new))
        self._advertised = dict(channels)
        self._subscriptions = {
            key: channel for key, channel in self._subscriptions.items() if channel.id not in gone
        }
        return tuple(replies)

    def refuse(self, feed: Feed, why: str) -> bytes:
        """End a subscription that cannot be served; returns the reply."""
        channel = self._subscriptions.pop(int(feed.name))
        return error_status(f"channel {channel.id} cannot be served now: {why}")

    def _subscribe(self, subscriptions: Iterable[tuple[int, int]]) -> tuple[bytes, ...]:
        errors = []
        for key, channel_id in subscriptions:
            channel = self._advertised.get(channel_id)
            if channel is None:
                errors.append(f"there is no channel {channel_id}")
            elif key in self._subscriptions:
                errors.append(f"subscription {key} is in use")
            elif channel in self._subscriptions.values():
                errors.append(f"channel {channel_id} is subscribed to already")
            elif len(self._subscriptions) >= MAX_SUBSCRIPTIONS:
                errors.append(f"{MAX_SUBSCRIPTIONS} subscriptions are open, the limit")
            else:
                self._subscriptions[key] = channel
        return _errors(errors)

    def _unsubscribe(self, ids: Iterable[int]) -> tuple[bytes, ...]:
        return _errors(
            [
                f"there is no subscription {key}"
                for key in dict.fromkeys(ids)
                if self._subscriptions.pop(key, None) is None
            ]
        )


def _errors(errors: list[str]) -> tuple[bytes, ...]:
    # One message for all errors: the answer is never longer than the request.
    return (error_status("; ".join(errors)),) if errors else ()


# How often a client looks for layers, and how long what another client has found is new enough, s.
POLL_S: Final = 2.0
FRESH_S: Final = 1.0
MAX_LAYERS: Final = 64


class Offer:
    """What clients may subscribe to, by id; belongs to the event loop."""

    def __init__(self, source: TwinSource) -> None:
        self.session_id = uuid.uuid4().hex
        self.channels: dict[int, Channel] = {}
        self._source = source
        self._ids = count(1)
        self._looked_s = -math.inf
        self._looking = Shared()
        self._guard = Guard("foxglove's layers are unchanged")

    async def look(self) -> None:
        """Bring the channels up to date; all clients share the looks."""
        if time.monotonic() >= self._looked_s + FRESH_S:
            await self._guard.run(self._looking.get("look", self._look))

    async def _look(self) -> None:
        names = self._source.names
        wanted = list(topics_of(names))
        try:
            published = await self._source.relay.published(partial(_is_layer, names))
        except TwinUnavailableError:
            published = {}
        wanted += [Topic(kind, "", name) for name, kind in sorted(published.items())[:MAX_LAYERS]]
        known = {channel.topic: channel for channel in self.channels.values()}
        found = [known.get(topic) or await self._channel(topic) for topic in wanted]
        self.channels = {channel.id: channel for channel in found}
        self._looked_s = time.monotonic()

    async def _channel(self, topic: Topic) -> Channel:
        text = await asyncio.to_thread(schema_text, topic.type_name)
        return Channel(next(self._ids), topic, text)


def _is_layer(names: TwinNames, topic: str, type_name: str) -> bool:
    if type_name == interfaces.LAYERS.type_name:
        return topic.startswith(names.field_layers)
    is_markers = type_name == interfaces.TAGS.type_name
    return is_markers and topic in (names.tags_layer, names.planters_layer)
