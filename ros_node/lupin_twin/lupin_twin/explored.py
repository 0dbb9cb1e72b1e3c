"""What the robot has explored: the occupancy grid, and which cells of a field lie on known ground.

Pure: numpy and the standard library. Metres and radians in the map frame.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from lupin_twin.grid import BoolArray, FloatArray, cell_centres

# A site of 350 m by 350 m at 5 cm. The bound keeps memory finite when a producer is broken.
MAX_MAP_CELLS: Final = 50_000_000

# Occupancy of a known cell, in percent (nav_msgs/OccupancyGrid); -1 is unknown.
_KNOWN_MIN: Final = 0
_KNOWN_MAX: Final = 100

# A map's resolution comes as float32, so that a point on the edge of two map cells lands now on
# one side, now on the other. This much of a cell below its edge counts as on it.
_EDGE_NOISE_CELLS: Final = 1e-4

# Cells of the field that a turned map is looked up for at once; bounds the memory it takes.
_CELLS_AT_ONCE: Final = 16_384


@dataclass(frozen=True, slots=True, eq=False)
class OccupancyMap:
    """An occupancy grid (nav_msgs/OccupancyGrid), immutable; made by `occupancy_map`.

    `origin_x`, `origin_y` (m) and `origin_yaw` (rad, counter-clockwise) are the pose of the corner
    of cell (0, 0) in `frame_id`; `resolution` is the side of a cell (m). `cells` is read-only int8
    (height, width), row 0 at the origin: 0 to 100 is known, anything else is not. `stamp_ns` is
    ROS time. `revision` differs between any two maps of a process.
    """

    frame_id: str
    stamp_ns: int
    width: int
    height: int
    resolution: float
    origin_x: float
    origin_y: float
    origin_yaw: float
    cells: npt.NDArray[np.int8]
    revision: int

    @property
    def place(self) -> tuple[str, int, int, float, float, float, float]:
        """Frame, cells in x and y, side of a cell (m), origin (m) and its yaw (rad)."""
        return (
            self.frame_id,
            self.width,
            self.height,
            self.resolution,
            self.origin_x,
            self.origin_y,
            self.origin_yaw,
        )

    def shows_the_same_as(self, other: OccupancyMap) -> bool:
        """Whether place and cells are the same, whenever and however often it was published."""
        return self.place == other.place and np.array_equal(self.cells, other.cells)


def occupancy_map(
    *,
    frame_id: str,
    stamp_ns: int,
    width: int,
    height: int,
    resolution: float,
    origin_x: float,
    origin_y: float,
    origin_yaw: float,
    data: Sequence[int] | npt.NDArray[np.int8],
    revision: int,
) -> OccupancyMap:
    """A checked `OccupancyMap`; `data` is flat and row-major, and is copied.

    A map without a cell is a map on which nothing is explored.

    Raises:
        ValueError: a map that cannot be right; the message names the defect.

    """
    for name, number in (
        ("resolution", resolution),
        ("origin_x", origin_x),
        ("origin_y", origin_y),
        ("origin_yaw", origin_yaw),
    ):
        if not math.isfinite(number):
            raise ValueError(f"map {name} is {number}, must be finite")
    if resolution <= 0.0:
        raise ValueError(f"map resolution is {resolution} m, must be greater than 0")
    if width < 0 or height < 0:
        raise ValueError(f"map is {width} x {height} cells, must not be less than 0")
    if width * height > MAX_MAP_CELLS:
        raise ValueError(
            f"map is {width} x {height} = {width * height} cells, the limit is {MAX_MAP_CELLS}"
        )
    if len(data) != width * height:
        raise ValueError(
            f"map data holds {len(data)} cells, must be width x height = {width} x {height} "
            f"= {width * height}"
        )
    cells = _int8_copy(data).reshape(height, width)
    cells.setflags(write=False)
    return OccupancyMap(
        frame_id=frame_id,
        stamp_ns=stamp_ns,
        width=width,
        height=height,
        resolution=resolution,
        origin_x=origin_x,
        origin_y=origin_y,
        origin_yaw=origin_yaw,
        cells=cells,
        revision=revision,
    )


def _int8_copy(data: Sequence[int] | npt.NDArray[np.int8]) -> npt.NDArray[np.int8]:
    given = np.asarray(data)
    if given.size == 0:
        return np.zeros(0, dtype=np.int8)
    if given.dtype != np.int8:
        limits = np.iinfo(np.int8)
        if not np.issubdtype(given.dtype, np.integer):
            raise ValueError(f"map data is {given.dtype}, must be int8")
        if given.min() < limits.min or given.max() > limits.max:
            raise ValueError(
                f"map data ranges from {given.min()} to {given.max()}, must be within "
                f"{limits.min} to {limits.max}"
            )
    return given.astype(np.int8, copy=True)


def explored_mask(
    occupancy: OccupancyMap,
    *,
    width: int,
    height: int,
    origin_x: float,
    origin_y: float,
    resolution: float,
) -> BoolArray:
    """Which cells of a field are explored, (height, width): those with a known cell underneath.

    The field is axis-aligned: `origin_x`, `origin_y` (m) is the corner of its cell (0, 0),
    `resolution` (m) the side of a cell. The map cell that holds the centre of a field cell
    decides, its lower edges included; a centre outside the map is not explored.
    """
    x = cell_centres(origin_x, width, resolution) - occupancy.origin_x
    y = cell_centres(origin_y, height, resolution) - occupancy.origin_y
    explored = np.zeros((height, width), dtype=np.bool_)
    if occupancy.cells.size == 0:
        return explored
    if occupancy.origin_yaw == 0.0:
        columns, on_columns = _indices(x, occupancy.resolution, occupancy.width)
        rows, on_rows = _indices(y, occupancy.resolution, occupancy.height)
        # Only the part of the field that lies on the map is looked up.
        inside = np.ix_(np.flatnonzero(on_rows), np.flatnonzero(on_columns))
        explored[inside] = _known(occupancy.cells[np.ix_(rows[on_rows], columns[on_columns])])
        return explored
    cos, sin = math.cos(occupancy.origin_yaw), math.sin(occupancy.origin_yaw)
    rows_at_once = max(1, _CELLS_AT_ONCE // width)
    for top in range(0, height, rows_at_once):
        band = y[top : top + rows_at_once, None]
        columns, on_columns = _indices(cos * x + sin * band, occupancy.resolution, occupancy.width)
        rows, on_rows = _indices(cos * band - sin * x, occupancy.resolution, occupancy.height)
        known = _known(occupancy.cells[rows, columns])
        explored[top : top + rows_at_once] = known & on_columns & on_rows
    return explored


def _indices(
    offset: FloatArray, resolution: float, count: int
) -> tuple[npt.NDArray[np.intp], BoolArray]:
    """The map cell at each offset (m) along one axis, 0 where there is none; and where there is."""
    position = np.floor(offset / resolution + _EDGE_NOISE_CELLS)
    inside = (position >= 0) & (position < count)
    return np.where(inside, position, 0).astype(np.intp), inside


def _known(occupancy: npt.NDArray[np.int8]) -> BoolArray:
    return (occupancy >= _KNOWN_MIN) & (occupancy <= _KNOWN_MAX)
