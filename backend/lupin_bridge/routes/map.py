"""The occupancy grid: where it is, and its picture."""

from __future__ import annotations

import io
import math
from typing import Final

import numpy as np
import orjson
from fastapi import APIRouter, Request, Response

from lupin_bridge.field.query import matches
from lupin_bridge.routes.computing import kept_or_computed, made, or_refusal
from lupin_bridge.routes.tools import (
    JSON_TYPE,
    REVALIDATE,
    bridge_of,
    error_response,
    list_header,
    read_route,
)
from lupin_bridge.stream import schema
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
    # Megabytes of memory, for who has a map.
    from PIL import Image  # noqa: PLC0415

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


router = APIRouter()

# What drawing a cell takes, roughly and at worst.
_DRAW_CELL_S: Final = 50e-9

_NO_MAP = {
    304: {"description": "the ETag still holds"},
    404: {"model": schema.ErrorMessage, "description": "no map has come yet"},
    429: {"model": schema.ErrorMessage, "description": "this client asks for too much"},
    503: {"model": schema.ErrorMessage, "description": "the twin is not there, or busy"},
}


@read_route(
    router,
    "/api/map",
    summary="Frame, place and size of the occupancy grid",
    responses={200: {"model": schema.OccupancyGrid}, **_NO_MAP},
)
async def occupancy_map(request: Request) -> Response:
    """The map without its cells."""
    return await or_refusal(_map(request, "json"))


@read_route(
    router,
    "/api/map.png",
    summary="The occupancy grid as a picture",
    responses={
        200: {"content": {"image/png": {"schema": {"type": "string", "format": "binary"}}}},
        **_NO_MAP,
    },
)
async def map_picture(request: Request) -> Response:
    """One pixel a cell, the grid's last row on top, unknown cells transparent."""
    return await or_refusal(_map(request, "png"))


async def _map(request: Request, kind: str) -> Response:
    bridge = bridge_of(request)
    occupancy = bridge.source.occupancy_map()
    if occupancy is None:
        return error_response("no map has come yet on the twin's map_topic", 404)
    # A replica that started later has the same map with a later stamp, which is in the JSON.
    which = occupancy.stamp_ns if kind == "json" else kind
    headers = {"ETag": f'"{bridge.source.identity}-{occupancy.revision}-{which}"', **REVALIDATE}
    if matches(list_header(request, "if-none-match"), headers["ETag"]):
        return Response(status_code=304, headers=headers)
    if kind == "json":
        return Response(map_json(occupancy), headers=headers, media_type=JSON_TYPE)
    key = headers["ETag"]
    return await kept_or_computed(
        request,
        key,
        lambda: made(
            request,
            key,
            lambda: map_png(occupancy),
            "image/png",
            cost=occupancy.cells.size * _DRAW_CELL_S,
            headers=headers,
        ),
    )
