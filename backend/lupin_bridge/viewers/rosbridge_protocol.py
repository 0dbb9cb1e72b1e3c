"""The read-only part of the rosbridge v2 protocol, as values: what came in, what goes out.

Pure. Served at `/rosbridge` are `subscribe` and `unsubscribe` (the twin's topics), and
`call_service` (GetField and a little of rosapi): what roslib's clients use to read, with `args` as
an object. Any other operation is refused with a `status` message that names it.

How the options meet our policy, which keeps the newest for a client and queues no more:

- `throttle_rate` (ms) is honoured; of several subscriptions the smallest counts. When it has
  passed, the newest state follows by itself (rosbridge would wait for the next message).
- `queue_length` is the policy's, whatever is asked for: the newest, and of observations and
  discovered tags the newest 50. `compression` is none: plain JSON, which every client reads.
- `id` is a string or an integer. null counts as not given, everywhere. Members that are not named
  here are ignored, as rosbridge does.

https://github.com/RobotWebTools/rosbridge_suite/blob/ros2/ROSBRIDGE_PROTOCOL.md
"""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal

import orjson
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from lupin_bridge.serving.ws_protocol import members_of, shown

MAX_NAME_LENGTH: Final = 256
MAX_THROTTLE_RATE_MS: Final = 3_600_000.0

Level = Literal["error", "warning"]
Name = Annotated[str, Field(max_length=MAX_NAME_LENGTH)]
Id = Name | int | None


class Refused(ValueError):
    """A message that cannot be served; the text names the member, the value and the limit.

    `service` is the service whose call was refused: its caller waits for a response.
    """

    def __init__(self, text: str, message_id: Id = None, service: str | None = None) -> None:
        super().__init__(text)
        self.id = message_id
        self.service = service


class _Request(BaseModel):
    """What every operation may have."""

    model_config = ConfigDict(strict=True, frozen=True)

    id: Id = None


class Subscribe(_Request):
    """A subscription to a topic; `type` is empty where the client leaves it open."""

    topic: Name
    type: Name = ""
    throttle_rate: Annotated[float, Field(ge=0, le=MAX_THROTTLE_RATE_MS)] = 0.0


class Unsubscribe(_Request):
    """The end of one subscription to a topic, or of all where `id` is None."""

    topic: Name


class CallService(_Request):
    """A call; `args` are by name. `timeout`, s; one that is not positive is none."""

    service: Name
    type: Name = ""
    args: dict[str, Any] = Field(default_factory=dict)
    timeout: float | None = None


Request = Subscribe | Unsubscribe | CallService
_OPERATIONS: Final[dict[str, type[Request]]] = {
    "subscribe": Subscribe,
    "unsubscribe": Unsubscribe,
    "call_service": CallService,
}


# --- incoming ---------------------------------------------------------------------------------


def parse(message: str | bytes) -> Request:
    """Read one frame.

    Raises:
        Refused: not JSON text, not an operation that is served, or a member of the wrong kind.

    """
    try:
        given = members_of(message)
    except ValueError as error:
        raise Refused(str(error)) from None
    members = {name: value for name, value in given.items() if value is not None}
    op, message_id, service = (members.get(name) for name in ("op", "id", "service"))
    # Of a wrong kind, they are not repeated.
    message_id = message_id if _is_short(message_id) or type(message_id) is int else None
    kind = _OPERATIONS.get(op) if isinstance(op, str) else None
    if kind is None:
        served = ", ".join(_OPERATIONS)
        raise Refused(
            f"op {shown(op)} is refused: lupin-twin only reads, expected {served}", message_id
        )
    try:
        return kind.model_validate(members)
    except ValidationError as error:
        first = error.errors(include_url=False, include_context=False)[0]
        name, why = str(first["loc"][0]), first["msg"]
        value = "" if first["type"] == "missing" else f" is {shown(first['input'])}"
        called = service if kind is CallService and _is_short(service) else None
        raise Refused(f"{name}{value}: {why[0].lower()}{why[1:]}", message_id, called) from None


def _is_short(value: object) -> bool:
    return isinstance(value, str) and len(value) <= MAX_NAME_LENGTH


# --- outgoing ---------------------------------------------------------------------------------


def status(level: Level, text: str, message_id: Id = None) -> bytes:
    """A message about a message; `message_id` is that of the one it is about."""
    return orjson.dumps({"op": "status", **_id_member(message_id), "level": level, "msg": text})


def publish(topic: str, message: bytes) -> bytes:
    """A message on a topic; `message` is JSON."""
    return b'{"op":"publish","topic":%b,"msg":%b}' % (orjson.dumps(topic), message)


def service_response(message_id: Id, service: str, values: bytes, *, result: bool) -> bytes:
    """The end of a call; `values` is JSON: the response, or, where `result` is false, why not."""
    head = orjson.dumps({"op": "service_response", **_id_member(message_id), "service": service})
    return b'%b,"values":%b,"result":%b}' % (head[:-1], values, b"true" if result else b"false")


def service_failure(message_id: Id, service: str, text: str) -> bytes:
    """A call that got no response, and why."""
    return service_response(message_id, service, orjson.dumps(text), result=False)


def _id_member(message_id: Id) -> dict[str, Id]:
    return {} if message_id is None else {"id": message_id}
