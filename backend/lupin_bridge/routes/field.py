"""The field of one sensor, as JSON, PNG or NPY."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Coroutine, Hashable
from typing import Any, Final

from fastapi import APIRouter, Request, Response

from lupin_bridge.bridge import Bridge
from lupin_bridge.field import formats as field_formats
from lupin_bridge.field import query as field_query
from lupin_bridge.field.formats import JSON, NPY, PNG, FieldFormat
from lupin_bridge.routes.computing import (
    LentResponse,
    computed_response,
    field_answer,
    is_large,
    kept_response,
    on_worker,
    or_refusal,
)
from lupin_bridge.routes.tools import (
    JSON_TYPE,
    REVALIDATE,
    bridge_of,
    error_response,
    json_response,
    list_header,
    read_route,
)
from lupin_bridge.serving.admission import ClientLimitError
from lupin_bridge.serving.kept import Answer
from lupin_bridge.stream import schema
from lupin_bridge.twin.source import Told
from lupin_twin.fields import FieldRefused, FieldRequest, check_request, default_box
from lupin_twin.state import MAX_TEXT_LENGTH

router = APIRouter()

_NUMBER = {"type": "number"}

# What judging a tag by its neighbours takes, roughly and at worst.
_JUDGE_TAG_S: Final = 20e-6


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

    async def as_get_field_does() -> Response:
        try:
            return await answer
        except FieldRefused as error:
            return json_response(field_formats.refusal_json(str(error)), 400)
        except ClientLimitError as error:
            return json_response(field_formats.refusal_json(str(error)), 429, error.headers)

    return await or_refusal(as_get_field_does())


async def _quality(request: Request) -> Response:
    bridge = bridge_of(request)
    query = field_query.parse(request.query_params.multi_items())
    asked = query.request(_box_of_all_tags(bridge))
    check_request(asked, bridge.source.rules().max_grid_cells)
    field_query.check_scale(query, JSON, 1, 1)
    revision = bridge.source.field_revision(asked)
    tag = revision and field_query.etag(
        _revision_of_quality(revision, bridge.latest), asked, "quality", 1
    )
    key = (bridge.source.revision(), asked, "quality")
    return await _unless_known(request, tag, key, lambda: _quality_answer(bridge, asked))


async def _answer(bridge: Bridge, request: Request, field_format: FieldFormat) -> Response:
    source = bridge.source
    query = field_query.parse(request.query_params.multi_items())
    asked = query.request(_box_of_all_tags(bridge))
    max_cells = source.rules().max_grid_cells
    width, height = check_request(asked, max_cells)
    field_query.check_scale(query, field_format, width * height, max_cells)
    revision = source.field_revision(asked)
    tag = revision and field_query.etag(revision, asked, field_format.name, query.scale)
    key = (source.revision(), asked, field_format.name, query.scale)
    return await _unless_known(
        request, tag, key, lambda: field_answer(bridge, asked, field_format, query.scale)
    )


async def _unless_known(
    request: Request,
    tag: str | None,
    key: Hashable,
    compute: Callable[[], Coroutine[Any, Any, Answer]],
) -> Response:
    """304 for who has the answer, which `tag` names where that is known without computing."""
    if tag is not None:
        if _has(request, tag):
            return _not_modified(tag)
        kept = kept_response(bridge_of(request), tag)
        if kept is not None:
            return kept
    response = await computed_response(request, key, compute)
    made = response.headers.get("etag")
    if made is not None and _has(request, made):
        if isinstance(response, LentResponse) and response.give_back is not None:
            response.give_back()
        return _not_modified(made)
    return response


def _has(request: Request, tag: str) -> bool:
    return field_query.matches(list_header(request, "if-none-match"), tag)


def _not_modified(tag: str) -> Response:
    return Response(status_code=304, headers={"ETag": tag, **REVALIDATE})


async def _quality_answer(bridge: Bridge, asked: FieldRequest) -> Answer:
    rules = bridge.source.rules()
    with (
        bridge.admission.computing(is_large=is_large(bridge, asked)),
        bridge.metrics.field_seconds.time(),
    ):
        result = await bridge.source.field(asked)
        latest = bridge.latest
        tags = () if latest is None else latest.snapshot.tags
        body = await on_worker(
            bridge,
            lambda should_stop: field_formats.write_quality(
                result.grid, tags, asked.sensor_type, rules, should_stop
            ),
            len(tags) * _JUDGE_TAG_S,
        )
    tag = field_query.etag(_revision_of_quality(result.revision, latest), asked, "quality", 1)
    answer = Answer(body, JSON_TYPE, {"ETag": tag, **REVALIDATE})
    bridge.kept.put(tag, answer)
    return answer


def _revision_of_quality(field_revision: str, latest: Told | None) -> str:
    """Of both that it is made of: the tags' state comes on a way of its own."""
    return f"{field_revision} {'' if latest is None else latest.revision}"


def _box_of_all_tags(bridge: Bridge) -> field_query.Box:
    latest = bridge.latest
    tags = () if latest is None else latest.snapshot.tags
    return default_box(
        [(tag.pose.x, tag.pose.y) for tag in tags if tag.pose is not None],
        bridge.source.rules().max_distance_m,
    )
