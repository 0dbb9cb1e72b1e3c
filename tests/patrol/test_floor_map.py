"""The map of the floor."""

import numpy as np
from greenhouse_sim.simulator import GreenhouseSimulator

from lupin_patrol.greenhouse import Point, read_greenhouse
from lupin_patrol.perception import FREE, OCCUPIED, RESOLUTION_M, Grid, floor_map


def cell(grid: Grid, point: Point) -> int:
    """The value at a point, by the rule of nav_msgs/OccupancyGrid."""
    column = int((point[0] - grid.origin[0]) / grid.resolution_m)
    row = int((point[1] - grid.origin[1]) / grid.resolution_m)
    return int(np.frombuffer(grid.cells, dtype=np.int8)[row * grid.width + column])


def test_a_complete_map_has_tables_and_walls_and_otherwise_free_floor() -> None:
    greenhouse = read_greenhouse(GreenhouseSimulator())
    grid = floor_map(greenhouse)
    for row in range(grid.height):
        for column in range(grid.width):
            x = grid.origin[0] + (column + 0.5) * RESOLUTION_M
            y = grid.origin[1] + (row + 0.5) * RESOLUTION_M
            is_floor = greenhouse.interior.contains((x, y)) and not any(
                table.rect.contains((x, y)) for table in greenhouse.tables
            )
            assert cell(grid, (x, y)) == (FREE if is_floor else OCCUPIED), (x, y)
