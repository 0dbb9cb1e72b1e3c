"""Fields and their requests as messages and back, without a running ROS."""

from __future__ import annotations

from array import array
from typing import Any

import numpy as np
from lupin_msgs.srv import GetField

from lupin_twin.field.grid import FieldGrid
from lupin_twin.ros import convert_field


def test_a_response_is_filled_from_a_grid_and_shares_nothing_with_it() -> None:
    values = np.array([1.0, np.nan, 3.0, 4.0], dtype=np.float32)
    grid = FieldGrid(2, 2, 0.5, -1.5, 0.25, values, 1.0, 4.0, 9)
    response: Any = convert_field.fill_response(GetField.Response(), grid)
    values[0] = 99.0
    assert isinstance(response.values, array)
    assert response.ok
    assert np.array_equal(response.values, [1.0, np.nan, 3.0, 4.0], equal_nan=True)
    assert (response.width, response.height, response.sample_count) == (2, 2, 9)
    assert (response.origin_x, response.origin_y, response.resolution_used) == (0.5, -1.5, 0.25)
    assert (response.value_min, response.value_max) == (1.0, 4.0)


def test_a_field_request_is_read_field_by_field() -> None:
    request = convert_field.field_request_of(
        GetField.Request(
            sensor_type="co2",
            resolution=0.5,
            bbox_min_x=1.0,
            bbox_min_y=2.0,
            bbox_max_x=3.0,
            bbox_max_y=4.0,
        )
    )
    assert (request.sensor_type, request.resolution) == ("co2", 0.5)
    assert (request.bbox_min_x, request.bbox_min_y) == (1.0, 2.0)
    assert (request.bbox_max_x, request.bbox_max_y) == (3.0, 4.0)
