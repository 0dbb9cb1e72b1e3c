"""The estimate of one sensor with its error, and reports of what estimates are worth."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Annotated, Final, TypeVar

from annotated_types import Interval
from fastapi import APIRouter, Request, Response

from lupin_bridge.access.middleware import client_of
from lupin_bridge.bridge import Bridge
from lupin_bridge.feed.estimates import sensors_of
from lupin_bridge.feed.source import TwinUnavailableError
from lupin_bridge.field import formats
from lupin_bridge.field.formats import PNG, FieldFormat
from lupin_bridge.field.query import EstimateQuery
from lupin_bridge.past import query as past_query
from lupin_bridge.past.fields import Estimated
from lupin_bridge.query_string import Name, needed, parameter, parameters_of, read
from lupin_bridge.routes.answers import (
    NO_TWIN,
    NOT_REMEMBERED,
    bridge_of,
    error_response,
    on_worker,
    read_route,
    respond,
    respond_as_of,
    respond_past,
)
from lupin_bridge.routes.field import InFormats
from lupin_bridge.serving.admission import Answer, json_answer
from lupin_bridge.stream import estimate_schema
from lupin_twin.field.engine import FieldRefused
from lupin_twin.runtime.estimates import DEFAULT_PLACES, MAX_PLACES, ReportRequest

router = APIRouter()

ESTIMATE: Final = InFormats(
    name="estimate",
    summary="The estimate of one sensor",
    description="""From all readings of a day, in space and time, with its error.

Made of what the log has up to a moment, the model too. That of now is made for the newest reading
or the last whole minute of the day, whichever is later: until then its ETag holds.""",
    parameters=parameters_of(EstimateQuery),
    model=estimate_schema.GetEstimateResponse,
    refusal_json=formats.estimate_refusal_json,
)


async def _answer(request: Request, field_format: FieldFormat) -> Response:
    bridge = bridge_of(request)
    query = read(EstimateQuery, request.query_params.multi_items(), FieldRefused)
    if query.layer != "mean" and field_format != PNG:
        raise FieldRefused(f"layer is {query.layer!r}, but only a PNG has one")
    now_ns, source = bridge.ros_time_ns, bridge.source
    at_ns = past_query.at_of(query.at, now_ns)
    estimated = Estimated(
        *(at_ns, query, field_format, source.rules, None, bridge.criteria),
        day_length_s=source.world.day_length_s,
        now_ns=now_ns or 0,
    )
    estimated.check()
    if at_ns is not None:
        return await respond_as_of(request, estimated, at_ns)
    if now_ns is None:
        raise TwinUnavailableError(NO_TWIN)
    return await respond_past(request, estimated, "estimate")


ESTIMATE.register(router, _answer)


# --- reports --------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class QualityQuery:
    """The parameters of `/api/estimate/quality`."""

    sensor_type: Name | None = parameter("of this sensor alone; default: of every one")


@dataclass(frozen=True, slots=True)
class TagsQuery:
    """The parameters of `/api/estimate/tags`."""

    sensor_type: Name = needed("name of a sensor, as in a reading")


@dataclass(frozen=True, slots=True)
class AdviceQuery(TagsQuery):
    """The parameters of `/api/estimate/advice`."""

    places: Annotated[int, Interval(ge=1, le=MAX_PLACES)] = parameter(
        "at most so many places", DEFAULT_PLACES
    )


QueryT = TypeVar("QueryT", QualityQuery, TagsQuery, AdviceQuery)

# What writing a tag takes.
_WRITE_TAG_S: Final = 10e-6


@read_route(
    router,
    "/api/estimate/quality",
    summary="How often the estimates of each sensor were right",
    responses={**NOT_REMEMBERED, 200: {"model": estimate_schema.EstimateQualities}},
    openapi_extra={"parameters": parameters_of(QualityQuery)},
)
async def quality(request: Request) -> Response:
    """Each new scan is compared with the prediction from all tags but its own and those beside it.

    So it shows how right the estimate is between tags: 9 of 10 are to lie inside. Counts are by
    the hour, over the last day and week, since the twin was started.
    """

    async def body(bridge: Bridge, query: QualityQuery) -> bytes:
        names = [query.sensor_type] if query.sensor_type else _sensors(bridge)
        reports = {name: await bridge.source.estimate_report(ReportRequest(name)) for name in names}
        return estimate_schema.qualities(reports)

    return await _report(request, QualityQuery, body)


@read_route(
    router,
    "/api/estimate/tags",
    summary="What was expected of each tag's newest reading, and which tags have changed",
    responses={**NOT_REMEMBERED, 200: {"model": estimate_schema.ExpectedTags}},
    openapi_extra={"parameters": parameters_of(TagsQuery)},
)
async def tags(request: Request) -> Response:
    """By all other tags, and by the tag's own readings but for its last ones."""

    async def body(bridge: Bridge, query: TagsQuery) -> bytes:
        sensor = query.sensor_type
        report = await bridge.source.estimate_report(ReportRequest(sensor))
        cost_s = len(report.tags) * _WRITE_TAG_S
        return await on_worker(bridge, lambda _: estimate_schema.tags(sensor, report), cost_s)

    return await _report(request, TagsQuery, body)


@read_route(
    router,
    "/api/estimate/advice",
    summary="Where another tag helps the estimate most",
    responses={**NOT_REMEMBERED, 200: {"model": estimate_schema.Advice}},
    openapi_extra={"parameters": parameters_of(AdviceQuery)},
)
async def advice(request: Request) -> Response:
    """Of the free floor on the map, or about the tags without one; the best place first."""

    async def body(bridge: Bridge, query: AdviceQuery) -> bytes:
        wanted = ReportRequest(query.sensor_type, query.places)
        return estimate_schema.advice(
            query.sensor_type, await bridge.source.estimate_report(wanted)
        )

    return await _report(request, AdviceQuery, body)


Body = Callable[[Bridge, QueryT], Awaitable[bytes]]


async def _report(request: Request, kind: type[QueryT], body: Body[QueryT]) -> Response:
    bridge = bridge_of(request)
    try:
        query = read(kind, request.query_params.multi_items(), FieldRefused)
    except FieldRefused as error:
        return error_response(str(error), 400)

    async def compute() -> Answer:
        with bridge.admission.computing(client_of(request), is_large=True):
            return json_answer(await body(bridge, query))

    return await respond(request, query, compute)


def _sensors(bridge: Bridge) -> list[str]:
    if bridge.latest is None:
        raise TwinUnavailableError(NO_TWIN)
    return sensors_of(bridge.latest.snapshot)
