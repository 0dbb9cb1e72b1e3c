"""What estimates are worth: how often they were right, who is off, where another tag helps."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from hashlib import blake2b
from typing import Annotated, Any, Final, TypeVar

from annotated_types import Interval
from fastapi import APIRouter, Request, Response

from lupin_bridge.access.middleware import client_of
from lupin_bridge.bridge import Bridge
from lupin_bridge.estimates.following import MAX_SENSORS, newest_of
from lupin_bridge.query_string import Name, needed, parameter, parameters_of, read
from lupin_bridge.routes.computing import on_worker, or_refusal, unless_known
from lupin_bridge.routes.tools import (
    JSON_TYPE,
    NOT_REMEMBERED,
    REVALIDATE,
    bridge_of,
    error_response,
    read_route,
)
from lupin_bridge.serving.kept import Answer
from lupin_bridge.stream import estimate_schema, report_json
from lupin_bridge.twin.source import TwinUnavailableError
from lupin_twin.estimate_report import DEFAULT_PLACES, MAX_PLACES, ReportRequest
from lupin_twin.fields import FieldRefused

router = APIRouter()


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

    return await _answer(request, QualityQuery, body)


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

    return await _answer(request, TagsQuery, body)


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
        asked = ReportRequest(query.sensor_type, query.places)
        return report_json.advice(query.sensor_type, await bridge.reports.of(asked))

    return await _answer(request, AdviceQuery, body)


Body = Callable[[Bridge, QueryT], Awaitable[bytes]]


async def _answer(request: Request, kind: type[QueryT], body: Body[QueryT]) -> Response:
    async def answer() -> Response:
        try:
            query = read(kind, request.query_params.multi_items(), FieldRefused)
            return await unless_known(request, None, query, lambda: _made(request, query, body))
        except FieldRefused as error:
            return error_response(str(error), 400)

    return await or_refusal(answer())


async def _made(request: Request, query: QueryT, body: Body[QueryT]) -> Answer:
    bridge = bridge_of(request)
    with bridge.admission.computing(client_of(request), is_large=True):
        text = await body(bridge, query)
    headers: dict[str, Any] = {"ETag": f'"{blake2b(text, digest_size=12).hexdigest()}"'}
    return Answer(text, JSON_TYPE, {**headers, **REVALIDATE})


async def _sensors(bridge: Bridge) -> list[str]:
    if bridge.latest is None:
        raise TwinUnavailableError("no twin has been heard yet")
    snapshot = bridge.latest.snapshot
    newest = await on_worker(
        bridge, lambda _: newest_of(snapshot), len(snapshot.tags) * _LOOK_TAG_S
    )
    return sorted(newest)[:MAX_SENSORS]
