"""The path from a request to its response: not modified, cached, under way, or computed.

A request is admitted first. Its answer is computed once for all clients that wait for the same one,
within a time limit, and only while somebody waits. The cache serves later requests at no cost. Past
a limit, each function here raises an `AdmissionError`; other errors are those of the work.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable, Coroutine, Hashable, Mapping
from contextlib import AbstractContextManager, ExitStack, nullcontext
from functools import partial
from typing import Any, Final, TypeVar, cast

import orjson
from fastapi import APIRouter, FastAPI, Request, Response
from fastapi.exceptions import RequestValidationError
from fastapi.routing import APIRoute
from starlette.requests import HTTPConnection
from starlette.types import Receive, Scope, Send

from lupin_bridge.access.credentials import Person
from lupin_bridge.access.middleware import PERSON_KEY, client_of
from lupin_bridge.bridge import Bridge
from lupin_bridge.feed.source import TwinTimeoutError, TwinUnavailableError
from lupin_bridge.past import bodies
from lupin_bridge.past.plans import Answered, Query, StateQuery, answered
from lupin_bridge.query_string import NoParameters, matches, parameters_of, read
from lupin_bridge.serving.admission import REVALIDATE, AdmissionError, Answer, BusyError, Limits
from lupin_bridge.stream import schema
from lupin_twin.core.notes import NotesUnwritable
from lupin_twin.core.past import NotFound, NotRemembered, PastRefused
from lupin_twin.core.state import Snapshot
from lupin_twin.runtime.workers import SMALL_S, ShouldStop

NEVER_STORE: Final = {"Cache-Control": "no-store"}
NO_TWIN: Final = "nothing has been received from a twin yet"
# nginx's "client closed request"; nobody receives it.
CLIENT_DISCONNECTED: Final = 499

_NOT_TIMED: Final = nullcontext()
Documented = dict[int | str, dict[str, Any]]


def refusing(reasons: Mapping[int, str]) -> Documented:
    """Refusals by their status, for the OpenAPI document."""
    return {
        status: {"model": schema.ErrorMessage, "description": why}
        for status, why in reasons.items()
    }


# The responses that `add_refusals` makes of refusals, for the OpenAPI document.
NOT_REMEMBERED: Final[Documented] = {
    304: {"description": "not modified: the ETag is still current"},
    **refusing(
        {
            400: "refused; detail has the reason",
            429: "too many requests from this client",
            503: "not readable at the moment, or the server is overloaded",
            504: "the answer took too long",
        }
    ),
}

ResultT = TypeVar("ResultT")
RouteT = TypeVar("RouteT", bound=Callable[..., Any])


class ApiRoute(APIRoute):
    """Refuses all parameters below `/api/`, unless it describes some, and parses them itself."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """See `APIRoute`."""
        handle = super().get_route_handler()
        if "parameters" in (self.openapi_extra or {}) or not self.path.startswith("/api/"):
            return handle

        async def without_parameters(request: Request) -> Response:
            read(NoParameters, request.query_params.multi_items())
            return await handle(request)

        return without_parameters


def read_route(
    router: APIRouter, path: str, query: type[Any] | None = None, **documentation: Any
) -> Callable[[RouteT], RouteT]:
    """Register a function for GET and, undocumented, for HEAD (the server drops the body).

    `query` has the parameters that the function reads.
    """
    if query is not None:
        documentation["openapi_extra"] = {"parameters": parameters_of(query)}

    def register(function: RouteT) -> RouteT:
        router.get(path, response_class=Response, **documentation)(function)
        hidden: dict[str, Any] = {**documentation, "responses": None, "include_in_schema": False}
        router.head(path, response_class=Response, **hidden)(function)
        return function

    return register


def bridge_of(request: Request) -> Bridge:
    """The application's bridge."""
    return cast("Bridge", request.app.state.bridge)


def newest_of(bridge: Bridge) -> Snapshot:
    """The newest state; raises `TwinUnavailableError` if there is none."""
    if bridge.latest is None:
        raise TwinUnavailableError(NO_TWIN)
    return bridge.latest.snapshot


def person_of(request: HTTPConnection) -> Person | None:
    """Who makes a request; None: not known."""
    found: Person | None = request.scope["state"].get(PERSON_KEY)
    return found


def writer_of(request: HTTPConnection) -> Person | None:
    """As `person_of`, of a request that writes: its body may have been long in coming.

    Raises:
        Refused: the session of the request has ended meanwhile.

    """
    people, person = request.app.state.access.people, person_of(request)
    if people is not None and person is not None and not people.may_stay(person):
        raise Refused("the session has ended: sign in again", 401)
    return person


