"""The map's JSON and picture, cell by cell."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lupin_bridge.routes.status import map_json, map_png
from lupin_bridge.stream import schema
from lupin_twin.field.explored import OccupancyMap
from tests.bridge.field.test_formats import decoded

FREE, OCCUPIED = 236, 70


def map_of(rows: Sequence[Sequence[int]], yaw: float = 0.0) -> OccupancyMap:
    """A map from its rows, the first at the origin."""
    return OccupancyMap(
        frame_id="map",
        stamp_ns=12_000_000_034,
        width=len(rows[0]) if rows else 0,
        height=len(rows),
        resolution=0.05,
        origin_x=-4.0,
        origin_y=1.5,
        origin_yaw=yaw,
        cells=np.array([cell for row in rows for cell in row], dtype=np.int8),
        revision=1,
    )


ROWS = st.tuples(st.integers(1, 5), st.integers(1, 5)).flatmap(
    lambda shape: st.lists(
        st.lists(st.integers(-128, 127), min_size=shape[0], max_size=shape[0]),
        min_size=shape[1],
        max_size=shape[1],
    )
)


@given(ROWS)
@settings(max_examples=100)
def test_every_pixel_is_the_grey_of_its_cell(rows: list[list[int]]) -> None:
    picture = decoded(map_png(map_of(rows)))
    assert picture.shape == (len(rows), len(rows[0]), 4)
    for row, cells in enumerate(rows):
        for column, occupancy in enumerate(cells):
            red, green, blue, alpha = picture[len(rows) - 1 - row, column].tolist()
            if not 0 <= occupancy <= 100:
                assert alpha == 0
                continue
            exact = FREE + (OCCUPIED - FREE) * occupancy / 100
            assert (red == green == blue, alpha) == (True, 255)
            assert abs(red - exact) <= 0.5


@pytest.mark.parametrize("rows", [[], [[]], [[], []]])
def test_a_map_without_a_cell_is_one_transparent_pixel(rows: list[list[int]]) -> None:
    assert decoded(map_png(map_of(rows))).tolist() == [[[0, 0, 0, 0]]]


@pytest.mark.parametrize("yaw", [0.0, 0.5, -math.pi / 2, math.pi])
def test_json_has_the_position_of_the_map(yaw: float) -> None:
    text = map_json(map_of([[0, 0, -1], [0, 100, 0]], yaw))
    grid = schema.OccupancyGrid.model_validate_json(text, strict=True)
    assert grid.header == schema.Header(stamp=schema.Time(sec=12, nanosec=34), frame_id="map")
    assert (grid.info.width, grid.info.height, grid.info.resolution) == (3, 2, 0.05)
    origin = grid.info.origin
    assert (origin.position.x, origin.position.y, origin.position.z) == (-4.0, 1.5, 0.0)
    turn = origin.orientation
    assert None not in (turn.z, turn.w)
    assert (turn.x, turn.y) == (0.0, 0.0)
    assert 2 * math.atan2(turn.z or 0.0, turn.w or 0.0) == pytest.approx(yaw)
