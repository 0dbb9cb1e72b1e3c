"""The role `web` and a twin's services: found late, gone again, and asked by many others too."""

from __future__ import annotations

import asyncio
import threading
from typing import Any

import pytest
from lupin_msgs.msg import TwinState
from lupin_msgs.srv import GetField

from lupin_bridge.feed import web_node
from lupin_bridge.feed.source import TwinUnavailableError
from tests.bridge.feed.test_web import REQUEST, Service, found, pending, service_in, started
from tests.support.ros import Peer
from tests.support.waiting import PATIENCE_S, until


async def test_a_field_of_a_twin_that_has_just_come_waits_for_its_service(
    domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(web_node, "NEW_TWIN_S", PATIENCE_S)

    with Peer(domain) as peer:
        async with started() as (twin, told):
            peer.publish("/twin/state", TwinState(), depth=1)
            await until(lambda: told, "a state of the twin")
            early = asyncio.create_task(twin.field(REQUEST))
            # Refused, it would have been by then.
            for _ in range(3):
                await twin.thread.call(lambda _: None)
            assert not early.done()
            async with Service(peer).answering():
                assert (await early).grid.width == 2


async def test_a_field_of_a_twin_that_came_long_ago_waits_for_no_service(
    domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    with Peer(domain) as peer:
        async with started() as (twin, told):
            peer.publish("/twin/state", TwinState(), depth=1)
            await until(lambda: told, "a state of the twin")
            monkeypatch.setattr(web_node, "NEW_TWIN_S", 0.0)
            with pytest.raises(TwinUnavailableError, match=r"field: its state is heard"):
                await twin.field(REQUEST)


async def test_a_twin_that_comes_and_goes_is_no_reason_to_wait_for_ever(
    domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(web_node, "NEW_TWIN_S", 0.2)
    monkeypatch.setattr(web_node.WebNode, "has_new_twin", True)

    async with started() as (twin, _):
        with pytest.raises(TwinUnavailableError, match="no twin offers"):
            await twin.field(REQUEST)


async def test_an_answer_is_not_lost_among_those_to_all_others(domain: int) -> None:
    """The answers of a service go to all its clients, and a client holds so many of them."""
    held, may_go_on = threading.Event(), threading.Event()

    def hold(_: Any) -> None:
        held.set()
        may_go_on.wait(PATIENCE_S)

    with service_in(domain) as service, Peer(domain, "other") as other:
        async with started() as (twin, _):
            await found(twin)
            early = asyncio.create_task(twin.field(REQUEST))
            await until(lambda: pending(twin), "the question")
            holding = asyncio.create_task(twin.thread.call(hold))
            await until(held.is_set, "a thread that is busy")
            async with service.answering():
                await until(lambda: service.asked, "its answer")
                for _ in range(5):
                    requests = [GetField.Request()] * 5
                    await asyncio.to_thread(other.ask_all, GetField, "/twin/get_field", requests)
            may_go_on.set()
            await holding
            assert (await early).grid.width == 2
