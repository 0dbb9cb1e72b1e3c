"""The services and the values of `/rosbridge`: GetField, a part of rosapi, messages as JSON. Pure.

A call of GetField is only checked here, and computed by the caller. rosapi's requests are about
names that are known, and answered at once. `type`, where a call gives it, is checked for GetField;
rosapi's packages have other names in ROS 1 than in ROS 2, and rosbridge does not look at it at all.

In JSON, arrays of bytes (uint8, char) are base64, all others lists; a number that is not finite is
null. A time is `{sec, nanosec}`, as any other message.
"""

from __future__ import annotations

import re
from binascii import b2a_base64
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, Final

import numpy as np
import orjson

from lupin_bridge.feed.relay import TwinNames, absolute, topics_of
from lupin_bridge.field.query import BOX_NAMES, FieldQuery
from lupin_bridge.serving.ws_protocol import shown
from lupin_bridge.viewers.rosbridge_protocol import CallService, Refused

Converter = Callable[[Any], Any]

_ARRAY: Final = re.compile(r"sequence<(?P<kind>[\w/]+)(?:, \d+)?>|(?P<of>[\w/]+)\[\d+\]")
_BYTES: Final = frozenset(("uint8", "char"))
_NUMBERS: Final = frozenset(
    ("uint16", "uint32", "uint64", "int8", "int16", "int32", "int64", "float", "double")
)
# Numbers that are written as JSON in one go: a millisecond's worth.
_PART: Final = 65_536
_PLAIN: Final = _NUMBERS | _BYTES | {"boolean"}


def json_of(message: Any) -> bytes:
    """The message in JSON.

    Raises:
        TypeError: a text that is no Unicode.

    """
    return orjson.dumps(_message(message))


def _base64(values: Any) -> str:
    return b2a_base64(bytes(values), newline=False).decode("ascii")


def _array(values: Any) -> orjson.Fragment:
    # Not by a list, of which a map of millions of cells would make as many objects; and in parts,
    # for while orjson writes no other thread runs.
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
    """Makes a dict of a message. Its fields are read once for each type."""
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
    if of in _BYTES:
        return _base64
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

# A request's members in their order, at ROS's defaults for what a call leaves out.
_FIELD_ARGS: Final[Mapping[str, str | float]] = {
    "sensor_type": "",
    "resolution": 0.0,
    **dict.fromkeys(BOX_NAMES, 0.0),
}
_ROSAPI: Final[Mapping[str, tuple[str, Mapping[str, str | float]]]] = {
    "/rosapi/topics": ("Topics", {}),
    "/rosapi/topics_for_type": ("TopicsForType", {"type": ""}),
    "/rosapi/topic_type": ("TopicType", {"topic": ""}),
    "/rosapi/services": ("Services", {}),
    "/rosapi/services_for_type": ("ServicesForType", {"type": ""}),
    "/rosapi/service_type": ("ServiceType", {"service": ""}),
}


@dataclass(frozen=True, slots=True)
class FieldCall:
    """A checked call of GetField; the field itself may still be refused by the twin."""

    call: CallService
    query: FieldQuery


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
        if service in _ROSAPI:
            _, defaults = _ROSAPI[service]
            return orjson.dumps(_rosapi(service, _arguments(call.args, defaults), names))
    except Refused as error:
        raise Refused(str(error), call.id, call.service) from None
    known = ", ".join((names.field_service, *_ROSAPI))
    raise Refused(
        f"service {shown(call.service)} is not served, expected one of {known}",
        call.id,
        call.service,
    )


def _field_call(call: CallService) -> FieldCall:
    if call.type and not is_type(call.type, FIELD_TYPE):
        raise Refused(f"type is {shown(call.type)}, expected {FIELD_TYPE}")
    return FieldCall(call, FieldQuery(**_arguments(call.args, _FIELD_ARGS)))


def _arguments(args: dict[str, Any], defaults: Mapping[str, str | float]) -> dict[str, Any]:
    values: dict[str, Any] = dict(defaults)
    for name, value in args.items():
        if name not in defaults:
            raise Refused(f"args.{name[:64]} is unknown, expected {_listed(defaults)}")
        values[name] = _checked(name, value, defaults[name])
    return values


def _checked(name: str, value: Any, default: str | float) -> str | float:
    if isinstance(default, str):
        if isinstance(value, str):
            return value
        raise Refused(f"args.{name} is {shown(value)}, expected a string")
    if type(value) in (int, float):
        return float(value)
    raise Refused(f"args.{name} is {shown(value)}, expected a number")


def _listed(defaults: Mapping[str, object]) -> str:
    return ", ".join(defaults) or "no arguments"


def _rosapi(service: str, args: Mapping[str, Any], names: TwinNames) -> dict[str, Any]:
    """What rosapi says of names and types it does not know: nothing, and that is no error."""
    topics = {topic.name: topic.type_name for topic in topics_of(names)}
    services = {names.field_service: FIELD_TYPE}
    services |= {name: f"rosapi_msgs/srv/{kind}" for name, (kind, _) in _ROSAPI.items()}
    match service:
        case "/rosapi/topics":
            return {"topics": list(topics), "types": list(topics.values())}
        case "/rosapi/topics_for_type":
            return {"topics": _of_type(topics, args["type"])}
        case "/rosapi/topic_type":
            return {"type": topics.get(absolute(args["topic"]), "")}
        case "/rosapi/services":
            return {"services": list(services)}
        case "/rosapi/services_for_type":
            return {"services": _of_type(services, args["type"])}
        case _:
            return {"type": services.get(absolute(args["service"]), "")}


def _of_type(names: Mapping[str, str], type_: str) -> list[str]:
    return [name for name, known in names.items() if is_type(type_, known)]
