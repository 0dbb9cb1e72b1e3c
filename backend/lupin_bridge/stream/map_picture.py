"""The occupancy grid as JSON and as a picture. Pure."""

from __future__ import annotations

import io
import math

import numpy as np
import orjson
from PIL import Image

from lupin_bridge.stream.state_json import header, stamp
from lupin_twin.explored import OccupancyMap

# Grey of a free and of an occupied cell; unknown is transparent. The page decides what is below.
_FREE_GREY = 236
_OCCUPIED_GREY = 70
_UNKNOWN_INDEX = 101


def map_json(occupancy: OccupancyMap) -> bytes:
    """`schema.OccupancyGrid`: where the map is and how large, without its cells."""
    half_yaw = occupancy.origin_yaw / 2
    return orjson.dumps(
        {
            "header": header(occupancy.stamp_ns, occupancy.frame_id),
            "info": {
                "map_load_time": stamp(0),
                "resolution": occupancy.resolution,
                "width": occupancy.width,
                "height": occupancy.height,
                "origin": {
                    "position": {"x": occupancy.origin_x, "y": occupancy.origin_y, "z": 0.0},
                    "orientation": {
                        "x": 0.0,
                        "y": 0.0,
                        "z": math.sin(half_yaw),
                        "w": math.cos(half_yaw),
                    },
                },
            },
        }
    )


def map_png(occupancy: OccupancyMap) -> bytes:
    """One pixel a cell, the grid's last row on top (the row flip), unknown transparent.

    The picture is in the grid's own axes: a map whose origin has a yaw is turned by the viewer.
    A map without a cell is one transparent pixel, for PNG knows no empty picture.
    """
    cells = occupancy.cells
    if cells.size == 0:
        cells = np.full((1, 1), -1, dtype=np.int8)
    known = (cells >= 0) & (cells <= 100)
    indices = np.flipud(np.where(known, cells, _UNKNOWN_INDEX)).astype(np.uint8)
    image = Image.fromarray(np.ascontiguousarray(indices), mode="P")
    greys = np.rint(np.linspace(_FREE_GREY, _OCCUPIED_GREY, 101)).astype(int).tolist()
    image.putpalette([grey for grey in [*greys, 0] for _ in range(3)])
    buffer = io.BytesIO()
    image.save(buffer, format="PNG", transparency=b"\xff" * 101 + b"\x00", compress_level=1)
    return buffer.getvalue()
