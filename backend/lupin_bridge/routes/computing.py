"""How every answer that has to be computed comes about.

It is admitted, computed once for all who ask the same, within its time, and only as long as
somebody waits; what can be kept is kept, and costs nothing when it is asked for again.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable, Coroutine, Hashable, Mapping
from contextlib import ExitStack
from typing import Any, Final, TypeVar

from fastapi import Request, Response
from starlette.types import Receive, Scope, Send

from lupin_bridge.access.middleware import client_of
from lupin_bridge.bridge import Bridge
from lupin_bridge.field import formats as field_formats
from lupin_bridge.field import query as field_query
from lupin_bridge.field.formats import FieldFormat
from lupin_bridge.field.query import FieldQuery
from lupin_bridge.routes.tools import (
    NEVER_KEEP,
    REVALIDATE,
    bridge_of,
    error_response,
    list_header,
)
from lupin_bridge.serving.admission import AdmissionError, BusyError
from lupin_bridge.serving.kept import Answer
from lupin_bridge.twin.source import TwinTimeoutError, TwinUnavailableError
from lupin_twin.far_off import far_off_tags
from lupin_twin.fields import FieldRequest, check_request, cost_s, default_box
from lupin_twin.past import NotRemembered, PastRefused
from lupin_twin.state import TagState
from lupin_twin.workers import SMALL_S, ShouldStop

ResultT = TypeVar("ResultT")

# What writing takes, roughly and at worst, for each cell or pixel.
_WRITE_CELL_S: Final = 50e-9
# nginx's "client closed request"; nobody gets it.
CLIENT_GONE: Final = 499


class LentResponse(Response):
    """An answer that gives something back once its client has taken it, or left."""

    give_back: Callable[[], None] | None = None

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send it."""
        try:
            await super().__call__(scope, receive, send)
        finally:
            if self.give_back is not None:
                self.give_back()


def kept_response(bridge: Bridge, key: Hashable) -> LentResponse | None:
    """The answer that is kept under a key: it costs nothing, and passes. None: nothing is."""
    lent = bridge.kept.lend(key)
    if lent is None:
        return None
    answer, give_back = lent
    return _response(answer, give_back)


async def kept_or_computed(
    request: Request, key: Hashable, compute: Callable[[], Coroutine[Any, Any, Answer]]
) -> Response:
    """`kept_response`, or else `computed_response`."""
    return kept_response(bridge_of(request), key) or await computed_response(request, key, compute)


async def computed_response(
    request: Request, key: Hashable, compute: Callable[[], Coroutine[Any, Any, Answer]]
) -> Response:
    """The answer that `compute` makes, or the one under way under the same key.

    Raises:
        AdmissionError: past a limit of the client.
        Exception: whatever `compute` raised; `refusal` makes an answer of what it may.

    """
    bridge = bridge_of(request)
    return await admitted_response(request, lambda: bridge.answering.get(key, compute))


async def admitted_response(
    request: Request, work: Callable[[], Awaitable[Answer | Response]]
) -> Response:
    """What `work` gives, which counts as one request of the client until it has taken it.

    Raises:
        AdmissionError: past a limit of the client.
        Exception: whatever `work` raised.

    """
    bridge = bridge_of(request)
    with ExitStack() as held:
        held.enter_context(bridge.admission.request(client_of(request), time.monotonic()))
        answer = await while_client_waits(request, within_time(bridge, work()))
        if answer is None:
            return Response(status_code=CLIENT_GONE)
        if isinstance(answer, Response):
            return answer
        return _response(answer, held.pop_all().close)


async def unless_known(
    request: Request,
    tag: str | None,
    key: Hashable,
    compute: Callable[[], Coroutine[Any, Any, Answer]],
) -> Response:
    """304 for who has the answer, which `tag` names where that is known without computing."""
    if tag is not None:
        if has_already(request, tag):
            return not_modified(tag)
        kept = kept_response(bridge_of(request), tag)
        if kept is not None:
            return kept
    response = await computed_response(request, key, compute)
    made = response.headers.get("etag")
    if made is not None and has_already(request, made):
        if isinstance(response, LentResponse) and response.give_back is not None:
            response.give_back()
        return not_modified(made)
    return response


def has_already(request: Request, tag: str) -> bool:
    """Whether the client says that it has the answer of this ETag."""
    return field_query.matches(list_header(request, "if-none-match"), tag)


def not_modified(tag: str) -> Response:
    """The answer for who has it already."""
    return Response(status_code=304, headers={"ETag": tag, **REVALIDATE})


def _response(answer: Answer, give_back: Callable[[], None]) -> LentResponse:
    response = LentResponse(answer.body, headers=dict(answer.headers), media_type=answer.media_type)
    response.give_back = give_back
    return response


async def within_time(bridge: Bridge, work: Awaitable[ResultT]) -> ResultT:
    """What `work` gives, within `Limits.answer_timeout_s`.

    Raises:
        TwinTimeoutError: it took longer; it is cancelled.

    """
    limit_s = bridge.limits.answer_timeout_s
    try:
        async with asyncio.timeout(limit_s):
            return await work
    except TimeoutError:
        raise TwinTimeoutError(f"the answer was not there within {limit_s:g} s") from None


