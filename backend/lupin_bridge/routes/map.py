"""The occupancy grid: where it is, and its picture."""

from __future__ import annotations

from typing import Final

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
from lupin_bridge.stream.map_picture import map_json, map_png

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
