"""What the README shows of calls: each is one that ROS takes."""

from __future__ import annotations

import re
from typing import Any

import yaml
from lupin_msgs import srv

from lupin_twin.estimates import ESTIMATE_SERVICE
from lupin_twin.past import HISTORY_SERVICE, STATE_AT_SERVICE
from tests.test_docs import README


def test_every_service_call_that_is_shown_is_one_that_the_service_takes() -> None:
    calls = re.findall(
        r'^ros2 service call (/\S+) lupin_msgs/srv/(\w+) (?:\\\n +)?"(.*)"$', README, re.MULTILINE
    )
    names = {"/" + name for name in (ESTIMATE_SERVICE, STATE_AT_SERVICE, HISTORY_SERVICE)}
    assert {name for name, _, _ in calls} == {"/twin/get_field", *names}
    for _, kind, arguments in calls:
        # What the shell fills in is a number of seconds.
        given = yaml.safe_load(re.sub(r"\$\([^)]*\)", "5", arguments))
        assert filled(getattr(srv, kind).Request(), given) != getattr(srv, kind).Request()


def filled(message: Any, values: dict[str, Any]) -> Any:
    """The message with these fields, as `ros2 service call` fills it; rclpy checks their types."""
    for name, value in values.items():
        before = getattr(message, name)
        if isinstance(value, dict):
            filled(before, value)
        else:
            setattr(message, name, type(before)(value))
    return message
