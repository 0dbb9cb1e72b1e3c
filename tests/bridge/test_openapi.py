"""The OpenAPI document: complete, and available without ROS."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import Point, Polygon, Pose, Quaternion
from lupin_msgs.msg import FlowerPoint, SensorReading, TagTimes, TwinState, TwinTagState
from lupin_msgs.srv import GetEstimate, GetField
from nav_msgs.msg import MapMetaData, OccupancyGrid
from pydantic import BaseModel
from std_msgs.msg import Header

from lupin_bridge.app import document
from lupin_bridge.stream import schema
from lupin_bridge.stream.estimate_schema import GetEstimateResponse

DOCUMENT: dict[str, Any] = json.loads(document())


def test_only_the_writing_routes_have_more_than_get() -> None:
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


def test_the_process_that_reads_the_past_loads_little() -> None:
    for imported, needless in (
        ("feed.query, lupin_bridge.past.plans", {"numpy", "pydantic", "asyncio"}),
        ("past.fields", {"pydantic", "asyncio"}),  # for estimates, every few seconds
    ):
        script = f"import sys, lupin_bridge.{imported}; assert not {needless} & set(sys.modules)"
        subprocess.run([sys.executable, "-c", script], check=True)


def test_the_copy_for_the_browsers_types_is_up_to_date() -> None:
    copy = Path(__file__).parents[2] / "frontend" / "openapi.json"
    assert copy.read_bytes() == document(), (
        f"stale: run `python -m lupin_bridge.app > {copy}` and `npm run types:gen`"
    )


def names(message_type: Any) -> list[str]:
    return list(message_type.get_fields_and_field_types())


DERIVED = ["derived", "derived_at"]
# What a type has after the fields of its message.
ADDED: dict[Any, list[str]] = {
    schema.TwinTagState: ["looked_at", "last_try", "last_try_status", "last_try_detail", *DERIVED],
    schema.SensorReading: ["observed_at"],
}


@pytest.mark.parametrize(
    ("model", "message_type"),
    [
        (schema.TwinState, TwinState),
        (schema.TwinTagState, TwinTagState),
        (schema.SensorReading, SensorReading),
        (schema.FlowerPoint, FlowerPoint),
        (schema.GetFieldResponse, GetField.Response),
        (schema.MapMetaData, MapMetaData),
        (schema.Header, Header),
        (schema.Pose, Pose),
        (schema.Point, Point),
        (schema.Quaternion, Quaternion),
        (schema.Polygon, Polygon),
        (schema.OccupancyGrid, OccupancyGrid),
        (GetEstimateResponse, GetEstimate.Response),
    ],
)
def test_a_type_has_the_fields_of_its_message_in_their_order_and_then_others(
    model: type[BaseModel], message_type: Any
) -> None:
    # The cells of a map are a picture.
    expected = [
        name for name in names(message_type) if (model, name) != (schema.OccupancyGrid, "data")
    ]
    added = ADDED.get(model, [])
    assert list(model.model_fields) == expected + added
    assert set(added) - set(DERIVED) <= set(names(TagTimes)) - {"tag_id", "sensors"}


def test_every_type_forbids_unknown_fields() -> None:
    models = [m for m in vars(schema).values() if isinstance(m, type) and issubclass(m, BaseModel)]
    assert len(models) > 15
    assert all(model.model_config.get("extra") == "forbid" for model in models[1:])
