"""How every answer about the past comes about, and those that are made of the newest state here.

Whoever knows the past makes the ETag first. Who has the answer of that ETag, or finds it kept,
costs nothing more; what is made for one who asks is made for all who ask the same meanwhile.
"""

from __future__ import annotations

from typing import Final

from fastapi import Request, Response

from lupin_bridge.access.middleware import client_of
from lupin_bridge.bridge import Bridge
from lupin_bridge.past import complete
from lupin_bridge.past.as_of import Written
from lupin_bridge.past.asked import Answered, Answering, Asked, AsOf, OfState
from lupin_bridge.routes.computing import (
    admitted_response,
    has_already,
    kept_response,
    not_modified,
    on_worker,
)
from lupin_bridge.routes.tools import REVALIDATE, bridge_of, list_header
from lupin_bridge.serving.kept import Answer
from lupin_bridge.twin.source import TwinUnavailableError
from lupin_twin.idw import never
from lupin_twin.workers import SMALL_S

# What planning an answer takes for each tag, roughly and at worst.
_PLAN_TAG_S: Final = 10e-6
# What takes less is done on the loop: of a usual house, the way to a worker and back takes longer.
_AT_ONCE_S: Final = 1e-3


async def response_as_of(request: Request, at_ns: int | None, of: OfState) -> Response:
    """What is asked of the state as of `at_ns`; None: of the newest.

    Raises:
        AdmissionError: past a limit.
        Exception: what the source or the question raised.

    """
    bridge = bridge_of(request)
    if at_ns is not None:
        return await response_of_moment(request, AsOf(at_ns, of), at_ns)

    async def work() -> Answer | Response:
        if bridge.latest is None:
            raise TwinUnavailableError("no twin has been heard yet")
        snapshot = bridge.latest.snapshot
        cost_s = len(snapshot.tags) * _PLAN_TAG_S
        if cost_s <= _AT_ONCE_S:
            plan = of.plan(snapshot)
        else:
            plan = await on_worker(bridge, lambda _: of.plan(snapshot), cost_s)
        if has_already(request, plan.etag):
            return not_modified(plan.etag)

        async def write() -> Answer:
            with bridge.admission.computing(client_of(request), is_large=plan.cost_s > SMALL_S):
                if plan.cost_s <= _AT_ONCE_S:
                    written = plan.write(never)
                else:
                    written = await on_worker(bridge, plan.write, plan.cost_s)
            return _kept(bridge, plan.etag, written)

        return kept_response(bridge, plan.etag) or await bridge.answering.get(plan.etag, write)

    return await admitted_response(request, work)


async def response_of_moment(request: Request, asked: Asked, at_ns: int) -> Response:
    """What is asked of the past as of a moment, and how far that is complete.

    Raises:
        AdmissionError: past a limit.
        Exception: what the source or the question raised.

    """
    # Beside the answer, which stays as it is when what is older is deleted; and of before it.
    headers = complete.of_moment(bridge_of(request).source.journal(), at_ns)
    response = await response_of_past(request, asked, "state")
    response.headers.update(headers)
    return response


async def response_of_past(request: Request, asked: Asked, kind: str) -> Response:
    """What is asked of the past; `kind` is what the question is called in the metrics.

    Raises:
        AdmissionError: past a limit.
        Exception: what the source or the question raised.

    """
    bridge = bridge_of(request)
    header = list_header(request, "if-none-match")

    async def work() -> Answer | Response:
        # What is kept here need not be written there; if it goes meanwhile, it is.
        while True:
            has = ", ".join((header, *bridge.kept.newest_tags()))
            key = (kind, asked, header, bridge.state_number)
            answered = await bridge.looking_back.get(
                key,
                lambda has=has: _answered(request, Answering(asked, has), kind),  # type: ignore[misc]
            )
            if has_already(request, answered.etag):
                return not_modified(answered.etag)
            kept = kept_response(bridge, answered.etag)
            if kept is not None:
                return kept
            if answered.written is not None:
                return _answer(answered.etag, answered.written)

    return await admitted_response(request, work)


async def _answered(request: Request, question: Answering, kind: str) -> Answered:
    bridge = bridge_of(request)
    tags = 0 if bridge.latest is None else len(bridge.latest.snapshot.tags)
    # Of all that it takes: in which lane it waits is decided once, whatever it asks for first.
    cost_s = question.asked.cost_s(tags)
    with (
        bridge.admission.computing(client_of(request), is_large=cost_s > SMALL_S),
        bridge.metrics.past_seconds.labels(kind).time(),
    ):
        answered = await bridge.source.ask(question, cost_s)
    if answered.written is not None:
        _kept(bridge, answered.etag, answered.written)
    return answered


def _kept(bridge: Bridge, etag: str, written: Written) -> Answer:
    answer = _answer(etag, written)
    bridge.kept.put(etag, answer)
    return answer


def _answer(etag: str, written: Written) -> Answer:
    headers = {**written.headers, "ETag": etag, **REVALIDATE}
    return Answer(written.body, written.media_type, headers)
