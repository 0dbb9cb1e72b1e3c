"""Routes of the state, over WebSocket and as JSON, whole or tag by tag; and of the past."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Annotated, Final

from annotated_types import Ge
from fastapi import APIRouter, Request, Response, WebSocket

from lupin_bridge import query_string
from lupin_bridge.bridge import Bridge
from lupin_bridge.judge.judging import zone_of
from lupin_bridge.past.plans import (
    History,
    LatestOfTag,
    OneTag,
    Timeline,
    WholeState,
    tag_of,
)
from lupin_bridge.past.report import Report
from lupin_bridge.past.report_page import ReportPage
from lupin_bridge.query_string import parameter, read
from lupin_bridge.routes.answers import (
    NEVER_STORE,
    NOT_REMEMBERED,
    ApiRoute,
    bridge_of,
    json_response,
    newest_of,
    read_route,
    refusing,
    respond,
    respond_as_of,
    respond_past,
)
from lupin_bridge.routes.sockets import listen
from lupin_bridge.serving.admission import Answer
from lupin_bridge.stream import routes_schema, schema
from lupin_bridge.stream.hub import CLOSE_POLICY
from lupin_twin.core.past import EVERY_TAG, SeriesRequest

# Longest reason in a close frame (RFC 6455, section 5.5).
MAX_REASON_BYTES: Final = 123


@dataclass(frozen=True, slots=True)
class ListenQuery:
    """How a client wants its frames."""

    delta: bool = parameter("1: only what has changed since the client's previous frame", False)
    max_rate_hz: Annotated[float, Ge(0.01)] = parameter("maximum rate of frames, Hz", math.inf)

    @property
    def min_interval_s(self) -> float:
        """The least time between two frames, s."""
        return 1.0 / self.max_rate_hz


router = APIRouter(route_class=ApiRoute)

# How long the ages of an answer may be reused: they are shown in seconds.
AGES_HOLD_S: Final = 0.2

_NO_TAG = refusing({404: "no such tag"})


@router.websocket("/ws/state")
async def ws_state(websocket: WebSocket) -> None:
    """The status and the current state at once, then every change; input is ignored."""
    bridge: Bridge = websocket.app.state.bridge
    await websocket.accept()
    try:
        query = read(ListenQuery, websocket.query_params.multi_items())
    except ValueError as error:
        reason = str(error).encode("ascii", "backslashreplace")[:MAX_REASON_BYTES].decode()
        await websocket.close(CLOSE_POLICY, reason)
        return
    await listen(websocket, bridge.hub, delta=query.delta, min_interval_s=query.min_interval_s)


@read_route(
    router,
    "/api/state",
    summary="The current state of every tag",
    responses={200: {"model": schema.TwinState}, **NOT_REMEMBERED},
    query=query_string.OfMoment,
)
async def state(request: Request) -> Response:
    """The newest TwinState, with the message's own field names, and ages at the time of the answer.

    With `at`, `header.stamp` is that moment, and ages are as of then.
    """
    bridge = bridge_of(request)
    at_ns = query_string.at(request.query_params.multi_items(), bridge.ros_time_ns)
    if at_ns is not None:
        return await respond_as_of(request, WholeState(at_ns, bridge.criteria.sensors))
    newest = newest_of(bridge)
    # Always the newest state, with ages that may be a little older: so thousands of tags are
    # written only a few times a second, even for thousands of clients.
    key = ("state", bridge.state_number, int(time.monotonic() / AGES_HOLD_S))

    async def compute() -> Answer:
        body = bridge.frames.json.state(newest, bridge.ros_time_ns)
        answer = Answer(body, "application/json", NEVER_STORE)
        bridge.cache.put(key, answer, instead_of=bridge.cached_state)
        bridge.cached_state = key
        return answer

    return await respond(request, key, compute)


# A tag_id may hold a slash, which is decoded before the routes are matched: hence :path, and the
# longer route first.
@read_route(
    router,
    "/api/tags/{tag_id:path}/history",
    summary="The latest scans and attempts of one tag",
    responses={200: {"model": schema.TagHistory}, **NOT_REMEMBERED, **_NO_TAG},
)
async def history(request: Request, tag_id: str) -> Response:
    """The tag's latest scans with readings, sensor by sensor, and its latest attempts."""
    bridge = bridge_of(request)
    if bridge.latest is not None:
        tag_of(bridge.latest.snapshot, tag_id)  # or 404
    query = LatestOfTag(tag_id, bridge.source.buffer_len)
    return await respond_past(request, query, "latest")


