"""The past: one sensor's readings, what happened when, and every row of a period as CSV."""

from __future__ import annotations

import logging
import time
from collections.abc import AsyncGenerator, AsyncIterator, Callable
from contextlib import ExitStack
from functools import partial

from fastapi import APIRouter, Request, Response
from starlette.types import Message, Receive, Scope, Send

from lupin_bridge.access.middleware import client_of
from lupin_bridge.bridge import Bridge
from lupin_bridge.past import bodies, query, schema
from lupin_bridge.past.plans import History, Timeline
from lupin_bridge.past.query import MAX_SECONDS
from lupin_bridge.query_string import parameters_of
from lupin_bridge.routes.answers import (
    CLIENT_GONE,
    NEVER_STORE,
    NOT_REMEMBERED,
    bridge_of,
    client_left,
    read_route,
    respond_past,
    while_client_waits,
    within_time,
)
from lupin_bridge.serving.admission import Export
from lupin_bridge.serving.http_protocol import CONNECTION_KEY, HttpConnection
from lupin_twin.core.state import NANOSECONDS_PER_SECOND

log = logging.getLogger(__name__)

router = APIRouter()

_EXPORT_ANSWERS = {status: what for status, what in NOT_REMEMBERED.items() if status != 304}
# An export's rows as CSV, in parts.
Parts = AsyncIterator[bytes]


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


@read_route(
    router,
    "/api/export.csv",
    summary="Every reading and failed try of a period, as CSV",
    responses={200: {"content": {"text/csv": {"schema": {"type": "string"}}}}, **_EXPORT_ANSWERS},
    openapi_extra={"parameters": parameters_of(query.OfExport)},
)
async def export_route(request: Request) -> Response:
    """A row for each reading, and one without a sensor for each try that brought none.

    It is streamed: one that does not end as HTTP says it must (the last chunk) is not whole.
    """
    bridge = bridge_of(request)
    now_ns = bridge.ros_time_ns
    period = query.period(query.OfExport, request.query_params.multi_items(), now_ns)
    end_ns = period.end_ns or now_ns or MAX_SECONDS * NANOSECONDS_PER_SECOND
    headers = {
        **NEVER_STORE,
        **bodies.period_headers(bridge.source.journal(), period.start_ns, end_ns),
        "Content-Disposition": f'attachment; filename="{bodies.csv_file_name(period, now_ns)}"',
    }
    if request.method == "HEAD":
        return Response(headers=headers, media_type=bodies.CSV_TYPE)
    client, connection = client_of(request), request.scope["state"][CONNECTION_KEY]

    def evict() -> None:
        log.warning("the export of %s is slow and makes place for another one", client)
        connection.break_off()

    with ExitStack() as held:
        # A response that has begun cannot be refused any more: so the first rows come before it.
        with bridge.admission.request(client, time.monotonic()):
            export = held.enter_context(bridge.admission.export(client, time.monotonic(), evict))
            write = partial(bodies.csv_lines, sensors=bridge.criteria.sensors)
            parts = bridge.source.rows(
                period.start_ns, end_ns, period.tag_id, period.sensor_type, write
            )
            first = await while_client_waits(request, within_time(bridge, _next(parts)))
        if first is None:
            return Response(status_code=CLIENT_GONE)
        return ExportResponse(
            bridge, export, first[0], parts, headers, release=held.pop_all().close
        )


async def _next(parts: Parts) -> tuple[bytes | None]:
    """The next part, in a tuple of one; None in it: there is none."""
    return (await anext(parts, None),)


class ExportResponse(Response):
    """Rows as CSV; the next part is read when the socket has taken those before."""

    def __init__(
        self,
        bridge: Bridge,
        export: Export,
        first: bytes | None,
        parts: Parts,
        headers: dict[str, str],
        *,
        release: Callable[[], None],
    ) -> None:
        super().__init__(headers=headers, media_type=bodies.CSV_TYPE)
        del self.headers["content-length"]
        self._bridge, self._export, self._first, self._parts = bridge, export, first, parts
        self._release = release

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send it; where that fails, break the connection: a part must not pass for the whole."""
        request = Request(scope, receive)
        try:
            await while_client_waits(request, self._send_all(send))
        except Exception as error:
            log.warning("an export ended before its end: %s", error, exc_info=True)
            connection: HttpConnection = scope["state"][CONNECTION_KEY]
            connection.break_off()
            await client_left(request)  # or the server would complain of an answer without an end
        finally:
            self._release()
            if isinstance(self._parts, AsyncGenerator):
                await self._parts.aclose()

    async def _send_all(self, send: Send) -> None:
        start: Message = {
            "type": "http.response.start",
            "status": self.status_code,
            "headers": self.raw_headers,
        }
        await send(start)
        await send(_piece(bodies.CSV_HEADER))
        part = self._first
        while part is not None:
            if part:
                await send(_piece(part))
                self._export.take(len(part), time.monotonic())
            (part,) = await within_time(self._bridge, _next(self._parts))
        await send({"type": "http.response.body", "body": b""})


def _piece(body: bytes) -> Message:
    return {"type": "http.response.body", "body": body, "more_body": True}
