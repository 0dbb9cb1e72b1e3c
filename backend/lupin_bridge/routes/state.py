"""The state: over WebSocket, as JSON, and tag by tag."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Annotated, Final

from annotated_types import Ge
from fastapi import APIRouter, Request, Response, WebSocket

from lupin_bridge.access.middleware import client_of
from lupin_bridge.bridge import Bridge
from lupin_bridge.past import bodies
from lupin_bridge.past import query as past_query
from lupin_bridge.past.plans import LatestOfTag, NoSuchTag, OneTag, WholeState
from lupin_bridge.query_string import parameter, parameters_of, read
from lupin_bridge.routes.answers import (
    NEVER_STORE,
    NO_TWIN,
    NOT_REMEMBERED,
    bridge_of,
    error_response,
    json_response,
    read_route,
    respond,
    respond_as_of,
    respond_past,
)
from lupin_bridge.routes.sockets import has_place, next_message
from lupin_bridge.serving.admission import Answer
from lupin_bridge.serving.ws_protocol import CONNECTION_KEY, Connection
from lupin_bridge.stream import schema
from lupin_bridge.stream.hub import CLOSE_POLICY, Client
from lupin_twin.core.state import Snapshot, TagState

# Of the reason in a close frame (RFC 6455, section 5.5).
MAX_REASON_BYTES: Final = 123


class ListenRefused(ValueError):
    """A query that cannot be served; the message names the parameter, the value and the limit."""


@dataclass(frozen=True, slots=True)
class ListenQuery:
    """How a client wants its frames."""

    delta: bool = parameter("1: only what has changed, to who has the frame before", False)
    max_rate_hz: Annotated[float, Ge(0.01)] = parameter("frames a second at most", math.inf)

    @property
    def min_interval_s(self) -> float:
        """The least time between two frames, s."""
        return 1.0 / self.max_rate_hz


router = APIRouter()

# How long the ages of an answer hold: they are shown in seconds.
AGES_HOLD_S: Final = 0.2

_NO_TAG = {404: {"model": schema.ErrorMessage, "description": "no such tag"}}


@router.websocket("/ws/state")
async def ws_state(websocket: WebSocket) -> None:
    """The status and the current state at once, then every change; input is ignored."""
    bridge: Bridge = websocket.app.state.bridge
    await websocket.accept()
    try:
        query = read(ListenQuery, websocket.query_params.multi_items(), ListenRefused)
    except ListenRefused as error:
        reason = str(error).encode("ascii", "backslashreplace")[:MAX_REASON_BYTES].decode()
        await websocket.close(CLOSE_POLICY, reason)
        return
    if not await has_place(websocket, bridge.hub):
        return
    connection: Connection = getattr(websocket.state, CONNECTION_KEY)
    client = Client(
        connection,
        address=client_of(websocket),
        delta=query.delta,
        min_interval_s=query.min_interval_s,
    )
    connection.on_writable = lambda: bridge.serve(client)
    bridge.join(client)
    try:
        while await next_message(websocket) is not None:
            pass
    finally:
        connection.on_writable = None
        bridge.hub.leave(client)


@read_route(
    router,
    "/api/state",
    summary="The current state of every tag",
    responses={200: {"model": schema.TwinState}, **NOT_REMEMBERED},
    openapi_extra={"parameters": parameters_of(past_query.OfMoment)},
)
async def state(request: Request) -> Response:
    """TwinState with the message's own field names; the newest, with ages as of this answer.

    As of a moment that has passed, `header.stamp` is that moment, and ages are those of then.
    """
    bridge = bridge_of(request)
    at_ns = past_query.at(request.query_params.multi_items(), bridge.ros_time_ns)
    if at_ns is not None:
        return await respond_as_of(request, WholeState(at_ns), at_ns)
    latest = bridge.latest
    if latest is None:
        return error_response(NO_TWIN, 503)
    # The newest state always, its ages a little older at most: so thousands of tags that thousands
    # of clients request are written a few times a second.
    key = ("state", bridge.state_number, int(time.monotonic() / AGES_HOLD_S))

    async def compute() -> Answer:
        body = bridge.frames.json.state(latest.snapshot, bridge.ros_time_ns)
        answer = Answer(body, "application/json", NEVER_STORE)
        bridge.cache.put(key, answer, instead_of=bridge.cached_state)
        bridge.cached_state = key
        return answer

    return await respond(request, key, compute)


# An id may hold a slash, which is decoded before the routes are tried: hence :path, and the longer
# route first.
@read_route(
    router,
    "/api/tags/{tag_id:path}/history",
    summary="The last scans and attempts of one tag",
    responses={200: {"model": schema.TagHistory}, **NOT_REMEMBERED, **_NO_TAG},
)
async def history(request: Request, tag_id: str) -> Response:
    """The tag's last scans that brought readings, sensor by sensor, and its last attempts."""
    bridge = bridge_of(request)
    newest = None if bridge.latest is None else _tag_of(bridge.latest.snapshot, tag_id)
    query = LatestOfTag(tag_id, newest, bridge.source.buffer_len)
    return await respond_past(request, query, "latest")


@read_route(
    router,
    "/api/tags/{tag_id:path}",
    summary="One tag",
    responses={200: {"model": schema.TwinTagState}, **NOT_REMEMBERED, **_NO_TAG},
    openapi_extra={"parameters": parameters_of(past_query.OfMoment)},
)
async def tag(request: Request, tag_id: str) -> Response:
    """Everything that the twin knows about one tag, or knew at a moment."""
    bridge = bridge_of(request)
    at_ns = past_query.at(request.query_params.multi_items(), bridge.ros_time_ns)
    if at_ns is not None:
        return await _tag_as_of(request, tag_id, at_ns)
    if bridge.latest is None:
        return error_response(NO_TWIN, 503)
    found = _tag_of(bridge.latest.snapshot, tag_id)
    return json_response(bridge.frames.json.tag(found, bridge.ros_time_ns))


def _tag_of(snapshot: Snapshot, tag_id: str) -> TagState:
    for found in snapshot.tags:
        if found.tag_id == tag_id:
            return found
    raise NoSuchTag(tag_id, len(snapshot.tags))


async def _tag_as_of(request: Request, tag_id: str, at_ns: int) -> Response:
    try:
        return await respond_as_of(request, OneTag(at_ns, tag_id), at_ns)
    except NoSuchTag as error:
        journal = bridge_of(request).source.journal()
        response = error_response(f"{error}{bodies.why_not(journal, at_ns)}", 404)
        response.headers.update(bodies.moment_headers(journal, at_ns))
        return response
