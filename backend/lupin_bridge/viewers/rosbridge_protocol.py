"""The read-only part of the rosbridge v2 protocol, as values: what came in, what goes out.

Pure. Served at `/rosbridge` are `subscribe` and `unsubscribe` (the twin's topics), `call_service`
(GetField and a little of rosapi) and `set_level`: what roslib's clients use to read, with `args` as
an object. Any other operation is refused with a `status` message that names it.

How the options meet our policy, which keeps the newest for a client and queues no more:

- `throttle_rate` (ms) is honoured; of several subscriptions the smallest counts. When it has
  passed, the newest state follows by itself (rosbridge would wait for the next message).
- `queue_length` 0 or 1 is what every client gets: the newest, and of observations and discovered
  tags the newest 50. A longer queue is accepted as 1, with a warning.
- `compression` other than `none`: a warning, and plain JSON, which every client reads.
- `id` is a string or an integer. null counts as not given, everywhere. Members that are not named
  here are ignored, as rosbridge does.

https://github.com/RobotWebTools/rosbridge_suite/blob/ros2/ROSBRIDGE_PROTOCOL.md
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal

import orjson

from lupin_bridge.serving.ws_protocol import members_of, shown

MAX_NAME_LENGTH: Final = 256
MAX_THROTTLE_RATE_MS: Final = 3_600_000.0

Level = Literal["none", "error", "warning", "info"]
LEVELS: Final[tuple[Level, ...]] = ("none", "error", "warning", "info")

Id = str | int | None


class Refused(ValueError):
    """A message that cannot be served; the text names the member, the value and the limit.

    `service` is the service whose call was refused: its caller waits for a response.
    """

    def __init__(self, text: str, message_id: Id = None, service: str | None = None) -> None:
        super().__init__(text)
        self.id = message_id
        self.service = service


@dataclass(frozen=True, slots=True)
class Subscribe:
    """A subscription to a topic; `type` is empty where the client leaves it open."""

    id: Id
    topic: str
    type: str
    throttle_rate_ms: float
    warnings: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Unsubscribe:
    """The end of one subscription to a topic, or of all where `id` is None."""

    id: Id
    topic: str


@dataclass(frozen=True, slots=True)
class CallService:
    """A call; `args` are by name. `timeout_s` None: as long as the bridge waits."""

    id: Id
    service: str
    type: str
    args: dict[str, Any]
    timeout_s: float | None
    warnings: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class SetLevel:
    """The least level of status that the client wants, for the whole connection."""

    level: Level


Request = Subscribe | Unsubscribe | CallService | SetLevel


# --- incoming ---------------------------------------------------------------------------------


def parse(message: str | bytes) -> Request:
    """Read one frame.

    Raises:
        Refused: not JSON text, not an operation that is served, or a member of the wrong kind.

    """
    try:
        members = members_of(message)
    except ValueError as error:
        raise Refused(str(error)) from None
    message_id = _id(members)
    try:
        return _request(members, message_id)
    except Refused as error:
        raise Refused(str(error), message_id, error.service) from None


def _id(members: Mapping[str, Any]) -> Id:
    value = members.get("id")
    if isinstance(value, str) and len(value) > MAX_NAME_LENGTH:
        raise Refused(f"id has {len(value)} characters, the limit is {MAX_NAME_LENGTH}")
    if value is None or type(value) in (str, int):
        return value
    raise Refused(f"id is {shown(value)}, expected a string or an integer")


def _request(members: Mapping[str, Any], message_id: Id) -> Request:
    op = _text(members, "op")
    if op == "subscribe":
        return _subscribe(members, message_id)
    if op == "unsubscribe":
        return Unsubscribe(message_id, _text(members, "topic"))
    if op == "call_service":
        return _call_service(members, message_id)
    if op == "set_level":
        return _set_level(members)
    raise Refused(
        f"{op} is refused: lupin-twin only reads, expected subscribe, unsubscribe, "
        "call_service or set_level"
    )


def _subscribe(members: Mapping[str, Any], message_id: Id) -> Subscribe:
    warnings = _transport(members)
    queue_length = _number(members, "queue_length", 0.0)
    if queue_length > 1:
        warnings.append(f"queue_length {queue_length:.15g} is served as 1: the newest only")
    throttle_rate_ms = _number(members, "throttle_rate", 0.0)
    if throttle_rate_ms > MAX_THROTTLE_RATE_MS:
        raise Refused(
            f"throttle_rate is {members['throttle_rate']}, expected 0 to "
            f"{MAX_THROTTLE_RATE_MS:.15g} ms"
        )
    return Subscribe(
        id=message_id,
        topic=_text(members, "topic"),
        type=_text(members, "type", default=""),
        throttle_rate_ms=throttle_rate_ms,
        warnings=tuple(warnings),
    )


def _call_service(members: Mapping[str, Any], message_id: Id) -> CallService:
    service = _text(members, "service")
    try:
        warnings = _transport(members)
        timeout_s = _number(members, "timeout", 0.0, low=-math.inf)
        return CallService(
            id=message_id,
            service=service,
            type=_text(members, "type", default=""),
            args=_args(members),
            timeout_s=timeout_s if timeout_s > 0.0 else None,
            warnings=tuple(warnings),
        )
    except Refused as error:
        raise Refused(str(error), service=service) from None


def _args(members: Mapping[str, Any]) -> dict[str, Any]:
    args = members.get("args")
    if args is None:
        return {}
    if isinstance(args, dict):
        return args
    raise Refused(f"args is {shown(args)}, expected an object")


def _set_level(members: Mapping[str, Any]) -> SetLevel:
    level = _text(members, "level")
    if level not in LEVELS:
        raise Refused(f"level is {shown(level)}, expected {', '.join(LEVELS)}")
    return SetLevel(level)


def _transport(members: Mapping[str, Any]) -> list[str]:
    compression = _text(members, "compression", default="none")
    if compression == "none":
        return []
    return [f"compression {shown(compression)} is not served: messages are plain JSON"]


def _text(members: Mapping[str, Any], name: str, *, default: str | None = None) -> str:
    value = members.get(name)
    if value is None:
        if default is None:
            raise Refused(f"{name} is missing, expected a string")
        return default
    if not isinstance(value, str):
        raise Refused(f"{name} is {shown(value)}, expected a string")
    if len(value) > MAX_NAME_LENGTH:
        raise Refused(f"{name} has {len(value)} characters, the limit is {MAX_NAME_LENGTH}")
    return value


def _number(members: Mapping[str, Any], name: str, default: float, low: float = 0.0) -> float:
    value = members.get(name)
    if value is None:
        return default
    if type(value) not in (int, float):
        raise Refused(f"{name} is {shown(value)}, expected a number")
    if value < low:
        raise Refused(f"{name} is {value}, must not be less than {low:.15g}")
    return float(value)


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
