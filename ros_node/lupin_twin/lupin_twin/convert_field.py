"""Fields and what is asked for them, as messages and as values."""

from __future__ import annotations

from typing import Any

import numpy as np
from lupin_msgs.srv import GetField

from lupin_twin import convert
from lupin_twin.fields import FieldRequest
from lupin_twin.grid import FieldGrid


def request_of(msg: Any) -> FieldRequest:
    """GetField.Request as a value; of GetEstimate.Request, what it shares with that."""
    return FieldRequest(
        sensor_type=msg.sensor_type,
        resolution=float(msg.resolution),
        bbox_min_x=float(msg.bbox_min_x),
        bbox_min_y=float(msg.bbox_min_y),
        bbox_max_x=float(msg.bbox_max_x),
        bbox_max_y=float(msg.bbox_max_y),
    )


def request_message(request: FieldRequest) -> Any:
    """The other direction of `request_of`."""
    return GetField.Request(**box_fields(request))


def box_fields(request: FieldRequest) -> dict[str, Any]:
    """The fields that the requests of GetField and GetEstimate share."""
    return {
        "sensor_type": request.sensor_type,
        "resolution": float(request.resolution),
        "bbox_min_x": float(request.bbox_min_x),
        "bbox_min_y": float(request.bbox_min_y),
        "bbox_max_x": float(request.bbox_max_x),
        "bbox_max_y": float(request.bbox_max_y),
    }


def fill_response(response: Any, grid: FieldGrid) -> Any:
    """Fill a GetField.Response from a grid, whose values are copied."""
    response.ok = True
    response.error_message = ""
    response.values = convert.floats(grid.values)
    response.width = int(grid.width)
    response.height = int(grid.height)
    response.origin_x = float(grid.origin_x)
    response.origin_y = float(grid.origin_y)
    response.resolution_used = float(grid.resolution)
    response.value_min = float(grid.value_min)
    response.value_max = float(grid.value_max)
    response.sample_count = int(grid.sample_count)
    return response


def grid_of(response: Any) -> FieldGrid:
    """A GetField.Response that is `ok` as a grid: the other direction of `fill_response`."""
    values = np.array(response.values, dtype=np.float32)
    values.setflags(write=False)
    return FieldGrid(
        width=int(response.width),
        height=int(response.height),
        origin_x=float(response.origin_x),
        origin_y=float(response.origin_y),
        resolution=float(response.resolution_used),
        values=values,
        value_min=float(response.value_min),
        value_max=float(response.value_max),
        sample_count=int(response.sample_count),
    )


def refusal() -> Any:
    """A GetField.Response with every field zeroed, for the caller to say why."""
    return GetField.Response()
