"""The field of one sensor, as JSON, PNG or NPY."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable
from contextlib import ExitStack
from typing import Any

from fastapi import APIRouter, Request, Response
from starlette.types import Receive, Scope, Send

from lupin_bridge.access.middleware import client_of
from lupin_bridge.bridge import Bridge
from lupin_bridge.field import formats as field_formats
from lupin_bridge.field import query as field_query
from lupin_bridge.field.formats import JSON, NPY, PNG, FieldFormat
from lupin_bridge.field.limits import BusyError, ClientLimitError
from lupin_bridge.routes.tools import (
    JSON_TYPE,
    REVALIDATE,
    bridge_of,
    error_response,
    json_response,
    list_header,
    read_route,
)
from lupin_bridge.stream import schema
from lupin_bridge.twin.source import TwinTimeoutError, TwinUnavailableError
from lupin_twin.fields import FieldRefused, check_request, default_box
from lupin_twin.state import MAX_TEXT_LENGTH

router = APIRouter()

_NUMBER = {"type": "number"}


def _parameter(name: str, schema_: dict[str, Any], description: str, required: bool = False) -> Any:
    return {
        "name": name,
        "in": "query",
        "required": required,
        "schema": schema_,
        "description": description,
    }


# Read by hand (field_query), so that a refusal is GetField's own body; documented here.
_PARAMETERS = [
    _parameter(
        "sensor_type",
        {"type": "string", "minLength": 1, "maxLength": MAX_TEXT_LENGTH},
        "name of a sensor, as in a reading",
        True,
    ),
    _parameter(
        "resolution",
        {**_NUMBER, "exclusiveMinimum": 0, "default": field_query.DEFAULT_RESOLUTION_M},
        "m, side of a square cell",
    ),
    *(
        _parameter(name, _NUMBER, "m, map frame; without a box: all pinned tags and their reach")
        for name in field_query.BOX_NAMES
    ),
    _parameter(
        "scale",
        {"type": "integer", "minimum": 1, "maximum": 1000, "default": 1},
        "PNG only: pixels a cell along each side",
    ),
]
_BINARY = {"schema": {"type": "string", "format": "binary"}}
_REFUSALS: dict[int | str, dict[str, Any]] = {
    304: {"description": "the ETag still holds"},
    400: {"model": schema.GetFieldResponse, "description": "refused; error_message says why"},
    429: {"model": schema.GetFieldResponse, "description": "this client asks for too much"},
    503: {"model": schema.ErrorMessage, "description": "the twin is not there, or busy"},
    504: {"model": schema.ErrorMessage, "description": "the twin did not answer in time"},
}


def _register(field_format: FieldFormat) -> None:
    content = (
        {"model": schema.GetFieldResponse}
        if field_format is JSON
        else {"content": {field_format.media_type: _BINARY}}
    )

    @read_route(
        router,
        f"/api/field.{field_format.name}",
        summary=f"The field of one sensor as {field_format.name.upper()}",
        responses={200: content, **_REFUSALS},
        openapi_extra={"parameters": _PARAMETERS},
        name=f"field_{field_format.name}",
    )
    async def field_in_one_format(request: Request) -> Response:
        return await _field(request, field_format)


@read_route(
    router,
    "/api/field",
    summary="The field of one sensor, in the format that Accept asks for",
    responses={
        200: {
            "model": schema.GetFieldResponse,
            "content": {PNG.media_type: _BINARY, NPY.media_type: _BINARY},
        },
        **_REFUSALS,
        406: {"model": schema.ErrorMessage, "description": "no format that Accept allows"},
    },
    openapi_extra={"parameters": _PARAMETERS},
)
async def field(request: Request) -> Response:
    """Inverse-distance-weighted from the pinned tags; not known where no tag is near."""
    field_format = field_query.negotiate(list_header(request, "accept"))
    if field_format is None:
        types = ", ".join(known.media_type for known in field_formats.FORMATS)
        return error_response(f"Accept allows none of {types}", 406, {"Vary": "Accept"})
    response = await _field(request, field_format)
    response.headers["Vary"] = "Accept"
    return response


for _format in field_formats.FORMATS:
    _register(_format)


@read_route(
    router,
    "/api/field/quality",
    summary="How far off the field is, and how much of it is known",
    responses={200: {"model": schema.FieldQuality}, **_REFUSALS},
    openapi_extra={"parameters": _PARAMETERS[:-1]},
)
async def field_quality(request: Request) -> Response:
    """The leave-one-out error of the current readings, and the share of cells painted."""
    return await _refusing(_quality(request))


async def _field(request: Request, field_format: FieldFormat) -> Response:
    return await _refusing(_answer(bridge_of(request), request, field_format))


async def _refusing(answer: Awaitable[Response]) -> Response:
    """Wait for an answer; what stands in its way becomes the answer."""
    try:
        return await answer
    except FieldRefused as error:
        return json_response(field_formats.refusal_json(str(error)), 400)
    except ClientLimitError as error:
        return json_response(field_formats.refusal_json(str(error)), 429, error.headers)
    except BusyError as error:
        return error_response(str(error), 503, error.headers)
    except TwinTimeoutError as error:
        return error_response(str(error), 504)
    except TwinUnavailableError as error:
        return error_response(str(error), 503, {"Retry-After": "3"})


class _FieldResponse(Response):
    """An answer that lets go of its place in the limits once the client has taken it, or left."""

    let_go: Callable[[], None] | None = None

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        try:
            await super().__call__(scope, receive, send)
        finally:
            if self.let_go is not None:
                self.let_go()


async def _limited(request: Request, compute: Callable[[], Awaitable[_FieldResponse]]) -> Response:
    """Compute within the client's and everybody's limits."""
    bridge = bridge_of(request)
    limits = bridge.field_limits
    with ExitStack() as held:
        held.enter_context(limits.request(client_of(request), time.monotonic()))
        with limits.computing(), bridge.metrics.field_seconds.time():
            response = await compute()
        response.let_go = held.pop_all().close
    return response


async def _quality(request: Request) -> Response:
    bridge = bridge_of(request)
    query = field_query.parse(request.query_params.multi_items())
    asked = query.request(_box_of_all_tags(bridge))
    rules = bridge.source.rules()
    check_request(asked, rules.max_grid_cells)
    field_query.check_scale(query, JSON, 1, 1)
    tag = field_query.etag(bridge.source.revision(), asked, "quality", 1)
    if field_query.matches(list_header(request, "if-none-match"), tag):
        return Response(status_code=304, headers={"ETag": tag, **REVALIDATE})

    async def compute() -> _FieldResponse:
        result = await bridge.source.field(asked)
        tags = () if bridge.latest is None else bridge.latest.snapshot.tags
        loop = asyncio.get_running_loop()
        body = await loop.run_in_executor(
            bridge.pool, field_formats.write_quality, result.grid, tags, asked.sensor_type, rules
        )
        tag = field_query.etag(result.revision, asked, "quality", 1)
        return _FieldResponse(body, headers={"ETag": tag, **REVALIDATE}, media_type=JSON_TYPE)

    return await _limited(request, compute)


async def _answer(bridge: Bridge, request: Request, field_format: FieldFormat) -> Response:
    source = bridge.source
    query = field_query.parse(request.query_params.multi_items())
    asked = query.request(_box_of_all_tags(bridge))
    max_cells = source.rules().max_grid_cells
    width, height = check_request(asked, max_cells)
    field_query.check_scale(query, field_format, width * height, max_cells)
    known = list_header(request, "if-none-match")
    tag = field_query.etag(source.revision(), asked, field_format.name, query.scale)
    if field_query.matches(known, tag):
        return Response(status_code=304, headers={"ETag": tag, **REVALIDATE})

    async def compute() -> _FieldResponse:
        result = await source.field(asked)
        # The revision that the field was made from, which may be newer than the one just compared.
        tag = field_query.etag(result.revision, asked, field_format.name, query.scale)
        loop = asyncio.get_running_loop()
        body = await loop.run_in_executor(
            bridge.pool,
            field_formats.write,
            result.grid,
            field_format,
            asked.sensor_type,
            query.scale,
        )
        headers = field_query.headers(
            field_formats.metadata(result.grid, asked.sensor_type),
            f"{asked.sensor_type}.{field_format.name}",
        )
        headers |= {"ETag": tag, **REVALIDATE}
        return _FieldResponse(body, headers=headers, media_type=field_format.media_type)

    return await _limited(request, compute)


def _box_of_all_tags(bridge: Bridge) -> field_query.Box:
    latest = bridge.latest
    tags = () if latest is None else latest.snapshot.tags
    return default_box(
        [(tag.pose.x, tag.pose.y) for tag in tags if tag.pose is not None],
        bridge.source.rules().max_distance_m,
    )
