"""The field of one sensor, as JSON, PNG or NPY."""

from __future__ import annotations

from typing import Final

from fastapi import APIRouter, Request, Response

from lupin_bridge.access.middleware import client_of
from lupin_bridge.field import formats as field_formats
from lupin_bridge.field import query as field_query
from lupin_bridge.field.formats import JSON, FieldFormat
from lupin_bridge.field.query import FieldQuery
from lupin_bridge.judge.daily import DAILY
from lupin_bridge.judge.derived import DERIVED
from lupin_bridge.past import query as past_query
from lupin_bridge.past.as_of import FieldAsked
from lupin_bridge.past.asked import DailyField, Field
from lupin_bridge.query_string import parameters_of, read
from lupin_bridge.routes.as_of import response_as_of, response_of_moment
from lupin_bridge.routes.computing import (
    field_answer,
    is_large,
    on_worker,
    request_of,
    unless_known,
)
from lupin_bridge.routes.in_formats import InFormats
from lupin_bridge.routes.tools import JSON_TYPE, REVALIDATE, bridge_of, read_route
from lupin_bridge.serving.kept import Answer
from lupin_bridge.stream import schema
from lupin_bridge.twin.source import Told
from lupin_twin.fields import FieldRefused, FieldRequest, check_request

router = APIRouter()

# What judging a tag by its neighbours takes, roughly and at worst.
# What is made of a day's readings changes slowly: now is the last whole minute.
_MINUTE_NS: Final = 60 * 1_000_000_000
_JUDGE_TAG_S: Final = 20e-6


FIELDS: Final = InFormats(
    name="field",
    summary="The field of one sensor",
    description="""Inverse-distance-weighted from the pinned tags; not known where no tag is near.

As of a moment that has passed: of the tags as they were then, by the rules and on the map of
now.""",
    parameters=parameters_of(FieldQuery),
    model=schema.GetFieldResponse,
    refusal_json=field_formats.refusal_json,
)


async def _quality(request: Request) -> Response:
    bridge = bridge_of(request)
    query = read(FieldQuery, request.query_params.multi_items(), FieldRefused)
    at_ns = past_query.at_of(query.at, bridge.ros_time_ns)
    if at_ns is not None or query.sensor_type in DERIVED or query.sensor_type in DAILY:
        return await _as_of(request, at_ns, query, None)
    asked = request_of(bridge, query)
    check_request(asked, bridge.source.rules().max_grid_cells)
    field_query.check_scale(query, JSON, 1, 1)
    revision = bridge.source.field_revision(asked)
    tag = revision and field_query.etag(
        _revision_of_quality(revision, bridge.latest), asked, "quality", 1
    )
    key = (bridge.source.revision(), asked, "quality")
    return await unless_known(request, tag, key, lambda: _quality_answer(request, asked))


async def _answer(request: Request, field_format: FieldFormat) -> Response:
    bridge = bridge_of(request)
    source = bridge.source
    query = read(FieldQuery, request.query_params.multi_items(), FieldRefused)
    at_ns = past_query.at_of(query.at, bridge.ros_time_ns)
    # What is derived, no twin knows: it is made here, of the newest state.
    if at_ns is not None or query.sensor_type in DERIVED or query.sensor_type in DAILY:
        return await _as_of(request, at_ns, query, field_format)
    asked = request_of(bridge, query)
    max_cells = source.rules().max_grid_cells
    width, height = check_request(asked, max_cells)
    field_query.check_scale(query, field_format, width * height, max_cells)
    revision = source.field_revision(asked)
    tag = revision and field_query.etag(revision, asked, field_format.name, query.scale)
    key = (source.revision(), asked, field_format.name, query.scale)
    return await unless_known(
        request,
        tag,
        key,
        lambda: field_answer(bridge, client_of(request), asked, field_format, query.scale),
    )


async def _as_of(
    request: Request, at_ns: int | None, query: FieldQuery, field_format: FieldFormat | None
) -> Response:
    """The field as of a moment, or now, in a format; None: its quality."""
    source = bridge_of(request).source
    sensors = bridge_of(request).criteria.sensors
    asked = FieldAsked(query, source.rules(), source.occupancy_map(), sensors)
    asked.check(field_format or JSON)
    of = Field(asked, field_format)
    now_ns = bridge_of(request).ros_time_ns
    if query.sensor_type in DAILY and (at_ns is not None or now_ns is not None):
        if at_ns is None and now_ns is not None:
            at_ns = now_ns - now_ns % _MINUTE_NS
        question = DailyField(at_ns or 0, of, bridge_of(request).criteria)
        return await response_of_moment(request, question, at_ns or 0)
    return await response_as_of(request, at_ns, of)


async def _quality_answer(request: Request, asked: FieldRequest) -> Answer:
    bridge = bridge_of(request)
    rules = bridge.source.rules()
    with (
        bridge.admission.computing(client_of(request), is_large=is_large(bridge, asked)),
        bridge.metrics.field_seconds.time(),
    ):
        result = await bridge.source.field(asked)
        latest = bridge.latest
        tags = () if latest is None else latest.snapshot.tags
        sensor = bridge.criteria.sensors.named(asked.sensor_type)
        body = await on_worker(
            bridge,
            lambda should_stop: field_formats.write_quality(
                result.grid, tags, sensor, rules, should_stop
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
    return await FIELDS.refusing(_quality(request))