async def while_client_waits(
    request: Request, work: Coroutine[Any, Any, ResultT]
) -> ResultT | None:
    """What `work` gives; None: the client has left, and the work was cancelled."""
    working = asyncio.create_task(work)
    leaving = asyncio.create_task(client_left(request))
    try:
        await asyncio.wait((working, leaving), return_when=asyncio.FIRST_COMPLETED)
        return await working if working.done() else None
    finally:
        leaving.cancel()
        if not working.done():
            working.cancel()
            # What it works on is free when this returns.
            await asyncio.wait((working,))
            if not working.cancelled():
                working.exception()


async def client_left(request: Request) -> None:
    """Return when the client has left."""
    while (await request.receive())["type"] != "http.disconnect":
        pass


async def on_worker(
    bridge: Bridge, work: Callable[[ShouldStop], ResultT], cost: float = 0.0
) -> ResultT:
    """What `work(should_stop)` gives, off the loop; `cost` is an estimate, s."""
    return await asyncio.wrap_future(bridge.source.workers.submit(work, cost))


async def made(
    request: Request,
    key: Hashable,
    write: Callable[[], bytes],
    media_type: str,
    *,
    cost: float = 0.0,
    headers: Mapping[str, str] = NEVER_KEEP,
) -> Answer:
    """What `write` makes on a worker (`cost`: an estimate, s), and kept.

    Raises:
        BusyError: one computation too many.

    """
    bridge = bridge_of(request)
    with bridge.admission.computing(client_of(request), is_large=cost > SMALL_S):
        body = await on_worker(bridge, lambda _: write(), cost)
    answer = Answer(body, media_type, headers)
    bridge.kept.put(key, answer)
    return answer


async def or_refusal(answer: Awaitable[Response]) -> Response:
    """Wait for an answer; what stands in its way becomes the answer."""
    try:
        return await answer
    except AdmissionError as error:
        status = 503 if isinstance(error, BusyError) else 429
        return error_response(str(error), status, error.headers)
    except PastRefused as error:
        return error_response(str(error), 400)
    except NotRemembered as error:
        if_passing = None if error.is_lasting else {"Retry-After": "3"}
        return error_response(str(error), 404 if error.is_lasting else 503, if_passing)
    except TwinTimeoutError as error:
        return error_response(str(error), 504)
    except TwinUnavailableError as error:
        return error_response(str(error), 503, {"Retry-After": "3"})


# --- fields -------------------------------------------------------------------------------------


def is_large(bridge: Bridge, asked: FieldRequest, scale: int = 1) -> bool:
    """Whether a field may take long: as if every tag had a reading and none was computed before.

    Writing it counts too: of few tags, that takes longer than the field.

    Raises:
        lupin_twin.fields.FieldRefused: a bad request.

    """
    tags = 0 if bridge.latest is None else len(bridge.latest.snapshot.tags)
    rules = bridge.source.rules()
    width, height = check_request(asked, rules.max_grid_cells)
    return cost_s(asked, tags, rules) + write_s(width * height, scale) > SMALL_S


def write_s(cells: int, scale: int) -> float:
    """About what writing cells takes, s of one core."""
    return cells * scale**2 * _WRITE_CELL_S


async def field_answer(
    bridge: Bridge, client: str, asked: FieldRequest, field_format: FieldFormat, scale: int = 1
) -> Answer:
    """The field in a format, with its ETag; it is kept. `client` is who asked first.

    Raises:
        lupin_twin.fields.FieldRefused: a bad request.
        BusyError: one computation too many.
        TwinUnavailableError: nobody there to compute it.

    """
    with (
        bridge.admission.computing(client, is_large=is_large(bridge, asked, scale)),
        bridge.metrics.field_seconds.time(),
    ):
        result = await bridge.source.field(asked)
        # The revision that the field was made from, which may be newer than the one asked at.
        tag = field_query.etag(result.revision, asked, field_format.name, scale)
        grid, sensors = result.grid, bridge.criteria.sensors
        body = await on_worker(
            bridge,
            lambda _: field_formats.write(grid, field_format, asked.sensor_type, sensors, scale),
            write_s(grid.width * grid.height, scale),
        )
    headers = field_query.headers(
        {**field_formats.metadata(grid, sensors.named(asked.sensor_type)), **far_off(bridge)},
        f"{asked.sensor_type}.{field_format.name}",
    )
    answer = Answer(body, field_format.media_type, {**headers, "ETag": tag, **REVALIDATE})
    bridge.kept.put(tag, answer)
    return answer


def request_of(bridge: Bridge, query: FieldQuery) -> FieldRequest:
    """As GetField has it; the box of who asks for none is that of the tags, and their reach."""
    rules = bridge.source.rules()
    places = [(tag.pose.x, tag.pose.y) for tag in _tags(bridge) if tag.pose is not None]
    return query.request(default_box(places, rules.max_distance_m), rules.max_grid_cells)


def far_off(bridge: Bridge) -> dict[str, str]:
    """How many tags are too far off for a default box, as a field's metadata."""
    return field_formats.far_off(far_off_tags(_tags(bridge)))


def _tags(bridge: Bridge) -> tuple[TagState, ...]:
    return () if bridge.latest is None else bridge.latest.snapshot.tags
