"""Routes of the map, the robot, health, sensors and alarms; and of the bridge's own condition."""

from __future__ import annotations

import io
import math
from functools import partial
from itertools import islice
from typing import Final

import numpy as np
import orjson
from fastapi import APIRouter, Request, Response

from lupin_bridge import query_string
from lupin_bridge.access.middleware import client_of
from lupin_bridge.alarms.board import notes_of_alarms
from lupin_bridge.feed.source import ailment
from lupin_bridge.judge.episodes import Alarm
from lupin_bridge.metrics import CONTENT_TYPE
from lupin_bridge.past.plans import Health
from lupin_bridge.query_string import read
from lupin_bridge.routes.answers import (
    NEVER_STORE,
    NOT_REMEMBERED,
    ApiRoute,
    bridge_of,
    computed,
    error_response,
    has_etag,
    json_response,
    newest_of,
    not_modified,
    on_worker,
    read_route,
    refusing,
    respond,
    respond_as_of,
)
from lupin_bridge.serving.admission import REVALIDATE, Answer, content_answer
from lupin_bridge.stream import routes_schema, schema
from lupin_bridge.stream.state_json import alarms_body, header, judgement, pose, robot_body, stamp
from lupin_twin.core.state import Pose
from lupin_twin.field.explored import OccupancyMap

# Grey of a free and of an occupied cell; an unknown one is transparent.
_FREE_GREY = 236
_OCCUPIED_GREY = 70
_UNKNOWN_INDEX = 101


def map_json(occupancy: OccupancyMap) -> bytes:
    """`schema.OccupancyGrid`: where the map is and how large, without its cells."""
    half_yaw = occupancy.origin_yaw / 2
    turned = (0.0, 0.0, math.sin(half_yaw), math.cos(half_yaw))
    return orjson.dumps(
        {
            "header": header(occupancy.stamp_ns, occupancy.frame_id),
            "info": {
                "map_load_time": stamp(0),
                "resolution": occupancy.resolution,
                "width": occupancy.width,
                "height": occupancy.height,
                "origin": pose(Pose(occupancy.origin_x, occupancy.origin_y, 0.0, *turned)),
            },
        }
    )


def map_png(occupancy: OccupancyMap) -> bytes:
    """A PNG of one pixel per cell, the grid's last row on top (the row flip), unknown transparent.

    The picture is in the grid's own axes: the viewer rotates a map whose origin has a yaw.
    A map without a cell is one transparent pixel, because PNG has no empty pictures.
    """
    # Pillow takes megabytes, and only a bridge with a map needs it.
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


router = APIRouter(route_class=ApiRoute)

# Rough worst-case time to draw a cell, s.
_DRAW_CELL_S: Final = 50e-9

_NO_MAP = {
    304: {"description": "not modified: the ETag is still current"},
    **refusing(
        {
            404: "no map has been received yet",
            429: "too many requests from this client",
            503: "the twin is missing or busy",
        }
    ),
}


@read_route(
    router,
    "/api/map",
    summary="Frame, origin and size of the occupancy grid",
    responses={200: {"model": schema.OccupancyGrid}, **_NO_MAP},
)
async def occupancy_map(request: Request) -> Response:
    """The map without its cells."""
    return await _map(request, "json")


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
    """One pixel per cell, the grid's last row on top, unknown cells transparent."""
    return await _map(request, "png")


async def _map(request: Request, kind: str) -> Response:
    bridge = bridge_of(request)
    occupancy = bridge.source.occupancy_map()
    if occupancy is None:
        return error_response("no map has been received yet on the twin's map_topic", 404)
    # A replica that started later has the same map with a later stamp, which is in the JSON.
    which = occupancy.stamp_ns if kind == "json" else kind
    etag = f'"{bridge.source.identity}-{occupancy.revision}-{which}"'
    headers = {"ETag": etag, **REVALIDATE}
    if kind == "json":
        if has_etag(request, etag):
            return not_modified(etag)
        return Response(map_json(occupancy), headers=headers, media_type="application/json")
    cost_s = occupancy.cells.size * _DRAW_CELL_S

    def write(_: object) -> Answer:
        return Answer(map_png(occupancy), "image/png", headers)

    compute = partial(computed, bridge, client_of(request), etag, write, cost_s)
    return await respond(request, etag, compute, etag)


@read_route(
    router,
    "/api/robot",
    summary="The robot's position, trail, planned path and battery",
    responses={200: {"model": routes_schema.Robot}},
)
async def robot(request: Request) -> Response:
    """From the robot's own topics. Only current data: the journal does not record it."""
    known = bridge_of(request).robot

    async def compute() -> Answer:
        return Answer(robot_body(known), "application/json", NEVER_STORE)

    return await respond(request, "robot", compute)