class Refused(Exception):
    """A request that the route refuses; the message names field, value and limit."""

    def __init__(
        self, message: str, status: int = 400, headers: Mapping[str, str] | None = None
    ) -> None:
        super().__init__(message)
        self.status, self.headers = status, headers


def list_header(request: Request, name: str) -> str:
    """All lines of a header that is a list, as one (RFC 9110, section 5.3)."""
    return ", ".join(request.headers.getlist(name))


def json_response(
    body: bytes, status_code: int = 200, headers: Mapping[str, str] | None = None
) -> Response:
    """JSON that is already text; never stored by anyone unless the headers say so."""
    return Response(body, status_code, headers or NEVER_STORE, "application/json")


def error_response(
    detail: str, status_code: int, headers: Mapping[str, str] | None = None
) -> Response:
    """`schema.ErrorMessage`."""
    return json_response(orjson.dumps({"detail": detail}), status_code, headers)


REFUSALS: Final = (
    *(AdmissionError, NotRemembered, PastRefused, TwinUnavailableError),
    *(Refused, NotesUnwritable),
)


def add_refusals(app: FastAPI) -> None:
    """Turn the `REFUSALS` that routes raise into responses."""

    async def refuse(_request: Request, error: Exception) -> Response:
        return refusal(error)

    async def refuse_body(_request: Request, error: Exception) -> Response:
        first = cast("RequestValidationError", error).errors()[0]
        _, *where = first["loc"]
        name, why = ".".join(map(str, where)), first["msg"]
        if first["type"] == "json_invalid":
            name, why = "", f"not JSON: {first['ctx']['error']}"
        elif first["type"] == "model_attributes_type":  # also of another Content-Type
            why = "expected a JSON object, sent as application/json"
        elif first["type"] == "string_pattern_mismatch":  # the only patterns of `routes_schema`
            why = "it contains a control character"
        return error_response(f"{name[:64] or 'the body'}: {why[0].lower()}{why[1:]}", 400)

    for kind in REFUSALS:
        app.add_exception_handler(kind, refuse)
    app.add_exception_handler(RequestValidationError, refuse_body)


def refusal(error: Exception) -> Response:
    """The response to one of the `REFUSALS`."""
    status: int = 400
    headers: Mapping[str, str] | None = None
    retry = {"Retry-After": "3"}
    match error:
        case AdmissionError():
            status, headers = (503 if isinstance(error, BusyError) else 429), error.headers
        case NotFound():
            status = 404
        case Refused():
            status, headers = error.status, error.headers
        case TwinTimeoutError():
            status = 504
        case NotesUnwritable() | NotRemembered() | TwinUnavailableError():
            status, headers = 503, retry
    return error_response(str(error), status, headers)


# --- answers that are computed --------------------------------------------------------------------


# Size of a piece of a body: the next one follows when the socket has taken it.
PIECE_BYTES: Final = 64 * 1024


class CachedResponse(Response):
    """A response that calls `release` once its client has received it, or left.

    It is sent in pieces, each when the reader has taken the last: a hundred readers share one body.
    """

    def __init__(self, answer: Answer, release: Callable[[], None]) -> None:
        super().__init__(answer.body, headers=dict(answer.headers), media_type=answer.media_type)
        self.release = release

    async def __call__(self, _scope: Scope, _receive: Receive, send: Send) -> None:
        """Send it."""
        head = {"type": "http.response.start", "status": 200, "headers": self.raw_headers}
        body = memoryview(self.body)
        try:
            await send(head)
            for start in range(0, len(body), PIECE_BYTES):
                piece = body[start : start + PIECE_BYTES]
                await send({"type": "http.response.body", "body": piece, "more_body": True})
            # uvicorn waits before it writes: the empty last message waits for the last piece.
            await send({"type": "http.response.body", "body": b""})
        finally:
            self.release()


async def respond(
    request: Request,
    key: Hashable,
    compute: Callable[[], Coroutine[Any, Any, Answer]],
    etag: str | None = None,
) -> Response:
    """The answer under a key. `etag` is its key in the cache, if it is known beforehand."""
    bridge = bridge_of(request)
    if etag is not None and has_etag(request, etag):
        return not_modified(etag)
    lent = bridge.cache.lend(etag or key)
    response: Response
    if lent is not None:
        response = CachedResponse(*lent)
    else:
        response = await admitted(request, lambda: bridge.answering.get(key, compute))
    found = response.headers.get("etag")
    if found is not None and response.status_code == 200 and has_etag(request, found):
        if isinstance(response, CachedResponse):
            response.release()
        return not_modified(found)
    return response


