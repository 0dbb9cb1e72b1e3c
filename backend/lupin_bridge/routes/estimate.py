"""The estimate of one sensor, with how sure it is, as JSON, PNG or NPY."""

from __future__ import annotations

from typing import Final

from fastapi import APIRouter, Request, Response

from lupin_bridge.access.middleware import client_of
from lupin_bridge.field import estimate_formats
from lupin_bridge.field import query as field_query
from lupin_bridge.field.formats import PNG, FieldFormat
from lupin_bridge.field.query import EstimateQuery
from lupin_bridge.past import complete
from lupin_bridge.past import query as past_query
from lupin_bridge.query_string import parameters_of, read
from lupin_bridge.routes.computing import (
    far_off,
    on_worker,
    request_of,
    unless_known,
    write_s,
)
from lupin_bridge.routes.in_formats import InFormats
from lupin_bridge.routes.tools import REVALIDATE, bridge_of
from lupin_bridge.serving.kept import Answer
from lupin_bridge.stream.estimate_schema import GetEstimateResponse
from lupin_twin.estimates import EstimateRequest, cost_s
from lupin_twin.fields import FieldRefused, check_request
from lupin_twin.workers import SMALL_S

router = APIRouter()

ESTIMATE: Final = InFormats(
    name="estimate",
    summary="The estimate of one sensor",
    description="""From all readings of a day, in space and time, with its error.

That of now is made for the newest reading or the last whole minute of the day, whichever is
later: until then its ETag holds, unless something arrives, or a model fitted anew. Of a moment
that has passed it is made by the model of now.""",
    parameters=parameters_of(EstimateQuery),
    model=GetEstimateResponse,
    refusal_json=estimate_formats.refusal_json,
)


async def _answer(request: Request, field_format: FieldFormat) -> Response:
    bridge = bridge_of(request)
    query = read(EstimateQuery, request.query_params.multi_items(), FieldRefused)
    if query.layer != "mean" and field_format != PNG:
        raise FieldRefused(f"layer is {query.layer!r}, but only a PNG has one")
    at_ns = past_query.at_of(query.at, bridge.ros_time_ns) or 0
    asked = EstimateRequest(request_of(bridge, query), at_ns)
    max_cells = bridge.source.rules().max_grid_cells
    width, height = check_request(asked.box, max_cells)
    field_query.check_scale(query, field_format, width * height, max_cells)
    revision = bridge.source.estimate_revision(asked)
    key = (bridge.source.revision(), asked, field_format.name, query.layer, query.scale)
    journal = bridge.source.journal()
    response = await unless_known(
        request,
        revision and _etag(revision, asked, query, field_format),
        key,
        lambda: _computed(request, asked, query, field_format),
    )
    response.headers.update(complete.of_moment(journal, at_ns) if at_ns else {})
    return response


async def _computed(
    request: Request, asked: EstimateRequest, query: EstimateQuery, field_format: FieldFormat
) -> Answer:
    """The estimate in a format, with its ETag; it is kept."""
    bridge = bridge_of(request)
    max_cells = bridge.source.rules().max_grid_cells
    width, height = check_request(asked.box, max_cells)
    tags = 0 if bridge.latest is None else len(bridge.latest.snapshot.tags)
    writing_s = 2 * write_s(width * height, query.scale)
    is_large = cost_s(asked, tags, max_cells) + writing_s > SMALL_S
    sensor_type, sensors = query.sensor_type, bridge.criteria.sensors
    with (
        bridge.admission.computing(client_of(request), is_large=is_large),
        bridge.metrics.estimate_seconds.time(),
    ):
        result = await bridge.source.estimate(asked)
        estimate = estimate_formats.within_ideal(result.estimate, sensors.named(sensor_type))
        body = await on_worker(
            bridge,
            lambda _: estimate_formats.write(
                estimate,
                field_format,
                sensor_type,
                sensors,
                layer=query.layer,
                scale=query.scale,
            ),
            writing_s,
        )
    tag = _etag(result.revision, asked, query, field_format)
    headers = field_query.headers(
        {
            **estimate_formats.metadata(estimate, sensors.named(sensor_type)),
            **far_off(bridge),
        },
        f"{sensor_type}.{field_format.name}",
        "Estimate",
    )
    answer = Answer(body, field_format.media_type, {**headers, "ETag": tag, **REVALIDATE})
    bridge.kept.put(tag, answer)
    return answer


def _etag(
    revision: str, asked: EstimateRequest, query: EstimateQuery, field_format: FieldFormat
) -> str:
    kind = f"estimate {field_format.name} {query.layer} {asked.at_ns}"
    return field_query.etag(revision, asked.box, kind, query.scale)


ESTIMATE.register(router, _answer)
