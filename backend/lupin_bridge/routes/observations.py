"""Readings of programs: the one route that leads to ROS, off unless a setting says otherwise."""

from __future__ import annotations

import math
import time
from typing import Final

import orjson
from fastapi import APIRouter, Request, Response

from lupin_bridge.access.middleware import OBSERVATIONS
from lupin_bridge.access.person import WRITER
from lupin_bridge.feed.source import TwinUnavailableError
from lupin_bridge.past.query import moment
from lupin_bridge.routes.answers import (
    TOO_MUCH,
    BodyRefused,
    bridge_of,
    error_response,
    json_response,
    person_of,
    read_body,
)
from lupin_bridge.serving.admission import ClientLimitError
from lupin_bridge.stream import people_schema, schema
from lupin_bridge.stream.state_json import stamp
from lupin_twin.adapt.config import Place
from lupin_twin.adapt.scans import BuiltScan
from lupin_twin.core.state import NANOSECONDS_PER_SECOND

router = APIRouter()

# A clock may be so much ahead; what is dated farther is of a clock that is wrong.
MAX_AHEAD_S: Final = 10


@router.post(
    OBSERVATIONS,
    summary="Post the readings of one tag: they reach the twin over ROS, as a robot's do",
    status_code=202,
    response_class=Response,
    responses={
        202: {"model": people_schema.PublishedObservation, "description": "published over ROS"},
        400: {"model": schema.ErrorMessage, "description": "refused; detail has the reason"},
        403: {
            "model": schema.ErrorMessage,
            "description": "it takes a token of the role writer, and a bridge with "
            "--http-observations on",
        },
        **TOO_MUCH,
        503: {"model": schema.ErrorMessage, "description": "the twin is silent"},
    },
    openapi_extra={
        "requestBody": {
            "required": True,
            "content": {
                "application/json": {"schema": {"$ref": "#/components/schemas/ObservationDraft"}}
            },
        }
    },
)
async def post_observation(request: Request) -> Response:
    """By a token of the role writer. The same tag at the same `observed_at` counts once.

    The twin goes by its own rules: what it drops is on `/diagnostics`.
    """
    bridge, person = bridge_of(request), person_of(request)
    if person is None or person.role != WRITER:
        return error_response(
            f"observations take a token of the role {WRITER} "
            f"(`lupin-twin token add NAME --role {WRITER}`), as Authorization: Bearer",
            403,
        )
    if not bridge.takes_observations:
        return error_response(
            "this bridge takes no observations: start serve or web with --http-observations on", 403
        )
    limits = bridge.limits
    wait_s = bridge.observations_pace.take(person.name, time.monotonic())
    if wait_s > 0.0:
        raise ClientLimitError(
            f"{person.name} has posted more than {limits.observation_burst} observations and "
            f"{limits.observations_per_s:g} a second",
            wait_s,
        )
    draft = await read_body(request, people_schema.ObservationDraft)
    now_ns = bridge.ros_time_ns
    if now_ns is None or not bridge.status.is_live:
        raise TwinUnavailableError("the twin is silent: post it again later")
    stamp_ns = _stamp_ns(draft.observed_at, now_ns)
    place = None if draft.place is None else Place(*draft.place)
    scan = BuiltScan(draft.tag_id, stamp_ns, place, tuple(draft.readings.items()), "")
    source = f"http/{person.name}"
    await bridge.source.publish_observation(scan, source)
    body = {"tag_id": draft.tag_id, "observed_at": stamp(stamp_ns), "source": source}
    return json_response(orjson.dumps(body), 202)


def _stamp_ns(observed_at: str | float | None, now_ns: int) -> int:
    if observed_at is None:
        return now_ns
    text = observed_at if isinstance(observed_at, str) else f"{observed_at:.9f}"
    stamp_ns = moment("observed_at", text)
    ahead_s = (stamp_ns - now_ns) / NANOSECONDS_PER_SECOND
    if ahead_s > MAX_AHEAD_S:
        raise BodyRefused(
            f"observed_at is {math.ceil(ahead_s)} s ahead of ROS time, the limit is "
            f"{MAX_AHEAD_S} s: is a clock wrong?"
        )
    if not stamp_ns:
        raise BodyRefused("observed_at is 0, which is no moment: leave it out for now")
    return min(stamp_ns, now_ns)
