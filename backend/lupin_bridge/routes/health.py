"""Liveness of the bridge, readiness of the twin behind it, and metrics of both."""

from __future__ import annotations

import orjson
from fastapi import APIRouter, Request, Response

from lupin_bridge.metrics import CONTENT_TYPE
from lupin_bridge.routes.computing import computed_response, or_refusal
from lupin_bridge.routes.tools import NEVER_KEEP, bridge_of, json_response, read_route
from lupin_bridge.serving.kept import Answer
from lupin_bridge.stream import schema
from lupin_bridge.twin.source import ailment

router = APIRouter()


@read_route(
    router,
    "/healthz",
    summary="Is the bridge itself alive?",
    responses={
        200: {"model": schema.Health},
        503: {
            "model": schema.Health,
            "description": "the ROS thread has ended, or is stuck: restart",
        },
    },
)
async def healthz(request: Request) -> Response:
    """503 when the ROS thread has ended or hangs in a callback, for whoever restarts services."""
    source = bridge_of(request).source
    wrong = ailment(source)
    body = {
        "ok": wrong is None,
        "message": wrong or "The ROS thread runs.",
        "callback_errors": source.callback_errors,
    }
    return json_response(orjson.dumps(body), 200 if wrong is None else 503)


@read_route(
    router,
    "/metrics",
    summary="Metrics for Prometheus",
    responses={200: {"content": {"text/plain": {"schema": {"type": "string"}}}}},
)
async def metrics(request: Request) -> Response:
    """Clients, frames, latencies, fields, and the ROS thread, in Prometheus' text format."""
    bridge = bridge_of(request)

    async def compute() -> Answer:
        return Answer(bridge.metrics.text(), CONTENT_TYPE, NEVER_KEEP)

    return await or_refusal(computed_response(request, "metrics", compute))


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
    """The status as WebSocket clients receive it; 503 while the twin is offline.

    A journal that cannot be written is reported, and no reason for 503: the twin goes on.
    """
    status = bridge_of(request).status
    return json_response(orjson.dumps(status.frame()), 200 if status.is_live else 503)
