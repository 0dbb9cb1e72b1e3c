"""The service calls in the docs are valid: each one fits its service."""

import re
from typing import Any

import yaml
from lupin_msgs import srv

from lupin_twin.core.interfaces import SERVICES
from tests.support.docs import pages

TYPES = {f"/{service.name}": service.type_name for service in SERVICES}


def test_every_service_call_in_the_docs_fits_its_service() -> None:
    text = "\n".join(page.read_text(encoding="utf-8") for page in pages())
    calls = re.findall(
        r'^ *ros2 service call (/\S+) (lupin_msgs/srv/\w+) (?:\\\n +)?"(.*)"$', text, re.MULTILINE
    )
    assert calls
    for name, type_name, arguments in calls:
        assert TYPES[name] == type_name
        kind = getattr(srv, type_name.rpartition("/")[2]).Request
        # What the shell fills in is a number of seconds.
        given = yaml.safe_load(re.sub(r"\$\([^)]*\)", "5", arguments))
        assert filled(kind(), given) != kind()


def filled(message: Any, values: dict[str, Any]) -> Any:
    """The message with these fields, as `ros2 service call` fills it; rclpy checks their types."""
    for name, value in values.items():
        before = getattr(message, name)
        if isinstance(value, dict):
            filled(before, value)
        else:
            setattr(message, name, type(before)(value))
    return message
