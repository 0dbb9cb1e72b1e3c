"""The past: one sensor's readings, and what happened when."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from lupin_bridge.past import query, schema
from lupin_bridge.past.plans import History, Timeline
from lupin_bridge.query_string import parameters_of
from lupin_bridge.routes.answers import (
    NOT_REMEMBERED,
    bridge_of,
    read_route,
    respond_past,
)

router = APIRouter()


@read_route(
    router,
    "/api/history",
    summary="The readings of one sensor of one tag over a period",
    responses={200: {"model": schema.History}, **NOT_REMEMBERED},
    openapi_extra={"parameters": parameters_of(query.OfHistory)},
)
async def history_route(request: Request) -> Response:
    """Readings, or equal buckets if there are more than `points`; `gaps`: where nothing came."""
    bridge = bridge_of(request)
    now_ns = bridge.ros_time_ns
    series = query.history(request.query_params.multi_items(), now_ns)
    history = History(series, now_ns, bridge.criteria, bridge.source.journal())
    return await respond_past(request, history, "history")


@read_route(
    router,
    "/api/timeline",
    summary="What happened when: scans, failures, looks, pests, silences, runs of the clock",
    responses={200: {"model": schema.Timeline}, **NOT_REMEMBERED},
    openapi_extra={"parameters": parameters_of(query.OfTimeline)},
)
async def timeline_route(request: Request) -> Response:
    """Events counted in buckets of equal length, and how far back anything is remembered."""
    bridge = bridge_of(request)
    period = query.period(query.OfTimeline, request.query_params.multi_items(), bridge.ros_time_ns)
    return await respond_past(request, Timeline(period, bridge.source.journal()), "timeline")
