"""A client of Foxglove's protocol that sees everything, and other decoders of its messages."""

import json
import struct
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from mcap.records import Schema
from mcap_ros2.decoder import DecoderFactory
from websockets.sync.client import ClientConnection

from tests.support.waiting import PATIENCE_S
from tests.support.ws_client import open_websocket

SDK, WEBSOCKET = "foxglove.sdk.v1", "foxglove.websocket.v1"

TwinUpdate = dict[str, Any]


class Viewer:
    """A client that sees every message."""

    def __init__(self, connection: ClientConnection) -> None:
        self.connection = connection
        self.channels: dict[str, TwinUpdate] = {}

    def send(self, **members: Any) -> None:
        self.connection.send(json.dumps(members))

    def next(self) -> TwinUpdate | tuple[int, int, bytes]:
        """The next message: JSON, or (subscription, ns, payload)."""
        message = self.connection.recv(timeout=PATIENCE_S)
        if isinstance(message, str):
            reported: TwinUpdate = json.loads(message)
            if reported["op"] == "advertise":
                self.channels |= {channel["topic"]: channel for channel in reported["channels"]}
            return reported
        key, stamp_ns = struct.unpack_from("<IQ", message, 1)
        return key, stamp_ns, message[13:]

    def reported(self, op: str) -> TwinUpdate:
        """Read on to the first JSON message of a kind."""
        while not isinstance(message := self.next(), dict) or message["op"] != op:
            pass
        return message

    def status(self) -> str:
        status = self.reported("status")
        assert status["level"] == 2, status
        return str(status["message"])

    def data(self, key: int) -> bytes:
        """The payload of the next message of a subscription."""
        while isinstance(message := self.next(), dict) or message[0] != key:
            pass
        return message[2]

    def subscribe(self, topic: str, key: int = 1) -> None:
        """Subscribe to a topic by its channel."""
        channel_id = self.channels[topic]["id"]
        self.send(op="subscribe", subscriptions=[{"id": key, "channelId": channel_id}])


@contextmanager
def viewer(url: str, subprotocols: Sequence[str] = (SDK,), **options: Any) -> Iterator[Viewer]:
    """A client that knows the server and its channels."""
    address = f"{url.replace('http', 'ws', 1)}/foxglove"
    with open_websocket(address, subprotocols, **options) as connection:
        client = Viewer(connection)
        client.reported("advertise")
        yield client


def reader_of(channel: TwinUpdate) -> Callable[[bytes], Any]:
    """A decoder of a channel's payload, from the advertised schema alone."""
    schema = Schema(1, channel["schema"].encode(), channel["schemaEncoding"], channel["schemaName"])
    decode = DecoderFactory().decoder_for(channel["encoding"], schema)
    assert decode is not None
    return decode
