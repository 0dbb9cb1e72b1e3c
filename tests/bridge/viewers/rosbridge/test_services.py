"""The services behind rosbridge: arguments as ROS takes them, and rosapi's questions."""

from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lupin_bridge.feed.topics import TwinNames
from lupin_bridge.viewers.rosbridge_protocol import CallService, Refused
from lupin_bridge.viewers.rosbridge_services import FieldCall, answer, is_type
from lupin_twin.field.engine import FieldRequest

NAMES = TwinNames("/house/state", "/house/get_field")
FIELD_SERVICE = NAMES.field_service


def call(service: str, args: Any = None, type_: str = "") -> CallService:
    return CallService("a", service, type_, {} if args is None else args, None, ())


def field_request(args: Any) -> FieldRequest:
    result = answer(call(FIELD_SERVICE, args), NAMES)
    assert isinstance(result, FieldCall)
    return result.request


def values(service: str, args: Any = None) -> Any:
    result = answer(call(service, args), NAMES)
    assert isinstance(result, bytes)
    return json.loads(result)


def refusal(request: CallService) -> Refused:
    with pytest.raises(Refused) as refused:
        answer(request, NAMES)
    assert (refused.value.id, refused.value.service) == ("a", request.service)
    return refused.value


# --- GetField ---------------------------------------------------------------------------------

FULL = {
    "sensor_type": "temperature",
    "resolution": 0.5,
    "bbox_min_x": -1,
    "bbox_min_y": -2,
    "bbox_max_x": 3,
    "bbox_max_y": 4.0,
}


def test_arguments_are_by_name() -> None:
    expected = FieldRequest("temperature", 0.5, -1.0, -2.0, 3.0, 4.0)
    assert field_request(FULL) == expected


def test_what_is_left_out_is_at_ross_default() -> None:
    assert field_request({}) == FieldRequest("", 0.0, 0.0, 0.0, 0.0, 0.0)
    assert field_request({"sensor_type": "co2"}) == FieldRequest("co2", 0.0, 0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("type_", ["", "lupin_msgs/srv/GetField", "lupin_msgs/GetField"])
def test_the_type_may_be_given(type_: str) -> None:
    assert isinstance(answer(call(FIELD_SERVICE, FULL, type_), NAMES), FieldCall)


def test_the_name_may_be_relative_to_the_root() -> None:
    assert isinstance(answer(call("house/get_field", FULL), NAMES), FieldCall)


@pytest.mark.parametrize(
    ("args", "text"),
    [
        ({"sensor": "co2"}, "args.sensor is unknown, expected sensor_type, resolution, bbox_min_x"),
        ({"sensor_type": 5}, "args.sensor_type is 5, expected a string"),
        ({"sensor_type": None}, "args.sensor_type is None, expected a string"),
        ({"resolution": "0.5"}, "args.resolution is '0.5', expected a number"),
        ({"resolution": None}, "args.resolution is None, expected a number"),
        ({"bbox_max_y": True}, "args.bbox_max_y is True, expected a number"),
        ({"bbox_min_x": [0]}, "args.bbox_min_x is an array, expected a number"),
    ],
)
def test_wrong_arguments_are_refused(args: Any, text: str) -> None:
    assert str(refusal(call(FIELD_SERVICE, args))).startswith(text)


@pytest.mark.parametrize("type_", ["lupin_msgs/msg/GetField", "std_srvs/srv/Trigger", "GetField"])
def test_another_type_is_refused(type_: str) -> None:
    text = str(refusal(call(FIELD_SERVICE, FULL, type_)))
    assert text == f"type is {type_!r}, expected lupin_msgs/srv/GetField"


@pytest.mark.parametrize(
    "service", ["/twin/get_field", "/rosapi/set_param", "", "/", "/house/get_field/"]
)
def test_another_service_is_refused(service: str) -> None:
    text = str(refusal(call(service)))
    assert text.startswith(f"service {service!r} is not served, expected one of /house/get_field, ")


# --- rosapi -----------------------------------------------------------------------------------


def test_rosapi_tells_what_is_here() -> None:
    topics = values("/rosapi/topics")
    assert dict(zip(topics["topics"], topics["types"], strict=True)) == {
        "/house/state": "lupin_msgs/msg/TwinState",
        "/floranova/observations": "lupin_msgs/msg/Observation",
        "/perception/discovered_tags": "lupin_msgs/msg/DiscoveredTags",
        "/map": "nav_msgs/msg/OccupancyGrid",
        "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
    }
    services = values("rosapi/services")["services"]
    assert services[0] == FIELD_SERVICE
    assert "/rosapi/services" in services


def test_every_service_that_rosapi_lists_has_a_type_and_an_answer() -> None:
    for service in values("/rosapi/services")["services"]:
        type_ = values("/rosapi/service_type", {"service": service})["type"]
        assert service in values("/rosapi/services_for_type", {"type": type_})["services"]
        assert answer(call(service), NAMES)


def test_types_by_name_and_names_by_type() -> None:
    assert values("/rosapi/topic_type", {"topic": "/house/state"}) == {
        "type": "lupin_msgs/msg/TwinState"
    }
    assert values("/rosapi/topic_type", {"topic": "house/state"}) == {
        "type": "lupin_msgs/msg/TwinState"
    }
    assert values("/rosapi/service_type", {"service": FIELD_SERVICE}) == {
        "type": "lupin_msgs/srv/GetField"
    }
    assert values("/rosapi/topics_for_type", {"type": "lupin_msgs/TwinState"}) == {
        "topics": ["/house/state"]
    }


def test_what_rosapi_does_not_know_is_empty_and_no_error() -> None:
    assert values("/rosapi/topic_type", {"topic": "/cmd_vel"}) == {"type": ""}
    assert values("/rosapi/service_type") == {"type": ""}
    assert values("/rosapi/topics_for_type", {"type": "std_msgs/msg/String"}) == {"topics": []}
    assert values("/rosapi/services_for_type", {"type": ""}) == {"services": []}


def test_rosapi_checks_its_arguments_too() -> None:
    assert str(refusal(call("/rosapi/topics", {"x": 1}))) == (
        "args.x is unknown, expected no arguments"
    )
    assert str(refusal(call("/rosapi/topic_type", {"topic": 1}))) == (
        "args.topic is 1, expected a string"
    )


# --- names and types --------------------------------------------------------------------------


def test_a_type_is_known_in_both_of_its_forms() -> None:
    assert is_type("lupin_msgs/msg/TwinState", "lupin_msgs/msg/TwinState")
    assert is_type("lupin_msgs/TwinState", "lupin_msgs/msg/TwinState")
    assert not is_type("lupin_msgs/srv/TwinState", "lupin_msgs/msg/TwinState")
    assert not is_type("TwinState", "lupin_msgs/msg/TwinState")


ARGS = st.dictionaries(
    st.sampled_from([*FULL, "x"]),
    st.none() | st.booleans() | st.integers(-(2**63), 2**64 - 1) | st.floats() | st.text(),
)


@given(ARGS)
def test_any_arguments_make_a_request_or_a_refusal(args: Any) -> None:
    outcome = outcome_of(call(FIELD_SERVICE, args))
    if isinstance(outcome, Refused):
        assert 0 < len(str(outcome)) < 1000
    else:
        assert isinstance(outcome, FieldCall)


def outcome_of(request: CallService) -> FieldCall | bytes | Refused:
    try:
        return answer(request, NAMES)
    except Refused as refused:
        return refused
