"""The OpenAPI document: complete, and available without ROS."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

from lupin_bridge.app import document
from tests.support.web import ROUTES

DOCUMENT: dict[str, Any] = json.loads(document())


def test_it_lists_every_route_of_the_contract_and_only_writing_ones_have_more_than_get() -> (
    None
):
    described = {route for route, documented in ROUTES.items() if documented}
    # Only for people, and only for programs: see test_people and test_observations.
    described |= {"/api/notes/{note_id}", "/api/audit", "/api/observations", "/api/push"}
    assert set(DOCUMENT["paths"]) == described
    written = {
        "/api/notes": ["get", "post"],
        "/api/notes/{note_id}": ["delete"],
        "/api/observations": ["post"],
        "/api/push": ["get", "post"],
    }
    for path, operations in DOCUMENT["paths"].items():
        assert list(operations) == written.get(path, ["get"]), path
        for operation in operations.values():
            assert operation["summary"], path
            assert all(answer["description"] for answer in operation["responses"].values()), path
    field = DOCUMENT["paths"]["/api/field"]["get"]["parameters"]
    names = "sensor_type resolution bbox_min_x bbox_min_y bbox_max_x bbox_max_y scale at"
    assert [parameter["name"] for parameter in field] == names.split()
    assert all(parameter["description"] for parameter in field)
    assert {"StateFrame", "StatusFrame"} <= set(DOCUMENT["components"]["schemas"])


def test_the_command_and_a_fleet_need_no_ros() -> None:
    script = (
        "import runpy, sys; runpy.run_module('lupin_bridge.app', run_name='__main__');"
        "import lupin_bridge.cli.roles;"
        "ros = [m for m in sys.modules if m.split('.')[0] in ('rclpy', 'lupin_msgs')];"
        "assert not ros, ros"
    )
    result = subprocess.run([sys.executable, "-c", script], capture_output=True, check=True)
    assert json.loads(result.stdout) == DOCUMENT
    assert result.stdout.endswith(b"}\n")


def test_the_copy_for_the_browsers_types_is_up_to_date() -> None:
    copy = Path(__file__).parents[2] / "frontend" / "openapi.json"
    assert copy.read_bytes() == document(), (
        f"stale: run `python -m lupin_bridge.app > {copy}` and `npm run types:gen`"
    )
