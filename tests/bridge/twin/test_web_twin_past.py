"""The past by the role `web`: a twin that has none to tell, and bounds on what is asked."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from lupin_msgs.srv import GetStateAt

from lupin_bridge.twin import web_node
from lupin_bridge.twin.looking import Itself
from lupin_bridge.twin.source import TwinTimeoutError, TwinUnavailableError
from lupin_bridge.twin.web_node import Service
from lupin_bridge.twin.web_twin import MAX_REQUESTS
from lupin_twin.past import SeriesRequest
from tests.bridge.twin.test_web_twin import found, service_in, started, state_of
from tests.support.inprocess import run
from tests.support.ros import Peer
from tests.support.waiting import until


def test_a_twin_of_before_has_no_past_and_the_service_is_named(
    domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(web_node, "NEW_TWIN_S", 0.0)

    async def test() -> None:
        with service_in(domain) as service:
            async with started() as (twin, told), service.answering():
                await found(twin)
                with pytest.raises(TwinUnavailableError, match="nothing was heard yet on /twin/st"):
                    await twin.series(SeriesRequest("1", "co2"))
                service.peer.publish("/twin/state", state_of(1.0, 5), depth=1)
                await until(lambda: told, "a state")
                with pytest.raises(
                    TwinUnavailableError, match="no twin offers /twin/get_history: is it an older"
                ):
                    await twin.series(SeriesRequest("1", "co2"))
                with pytest.raises(
                    TwinUnavailableError, match="no twin offers /twin/get_state_at: is it an older"
                ):
                    await twin.ask(Itself(1), 0.0)
                rows = twin.rows(1, 2, None, None, list)
                with pytest.raises(TwinUnavailableError, match="no twin offers /twin/get_history"):
                    await anext(rows)

    run(domain, test())


def test_questions_about_the_past_go_the_same_bounded_way(domain: int) -> None:
    async def test() -> None:
        with Peer(domain) as peer:
            answers: list[Any] = []
            peer.node.create_service(
                GetStateAt,
                "/twin/get_state_at",
                lambda request, _: answers.append(request),
            )
            async with started() as (twin, _):
                client = await twin.thread.call(lambda node: node.clients_of_twin[Service.STATE_AT])
                await until(client.service_is_ready, "the service")

                def ask() -> list[asyncio.Task[Any]]:
                    return [asyncio.create_task(twin.ask(Itself(n), 0.0)) for n in range(20)]

                asked = ask()
                await until(lambda: len(client._pending_requests) == MAX_REQUESTS, "questions")
                for each in asked:
                    each.cancel()
                await until(lambda: not client._pending_requests, "the questions to be forgotten")
                twin.timeout_s = 0.2
                for each in ask():
                    with pytest.raises(TwinTimeoutError, match=r"within 0\.2 s"):
                        await each
                await until(lambda: not client._pending_requests, "these to be forgotten too")

    run(domain, test())
