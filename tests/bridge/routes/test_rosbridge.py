"""`/rosbridge` of a real `lupin-twin serve`: names and limits; the rest is in `test_roslib`."""

from tests.support.processes import limits
from tests.support.rosbridge import FIELD, FIELD_ARGS, ros_at
from tests.support.web import bridge


def test_names_are_those_of_ros() -> None:
    remapping = ("--ros-args", "-r", "/twin/state:=/house/state", "-p", "field_service_name:=field")
    with bridge(*remapping) as greenhouse, ros_at(greenhouse.url) as ros:
        topics = ros.call("/rosapi/topics")["values"]
        assert (topics["topics"][0], topics["types"][0]) == (
            "/house/state",
            "lupin_msgs/msg/TwinState",
        )
        assert ros.call("/rosapi/services")["values"]["services"][0] == "/field"
        ros.subscribe(topic="/house/state")
        assert ros.next()["topic"] == "/house/state"
        ros.subscribe()
        assert "expected one of /house/state, /flor" in ros.first("status")["msg"]


def test_the_limits_of_fields_hold_here_too() -> None:
    with bridge(*limits(answers_per_s=0.01)) as greenhouse, ros_at(greenhouse.url) as ros:
        assert ros.call(FIELD, args=FIELD_ARGS)["result"] is True
        assert ros.call(FIELD, args=FIELD_ARGS)["result"] is True, "a cached answer costs nothing"
        other = {**FIELD_ARGS, "resolution": 0.125}
        response = ros.call(FIELD, args=other)
        assert response["result"] is False
        assert response["values"] == (
            "127.0.0.1 requests more than 0.01 computed answers a second, the limit"
        )
        assert greenhouse.get("/api/field", **other).status_code == 429, "of one client, together"
