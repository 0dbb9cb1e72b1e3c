"""The estimate of one sensor with its error, and reports of what estimates are worth."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Final, TypeVar

from annotated_types import Interval
from fastapi import APIRouter, Request, Response

from lupin_bridge.access.middleware import client_of
from lupin_bridge.bridge import Bridge
from lupin_bridge.feed.estimates import MAX_SENSORS, newest_of
from lupin_bridge.feed.source import TwinUnavailableError
from lupin_bridge.field import formats
from lupin_bridge.field import query as field_query
from lupin_bridge.field.formats import PNG, FieldFormat
from lupin_bridge.field.query import EstimateQuery
from lupin_bridge.past import query as past_query
from lupin_bridge.past.estimate import Estimated
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
)
from lupin_bridge.routes.field import InFormats, checked_request, far_off, write_s
from lupin_bridge.serving.admission import REVALIDATE, Answer, json_answer
from lupin_bridge.stream import estimate_schema, report_json
from lupin_twin.estimate.engine import EstimateRequest, cost_s
from lupin_twin.field.engine import FieldRefused
from lupin_twin.runtime.estimate_rounds import DEFAULT_PLACES, MAX_PLACES, ReportRequest
from lupin_twin.runtime.workers import SMALL_S

router = APIRouter()

ESTIMATE: Final = InFormats(
    name="estimate",
    summary="The estimate of one sensor",
    description="""From all readings of a day, in space and time, with its error.

That of now is made for the newest reading or the last whole minute of the day, whichever is
later: until then its ETag holds, unless something arrives, or a model fitted anew. Of a moment
that has passed it is made of what the log has up to then, the model too.""",
    parameters=parameters_of(EstimateQuery),
    model=estimate_schema.GetEstimateResponse,
    refusal_json=formats.estimate_refusal_json,
)


async def _answer(http: Request, field_format: FieldFormat) -> Response:
    bridge = bridge_of(http)
    query = read(EstimateQuery, http.query_params.multi_items(), FieldRefused)
    if query.layer != "mean" and field_format != PNG:
        raise FieldRefused(f"layer is {query.layer!r}, but only a PNG has one")
    at_ns = past_query.at_of(query.at, bridge.ros_time_ns)
    if at_ns is not None:
        source = bridge.source
        rules, day_length_s = source.rules(), source.day_length_s
        estimated = Estimated(
            at_ns, query, field_format, rules, None, bridge.criteria, day_length_s
        )
        estimated.check()
        return await respond_as_of(http, estimated, at_ns)
    box, cells = checked_request(bridge, query, field_format)
    request = EstimateRequest(box)
    revision = bridge.source.estimate_revision(request)
    key = (bridge.source.revision(), request, field_format.name, query.layer, query.scale)
    return await respond(
        http,
        key,
        lambda: _computed(http, request, cells, query, field_format),
        revision and _etag(revision, request, query, field_format),
    )


async def _computed(
    http: Request,
    request: EstimateRequest,
    cells: int,
    query: EstimateQuery,
    field_format: FieldFormat,
) -> Answer:
    """The estimate in a format, with its ETag, put into the cache."""
    bridge = bridge_of(http)
    max_cells = bridge.source.rules().max_grid_cells
    tags = 0 if bridge.latest is None else len(bridge.latest.snapshot.tags)
    writing_s = 2 * write_s(cells, query.scale)
    is_large = cost_s(request, tags, max_cells) + writing_s > SMALL_S
    sensor_type, sensors = query.sensor_type, bridge.criteria.sensors
    with (
        bridge.admission.computing(client_of(http), is_large=is_large),
        bridge.metrics.estimate_seconds.time(),
    ):
        result = await bridge.source.estimate(request)
        estimate = formats.within_ideal(result.estimate, sensors.named(sensor_type))
        write = partial(formats.write_estimate, layer=query.layer, scale=query.scale)
        body = await on_worker(
            bridge, lambda _: write(estimate, field_format, sensor_type, sensors), writing_s
        )
    etag = _etag(result.revision, request, query, field_format)
    metadata = formats.estimate_metadata(estimate, sensors.named(sensor_type))
    headers = field_query.headers(
        {**metadata, **far_off(bridge)}, f"{sensor_type}.{field_format.name}", "Estimate"
    )
    answer = Answer(body, field_format.media_type, {**headers, "ETag": etag, **REVALIDATE})
    bridge.cache.put(etag, answer)
    return answer


def _etag(
    revision: str, request: EstimateRequest, query: EstimateQuery, field_format: FieldFormat
) -> str:
    kind = f"estimate {field_format.name} {query.layer}"
    return field_query.etag(revision, request.box, kind, query.scale)


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

# What looking through the tags for their sensors takes for each, and what writing one.
_LOOK_TAG_S: Final = 5e-6
_WRITE_TAG_S: Final = 10e-6


@read_route(
    router,
    "/api/estimate/quality",
    summary="How often the estimates of each sensor were right",
    responses={**NOT_REMEMBERED, 200: {"model": estimate_schema.EstimateQualities}},
    openapi_extra={"parameters": parameters_of(QualityQuery)},
)
async def quality(request: Request) -> Response:
    """Each new scan is held against what all but its own tag, and those beside it, say of it.

    So it tells how right the estimate is between tags: 9 of 10 are to lie inside. Counts are by
    the hour, over the last day and week, since the twin was started.
    """

    async def body(bridge: Bridge, query: QualityQuery) -> bytes:
        names = [query.sensor_type] if query.sensor_type else await _sensors(bridge)
        reports = {name: await bridge.reports.of(ReportRequest(name)) for name in names}
        return report_json.qualities(reports)

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
        report = await bridge.reports.of(ReportRequest(sensor))
        cost_s = len(report.tags) * _WRITE_TAG_S
        return await on_worker(bridge, lambda _: report_json.tags(sensor, report), cost_s)

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
        return report_json.advice(query.sensor_type, await bridge.reports.of(wanted))

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


async def _sensors(bridge: Bridge) -> list[str]:
    if bridge.latest is None:
        raise TwinUnavailableError(NO_TWIN)
    snapshot = bridge.latest.snapshot
    newest = await on_worker(
        bridge, lambda _: newest_of(snapshot), len(snapshot.tags) * _LOOK_TAG_S
    )
    return sorted(newest)[:MAX_SENSORS]
