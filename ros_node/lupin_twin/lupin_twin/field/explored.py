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

from lupin_twin.core.drops import valid_text
from lupin_twin.field.grid import BoolArray, FloatArray, cell_centres, reach_of

# A site of 350 m by 350 m at 5 cm. The bound keeps memory finite when a producer is broken.
MAX_MAP_CELLS: Final = 50_000_000

# Occupancy of a known cell, in percent (nav_msgs/OccupancyGrid); -1 is unknown.
_KNOWN_MIN: Final = 0
_KNOWN_MAX: Final = 100

# A map's resolution is float32, so rounding may put a point on the edge of two map cells on either
# side. A point that is below an edge by this share of a cell counts as on it.
_EDGE_NOISE_CELLS: Final = 1e-4

# Field cells that are looked up at once; bounds the memory.
CELLS_AT_ONCE: Final = 16_384

# The fields that locate a map.
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
        ValueError: the map is invalid; the message names the defect.

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
        """Whether place and cells are the same; stamp and revision may differ."""
        return self.place == other.place and np.array_equal(self.cells, other.cells)


def digest_of(occupancy: OccupancyMap) -> int:
    """Digest of a map's place and cells: the same in all replicas, and for republished maps.

    SLAM publishes a map again every few seconds, with another stamp each time.
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
    cos, sin = math.cos(occupancy.origin_yaw), math.sin(occupancy.origin_yaw)
    rows_at_once = max(1, CELLS_AT_ONCE // width)
    for top in range(0, height, rows_at_once):
        band = y[top : top + rows_at_once, None]
        columns, on_columns = _indices(cos * x + sin * band, occupancy.resolution, occupancy.width)
        rows, on_rows = _indices(cos * band - sin * x, occupancy.resolution, occupancy.height)
        percent = occupancy.cells[rows, columns]
        known = (percent >= _KNOWN_MIN) & (percent <= _KNOWN_MAX)
        explored[top : top + rows_at_once] = known & on_columns & on_rows
    return explored


def _indices(
    offset: FloatArray, resolution: float, count: int
) -> tuple[npt.NDArray[np.intp], BoolArray]:
    """The map cell at each offset (m) along one axis, and whether there is one; 0 if not."""
    position = np.floor(offset / resolution + _EDGE_NOISE_CELLS)
    inside = (position >= 0) & (position < count)
    return np.where(inside, position, 0).astype(np.intp), inside


# A tag that is closer than this to another measures nothing new.
LEAST_APART_M: Final = 0.5
# Without a map, places may be this far outside the tags' bounding box.
MARGIN_M: Final = 1.0
# Places that are considered along a side, and places that are kept at most.
_ALONG: Final = 60
MAX_PLACES: Final = 300
# With more tags than this, fewer places are kept: each has its own neighbours to be solved.
_MANY_TAGS: Final = 64
_PLACES_OF_MANY: Final = 100
# nav_msgs/OccupancyGrid: percent; from here on, the cell is more likely a wall.
_OCCUPIED: Final = 50


def floor(tags: FloatArray, occupancy: OccupancyMap | None) -> FloatArray:
    """Places (m, 2) all over the site: the map's free cells or, without a map, around `tags`.

    Tags that are far off do not count.
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
    """Those of `places` (k, 2) that are not next to a tag (T, 2)."""
    apart = np.hypot(*(places[:, None, :] - tags[None, :, :]).transpose(2, 0, 1))
    result: FloatArray = places[(apart >= LEAST_APART_M).all(axis=1)]
    return result


def _along(low: float, high: float) -> FloatArray:
    """The centres of equal parts, each half a metre or longer."""
    count = max(1, min(_ALONG, int((high - low) / LEAST_APART_M)))
    result: FloatArray = low + (np.arange(count) + 0.5) * (high - low) / count
    return result


def _cells(count: int) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    return np.unique(np.linspace(0, count - 1, min(count, _ALONG)).astype(np.int64))


def _thinned(places: FloatArray, tags: int) -> FloatArray:
    """All places, or a random selection, which is the same every time."""
    most = MAX_PLACES if tags <= _MANY_TAGS else _PLACES_OF_MANY
    if len(places) <= most:
        return places
    chosen = np.random.default_rng(len(places)).permutation(len(places))[:most]
    result: FloatArray = places[np.sort(chosen)]
    return result


# --- a map as text: one fact of the journal, written again when the map has changed ---------------

# Characters; a floor of 2 ha at 5 cm takes about 100 kB. A larger text is too large for a row.
MAX_TEXT: Final = 1_000_000
# Packing this many cells takes a tenth of a second.
MAX_PACKED_CELLS: Final = 16_000_000


def text_of(floor: OccupancyMap) -> str:
    """JSON of a map, its cells deflated and in base64; empty if it is too large for a row."""
    if floor.cells.size > MAX_PACKED_CELLS:
        return ""
    about = {name: getattr(floor, name) for name in (*_PLACE, "stamp_ns")}
    cells = base64.b64encode(zlib.compress(floor.cells.tobytes(), 1)).decode()
    text = json.dumps({**about, "cells": cells})
    return text if len(text) <= MAX_TEXT else ""


def map_of(text: str, revision: int) -> OccupancyMap:
    """Read a map from its text.

    Raises:
        ValueError: the text is not a map.

    """
    try:
        about = json.loads(text)
        size = int(about["width"]) * int(about["height"])
        if not 0 <= size <= MAX_PACKED_CELLS:
            raise ValueError(f"it has {size} cells, the limit is {MAX_PACKED_CELLS}")
        about |= {"frame_id": valid_text(about["frame_id"]), "stamp_ns": int(about["stamp_ns"])}
        # At most one byte more than the stated size, whatever was packed.
        packed = base64.b64decode(about.pop("cells"), validate=True)
        cells = zlib.decompressobj().decompress(packed, size + 1)
        return OccupancyMap(**about, cells=np.frombuffer(cells, np.int8), revision=revision)
    except (AttributeError, KeyError, TypeError, ArithmeticError, zlib.error) as error:
        raise ValueError(f"it is not a map: {error}") from None
