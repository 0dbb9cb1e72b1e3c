"""The field of one sensor as JSON, PNG or NPY, and the routes that answer in every format."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

from fastapi import APIRouter, Request, Response
from pydantic import BaseModel

from lupin_bridge.access.middleware import client_of
from lupin_bridge.bridge import Bridge
from lupin_bridge.feed.source import TwinUpdate
from lupin_bridge.field import formats
from lupin_bridge.field import query as field_query
from lupin_bridge.field.formats import FORMATS, JSON, FieldFormat
from lupin_bridge.field.query import FieldQuery
from lupin_bridge.judge.derived import DAILY, DERIVED
from lupin_bridge.past import query as past_query
from lupin_bridge.past.plans import JUDGE_TAG_S, WRITE_CELL_S, Field
from lupin_bridge.query_string import parameters_of, read
from lupin_bridge.routes.answers import (
    NOT_REMEMBERED,
    REFUSALS,
    bridge_of,
    error_response,
    json_response,
    list_header,
    on_worker,
    read_route,
    refusal,
    respond,
    respond_as_of,
    respond_newest,
)
from lupin_bridge.serving.admission import REVALIDATE, Answer, ClientLimitError
from lupin_bridge.stream import schema
from lupin_twin.core.past import PastRefused
from lupin_twin.core.state import TagState
from lupin_twin.field.engine import (
    FieldRefused,
    FieldRequest,
    check_request,
    cost_s,
    default_box,
)
from lupin_twin.field.grid import far_off_tags
from lupin_twin.runtime.workers import SMALL_S

router = APIRouter()

# Quantities of a day change slowly: now is the last whole minute.
_MINUTE_NS: Final = 60 * 1_000_000_000


@dataclass(frozen=True, slots=True)
class InFormats:
    """An answer in every format: a route for each, and one where Accept chooses.

    It is refused as the ROS service refuses it. So `parameters` are read by hand, and a refusal has
    the service's own body (`refusal_json`); `model` is that body's type.
    """

    name: str
    summary: str
    description: str
    parameters: Sequence[Any]
    model: type[BaseModel]
    refusal_json: Callable[[str], bytes]

    def refusals(self) -> dict[int | str, dict[str, Any]]:
        """What stands in the way of an answer, for the OpenAPI document."""
        return {
            304: {"description": "the ETag still holds"},
            400: {"model": self.model, "description": "refused; error_message says why"},
            429: {"model": self.model, "description": "this client asks for too much"},
            404: NOT_REMEMBERED[404],
            503: {"model": schema.ErrorMessage, "description": "the twin is not there, or busy"},
            504: {"model": schema.ErrorMessage, "description": "the twin did not answer in time"},
        }

    async def or_refusal(self, answer: Awaitable[Response]) -> Response:
        """The answer, or the service's refusal."""
        try:
            return await answer
        except (FieldRefused, PastRefused) as error:
            return json_response(self.refusal_json(str(error)), 400)
        except ClientLimitError as error:
            return json_response(self.refusal_json(str(error)), 429, error.headers)
        except REFUSALS as error:
            return refusal(error)

    def register(
        self, router: APIRouter, answer: Callable[[Request, FieldFormat], Awaitable[Response]]
    ) -> None:
        """Add `/api/<name>` and `/api/<name>.<format>`; `answer` may raise refusals."""
        documented: dict[str, Any] = {"openapi_extra": {"parameters": list(self.parameters)}}
        binary = {"schema": {"type": "string", "format": "binary"}}

        @read_route(
            router,
            f"/api/{self.name}",
            summary=f"{self.summary}, in the format that Accept asks for",
            description=self.description,
            responses={
                200: {
                    "model": self.model,
                    "content": {each.media_type: binary for each in FORMATS if each is not JSON},
                },
                **self.refusals(),
                406: {"model": schema.ErrorMessage, "description": "no format that Accept allows"},
            },
            name=self.name,
            **documented,
        )
        async def in_accepted_format(request: Request) -> Response:
            field_format = field_query.negotiate(list_header(request, "accept"))
            if field_format is None:
                types = ", ".join(known.media_type for known in FORMATS)
                return error_response(f"Accept allows none of {types}", 406, {"Vary": "Accept"})
            response = await self.or_refusal(answer(request, field_format))
            response.headers["Vary"] = "Accept"
            return response

        def in_one(field_format: FieldFormat) -> None:
            content = {"content": {field_format.media_type: binary}}

            @read_route(
                router,
                f"/api/{self.name}.{field_format.name}",
                summary=f"{self.summary} as {field_format.name.upper()}",
                responses={
                    200: {"model": self.model} if field_format is JSON else content,
                    **self.refusals(),
                },
                name=f"{self.name}_{field_format.name}",
                **documented,
            )
            async def in_one_format(request: Request) -> Response:
                return await self.or_refusal(answer(request, field_format))

        for field_format in FORMATS:
            in_one(field_format)


