"""`/api/export.csv`: every row of a period, written as fast as its reader takes them, no faster."""

from __future__ import annotations

import logging
import time
from collections.abc import AsyncGenerator, AsyncIterator, Callable
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial

from fastapi import APIRouter, Request, Response
from starlette.types import Message, Receive, Scope, Send

from lupin_bridge.access.middleware import client_of
from lupin_bridge.bridge import Bridge
from lupin_bridge.past import complete, query, table
from lupin_bridge.past.moments import MAX_SECONDS
from lupin_bridge.query_string import parameters_of
from lupin_bridge.routes.computing import (
    CLIENT_GONE,
    client_left,
    or_refusal,
    while_client_waits,
    within_time,
)
from lupin_bridge.routes.tools import NEVER_KEEP, NOT_REMEMBERED, bridge_of, read_route
from lupin_bridge.serving.admission import Export
from lupin_bridge.serving.http_protocol import CONNECTION_KEY, HttpConnection
from lupin_twin.state import NANOSECONDS_PER_SECOND

log = logging.getLogger(__name__)

router = APIRouter()

_ANSWERS = {status: what for status, what in NOT_REMEMBERED.items() if status != 304}

Lots = AsyncIterator[bytes]


@read_route(
    router,
    "/api/export.csv",
    summary="Every reading and failed try of a period, as CSV",
    responses={200: {"content": {"text/csv": {"schema": {"type": "string"}}}}, **_ANSWERS},
    openapi_extra={"parameters": parameters_of(query.OfExport)},
)
async def export_route(request: Request) -> Response:
    """A row for each reading, and one without a sensor for each try that brought none.

    It is streamed: one that does not end as HTTP says it must (the last chunk) is not whole.
    """
    return await or_refusal(_export(request))


async def _export(request: Request) -> Response:
    bridge = bridge_of(request)
    now_ns = bridge.ros_time_ns
    asked = query.export(request.query_params.multi_items(), now_ns)
    end_ns = asked.end_ns or now_ns or MAX_SECONDS * NANOSECONDS_PER_SECOND
    headers = {
        **NEVER_KEEP,
        **complete.headers(bridge.source.journal(), asked.start_ns, end_ns),
        "Content-Disposition": f'attachment; filename="{table.file_name(asked, now_ns)}"',
    }
    if request.method == "HEAD":
        return Response(headers=headers, media_type=table.MEDIA_TYPE)
    client, connection = client_of(request), request.scope["state"][CONNECTION_KEY]

    def end() -> None:
        log.warning("the export of %s is slow and makes place for another one", client)
        connection.break_off()

    with ExitStack() as held:
        # What has begun cannot be refused any more: so the first rows come before the answer.
        with bridge.admission.request(client, time.monotonic()):
            export = held.enter_context(bridge.admission.export(client, time.monotonic(), end))
            write = partial(table.lines, sensors=bridge.criteria.sensors)
            lots = bridge.source.rows(
                asked.start_ns, end_ns, asked.tag_id, asked.sensor_type, write
            )
            first = await while_client_waits(request, within_time(bridge, _next(lots)))
        if first is None:
            return Response(status_code=CLIENT_GONE)
        return ExportResponse(
            bridge, export, first.lot, lots, headers, give_back=held.pop_all().close
        )


@dataclass(frozen=True, slots=True)
class _Next:
    """The next lot; None: there is none."""

    lot: bytes | None


async def _next(lots: Lots) -> _Next:
    return _Next(await anext(lots, None))


async def _close(lots: Lots) -> None:
    if isinstance(lots, AsyncGenerator):
        await lots.aclose()


class ExportResponse(Response):
    """Rows as CSV; the next lot is asked for when the socket has taken those before."""

    def __init__(
        self,
        bridge: Bridge,
        export: Export,
        first: bytes | None,
        lots: Lots,
        headers: dict[str, str],
        *,
        give_back: Callable[[], None],
    ) -> None:
        super().__init__(headers=headers, media_type=table.MEDIA_TYPE)
        del self.headers["content-length"]
        self._bridge, self._export, self._first, self._lots = bridge, export, first, lots
        self._give_back = give_back

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send it; where that fails, the connection ends so that nobody takes it for the whole."""
        request = Request(scope, receive)
        try:
            await while_client_waits(request, self._send_all(send))
        except Exception as error:
            log.warning("an export ended before its end: %s", error, exc_info=True)
            connection: HttpConnection = scope["state"][CONNECTION_KEY]
            connection.break_off()
            await client_left(request)  # or the server would complain of an answer without an end
        finally:
            self._give_back()
            await _close(self._lots)

    async def _send_all(self, send: Send) -> None:
        start: Message = {
            "type": "http.response.start",
            "status": self.status_code,
            "headers": self.raw_headers,
        }
        await send(start)
        await send(_piece(table.HEADER))
        lot = self._first
        while lot is not None:
            if lot:
                await send(_piece(lot))
                self._export.take(len(lot), time.monotonic())
            lot = (await within_time(self._bridge, _next(self._lots))).lot
        await send({"type": "http.response.body", "body": b""})


def _piece(body: bytes) -> Message:
    return {"type": "http.response.body", "body": body, "more_body": True}
