"""The past: one sensor's readings, what happened when, and the shift report of both."""

from __future__ import annotations

from datetime import UTC

from fastapi import APIRouter, Request, Response

from lupin_bridge.past import query, schema
from lupin_bridge.past.plans import History, Timeline
from lupin_bridge.past.report import Report
from lupin_bridge.past.report_page import (
    HTML_TYPE,
    PAGE_HEADERS,
    ReportPage,
    languages,
    refused_page,
)
from lupin_bridge.query_string import parameters_of, read
from lupin_bridge.routes.answers import (
    NOT_REMEMBERED,
    REFUSALS,
    bridge_of,
    list_header,
    read_route,
    refusal,
    respond_past,
)
from lupin_bridge.routes.pages import language_of
from lupin_twin.core.past import PastRefused

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
    journal, has_nights = bridge.source.journal(), bridge.origin != "simulated"
    history = History(series, now_ns, bridge.criteria, journal, has_nights)
    return await respond_past(request, history, "history")


@read_route(
    router,
    "/api/timeline",
    summary="What happened when: scans, failures, inspections, pests, silences, runs of the clock",
    responses={200: {"model": schema.Timeline}, **NOT_REMEMBERED},
    openapi_extra={"parameters": parameters_of(query.OfTimeline)},
)
async def timeline_route(request: Request) -> Response:
    """Events counted in buckets of equal length, and how far back anything is remembered."""
    bridge = bridge_of(request)
    period = query.period(query.OfTimeline, request.query_params.multi_items(), bridge.ros_time_ns)
    return await respond_past(request, Timeline(period, bridge.source.journal()), "timeline")


@read_route(
    router,
    "/api/report",
    summary="What happened between two moments: alarms, notes, silences, extremes, scans",
    responses={200: {"model": schema.ShiftReport}, **NOT_REMEMBERED},
    openapi_extra={"parameters": parameters_of(query.OfReport)},
)
async def report_route(request: Request) -> Response:
    """At most 31 days and 100,000 scans and inspections; 500 entries of each list."""
    given = read(query.OfReport, request.query_params.multi_items(), PastRefused)
    return await respond_past(request, _report(request, given), "report")


@read_route(
    router,
    "/api/report.html",
    summary="The same as a page for paper, A4",
    responses={200: {"content": {"text/html": {"schema": {"type": "string"}}}}, **NOT_REMEMBERED},
    openapi_extra={"parameters": parameters_of(query.OfReportPage)},
)
async def report_page_route(request: Request) -> Response:
    """Without scripts. A browser gets a refusal as a page too."""
    try:
        return await _report_page(request)
    except REFUSALS as error:
        refused = refusal(error)
        if "text/html" in list_header(request, "accept"):
            lang = language_of(
                request.query_params.get("lang"),
                list_header(request, "accept-language"),
                languages(),
            )
            page = refused_page(str(error), lang)
            headers = {**refused.headers, **PAGE_HEADERS}
            del headers["content-length"], headers["content-type"]
            return Response(page, refused.status_code, headers, HTML_TYPE)
        return refused


async def _report_page(request: Request) -> Response:
    given = read(query.OfReportPage, request.query_params.multi_items(), PastRefused)
    found = _report(request, given)
    name = given.time_zone or ""
    zone = query.zone(name) if name else None
    unknown_zone = "" if zone else name[:64]
    page = ReportPage(
        found.start_ns,
        found.end_ns,
        found.criteria,
        found.journal,
        lang=given.lang,
        zone=UTC if unknown_zone else zone,
        unknown_zone=unknown_zone,
        origin=bridge_of(request).origin,
        site=bridge_of(request).site,
    )
    return await respond_past(request, page, "report")


def _report(request: Request, given: query.OfReport) -> Report:
    bridge = bridge_of(request)
    journal = bridge.source.journal()
    now_ns = bridge.ros_time_ns
    return Report(
        *query.report(given, journal.complete_ns if now_ns is None else now_ns),
        bridge.criteria,
        journal,
    )
