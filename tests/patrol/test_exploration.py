"""The growing occupancy grid."""

from math import dist

import numpy as np
from greenhouse_sim.simulator import GreenhouseSimulator

from lupin_patrol.greenhouse import Greenhouse, Point, Rect, read_greenhouse
from lupin_patrol.perception import (
    FREE,
    OCCUPIED,
    RESOLUTION_M,
    UNKNOWN,
    VIEW_RADIUS_M,
    Exploration,
    Grid,
)
from tests.support.climate import known_in


def cell(grid: Grid, point: Point) -> int:
    """The value at a point, by the rule of nav_msgs/OccupancyGrid."""
    column = int((point[0] - grid.origin[0]) / grid.resolution_m)
    row = int((point[1] - grid.origin[1]) / grid.resolution_m)
    return int(np.frombuffer(grid.cells, dtype=np.int8)[row * grid.width + column])


def explored_from(*positions: Point, greenhouse: Greenhouse) -> Grid:
    exploration = Exploration(greenhouse)
    for position in positions:
        exploration.observe_from(position)
    return exploration.snapshot()


def everywhere(greenhouse: Greenhouse) -> list[Point]:
    return [
        (x, y)
        for x in np.arange(0.25, greenhouse.interior.x1, 0.5).tolist()
        for y in np.arange(0.25, greenhouse.interior.y1, 0.5).tolist()
        if greenhouse.is_free((x, y))
    ]


def test_a_complete_map_has_tables_and_walls_and_otherwise_free_floor() -> None:
    greenhouse = read_greenhouse(GreenhouseSimulator())
    grid = explored_from(*everywhere(greenhouse), greenhouse=greenhouse)
    assert known_in(grid) == len(grid.cells)
    for row in range(grid.height):
        for column in range(grid.width):
            x = grid.origin[0] + (column + 0.5) * RESOLUTION_M
            y = grid.origin[1] + (row + 0.5) * RESOLUTION_M
            is_floor = greenhouse.interior.contains((x, y)) and not any(
                table.rect.contains((x, y)) for table in greenhouse.tables
            )
            assert cell(grid, (x, y)) == (FREE if is_floor else OCCUPIED), (x, y)


def test_nothing_is_known_beyond_the_view_radius() -> None:
    far = Greenhouse(Rect(0.0, 0.0, 8.0, 2.0), (), ())
    grid = explored_from((0.5, 1.0), greenhouse=far)
    cells = np.frombuffer(grid.cells, dtype=np.int8).reshape(grid.height, grid.width)
    for row, column in np.argwhere(cells != UNKNOWN):
        x, y = grid.origin[0] + (column + 0.5) * 0.05, grid.origin[1] + (row + 0.5) * 0.05
        assert dist((x, y), (0.5, 1.0)) <= VIEW_RADIUS_M
    assert cell(grid, (0.5 + VIEW_RADIUS_M - 0.1, 1.0)) == FREE
    assert cell(grid, (0.5 + VIEW_RADIUS_M + 0.1, 1.0)) == UNKNOWN