def is_large(bridge: Bridge, request: FieldRequest, scale: int = 1) -> bool:
    """Whether a field may take long: as if every tag had a reading and none was cached.

    Raises:
        lupin_twin.field.engine.FieldRefused: a bad request.

    """
    tags, rules = len(_tags(bridge)), bridge.source.rules()
    width, height = check_request(request, rules.max_grid_cells)
    return cost_s(request, tags, rules) + write_s(width * height, scale) > SMALL_S


def write_s(cells: int, scale: int) -> float:
    """The cost of writing cells, s of one core."""
    return cells * scale**2 * WRITE_CELL_S


def request_of(bridge: Bridge, query: FieldQuery) -> FieldRequest:
    """The request for GetField; the default box is that of the tags, and their reach."""
    rules = bridge.source.rules()
    places = [(tag.pose.x, tag.pose.y) for tag in _tags(bridge) if tag.pose is not None]
    return query.request(default_box(places, rules.max_distance_m), rules.max_grid_cells)


def checked_request(
    bridge: Bridge, query: FieldQuery, field_format: FieldFormat
) -> tuple[FieldRequest, int]:
    """`request_of`, and how many cells it has.

    Raises:
        lupin_twin.field.engine.FieldRefused: a bad request.

    """
    request, max_cells = request_of(bridge, query), bridge.source.rules().max_grid_cells
    width, height = check_request(request, max_cells)
    field_query.check_scale(query, field_format, width * height, max_cells)
    return request, width * height


def far_off(bridge: Bridge) -> dict[str, str]:
    """How many tags are too far off for a default box, as a field's metadata."""
    return formats.far_off(far_off_tags(_tags(bridge)))


def _tags(bridge: Bridge) -> tuple[TagState, ...]:
    return () if bridge.latest is None else bridge.latest.snapshot.tags


async def field_answer(
    bridge: Bridge, client: str, request: FieldRequest, field_format: FieldFormat, scale: int = 1
) -> Answer:
    """The field in a format, with its ETag, put into the cache; `client` was the first to ask.

    Raises:
        lupin_twin.field.engine.FieldRefused: a bad request.
        BusyError: one computation too many.
        TwinUnavailableError: no twin computes it.

    """
    sensors = bridge.criteria.sensors
    with (
        bridge.admission.computing(client, is_large=is_large(bridge, request, scale)),
        bridge.metrics.field_seconds.time(),
    ):
        result = await bridge.source.field(request)
        # The revision that the field was made from, which may be newer than that of the request.
        etag = field_query.etag(result.revision, request, field_format.name, scale)
        grid = result.grid
        body = await on_worker(
            bridge,
            lambda _: formats.write(grid, field_format, request.sensor_type, sensors, scale),
            write_s(grid.width * grid.height, scale),
        )
    headers = field_query.headers(
        {**formats.metadata(grid, sensors.named(request.sensor_type)), **far_off(bridge)},
        f"{request.sensor_type}.{field_format.name}",
    )
    answer = Answer(body, field_format.media_type, {**headers, "ETag": etag, **REVALIDATE})
    bridge.cache.put(etag, answer)
    return answer


