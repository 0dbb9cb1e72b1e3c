"""Which cells of a field are on explored ground."""

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lupin_twin.field import explored
from lupin_twin.field.explored import OccupancyMap, explored_mask
from tests.support.maps import map_of


def mask_of(
    occupancy: OccupancyMap,
    width: int,
    height: int,
    *,
    origin: tuple[float, float] = (0.0, 0.0),
    resolution: float = 1.0,
) -> npt.NDArray[np.bool_]:
    mask = explored_mask(
        occupancy,
        width=width,
        height=height,
        origin_x=origin[0],
        origin_y=origin[1],
        resolution=resolution,
    )
    assert mask.shape == (height, width)
    assert mask.dtype == np.bool_
    return mask


def test_known_cells_are_explored_and_unknown_ones_are_not() -> None:
    occupancy = map_of([[0, 100, -1], [50, -128, 101], [127, 1, 99]])
    np.testing.assert_array_equal(
        mask_of(occupancy, 3, 3), [[True, True, False], [True, False, False], [False, True, True]]
    )


def test_a_centre_on_an_edge_belongs_to_the_upper_cell_whatever_the_rounding() -> None:
    """Cells of 0.1 m over a map of 0.05 m: every centre lies on an edge of the map's cells.

    On the wire, both resolutions are float32, and neither is exact.
    """
    columns = 400
    rows = np.full((1, columns), -1)
    rows[0, 1::2] = 0
    for map_resolution in (0.05, float(np.float32(0.05))):
        for field_resolution in (0.1, float(np.float32(0.1))):
            occupancy = map_of(rows, resolution=map_resolution, origin_y=-0.01)
            mask = mask_of(
                occupancy, columns // 2, 1, resolution=field_resolution, origin=(0.0, -0.05)
            )
            assert mask.all()


@settings(max_examples=150)
@given(
    seed=st.integers(0, 1000),
    yaw=st.one_of(st.just(0.0), st.floats(-math.pi, math.pi)),
    origin=st.tuples(st.floats(-3, 3), st.floats(-3, 3)),
    map_resolution=st.sampled_from([0.05, 0.3, 1.0]),
    resolution=st.sampled_from([0.1, 0.25, 0.7]),
)
def test_the_mask_is_the_map_cell_under_each_centre(
    seed: int, yaw: float, origin: tuple[float, float], map_resolution: float, resolution: float
) -> None:
    """By a plain loop: each centre, transformed into the map's own frame."""
    rows = np.random.default_rng(seed).choice([-1, 0, 100], size=(9, 13))
    occupancy = map_of(
        rows, resolution=map_resolution, origin_x=origin[0], origin_y=origin[1], origin_yaw=yaw
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(explored, "CELLS_AT_ONCE", 40)
        mask = mask_of(occupancy, 14, 11, origin=(-2.0, -1.5), resolution=resolution)
    for row in range(11):
        for column in range(14):
            dx = -2.0 + (column + 0.5) * resolution - origin[0]
            dy = -1.5 + (row + 0.5) * resolution - origin[1]
            along = (math.cos(yaw) * dx + math.sin(yaw) * dy) / map_resolution
            across = (math.cos(yaw) * dy - math.sin(yaw) * dx) / map_resolution
            if max(along - math.floor(along), across - math.floor(across)) > 0.999:
                continue  # an edge, a rounding apart
            i, j = math.floor(along), math.floor(across)
            known = 0 <= i < 13 and 0 <= j < 9 and rows[j, i] >= 0
            assert mask[row, column] == known


def test_cells_are_a_read_only_copy_by_rows() -> None:
    data = np.array([0, -1, 100, 50, 7, -1], dtype=np.int8)
    occupancy = map_of(np.zeros((2, 3)), cells=data)
    data[0] = 42
    np.testing.assert_array_equal(occupancy.cells, [[0, -1, 100], [50, 7, -1]])
    with pytest.raises(ValueError, match="read-only"):
        occupancy.cells[0, 0] = 1


@pytest.mark.parametrize(
    "changes",
    [
        {"frame_id": "other"},
        {"width": 1, "height": 2},
        {"resolution": 2.0},
        {"origin_x": 1.0},
        {"origin_y": 1.0},
        {"origin_yaw": 1.0},
        {"cells": [0, 99]},
    ],
)
def test_a_map_that_differs_in_anything_has_another_mask(changes: dict[str, Any]) -> None:
    assert map_of([[0, 100]]).shows_the_same_as(map_of([[0, 100]], stamp_ns=9, revision=8))
    assert not map_of([[0, 100]]).shows_the_same_as(map_of([[0, 100]], **changes))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"cells": [0, 0, 0]}, "map data holds 3 cells, must be width x height = 2 x 1 = 2"),
        ({"width": 3}, "map data holds 2 cells, must be width x height = 3 x 1 = 3"),
        ({"resolution": 0.0}, r"map resolution is 0\.0 m, must be greater than 0"),
        ({"resolution": math.nan}, "map resolution is nan, must be finite"),
        ({"origin_x": math.nan}, "map origin_x is nan, must be finite"),
        ({"origin_y": -math.inf}, "map origin_y is -inf, must be finite"),
        ({"origin_yaw": math.nan}, "map origin_yaw is nan, must be finite"),
        ({"width": -2, "height": -1}, "map is -2 x -1 cells, must not be less than 0"),
        ({"width": 10**6, "height": 10**6}, "map is 1000000 x 1000000 = 1000000000000 cells, the"),
    ],
)
def test_a_malformed_map_is_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        map_of([[0, 0]], **changes)