async def admitted(request: Request, work: Callable[[], Awaitable[Answer | Response]]) -> Response:
    """The result of `work`. It counts as one request until the client has received it."""
    bridge = bridge_of(request)
    with ExitStack() as held:
        held.enter_context(bridge.admission.request(client_of(request), time.monotonic()))
        answer = await while_client_waits(request, within_time(bridge.limits, work()))
        if answer is None:
            return Response(status_code=CLIENT_DISCONNECTED)
        if isinstance(answer, Response):
            return answer
        return CachedResponse(answer, held.pop_all().close)


def has_etag(request: Request, etag: str) -> bool:
    """Whether the client says that it has the answer of this ETag."""
    return matches(list_header(request, "if-none-match"), etag)


def not_modified(etag: str) -> Response:
    """The response to a client that has the answer already."""
    return Response(status_code=304, headers={"ETag": etag, **REVALIDATE})


async def within_time(limits: Limits, work: Awaitable[ResultT]) -> ResultT:
    """The result of `work`, within `Limits.answer_timeout_s`.

    Raises:
        TwinTimeoutError: it took longer; it is cancelled.

    """
    limit_s = limits.answer_timeout_s
    try:
        async with asyncio.timeout(limit_s):
            return await work
    except TimeoutError:
        raise TwinTimeoutError(f"the answer was not ready within {limit_s:g} s") from None


async def while_client_waits(
    request: Request, work: Coroutine[Any, Any, ResultT]
) -> ResultT | None:
    """The result of `work`; None: the client has left, and the work was cancelled."""
    working = asyncio.create_task(work)
    disconnect = asyncio.create_task(client_left(request))
    try:
        await asyncio.wait((working, disconnect), return_when=asyncio.FIRST_COMPLETED)
        return await working if working.done() else None
    finally:
        disconnect.cancel()
        if not working.done():
            working.cancel()
            # Its resources are free when this returns.
            await asyncio.wait((working,))
            if not working.cancelled():
                working.exception()


async def client_left(request: Request) -> None:
    """Return when the client has left."""
    while (await request.receive())["type"] != "http.disconnect":
        pass


async def on_worker(
    bridge: Bridge, work: Callable[[ShouldStop], ResultT], cost_s: float = 0.0
) -> ResultT:
    """The result of `work(should_stop)`, off the event loop."""
    return await asyncio.wrap_future(bridge.source.workers.submit(work, cost_s))


async def computed(
    bridge: Bridge,
    client: str,
    key: Hashable,
    write: Callable[[ShouldStop], Answer],
    cost_s: float,
    *,
    timed: AbstractContextManager[object] = _NOT_TIMED,
) -> Answer:
    """The answer that `write` makes on a worker, put into the cache; `timed` lasts as long."""
    with bridge.admission.computing(client, is_large=cost_s > SMALL_S) as times, timed:
        answer = await on_worker(bridge, write, cost_s * times)
    bridge.cache.put(key, answer)
    return answer


# --- answers of the past --------------------------------------------------------------------------


async def respond_as_of(request: Request, query: StateQuery) -> Response:
    """A query as of a moment; headers say how far the answer is complete."""
    journal, at_ns = bridge_of(request).source.journal(), query.at_ns or 0
    # As of before the answer. In headers, as the body stays the same when older rows are deleted.
    headers = bodies.moment_headers(journal, at_ns)
    try:
        response = await respond_past(request, query, "state")
    except NotFound as error:
        response = error_response(f"{error}{bodies.why_not(journal, at_ns)}", 404)
    response.headers.update(headers)
    return response


async def respond_past(request: Request, query: Query, kind: str) -> Response:
    """A query of the past; `kind` is its name in the metrics."""
    bridge = bridge_of(request)
    header = list_header(request, "if-none-match")

    async def ask() -> Answered:
        tags = 0 if bridge.latest is None else len(bridge.latest.snapshot.tags)
        cost_s = query.cost_s(tags)
        with (
            bridge.admission.computing(client_of(request), is_large=cost_s > SMALL_S) as times,
            bridge.metrics.past_seconds.labels(kind).time(),
        ):
            return await bridge.source.ask(partial(answered, query, header), cost_s * times)

    async def work() -> Answer | Response:
        # The log grows: an equal query later is another one.
        key = (kind, query, header, bridge.state_number)
        found = await bridge.answering.get(key, ask)
        return found.answer or not_modified(found.etag)

    return await admitted(request, work)
