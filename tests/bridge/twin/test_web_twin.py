"""The source of the role `web`, and a peer that answers GetField, or does not."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager
from typing import Any

import numpy as np
import pytest
from lupin_msgs.msg import SensorReading, TwinState, TwinTagState
from lupin_msgs.srv import GetField

from lupin_bridge.twin import web_node
from lupin_bridge.twin.source import Revised, TwinTimeoutError, TwinUnavailableError
from lupin_bridge.twin.web_twin import MAX_REQUESTS, WebTwin
from lupin_twin.fields import FieldRefused, FieldRequest
from tests.support.inprocess import run
from tests.support.ros import Peer
from tests.support.waiting import PATIENCE_S, until

REQUEST = FieldRequest("co2", 0.5, 0.0, 0.0, 1.0, 0.5)


class Service:
    """The peer as a twin: it answers when it is let, with the number of the request as value."""

    def __init__(self, peer: Peer) -> None:
        self.peer = peer
        self.asked: list[Any] = []
        peer.node.create_service(GetField, "/twin/get_field", self._answer)

    def _answer(self, request: Any, response: Any) -> Any:
        self.asked.append(request)
        if request.sensor_type == "refused":
            response.error_message = "not that one"
            return response
        response.ok = True
        response.width, response.height, response.sample_count = 2, 1, 1
        response.values = [float(len(self.asked)), float("nan")]
        response.resolution_used = request.resolution
        response.value_min = response.value_max = float(len(self.asked))
        return response

    @asynccontextmanager
    async def answering(self) -> AsyncIterator[None]:
        """Answer meanwhile, on a thread of its own."""
        stopping = asyncio.Event()

        async def spin() -> None:
            while not stopping.is_set():
                await asyncio.to_thread(self.peer.spin_briefly)

        spinning = asyncio.create_task(spin())
        try:
            yield
        finally:
            stopping.set()
            await spinning


@contextmanager
def service_in(domain: int) -> Iterator[Service]:
    with Peer(domain) as peer:
        yield Service(peer)


@asynccontextmanager
async def started(timeout_s: float = 20.0) -> AsyncIterator[tuple[WebTwin, list[Revised]]]:
    twin, told = WebTwin(ros_args=(), timeout_s=timeout_s), list[Revised]()
    await twin.start(told.append, lambda: None)
    try:
        yield twin, told
    finally:
        await twin.stop()


async def found(twin: WebTwin) -> None:
    """Wait until the service is there to be asked."""
    client = twin._thread.peek(lambda node: node.field_client)
    await until(client.service_is_ready, "the service")


def pending(twin: WebTwin) -> int:
    """Requests that the ROS client still keeps."""
    return twin._thread.peek(lambda node: len(node.field_client._pending_requests))


def test_without_a_twin_a_field_is_refused_at_once_by_the_services_name(domain: int) -> None:
    async def test() -> None:
        async with started() as (twin, _):
            with pytest.raises(TwinUnavailableError, match="no twin offers /twin/get_field"):
                await twin.field(REQUEST)

    run(domain, test())


def test_a_field_of_a_twin_that_has_just_come_waits_for_its_service(
    domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(web_node, "NEW_TWIN_S", PATIENCE_S)

    async def test() -> None:
        with Peer(domain) as peer:
            async with started() as (twin, told):
                peer.publish("/twin/state", TwinState(), depth=1)
                await until(lambda: told, "a state of the twin")
                early = asyncio.create_task(twin.field(REQUEST))
                # Refused, it would have been by then.
                for _ in range(3):
                    await twin._thread.call(lambda _: None)
                assert not early.done()
                async with Service(peer).answering():
                    assert (await early).grid.width == 2

    run(domain, test())


def test_a_field_of_a_twin_that_came_long_ago_waits_for_no_service(
    domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def test() -> None:
        with Peer(domain) as peer:
            async with started() as (twin, told):
                peer.publish("/twin/state", TwinState(), depth=1)
                await until(lambda: told, "a state of the twin")
                monkeypatch.setattr(web_node, "NEW_TWIN_S", 0.0)
                with pytest.raises(TwinUnavailableError, match="no twin offers"):
                    await twin.field(REQUEST)

    run(domain, test())


def test_a_field_and_a_refusal_are_the_services(domain: int) -> None:
    async def test() -> None:
        with service_in(domain) as service:
            async with started() as (twin, _), service.answering():
                await found(twin)
                result = await twin.field(REQUEST)
                np.testing.assert_array_equal(
                    result.grid.values, np.array([1.0, np.nan], np.float32)
                )
                assert (result.grid.width, result.grid.height) == (2, 1)
                assert service.asked[0].bbox_max_x == 1.0
                with pytest.raises(FieldRefused, match="not that one"):
                    await twin.field(FieldRequest("refused", 0.5, 0.0, 0.0, 1.0, 1.0))

    run(domain, test())


def test_identical_requests_in_flight_are_asked_once_and_a_change_is_asked_for_anew(
    domain: int,
) -> None:
    async def test() -> None:
        with service_in(domain) as service:
            async with started() as (twin, told):
                await found(twin)
                first = [asyncio.create_task(twin.field(REQUEST)) for _ in range(10)]
                await until(lambda: pending(twin), "the request to be on its way")
                reading = SensorReading(name="co2", value=1.0)
                state = TwinState(tags=[TwinTagState(tag_id="1", readings=[reading])])
                service.peer.publish("/twin/state", state, depth=1)
                await until(lambda: told, "the change")
                second = [asyncio.create_task(twin.field(REQUEST)) for _ in range(10)]
                async with service.answering():
                    old = await asyncio.gather(*first)
                    new = await asyncio.gather(*second)
                assert len(service.asked) == 2
                assert {result.grid.value_max for result in old} == {1.0}
                assert {result.grid.value_max for result in new} == {2.0}
                assert {result.revision for result in new} == {told[-1].revision}
                assert old[0].revision != new[0].revision

    run(domain, test())


def test_only_so_many_requests_are_on_their_way_at_once(domain: int) -> None:
    async def test() -> None:
        with service_in(domain) as service:
            async with started() as (twin, _):
                await found(twin)
                requests = [FieldRequest("co2", 0.5, 0.0, 0.0, 1.0, n) for n in range(1, 11)]
                tasks = [asyncio.create_task(twin.field(request)) for request in requests]
                await until(lambda: pending(twin) >= MAX_REQUESTS, "requests to be on their way")
                assert pending(twin) == MAX_REQUESTS
                async with service.answering():
                    await asyncio.gather(*tasks)
                assert len(service.asked) == 10
                await until(lambda: pending(twin) == 0, "all of them to be forgotten")

    run(domain, test())


def test_a_twin_that_does_not_answer_in_time_is_given_up(domain: int) -> None:
    async def test() -> None:
        with service_in(domain):
            async with started(timeout_s=0.3) as (twin, _):
                await found(twin)
                with pytest.raises(TwinTimeoutError, match=r"within 0\.3 s \(field_timeout_s\)"):
                    await twin.field(REQUEST)
                await until(lambda: not pending(twin), "the request to be forgotten")

    run(domain, test())