MAX_ALARMS: Final = 2_000
# Rough worst-case time to examine an alarm and write it, s.
_WRITE_ALARM_S: Final = 10e-6


@read_route(
    router,
    "/api/health",
    summary="The status of the greenhouse and of each tag, with reasons",
    responses={
        **NOT_REMEMBERED,
        200: {"model": schema.Judgement},
        **refusing({503: "no twin has been found yet, or it is busy"}),
    },
    query=query_string.OfMoment,
)
async def health(request: Request) -> Response:
    """The verdicts, as in the frames of `/ws/state`, with the reasons for each.

    With `at`, the state of that moment is judged with the current ranges, and with each tag's scans
    up to it. A reason's `since` is then the last observation that shows it, not the first.
    """
    bridge = bridge_of(request)
    at_ns = query_string.at(request.query_params.multi_items(), bridge.ros_time_ns)
    if at_ns is not None:
        return await respond_as_of(request, Health(at_ns, bridge.criteria))
    newest_of(bridge)
    judged = bridge.judged

    async def compute() -> Answer:
        return Answer(judgement(judged), "application/json", NEVER_STORE)

    key = ("health", judged.number, bridge.status.is_live)
    return await respond(request, key, compute)


@read_route(
    router,
    "/api/sensors",
    summary="The sensors file in use: labels, units, colours, ranges",
    responses={200: {"content": {"application/json": {"schema": {"type": "object"}}}}},
)
async def sensors(request: Request) -> Response:
    """The built-in `sensors.json`, or the file of the setting `sensors`, unchanged."""
    answer = content_answer(bridge_of(request).criteria.sensors.text.encode())
    if has_etag(request, etag := answer.headers["ETag"]):
        return not_modified(etag)
    return json_response(answer.body, headers=answer.headers)


@read_route(
    router,
    "/api/alarms",
    summary="Alarms: what was wrong, where, from when to when, and the worst value",
    responses={200: {"model": schema.Alarms}, **NOT_REMEMBERED},
    query=query_string.OfAlarms,
)
async def alarms_route(request: Request) -> Response:
    """Alarms that were active at any time in the period, newest first, at most 2,000.

    They are derived from the observations and the current ranges, so every replica has the same.
    """
    bridge = bridge_of(request)
    given = read(query_string.OfAlarms, request.query_params.multi_items())
    span, active = given.span(bridge.ros_time_ns), given.active
    board = bridge.alarms.now
    alarms = board.active if active == "1" else board.alarms

    notes, now_ns = bridge.notes.notes or (), bridge.ros_time_ns

    def body() -> bytes:
        found = list(islice((it for it in alarms if _is_in(it, *span, active)), MAX_ALARMS))
        said = notes_of_alarms(board.alarms, notes, now_ns)
        return orjson.dumps(alarms_body(found, board.source, board.since_ns, said))

    # Not cached: a shelf ends by time alone.
    async def compute() -> Answer:
        with bridge.admission.computing(client_of(request)):
            text = await on_worker(bridge, lambda _: body(), len(alarms) * _WRITE_ALARM_S)
        return Answer(text, "application/json", NEVER_STORE)

    return await respond(request, ("alarms", board.number, bridge.notes.number, given), compute)


def _is_in(alarm: Alarm, start_ns: int, end_ns: int, active: str | None) -> bool:
    """Whether an alarm matches a query; `active` is the query's; `end_ns` 0: now."""
    if active is not None and alarm.is_active != (active == "1"):
        return False
    if end_ns and alarm.raised_at_ns >= end_ns:
        return False
    return alarm.cleared_at_ns is None or alarm.cleared_at_ns >= start_ns


@read_route(
    router,
    "/healthz",
    summary="Is the bridge itself alive?",
    responses={
        200: {"model": schema.Health},
        503: {
            "model": schema.Health,
            "description": "the ROS thread has ended or is stuck: restart the bridge",
        },
    },
)
async def healthz(request: Request) -> Response:
    """503 if the ROS thread has ended or hangs in a callback: a supervisor should restart it."""
    source = bridge_of(request).source
    wrong = ailment(source.thread)
    body = {
        "ok": wrong is None,
        "message": wrong or "The ROS thread runs.",
        "callback_errors": source.thread.callback_errors,
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
        return Answer(bridge.metrics.text(), CONTENT_TYPE, NEVER_STORE)

    return await respond(request, "metrics", compute)


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

    A journal that cannot be written is reported, but does not cause a 503: the twin continues.
    """
    status = bridge_of(request).status
    return json_response(orjson.dumps(status.frame()), 200 if status.is_live else 503)
