"""The services that `/rosbridge` answers: GetField, and what of rosapi can be told truthfully.

Pure. A call of GetField is only checked here, and computed by who calls this; rosapi's questions
are about names that are known, and answered at once. `type`, where a call gives it, is checked for
GetField; rosapi's packages are called differently in ROS 1 and ROS 2, and rosbridge does not look
at it at all.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import orjson

from lupin_bridge.field.query import BOX_NAMES
from lupin_bridge.rosbridge.protocol import CallService, Refused
from lupin_bridge.serving.client_messages import shown
from lupin_bridge.twin.names import TwinNames, topics_of
from lupin_twin.fields import FieldRequest

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
    request: FieldRequest


def absolute(name: str) -> str:
    """A ROS name as seen from the root namespace, where rosbridge stands: `a/b` is `/a/b`."""
    return name if name.startswith("/") else f"/{name}"


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
    return FieldCall(call, FieldRequest(**_arguments(call.args, _FIELD_ARGS)))


def _arguments(
    args: dict[str, Any] | list[Any], defaults: Mapping[str, str | float]
) -> dict[str, Any]:
    if isinstance(args, list):
        if len(args) > len(defaults):
            raise Refused(f"args has {len(args)} values, the limit is {len(defaults)}")
        args = dict(zip(defaults, args, strict=False))
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
