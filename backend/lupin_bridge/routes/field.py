"""Routes of fields and estimates, as JSON, PNG or NPY; and of reports on estimates."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any, Final

from annotated_types import Interval
from fastapi import APIRouter, Request, Response
from pydantic import BaseModel

from lupin_bridge import field as formats
from lupin_bridge import query_string
from lupin_bridge.access.middleware import client_of
from lupin_bridge.bridge import Bridge
from lupin_bridge.field import FORMATS, JSON, PNG, EstimateQuery, FieldFormat, FieldQuery
from lupin_bridge.judge.quantities import DAILY
from lupin_bridge.past import fields
from lupin_bridge.past.fields import Estimated, Field, Reports
from lupin_bridge.past.plans import PLAN_TAG_S
from lupin_bridge.query_string import AT, Name, needed, parameter, parameters_of, read
from lupin_bridge.routes.answers import (
    NOT_REMEMBERED,
    REFUSALS,
    ApiRoute,
    bridge_of,
    computed,
    json_response,
    list_header,
    newest_of,
    read_route,
    refusal,
    refusing,
    respond,
    respond_as_of,
    respond_past,
)
from lupin_bridge.serving.admission import Answer, ClientLimitError
from lupin_bridge.stream import estimate_schema, routes_schema, schema
from lupin_twin.core.past import PastRefused
from lupin_twin.field.engine import FieldRefused
from lupin_twin.runtime.estimates import DEFAULT_PLACES, MAX_PLACES, Report

router = APIRouter(route_class=ApiRoute)

# Daily quantities change slowly: "now" is the last whole minute.
_MINUTE_NS: Final = 60 * 1_000_000_000


@dataclass(frozen=True, slots=True)
class InFormats:
    """The routes of one answer in all formats: one for each, and one where Accept chooses.

    Refusals are those of the ROS service: they have the service's own response as body, of the type
    `model`. So `parameters` are parsed by hand.
    """

    name: str
    summary: str
    description: str
    parameters: Sequence[Any]
    model: type[BaseModel]

    def refusals(self) -> dict[int | str, dict[str, Any]]:
        """The responses other than 200, for the OpenAPI document."""
        return {
            304: {"description": "not modified: the ETag is still current"},
            400: {"model": self.model, "description": "refused; error_message has the reason"},
            429: {"model": self.model, "description": "too many requests from this client"},
            **refusing(
                {503: "the twin is missing or busy", 504: "the twin did not answer in time"}
            ),
        }

    async def or_refusal(self, answer: Awaitable[Response]) -> Response:
        """The answer, or the service's refusal."""
        try:
            return await answer
        except (FieldRefused, PastRefused) as error:
            return json_response(formats.refusal_json(self.model, str(error)), 400)
        except ClientLimitError as error:
            return json_response(formats.refusal_json(self.model, str(error)), 429, error.headers)
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
            summary=f"{self.summary}, in the format that the Accept header names",
            description=self.description,
            responses={
                200: {
                    "model": self.model,
                    "content": {each.media_type: binary for each in FORMATS if each is not JSON},
                },
                **self.refusals(),
            },
            name=self.name,
            **documented,
        )
        async def in_accepted_format(request: Request) -> Response:
            field_format = formats.negotiate(list_header(request, "accept"))
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


FIELDS: Final = InFormats(
    name="field",
    summary="The field of one sensor",
    description="""Inverse-distance-weighted from the pinned tags; unknown where no tag is near.

With `at`, it uses the tags as they were at that moment, with the current parameters. A field of the
past is never clipped to the map: the log does not have the map of that moment. Nor is one of a
daily quantity, which is made from the log.""",
    parameters=parameters_of(FieldQuery),
    model=schema.GetFieldResponse,
)


async def newest_field(bridge: Bridge, client: str, field: Field, etag: str) -> Answer:
    """A field of the newest state, which is computed in this process, and cached.

    Raises:
        AdmissionError: past a limit of the client that was the first to request it.
        TwinUnavailableError: there is no state.
        lupin_twin.field.engine.FieldRefused: a bad request.

    """
    snapshot, occupancy = newest_of(bridge), bridge.source.occupancy_map()
    cost_s = len(snapshot.tags) * PLAN_TAG_S + field.write_s(len(snapshot.tags))
    return await computed(
        *(bridge, client, etag),
        lambda stop: field.plan(snapshot, etag, occupancy).write(stop),
        cost_s,
        timed=bridge.metrics.field_seconds.time(),
    )


async def _answer(request: Request, field_format: FieldFormat | None) -> Response:
    """The field in a format; None: its quality."""
    bridge = bridge_of(request)
    source, now_ns = bridge.source, bridge.ros_time_ns
    query = read(FieldQuery, request.query_params.multi_items())
    at_ns = query_string.at_of(query.at, now_ns)
    if at_ns is None and query.sensor_type in DAILY and now_ns is not None:
        at_ns = now_ns - now_ns % _MINUTE_NS
    field = Field(at_ns, query, field_format, source.rules, bridge.criteria)
    field.check()
    if at_ns is None:
        etag, client = field.newest_etag(source.revision()), client_of(request)
        compute = partial(newest_field, bridge, client, field, etag)
        return await respond(request, etag, compute, etag)
    return await respond_as_of(request, field)


