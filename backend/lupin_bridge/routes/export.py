"""Every row of a period, streamed as CSV or Parquet: of one site, or of many in a fleet."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import AsyncGenerator, Callable, Mapping, Sequence
from contextlib import ExitStack, aclosing
from functools import partial
from importlib.util import find_spec
from typing import Any, Protocol, TypeVar

from fastapi import APIRouter, Request, Response
from starlette.responses import StreamingResponse
from starlette.types import Receive, Scope, Send

from lupin_bridge.access.middleware import client_of
from lupin_bridge.feed.source import TwinUnavailableError
from lupin_bridge.judge.judging import Criteria
from lupin_bridge.past import bodies
from lupin_bridge.past.export import Csv, Parquet
from lupin_bridge.query_string import MAX_SECONDS, OfExport, read
from lupin_bridge.routes.answers import (
    CLIENT_DISCONNECTED,
    NEVER_STORE,
    NOT_REMEMBERED,
    ApiRoute,
    Refused,
    bridge_of,
    client_left,
    read_route,
    refusing,
    while_client_waits,
    within_time,
)
from lupin_bridge.serving.admission import Admission, Limits
from lupin_bridge.serving.connections import CONNECTION_KEY, HttpConnection
from lupin_twin.core.past import NotRemembered, PastRefused, PastRow
from lupin_twin.core.state import NANOSECONDS_PER_SECOND
from lupin_twin.runtime.workers import Workers

log = logging.getLogger(__name__)

router = APIRouter(route_class=ApiRoute)

_ANSWERS = {status: what for status, what in NOT_REMEMBERED.items() if status != 304}
# Worst-case time to import a package, or to write a group of rows, s.
_WRITE_S = 0.5
# After the last lot.
_END: Any = object()
# The packed rows of an export, in lots.
Lots = AsyncGenerator[bytes]
Pack = Callable[[Sequence[PastRow]], bytes]
Format = type[Csv] | type[Parquet]
ResultT = TypeVar("ResultT")


class Exporting(Protocol):
    """What has rows to export: a bridge, or the fleet."""

    limits: Limits
    admission: Admission
    criteria: Criteria
    workers: Workers


def _content(media_type: str) -> dict[str, Any]:
    return {"content": {media_type.partition(";")[0]: {"schema": {"type": "string"}}}}


@read_route(
    router,
    "/api/export.csv",
    summary="Every reading and failed attempt of a period, as CSV",
    responses={200: _content(Csv.media_type), **_ANSWERS},
    query=OfExport,
)
async def csv_route(request: Request) -> Response:
    """One row for each reading, and one without a sensor for each attempt that got no reading.

    The answer is streamed: without the final HTTP chunk, it is incomplete.
    """
    return await _of_site(request, Csv)


@read_route(
    router,
    "/api/export.parquet",
    summary="The same rows as Parquet, with units and coordinates",
    responses={
        200: _content(Parquet.media_type),
        **_ANSWERS,
        **refusing({501: "the extra `science` is not installed"}),
    },
    query=OfExport,
)
async def parquet_route(request: Request) -> Response:
    """The columns of the CSV; `time` is a timestamp. Columns carry metadata."""
    return await _of_site(request, Parquet)


async def _of_site(request: Request, kind: Format) -> Response:
    bridge = bridge_of(request)
    now_ns = bridge.ros_time_ns
    given = read(OfExport, request.query_params.multi_items())
    start_ns, end_ns = span_of(given, now_ns)
    known = bodies.period_headers(bridge.source.journal(), start_ns, end_ns)

    def rows(pack: Pack) -> Lots:
        return bridge.source.rows(start_ns, end_ns, given.tag_id, given.sensor_type, pack)

    return await respond_export(request, bridge, rows, kind, given, now_ns=now_ns, known=known)


def span_of(given: OfExport, now_ns: int | None) -> tuple[int, int]:
    """Start and end of the period, ns of ROS time."""
    start_ns, end_ns = given.span(now_ns)
    # A reading with the stamp of now counts as past: the clock may be paused at it.
    until_ns = MAX_SECONDS * NANOSECONDS_PER_SECOND if now_ns is None else now_ns + 1
    return start_ns, end_ns or until_ns


async def respond_export(
    request: Request,
    of: Exporting,
    rows: Callable[[Pack], Lots],
    kind: Format,
    given: OfExport,
    *,
    now_ns: int | None,
    known: Mapping[str, str],
    has_site: bool = False,
) -> Response:
    """Stream what `rows` yields, in a format; `known` are headers on how far it is complete."""
    name = bodies.export_file_name(given, now_ns, kind.name)
    headers = {
        **NEVER_STORE, **known, "Content-Disposition": f'attachment; filename="{name}"',
    }  # fmt: skip
    if kind is Parquet and find_spec("pyarrow") is None:
        why = "Parquet needs pyarrow: pip install 'lupin-twin[science]'; CSV needs nothing"
        raise Refused(why, 501)
    if request.method == "HEAD":
        return Response(headers=headers, media_type=kind.media_type)
    sensors = of.criteria.sensors
    client, connection = client_of(request), request.scope["state"][CONNECTION_KEY]

    def evict() -> None:
        log.warning("the export of %s is old and is ended for another one", client)
        connection.dismiss()

    with ExitStack() as held:
        # A response that has begun cannot be refused any more: so the first rows are read before.
        with of.admission.request(client, time.monotonic()):
            held.enter_context(of.admission.export(client, time.monotonic(), evict))
            lots = rows(partial(kind.pack, sensors=sensors))
            lot = await while_client_waits(request, within_time(of.limits, anext(lots, _END)))
        if lot is None:
            return Response(status_code=CLIENT_DISCONNECTED)
        parts = _parts(of, kind, partial(kind, sensors, given.sensor_type, has_site), lot, lots)
        return ExportResponse(
            parts, headers=headers, media_type=kind.media_type, release=held.pop_all().close
        )


async def _parts(
    of: Exporting, kind: Format, make: Callable[[], Csv | Parquet], lot: bytes, lots: Lots
) -> Lots:
    """Yield the parts to send; the next lot is read once the part before has been sent."""
    async with aclosing(lots):
        writer = await _written(of, kind, make)
        yield writer.begin()
        while lot is not _END:
            yield await _written(of, kind, partial(writer.add, lot))
            lot = await within_time(of.limits, anext(lots, _END))
        yield await _written(of, kind, writer.end)


async def _written(of: Exporting, kind: Format, write: Callable[[], ResultT]) -> ResultT:
    """The result of `write`, on a worker; CSV is passed on unchanged, which takes no time."""
    if kind is Csv:
        return write()
    return await asyncio.wrap_future(of.workers.submit(lambda _: write(), _WRITE_S))


class ExportResponse(StreamingResponse):
    """Sends each part when the socket has taken the one before, and calls `release` at the end."""

    def __init__(
        self, parts: Lots, release: Callable[[], None], headers: dict[str, str], media_type: str
    ) -> None:
        super().__init__(parts, headers=headers, media_type=media_type)
        self._parts = parts
        self._release = release

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send the parts; on failure, break the connection: the client must see that parts miss."""
        request = Request(scope, receive)
        try:
            await while_client_waits(request, self.stream_response(send))
        except Exception as error:
            is_known = isinstance(error, (NotRemembered, PastRefused, TwinUnavailableError))
            log.warning("an export ended early: %s", error, exc_info=not is_known)
            connection: HttpConnection = scope["state"][CONNECTION_KEY]
            connection.dismiss()
            await client_left(request)  # or the server would log an answer without an end
        finally:
            self._release()
            await self._parts.aclose()
