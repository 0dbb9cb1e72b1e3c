"""The source of the role `web`, and a peer in place of its twin."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import pytest
from lupin_msgs.msg import SensorReading, TwinState, TwinTagState
from lupin_msgs.srv import GetEstimateReport

from lupin_bridge.feed.source import TwinTimeoutError, TwinUnavailableError, TwinUpdate
from lupin_bridge.feed.web import WebTwin
from lupin_twin.field.engine import FieldRefused
from lupin_twin.runtime.estimates import ReportRequest
from tests.support.messages import occupancy_grid
from tests.support.ros import Peer
from tests.support.waiting import until, until_answered

SAYS = {"refused": "not that one", "busy": "32 fields are being computed: ask again later"}
NAME = "/twin/get_estimate_report"


def state_of(value: float) -> TwinState:
    reading = SensorReading(name="co2", value=value)
    return TwinState(tags=[TwinTagState(tag_id="1", readings=[reading])])


@asynccontextmanager
async def started(timeout_s: float = 20.0) -> AsyncIterator[tuple[WebTwin, list[TwinUpdate]]]:
    twin, told = WebTwin(ros_args=(), timeout_s=timeout_s), list[TwinUpdate]()
    await twin.start(told.append, lambda: None)
    try:
        yield twin, told
    finally:
        await twin.stop()


async def test_a_map_alone_is_another_revision_and_no_sign_of_life(domain: int) -> None:
    with Peer(domain) as peer:
        async with started() as (twin, told):
            peer.publish("/twin/state", state_of(1.0), depth=1)
            await until(lambda: told and twin.revision() == told[-1].revision, "a state")
            before = len(told)
            peer.publish_map(occupancy_grid([[0, 100]]))
            await until(lambda: twin.occupancy_map() is not None, "the map")
            assert twin.revision() != told[-1].revision
            assert len(told) == before


async def test_without_a_twin_its_service_is_named(domain: int) -> None:
    async with started() as (twin, _):
        with pytest.raises(TwinUnavailableError, match=f"no twin offers {NAME}: is it running"):
            await twin.estimate_report(ReportRequest("co2"))


async def test_refusals_are_the_services_and_no_answer_is_waited_for_for_ever(domain: int) -> None:
    def answer(request: Any, response: Any) -> Any:
        response.error_message = SAYS[request.sensor_type]
        return response

    with Peer(domain) as peer:
        peer.node.create_service(GetEstimateReport, NAME, answer)
        async with started(timeout_s=0.5) as (twin, _):

            async def is_given_up() -> bool:
                try:
                    await twin.estimate_report(ReportRequest("refused"))
                except TwinTimeoutError as error:
                    return "within 0.5 s" in str(error)
                except TwinUnavailableError:  # not found yet
                    return False
                return False

            await until_answered(is_given_up, "the peer, which does not spin", bool)
            twin.timeout_s = 20.0
            for sensor, kind in (("refused", FieldRefused), ("busy", TwinUnavailableError)):
                asked = asyncio.create_task(twin.estimate_report(ReportRequest(sensor)))
                while not asked.done():
                    await asyncio.to_thread(peer.spin_briefly)
                with pytest.raises(kind, match=SAYS[sensor]):
                    await asked
