"""The occupancy grid that grows while the robot looks around.

Row-major with row 0 at the smallest y, as nav_msgs/OccupancyGrid has it; -1 unknown, 0 free, 100
occupied. The outermost ring of cells is the house's wall.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

import numpy as np
from numpy.typing import NDArray

from lupin_patrol.geometry import Point, crossings
from lupin_patrol.house import House

RESOLUTION_M = 0.05
VIEW_RADIUS_M = 2.0

UNKNOWN, FREE, OCCUPIED = -1, 0, 100


@dataclass(frozen=True, slots=True)
class Grid:
    """One state of the map: `cells` are int8 bytes, row-major; the origin is cell 0's corner."""

    width: int
    height: int
    resolution_m: float
    origin: Point
    cells: bytes

    @property
    def known(self) -> int:
        """How many cells are known."""
        return len(self.cells) - self.cells.count(UNKNOWN.to_bytes(1, "little", signed=True))


class Exploration:
    """What the robot has seen of the floor so far. Cells become known and never unknown again."""

    def __init__(self, house: House) -> None:
        self._tables = [table.rect for table in house.tables]
        inside = house.interior
        self._origin = (inside.x0 - RESOLUTION_M, inside.y0 - RESOLUTION_M)
        columns, rows = (
            2 + ceil(round(extent / RESOLUTION_M, 6))
            for extent in (inside.x1 - inside.x0, inside.y1 - inside.y0)
        )
        self._shape = (rows, columns)
        row, column = np.divmod(np.arange(rows * columns), columns)
        self._centres = np.column_stack(
            [
                self._origin[0] + (column + 0.5) * RESOLUTION_M,
                self._origin[1] + (row + 0.5) * RESOLUTION_M,
            ]
        )
        # A column for each table: whether it covers the cell.
        x, y = self._centres[:, [0]], self._centres[:, [1]]
        edge = np.array([(t.x0, t.y0, t.x1, t.y1) for t in self._tables]).reshape(-1, 4)
        self._covered = (edge[:, 0] < x) & (x < edge[:, 2]) & (edge[:, 1] < y) & (y < edge[:, 3])
        wall = (row == 0) | (row == rows - 1) | (column == 0) | (column == columns - 1)
        self._truth = np.where(wall | self._covered.any(axis=1), OCCUPIED, FREE).astype(np.int8)
        self._cells = np.full(rows * columns, UNKNOWN, dtype=np.int8)

    def look_from(self, position: Point) -> bool:
        """Add what is in view from there; returns whether anything was new.

        A cell is in view within VIEW_RADIUS_M unless a table stands before it. A table does not
        hide itself: the camera looks down on it, while the next one hides behind its plants.
        """
        unknown = np.flatnonzero(self._cells == UNKNOWN)
        offset = self._centres[unknown] - np.asarray(position)
        near = unknown[np.hypot(offset[:, 0], offset[:, 1]) <= VIEW_RADIUS_M]
        hidden = crossings(position, self._centres[near], self._tables) & ~self._covered[near]
        seen: NDArray[np.intp] = near[~hidden.any(axis=1)]
        self._cells[seen] = self._truth[seen]
        return seen.size > 0

    def snapshot(self) -> Grid:
        """Return the map as it is now; it does not change any more."""
        rows, columns = self._shape
        return Grid(columns, rows, RESOLUTION_M, self._origin, self._cells.tobytes())
