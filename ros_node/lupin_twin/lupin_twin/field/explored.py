"""What the robot has explored: the occupancy grid, the known cells of a field, and free floor.

Pure: numpy and the standard library. Metres and radians in the map frame.
"""

from __future__ import annotations

import base64
import json
import math
import zlib
from dataclasses import dataclass
from hashlib import blake2b
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from lupin_twin.field.grid import BoolArray, FloatArray, cell_centres, reach_of

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

# Where a map lies.
_PLACE: Final = "frame_id", "width", "height", "resolution", "origin_x", "origin_y", "origin_yaw"


@dataclass(frozen=True, slots=True, eq=False)
class OccupancyMap:
    """An occupancy grid (nav_msgs/OccupancyGrid), immutable.

    `origin_x`, `origin_y` (m) and `origin_yaw` (rad, counter-clockwise) are the pose of the corner
    of cell (0, 0) in `frame_id`; `resolution` is the side of a cell (m). `cells` is given flat and
    row-major, and becomes a read-only copy, int8 (height, width), row 0 at the origin: 0 to 100 is
    known, anything else is not. On a map without a cell nothing is explored. `stamp_ns` is ROS
    time. `revision` differs between any two maps of a process.

    Raises:
        ValueError: a map that cannot be right; the message names the defect.

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

    def __post_init__(self) -> None:
        width, height = self.width, self.height
        for name in ("resolution", "origin_x", "origin_y", "origin_yaw"):
            if not math.isfinite(number := getattr(self, name)):
                raise ValueError(f"map {name} is {number}, must be finite")
        if self.resolution <= 0.0:
            raise ValueError(f"map resolution is {self.resolution} m, must be greater than 0")
        if width < 0 or height < 0:
            raise ValueError(f"map is {width} x {height} cells, must not be less than 0")
        if width * height > MAX_MAP_CELLS:
            raise ValueError(
                f"map is {width} x {height} = {width * height} cells, the limit is {MAX_MAP_CELLS}"
            )
        cells = np.array(self.cells, dtype=np.int8)
        if cells.size != width * height:
            raise ValueError(
                f"map data holds {cells.size} cells, must be width x height = {width} x {height} "
                f"= {width * height}"
            )
        cells = cells.reshape(height, width)
        cells.setflags(write=False)
        object.__setattr__(self, "cells", cells)

    @property
    def place(self) -> tuple[Any, ...]:
        """Frame, cells in x and y, side of a cell (m), origin (m) and its yaw (rad)."""
        return tuple(getattr(self, name) for name in _PLACE)

    def shows_the_same_as(self, other: OccupancyMap) -> bool:
        """Whether place and cells are the same, whenever and however often it was published."""
        return self.place == other.place and np.array_equal(self.cells, other.cells)


def digest_of(occupancy: OccupancyMap) -> int:
    """Of place and cells: the same in all replicas, and for each copy that shows the same.

    SLAM publishes a map anew every few seconds, with another stamp each time.
    """
    digest = blake2b(repr(occupancy.place).encode("utf-8", "surrogatepass"), digest_size=6)
    digest.update(occupancy.cells.data)
    return int.from_bytes(digest.digest())


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


# Next to a tag another measures nothing that this one does not.
LEAST_APART_M: Final = 0.5
# What is not on any map may be this far from the tags.
MARGIN_M: Final = 1.0
# Places that are looked at along a side, and that are left at most.
_ALONG: Final = 60
MAX_PLACES: Final = 300
# Of a site of so many tags fewer: each place has a neighbourhood of its own to be reckoned with.
_MANY_TAGS: Final = 64
_PLACES_OF_MANY: Final = 100
# nav_msgs/OccupancyGrid: percent; from here on it is more likely a wall.
_OCCUPIED: Final = 50


def floor(tags: FloatArray, occupancy: OccupancyMap | None) -> FloatArray:
    """Places (m, 2) all over the site: the map's free cells, or without a map about `tags`.

    None about a tag that is far off.
    """
    if occupancy is None or occupancy.cells.size == 0:
        reach = reach_of((x, y) for x, y in tags.tolist())
        tags = tags[[reach.holds(x, y) for x, y in tags.tolist()]]
        if len(tags) == 0:
            return np.empty((0, 2))
        low, high = tags.min(axis=0) - MARGIN_M, tags.max(axis=0) + MARGIN_M
        x, y = (_along(*ends) for ends in zip(low, high, strict=True))
        return _thinned(np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2), len(tags))
    columns, rows = (_cells(count) for count in (occupancy.width, occupancy.height))
    percent = occupancy.cells[np.ix_(rows, columns)]
    row, column = np.nonzero((percent >= 0) & (percent < _OCCUPIED))
    along = (columns[column] + 0.5) * occupancy.resolution
    across = (rows[row] + 0.5) * occupancy.resolution
    cos, sin = math.cos(occupancy.origin_yaw), math.sin(occupancy.origin_yaw)
    x = occupancy.origin_x + cos * along - sin * across
    y = occupancy.origin_y + sin * along + cos * across
    return _thinned(np.stack((x, y), axis=-1), len(tags))


def free_of(tags: FloatArray, places: FloatArray) -> FloatArray:
    """Those of `places` (k, 2) that no tag (T, 2) stands at."""
    apart = np.hypot(*(places[:, None, :] - tags[None, :, :]).transpose(2, 0, 1))
    result: FloatArray = places[(apart >= LEAST_APART_M).all(axis=1)]
    return result


def _along(low: float, high: float) -> FloatArray:
    """The middles of equal parts, half a metre long or longer."""
    count = max(1, min(_ALONG, int((high - low) / LEAST_APART_M)))
    result: FloatArray = low + (np.arange(count) + 0.5) * (high - low) / count
    return result


def _cells(count: int) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    return np.unique(np.linspace(0, count - 1, min(count, _ALONG)).astype(np.int64))


def _thinned(places: FloatArray, tags: int) -> FloatArray:
    """All of them, or so many that lie anywhere: the same ones every time."""
    most = MAX_PLACES if tags <= _MANY_TAGS else _PLACES_OF_MANY
    if len(places) <= most:
        return places
    chosen = np.random.default_rng(len(places)).permutation(len(places))[:most]
    result: FloatArray = places[np.sort(chosen)]
    return result


# --- as a text: one fact of the log, written again when the map is another ------------------------

# A floor of 2 ha at 5 cm is some 100 kB. A larger text is no longer one row among others.
MAX_TEXT: Final = 1_000_000
# So many cells are packed in a tenth of a second.
MAX_PACKED_CELLS: Final = 16_000_000


def text_of(floor: OccupancyMap) -> str:
    """JSON of a map, its cells deflated and in base64; empty: it is too large for a row."""
    if floor.cells.size > MAX_PACKED_CELLS:
        return ""
    about = {name: getattr(floor, name) for name in (*_PLACE, "stamp_ns")}
    cells = base64.b64encode(zlib.compress(floor.cells.tobytes(), 1)).decode()
    text = json.dumps({**about, "cells": cells})
    return text if len(text) <= MAX_TEXT else ""


def map_of(text: str, revision: int) -> OccupancyMap:
    """The map of a text.

    Raises:
        ValueError: it is none.

    """
    try:
        about = json.loads(text)
        size = int(about["width"]) * int(about["height"])
        if not 0 <= size <= MAX_PACKED_CELLS:
            raise ValueError(f"it has {size} cells, the limit is {MAX_PACKED_CELLS}")
        # Never more than it says, whatever was packed.
        packed = base64.b64decode(about.pop("cells"), validate=True)
        cells = zlib.decompressobj().decompress(packed, size + 1)
        return OccupancyMap(**about, cells=np.frombuffer(cells, np.int8), revision=revision)
    except (AttributeError, KeyError, TypeError, zlib.error) as error:
        raise ValueError(f"it is no map: {error}") from None
