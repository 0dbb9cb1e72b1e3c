"""A rosbridge client that sees everything."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from websockets.frames import Frame, Opcode
from websockets.sync.client import ClientConnection

from tests.support.waiting import PATIENCE_S, wait_for
from tests.support.ws_client import open_websocket

TOPIC = "/twin/state"
FIELD = "/twin/get_field"
FIELD_ARGS: dict[str, Any] = {
    "sensor_type": "temperature",
    "resolution": 0.5,
    "bbox_min_x": -3.0,
    "bbox_min_y": -3.0,
    "bbox_max_x": 3.0,
    "bbox_max_y": 3.0,
}

Message = dict[str, Any]

# Nearly 10^6 cells, all of them null: 5 MB.
LARGE_CALL: Message = {
    "op": "call_service",
    "service": FIELD,
    "id": "large",
    "args": {**FIELD_ARGS, "resolution": 0.0061},
}


class Ros:
    """A rosbridge client that sees every message."""

    def __init__(self, connection: ClientConnection) -> None:
        self.connection = connection

    def send(self, **members: Any) -> None:
        self.connection.send(json.dumps(members))

    def next(self) -> Message:
        message: Message = json.loads(self.connection.recv(timeout=PATIENCE_S))
        return message

    def subscribe(self, message_id: object = None, **options: Any) -> None:
        self.send(**{"op": "subscribe", "topic": TOPIC, "id": message_id, **options})

    def call(self, service: str, message_id: str = "call", **members: Any) -> Message:
        """Call a service and return the very next message, whatever it is."""
        self.send(op="call_service", service=service, id=message_id, **members)
        return self.next()

    def is_quiet(self) -> bool:
        """Whether nothing came before the answer to a call made now."""
        return self.call("/rosapi/topics", "quiet?").get("id") == "quiet?"

    def first(self, op: str) -> Message:
        """Read on to the first message of a kind."""
        message = self.next()
        while message["op"] != op:
            message = self.next()
        return message

    def until_tag(self, tag_id: str) -> Message:
        """Read on to the first state that has the tag."""

        def check() -> Message | None:
            message = self.next()
            return message if message["op"] == "publish" and tag_id in tags(message) else None

        found = wait_for(check, f"a state with tag {tag_id}", meanwhile=lambda _: None)
        assert found is not None
        return found


def tags(message: Message) -> list[str]:
    return [tag["tag_id"] for tag in message["msg"]["tags"]]


@contextmanager
def ros_at(url: str) -> Iterator[Ros]:
    address = f"{url.replace('http', 'ws', 1)}/rosbridge"
    with open_websocket(address) as opened:
        yield Ros(opened)


def masked(message: Message) -> bytes:
    """A message as a client's WebSocket frame."""
    return Frame(Opcode.TEXT, json.dumps(message).encode()).serialize(mask=True)
