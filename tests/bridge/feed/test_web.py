"""The source of the role `web`, and a peer that answers GetField, or does not."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Iterator, Sized
from contextlib import asynccontextmanager, contextmanager
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from lupin_msgs.msg import SensorReading, TwinState, TwinTagState
from lupin_msgs.srv import GetField

from lupin_bridge.feed.revisions import REVISION_TTL_S
from lupin_bridge.feed.source import TwinTimeoutError, TwinUnavailableError, TwinUpdate
from lupin_bridge.feed.web import MAX_REQUESTS, WebTwin
from lupin_bridge.feed.web_node import Service as Asked
from lupin_twin.field.engine import FieldRefused, FieldRequest
from tests.support.inprocess import run
from tests.support.messages import occupancy_grid, scan
from tests.support.processes import twin_node
from tests.support.ros import Peer
from tests.support.waiting import until

# A state every 3 s.
SLOW = ("--ros-args", "-p", "state_publish_rate_hz:=0.33")
SAYS = {"refused": "not that one", "busy": "32 fields are being computed: ask again later"}
REQUEST = FieldRequest("co2", 0.5, 0.0, 0.0, 1.0, 0.5)


class Service:
    """The peer as a twin: it answers when it is let, with the number of the request as value."""

    def __init__(self, peer: Peer) -> None:
        self.peer = peer
        self.asked: list[Any] = []
        peer.node.create_service(GetField, "/twin/get_field", self._answer)

    def _answer(self, request: Any, response: Any) -> Any:
        self.asked.append(request)
        if request.sensor_type in SAYS:
            response.error_message = SAYS[request.sensor_type]
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
async def started(timeout_s: float = 20.0) -> AsyncIterator[tuple[WebTwin, list[TwinUpdate]]]:
    twin, told = WebTwin(ros_args=(), timeout_s=timeout_s), list[TwinUpdate]()
    await twin.start(told.append, lambda: None)
    try:
        yield twin, told
    finally:
        await twin.stop()


async def found(twin: WebTwin) -> None:
    """Wait until the service is there to be asked."""
    client = await twin.thread.call(lambda node: node.clients_of_twin[Asked.FIELD])
    await until(client.service_is_ready, "the service")


def pending(twin: WebTwin) -> int:
    """Requests that the ROS client still keeps."""
    return len(twin.thread.require_node().clients_of_twin[Asked.FIELD]._pending_requests)


async def test_without_a_twin_a_field_is_refused_at_once_by_the_services_name(domain: int) -> None:
    async with started() as (twin, _):
        with pytest.raises(TwinUnavailableError, match="/twin/get_field: is it running"):
            await twin.field(REQUEST)


async def test_a_field_and_a_refusal_are_the_services(domain: int) -> None:
    with service_in(domain) as service:
        async with started() as (twin, _), service.answering():
            await found(twin)
            result = await twin.field(REQUEST)
            np.testing.assert_array_equal(result.grid.values, np.array([1.0, np.nan], np.float32))
            assert (result.grid.width, result.grid.height) == (2, 1)
            assert service.asked[0].bbox_max_x == 1.0
            with pytest.raises(FieldRefused, match="not that one"):
                await twin.field(replace(REQUEST, sensor_type="refused"))
            # Nobody's mistake, and it passes.
            with pytest.raises(TwinUnavailableError, match="32 fields are being computed"):
                await twin.field(replace(REQUEST, sensor_type="busy"))


async def test_identical_requests_in_flight_are_asked_once_and_a_change_is_asked_for_anew(
    domain: int,
) -> None:
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
            assert len({result.revision for result in old}) == 1
            assert old[0].revision != new[0].revision
            assert twin.field_revision(REQUEST) == new[0].revision


def state_of(value: float, seconds: int = 0) -> TwinState:
    reading = SensorReading(name="co2", value=value)
    state = TwinState(tags=[TwinTagState(tag_id="1", readings=[reading])])
    state.tags[0].last_observed.sec = state.header.stamp.sec = seconds
    return state


def has_more_than(things: Sized, number: int) -> bool:
    return len(things) > number


async def test_an_answer_stands_for_the_field_until_something_else_is_heard(
    domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    with service_in(domain) as service:
        async with started() as (twin, told), service.answering():
            await found(twin)
            assert twin.field_revision(REQUEST) is None, "nothing was answered yet"
            service.peer.publish("/twin/state", state_of(1.0), depth=1)
            await until(lambda: told, "a state")
            first = await twin.field(REQUEST)
            assert twin.field_revision(REQUEST) == first.revision
            assert twin.field_revision(replace(REQUEST, resolution=0.25)) is None
            # The service knows more by now than any state has told: another answer.
            second = await twin.field(REQUEST)
            assert second.revision != first.revision
            assert twin.field_revision(REQUEST) == second.revision
            # A value that comes back to what it was is a change all the same.
            for value in (2.0, 1.0):
                before = len(told)
                service.peer.publish("/twin/state", state_of(value), depth=1)
                await until(partial(has_more_than, told, before), "the change")
                assert twin.field_revision(REQUEST) is None
            assert told[-1].revision == told[0].revision
            # And there are changes that no state tells.
            await twin.field(REQUEST)
            now_s = time.monotonic()
            monkeypatch.setattr(time, "monotonic", lambda: now_s + REVISION_TTL_S + 1.0)
            assert twin.field_revision(REQUEST) is None


async def test_a_map_alone_ends_what_stood_and_is_no_sign_of_life(domain: int) -> None:
    with service_in(domain) as service:
        async with started() as (twin, told), service.answering():
            await found(twin)
            service.peer.publish("/twin/state", state_of(1.0), depth=1)
            await until(lambda: told and twin.revision() == told[-1].revision, "a state")
            await twin.field(REQUEST)
            assert twin.field_revision(REQUEST) is not None
            before = len(told)
            service.peer.publish_map(occupancy_grid([[0, 100]]))
            await until(lambda: twin.occupancy_map() is not None, "the map")
            assert twin.field_revision(REQUEST) is None
            assert twin.revision() != told[-1].revision
            assert len(told) == before


async def test_an_answer_that_came_after_a_change_stands_for_nothing(domain: int) -> None:
    """It may be from before: nobody knows, and a 304 by it would be a lie."""

    with service_in(domain) as service:
        async with started() as (twin, told):
            await found(twin)
            asked = asyncio.create_task(twin.field(REQUEST))
            await until(lambda: pending(twin), "the request to be on its way")
            service.peer.publish("/twin/state", state_of(1.0), depth=1)
            await until(lambda: told, "the change")
            async with service.answering():
                await asked
            assert twin.field_revision(REQUEST) is None


async def test_a_small_field_does_not_wait_behind_large_ones(domain: int) -> None:
    with service_in(domain) as service:
        async with started() as (twin, told):
            await found(twin)
            tags = [TwinTagState(tag_id=f"{number}") for number in range(50)]
            service.peer.publish("/twin/state", TwinState(tags=tags), depth=1)
            await until(lambda: told, "as many tags as make a field dear")
            large = [FieldRequest("co2", 0.002, n, 0.0, n + 2.0, 1.0) for n in range(8)]
            tasks = [asyncio.create_task(twin.field(request)) for request in large]
            await until(lambda: pending(twin) == MAX_REQUESTS - 1, "large ones on their way")
            small = asyncio.create_task(twin.field(REQUEST))
            await until(lambda: pending(twin) == MAX_REQUESTS, "the small one beside them")
            async with service.answering():
                await asyncio.gather(small, *tasks)


# --- one tag, one field: with a real twin, while observations come -------------------------------


def test_two_fields_of_a_real_twin_never_have_one_revision(domain: int) -> None:
    """Answers between two states hold what no state has told yet."""
    request = FieldRequest("co2", 0.5, 0.0, 0.0, 2.0, 2.0)

    async def test(peer: Peer) -> None:
        async with started() as (twin, told):
            await until(lambda: told, "a state")
            known: dict[str, float] = {}
            epochs = set()
            for value in range(1, 8):
                peer.observe(scan("1", {"co2": float(value)}, at=(1.0, 1.0)))
                while True:
                    epochs.add(twin._received.epoch)
                    answer = await twin.field(request)
                    assert known.setdefault(answer.revision, answer.grid.value_max) == (
                        answer.grid.value_max
                    )
                    assert twin.field_revision(request) in (answer.revision, None)
                    if answer.grid.value_max == value:
                        break
            assert len(known) >= 7
            assert len(epochs) < 7, "more than one field between two states"

    with twin_node(domain, *SLOW), Peer(domain) as peer:
        run(domain, test(peer))


async def test_only_so_many_requests_are_on_their_way_at_once(domain: int) -> None:
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


async def test_a_twin_that_does_not_answer_in_time_is_given_up(domain: int) -> None:
    with service_in(domain):
        async with started(timeout_s=0.3) as (twin, _):
            await found(twin)
            with pytest.raises(TwinTimeoutError, match=r"within 0\.3 s"):
                await twin.field(REQUEST)
            await until(lambda: not pending(twin), "the request to be forgotten")