@read_route(
    router,
    "/api/tags/{tag_id:path}",
    summary="One tag",
    responses={200: {"model": schema.TwinTagState}, **NOT_REMEMBERED, **_NO_TAG},
    query=query_string.OfMoment,
)
async def tag(request: Request, tag_id: str) -> Response:
    """Everything that the twin knows about one tag or, with `at`, knew at that moment."""
    bridge = bridge_of(request)
    at_ns = query_string.at(request.query_params.multi_items(), bridge.ros_time_ns)
    if at_ns is not None:
        return await respond_as_of(request, OneTag(at_ns, tag_id, bridge.criteria.sensors))
    found = tag_of(newest_of(bridge), tag_id)
    return json_response(bridge.frames.json.tag(found, bridge.ros_time_ns))


# --- the past: one sensor's readings, what happened when, and the shift report of both ------------


@read_route(
    router,
    "/api/history",
    summary="The readings of one sensor of one tag over a period",
    responses={200: {"model": routes_schema.History}, **NOT_REMEMBERED},
    query=query_string.OfHistory,
)
async def history_route(request: Request) -> Response:
    """Readings, or equal buckets if there are more than `points`; `gaps`: without readings."""
    bridge = bridge_of(request)
    now_ns = bridge.ros_time_ns
    given = read(query_string.OfHistory, request.query_params.multi_items())
    series = SeriesRequest(given.tag_id, given.sensor_type, *given.span(now_ns), given.points)
    journal, is_by_clock = bridge.source.journal(), bridge.origin != "simulated"
    history = History(series, now_ns, bridge.criteria, journal, is_by_clock)
    return await respond_past(request, history, "history")


@read_route(
    router,
    "/api/timeline",
    summary="Events over time: scans, failures, inspections, pests, silences, runs of the clock",
    responses={200: {"model": routes_schema.Timeline}, **NOT_REMEMBERED},
    query=query_string.OfTimeline,
)
async def timeline_route(request: Request) -> Response:
    """Events counted in buckets of equal length, and how far back the journal reaches."""
    bridge = bridge_of(request)
    given = read(query_string.OfTimeline, request.query_params.multi_items())
    start_ns, end_ns = given.span(bridge.ros_time_ns)
    tag_id = given.tag_id or EVERY_TAG
    timeline = Timeline(start_ns, end_ns, given.points, tag_id, bridge.source.journal())
    return await respond_past(request, timeline, "timeline")


@read_route(
    router,
    "/api/report",
    summary="Report of a period: alarms, notes, silences, extremes, scans",
    responses={200: {"model": routes_schema.ShiftReport}, **NOT_REMEMBERED},
    query=query_string.OfReport,
)
async def report_route(request: Request) -> Response:
    """At most 31 days, 100,000 scans and inspections, and 500 entries in each list."""
    given = read(query_string.OfReport, request.query_params.multi_items())
    return await respond_past(request, _report(request, given), "report")


@read_route(
    router,
    "/api/report.html",
    summary="The same report as an A4 page for printing",
    responses={200: {"content": {"text/html": {"schema": {"type": "string"}}}}, **NOT_REMEMBERED},
    query=query_string.OfReportPage,
)
async def report_page_route(request: Request) -> Response:
    """The page has no scripts."""
    given = read(query_string.OfReportPage, request.query_params.multi_items())
    found = _report(request, given)
    page = ReportPage(
        found.start_ns,
        found.end_ns,
        found.criteria,
        found.journal,
        lang=given.lang,
        zone=zone_of(given.time_zone) if given.time_zone else None,
        origin=bridge_of(request).origin,
        site=bridge_of(request).site,
    )
    return await respond_past(request, page, "report")


def _report(request: Request, given: query_string.OfReport) -> Report:
    bridge = bridge_of(request)
    journal = bridge.source.journal()
    now_ns = bridge.ros_time_ns
    return Report(
        *query_string.report(given, journal.complete_ns if now_ns is None else now_ns),
        bridge.criteria,
        journal,
    )