FIELDS.register(router, _answer)


@read_route(
    router,
    "/api/field/quality",
    summary="The error of the field, and the share of it that is known",
    responses={200: {"model": routes_schema.FieldQuality}, **FIELDS.refusals()},
    openapi_extra={"parameters": [p for p in FIELDS.parameters if p["name"] != "scale"]},
)
async def field_quality(request: Request) -> Response:
    """The leave-one-out error of the current readings, and the share of known cells."""
    return await FIELDS.or_refusal(_answer(request, None))


# --- the estimate of one sensor with its error ----------------------------------------------------

ESTIMATE: Final = InFormats(
    name="estimate",
    summary="The estimate of one sensor",
    description="""From all readings of one day, in space and time, with its error.

It uses the journal up to a moment, for the model too. Without `at`, that moment is the newest
reading or the last whole minute, whichever is later; the ETag changes with it.""",
    parameters=parameters_of(EstimateQuery),
    model=estimate_schema.GetEstimateResponse,
)


async def _estimate(request: Request, field_format: FieldFormat) -> Response:
    bridge = bridge_of(request)
    query = read(EstimateQuery, request.query_params.multi_items())
    if query.layer != "mean" and field_format != PNG:
        raise FieldRefused(f"layer is {query.layer!r}, but only a PNG has one")
    now_ns, source = bridge.ros_time_ns, bridge.source
    at_ns = query_string.at_of(query.at, now_ns)
    estimated = Estimated(
        *(at_ns, query, field_format, source.rules, bridge.criteria),
        day_length_s=source.world.day_length_s,
        now_ns=now_ns or 0,
    )
    estimated.check()
    if at_ns is not None:
        return await respond_as_of(request, estimated)
    newest_of(bridge)  # without a state, the time is not known
    return await respond_past(request, estimated, "estimate")


ESTIMATE.register(router, _estimate)


# --- reports --------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class QualityQuery:
    """The parameters of `/api/estimate/quality`."""

    sensor_type: Name | None = parameter("this sensor only; default: all")
    at: str | None = parameter(AT)


@dataclass(frozen=True, slots=True)
class TagsQuery:
    """The parameters of `/api/estimate/tags`."""

    sensor_type: Name = needed("name of a sensor, as in a reading")
    at: str | None = parameter(AT)


@dataclass(frozen=True, slots=True)
class AdviceQuery(TagsQuery):
    """The parameters of `/api/estimate/advice`."""

    places: Annotated[int, Interval(ge=1, le=MAX_PLACES)] = parameter(
        "maximum number of places", DEFAULT_PLACES
    )


@read_route(
    router,
    "/api/estimate/quality",
    summary="How often the estimates of each sensor were right",
    responses={**NOT_REMEMBERED, 200: {"model": estimate_schema.EstimateQualities}},
    query=QualityQuery,
)
async def quality(request: Request) -> Response:
    """Each new scan is compared with a prediction from what was known before it.

    Its own tag and those beside it are left out, which shows how accurate the estimate is between
    tags: 9 of 10 scans should lie in the predicted interval. Scans of the last day and week count,
    up to the last whole hour.
    """
    query = read(QualityQuery, request.query_params.multi_items())
    return await _reports(request, query.sensor_type, query.at, fields.quality)


@read_route(
    router,
    "/api/estimate/tags",
    summary="The expected value of each tag's newest reading, and which tags have changed",
    responses={**NOT_REMEMBERED, 200: {"model": estimate_schema.ExpectedTags}},
    query=TagsQuery,
)
async def tags(request: Request) -> Response:
    """Predicted from all other tags, and from the tag's own readings except the latest ones."""
    query = read(TagsQuery, request.query_params.multi_items())
    return await _reports(request, query.sensor_type, query.at, fields.tags)


@read_route(
    router,
    "/api/estimate/advice",
    summary="Where an additional tag would help the estimate most",
    responses={**NOT_REMEMBERED, 200: {"model": estimate_schema.Advice}},
    query=AdviceQuery,
)
async def advice(request: Request) -> Response:
    """Places on the map's free floor, the best first.

    Without a map, and with `at`, they are around the tags: the log does not have past maps.
    """
    query = read(AdviceQuery, request.query_params.multi_items())
    return await _reports(request, query.sensor_type, query.at, fields.advice, query.places)


async def _reports(
    request: Request,
    sensor_type: str | None,
    at: str | None,
    write: Callable[[Mapping[str, Report]], bytes],
    places: int | None = None,
) -> Response:
    bridge = bridge_of(request)
    source = bridge.source
    now_ns = (await source.now()).stamp_ns
    at_ns = query_string.at_of(at, now_ns)
    reports = Reports(
        *(sensor_type, at_ns, now_ns, source.world.day_length_s, bridge.criteria.sensors, write),
        max_places=places,
        occupancy=source.occupancy_map() if places and at_ns is None else None,
    )
    return await respond_past(request, reports, "estimate")
