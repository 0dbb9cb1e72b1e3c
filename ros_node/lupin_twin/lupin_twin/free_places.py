"""Where another tag could stand: on free floor, and not on top of one that is there.

Pure. Metres in the map frame.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from lupin_twin.explored import OccupancyMap
from lupin_twin.far_off import reach_of
from lupin_twin.grid import FloatArray

# Next to a tag another tells nothing that this one does not.
LEAST_APART_M: Final = 0.5
# What is not on any map may be this far from the tags.
MARGIN_M: Final = 1.0
# Places that are looked at along a side, and that are left at most.
_ALONG: Final = 60
MAX_PLACES: Final = 300
# Of a house of so many tags fewer: each place has a neighbourhood of its own to be reckoned with.
_MANY_TAGS: Final = 64
_PLACES_OF_MANY: Final = 100
# nav_msgs/OccupancyGrid: percent; from here on it is more likely a wall.
_OCCUPIED: Final = 50


def floor(tags: FloatArray, occupancy: OccupancyMap | None) -> FloatArray:
    """Places (m, 2) all over the house: the map's free cells, or without a map about `tags`.

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
