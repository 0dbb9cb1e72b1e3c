"""Liveness of the bridge and readiness of the twin behind it."""

from __future__ import annotations

import orjson
from fastapi import APIRouter, Request, Response

from lupin_bridge import schema
from lupin_bridge.http_tools import bridge_of, json_response, read_route

router = APIRouter()


@read_route(
    router,
    "/healthz",
    summary="Is the bridge itself alive?",
    responses={
        200: {"model": schema.Health},
        503: {"model": schema.Health, "description": "the ROS thread has ended: restart"},
    },
)
async def healthz(request: Request) -> Response:
    """503 when the ROS thread has ended, for whoever restarts services."""
    source = bridge_of(request).source
    alive = source.is_alive
    body = {
        "ok": alive,
        "message": "The ROS thread runs." if alive else "The ROS thread has ended. Restart.",
        "callback_errors": source.callback_errors,
    }
    return json_response(orjson.dumps(body), 200 if alive else 503)


@read_route(
    router,
    "/readyz",
    summary="Is there a live twin behind the bridge?",
    responses={
        200: {"model": schema.StatusFrame},
        503: {"model": schema.StatusFrame, "description": "never seen, silent, or dead"},
    },
)
async def readyz(request: Request) -> Response:
    """The status as WebSocket clients are told it; 503 while the twin is offline."""
    status = bridge_of(request).status
    return json_response(orjson.dumps(status.frame()), 200 if status.is_live else 503)
