"""The contract's types have the names of the ROS messages."""

from typing import Any

import pytest
from geometry_msgs.msg import Point, Polygon, Pose, Quaternion
from lupin_msgs.msg import FlowerPoint, SensorReading, TagTimes, TwinState, TwinTagState
from lupin_msgs.srv import GetEstimate, GetField
from nav_msgs.msg import MapMetaData, OccupancyGrid
from pydantic import BaseModel
from std_msgs.msg import Header

from lupin_bridge.stream import schema
from lupin_bridge.stream.pollers import GetEstimateResponse


def names(message_type: Any) -> list[str]:
    """The fields of a ROS message, in their order."""
    return list(message_type.get_fields_and_field_types())


# What a type has after the fields of its message.
TIMES: dict[Any, list[str]] = {
    schema.TwinTagState: ["looked_at", "last_try", "last_try_status", "last_try_detail"],
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
def test_a_type_has_the_fields_of_its_message_in_their_order_and_then_the_times(
    model: type[BaseModel], message_type: Any
) -> None:
    # The cells of a map are a picture.
    expected = [
        name for name in names(message_type) if (model, name) != (schema.OccupancyGrid, "data")
    ]
    times = TIMES.get(model, [])
    assert list(model.model_fields) == expected + times
    assert set(times) <= set(names(TagTimes)) - {"tag_id", "sensors"}


def test_every_type_forbids_unknown_fields() -> None:
    models = [m for m in vars(schema).values() if isinstance(m, type) and issubclass(m, BaseModel)]
    assert len(models) > 15
    assert all(model.model_config.get("extra") == "forbid" for model in models[1:])
