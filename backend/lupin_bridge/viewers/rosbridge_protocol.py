"""The read-only part of the rosbridge v2 protocol: parses requests, and makes replies. Pure.

`/rosbridge` serves `subscribe` and `unsubscribe` (the twin's topics), and `call_service` (GetField
and rosapi's list of topics): what roslib clients use to read, with `args` as an object. Any other
operation is refused with a `status` message that names it.

How the options fit our policy, which keeps only the newest for a client:

- `throttle_rate` (ms) is honoured; of several subscriptions the smallest counts. When it has
  passed, the newest state follows by itself (rosbridge would wait for the next message).
- `queue_length` is ignored: the queue has the newest message, or the newest 50 of observations and
  discovered tags. `compression` is ignored: replies are plain JSON, which every client reads.
- `id` is a string or an integer. null counts as not given, everywhere. Members that are not named
  here are ignored, as rosbridge does.

A call of GetField is only checked here, and computed by the caller. `type`, if a call has it, is
checked only for GetField: rosapi's packages have other names in ROS 1 than in ROS 2.

In JSON, a number that is not finite is null. A time is `{sec, nanosec}`, as any other message.

https://github.com/RobotWebTools/rosbridge_suite/blob/ros2/ROSBRIDGE_PROTOCOL.md
"""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache
from typing import Annotated, Any, Final, Literal

import numpy as np
import orjson
from pydantic import BaseModel, ConfigDict, Field

from lupin_bridge.feed.relay import TwinNames, absolute, topics_of
from lupin_bridge.field import FieldQuery
from lupin_bridge.serving.ws_protocol import members_of, model_of, shown

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
    """The base of all operations."""

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
    # An id of the wrong type is not repeated.
    message_id = message_id if _is_short(message_id) or type(message_id) is int else None
    kind = _OPERATIONS.get(op) if isinstance(op, str) else None
    if kind is None:
        served = ", ".join(_OPERATIONS)
        raise Refused(
            f"op {shown(op)} is refused: lupin-twin only reads, expected {served}", message_id
        )
    try:
        return model_of(kind, members)
    except ValueError as error:
        called = service if kind is CallService and _is_short(service) else None
        raise Refused(str(error), message_id, called) from None


def _is_short(value: object) -> bool:
    return isinstance(value, str) and len(value) <= MAX_NAME_LENGTH


# --- outgoing ---------------------------------------------------------------------------------


def status(level: Level, text: str, message_id: Id = None) -> bytes:
    """A status message about a request; `message_id` is the id of that."""
    return orjson.dumps({"op": "status", **_id_member(message_id), "level": level, "msg": text})


def publish(topic: str, message: bytes) -> bytes:
    """A message on a topic; `message` is JSON."""
    return b'{"op":"publish","topic":%b,"msg":%b}' % (orjson.dumps(topic), message)


def service_response(message_id: Id, service: str, values: bytes, *, result: bool) -> bytes:
    """The end of a call; `values` is JSON: the response or, if `result` is false, the reason."""
    head = orjson.dumps({"op": "service_response", **_id_member(message_id), "service": service})
    return b'%b,"values":%b,"result":%b}' % (head[:-1], values, b"true" if result else b"false")


def service_failure(message_id: Id, service: str, text: str) -> bytes:
    """A call that got no response, and why."""
    return service_response(message_id, service, orjson.dumps(text), result=False)


def _id_member(message_id: Id) -> dict[str, Id]:
    return {} if message_id is None else {"id": message_id}


# --- the services and values ----------------------------------------------------------------------

Converter = Callable[[Any], Any]

_ARRAY: Final = re.compile(r"sequence<(?P<kind>[\w/]+)(?:, \d+)?>|(?P<of>[\w/]+)\[\d+\]")
_NUMBERS: Final = frozenset(
    ("uint8", "uint16", "uint32", "uint64", "int8", "int16", "int32", "int64", "float", "double")
)
# Numbers per call of orjson: a millisecond's worth.
_PART: Final = 65_536
_PLAIN: Final = _NUMBERS | {"boolean"}


def json_of(message: Any) -> bytes:
    """The message in JSON."""
    return orjson.dumps(_message(message))


def _array(values: Any) -> orjson.Fragment:
    # Not through a list: a map of millions of cells would become as many objects. In parts, because
    # no other thread runs while orjson writes.
    numbers = np.asarray(values)
    parts = (
        orjson.dumps(numbers[start : start + _PART], option=orjson.OPT_SERIALIZE_NUMPY)[1:-1]
        for start in range(0, len(numbers), _PART)
    )
    return orjson.Fragment(b"[%b]" % b",".join(parts))


def _message(message: Any) -> Any:
    kind: Any = type(message)
    return _members(kind)(message)


@cache
def _members(message_type: Any) -> Converter:
    """A function that converts a message of this type to a dict; made once for each type."""
    kinds = message_type.get_fields_and_field_types()
    converters = [(name, _converter(kind)) for name, kind in kinds.items()]

    def convert(message: Any) -> dict[str, Any]:
        return {name: converter(getattr(message, name)) for name, converter in converters}

    return convert


def _converter(kind: str) -> Converter:
    found = _ARRAY.fullmatch(kind)
    if found is None:
        return _one(kind)
    of = found["kind"] or found["of"]
    if of in _NUMBERS:
        return _array
    one = _one(of)
    return lambda values: [one(value) for value in values]


def _one(kind: str) -> Converter:
    if kind in _PLAIN or kind.startswith(("string", "wstring")):
        return lambda value: value
    if kind == "octet":
        return lambda value: int.from_bytes(value, "little")
    return _message


FIELD_TYPE: Final = "lupin_msgs/srv/GetField"
TOPICS_SERVICE: Final = "/rosapi/topics"


class _FieldArgs(BaseModel):
    """GetField's request; what a call leaves out has ROS's default."""

    model_config = ConfigDict(strict=True, extra="forbid")

    sensor_type: str = ""
    resolution: float = 0.0
    bbox_min_x: float = 0.0
    bbox_min_y: float = 0.0
    bbox_max_x: float = 0.0
    bbox_max_y: float = 0.0


# A checked call of GetField; the field itself may still be refused by the twin.
FieldCall = tuple[CallService, FieldQuery]


def is_type(given: str, expected: str) -> bool:
    """Whether `given` names the type, in the form of ROS 2 or in the shorter one of ROS 1."""
    package, _, name = expected.split("/")
    return given in (expected, f"{package}/{name}")


def answer(call: CallService, names: TwinNames) -> FieldCall | bytes:
    """A field to be computed, or the answer as JSON.

    Raises:
        Refused: no such service, another type, or arguments that it does not take.

    """
    service = absolute(call.service)
    try:
        if service == names.field_service:
            return _field_call(call)
        if service == TOPICS_SERVICE:
            known = {topic.name: topic.type_name for topic in topics_of(names)}
            return orjson.dumps({"topics": list(known), "types": list(known.values())})
    except Refused as error:
        raise Refused(str(error), call.id, call.service) from None
    raise Refused(
        f"service {shown(call.service)} is not served, expected {names.field_service} or"
        f" {TOPICS_SERVICE}",
        call.id,
        call.service,
    )


def _field_call(call: CallService) -> FieldCall:
    if call.type and not is_type(call.type, FIELD_TYPE):
        raise Refused(f"type is {shown(call.type)}, expected {FIELD_TYPE}")
    try:
        return call, FieldQuery(**model_of(_FieldArgs, call.args).model_dump())
    except ValueError as error:
        raise Refused(f"args.{error}") from None
