"""What the judge says, and the ranges that it goes by."""

from __future__ import annotations

from hashlib import blake2b

from fastapi import APIRouter, Request, Response

from lupin_bridge.field import query as field_query
from lupin_bridge.past import query as past_query
from lupin_bridge.past.asked import Health
from lupin_bridge.query_string import parameters_of
from lupin_bridge.routes.as_of import response_of_moment
from lupin_bridge.routes.computing import kept_or_computed, or_refusal
from lupin_bridge.routes.tools import (
    JSON_TYPE,
    NEVER_KEEP,
    NOT_REMEMBERED,
    REVALIDATE,
    bridge_of,
    error_response,
    json_response,
    list_header,
    read_route,
)
from lupin_bridge.serving.kept import Answer
from lupin_bridge.stream import schema

router = APIRouter()


@read_route(
    router,
    "/api/health",
    summary="The status of the greenhouse and of each tag, and why",
    responses={
        **NOT_REMEMBERED,
        200: {"model": schema.Judgement},
        503: {"model": schema.ErrorMessage, "description": "no twin was found yet, or it is busy"},
    },
    openapi_extra={"parameters": parameters_of(past_query.OfMoment)},
)
async def health(request: Request) -> Response:
    """The verdicts that stand in the frames of `/ws/state`, with the reasons for each.

    As of a moment that has passed, what was known then is judged by the ranges of now, and by the
    scans of each tag up to then; a reason's `since` is the observation of then that says so.
    """
    return await or_refusal(_health(request))


async def _health(request: Request) -> Response:
    bridge = bridge_of(request)
    at_ns = past_query.at(request.query_params.multi_items(), bridge.ros_time_ns)
    if at_ns is not None:
        return await response_of_moment(request, Health(at_ns, bridge.criteria), at_ns)
    if bridge.latest is None:
        return error_response("no twin has been heard yet", 503)
    judged = bridge.judged

    async def compute() -> Answer:
        return Answer(bridge.frames.health.whole(judged), JSON_TYPE, NEVER_KEEP)

    key = ("health", judged.number, bridge.status.is_live)
    return await kept_or_computed(request, key, compute)


@read_route(
    router,
    "/api/sensors",
    summary="The file of sensors that is in force: labels, units, colours, ranges",
    responses={200: {"content": {"application/json": {"schema": {"type": "object"}}}}},
)
async def sensors(request: Request) -> Response:
    """`sensors.json`, or the file that the operator gave instead, as it stands."""
    body = bridge_of(request).criteria.sensors.text.encode()
    tag = f'"{blake2b(body, digest_size=12).hexdigest()}"'
    if field_query.matches(list_header(request, "if-none-match"), tag):
        return Response(status_code=304, headers={"ETag": tag, **REVALIDATE})
    return json_response(body, headers={"ETag": tag, **REVALIDATE})