FIELDS: Final = InFormats(
    name="field",
    summary="The field of one sensor",
    description="""Inverse-distance-weighted from the pinned tags; not known where no tag is near.

As of a moment that has passed: of the tags as they were then, by the rules and on the map of
now.""",
    parameters=parameters_of(FieldQuery),
    model=schema.GetFieldResponse,
    refusal_json=formats.refusal_json,
)


async def _answer(http: Request, field_format: FieldFormat | None) -> Response:
    """The field in a format; None: its quality."""
    bridge = bridge_of(http)
    source = bridge.source
    query = read(FieldQuery, http.query_params.multi_items(), FieldRefused)
    at_ns = past_query.at_of(query.at, bridge.ros_time_ns)
    # The twin knows no derived quantity: it is computed here, from the newest state.
    if at_ns is not None or query.sensor_type in DERIVED or query.sensor_type in DAILY:
        return await _as_of(http, at_ns, query, field_format)
    request, _ = checked_request(bridge, query, field_format or JSON)
    revision = source.field_revision(request)
    if field_format is None:
        etag = revision and _quality_etag(revision, bridge.latest, request)
        key: tuple[Any, ...] = (source.revision(), request, "quality")
        return await respond(http, key, lambda: _quality_answer(http, request), etag)
    etag = revision and field_query.etag(revision, request, field_format.name, query.scale)
    key = (source.revision(), request, field_format.name, query.scale)
    return await respond(
        http,
        key,
        lambda: field_answer(bridge, client_of(http), request, field_format, query.scale),
        etag,
    )


async def _as_of(
    request: Request, at_ns: int | None, query: FieldQuery, field_format: FieldFormat | None
) -> Response:
    bridge = bridge_of(request)
    source, now_ns = bridge.source, bridge.ros_time_ns
    if at_ns is None and query.sensor_type in DAILY and now_ns is not None:
        at_ns = now_ns - now_ns % _MINUTE_NS
    field = Field(
        at_ns, query, field_format, source.rules(), source.occupancy_map(), bridge.criteria
    )
    field.check()
    if at_ns is None:
        return await respond_newest(request, field)
    return await respond_as_of(request, field, at_ns)


async def _quality_answer(http: Request, request: FieldRequest) -> Answer:
    bridge = bridge_of(http)
    rules = bridge.source.rules()
    with (
        bridge.admission.computing(client_of(http), is_large=is_large(bridge, request)),
        bridge.metrics.field_seconds.time(),
    ):
        result = await bridge.source.field(request)
        latest, tags = bridge.latest, _tags(bridge)
        sensor = bridge.criteria.sensors.named(request.sensor_type)
        body = await on_worker(
            bridge,
            lambda should_stop: formats.write_quality(
                result.grid, tags, sensor, rules, should_stop
            ),
            len(tags) * JUDGE_TAG_S,
        )
    etag = _quality_etag(result.revision, latest, request)
    answer = Answer(body, "application/json", {"ETag": etag, **REVALIDATE})
    bridge.cache.put(etag, answer)
    return answer


def _quality_etag(field_revision: str, latest: TwinUpdate | None, request: FieldRequest) -> str:
    """Of field and state: each comes on a way of its own."""
    both = f"{field_revision} {'' if latest is None else latest.revision}"
    return field_query.etag(both, request, "quality", 1)


FIELDS.register(router, _answer)


@read_route(
    router,
    "/api/field/quality",
    summary="How far off the field is, and how much of it is known",
    responses={200: {"model": schema.FieldQuality}, **FIELDS.refusals()},
    openapi_extra={"parameters": [p for p in FIELDS.parameters if p["name"] != "scale"]},
)
async def field_quality(request: Request) -> Response:
    """The leave-one-out error of the current readings, and the share of cells painted."""
    return await FIELDS.or_refusal(_answer(request, None))
