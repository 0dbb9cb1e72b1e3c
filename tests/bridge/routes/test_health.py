"""A bridge whose ROS thread has ended."""

import asyncio
import json
import sys

from websockets.asyncio.client import connect

from lupin_bridge.stream import schema
from lupin_twin.core.state import samples_of
from tests.support.inprocess import Running, running
from tests.support.messages import inspection, scan
from tests.support.ros import Peer
from tests.support.waiting import PATIENCE_S, until
from tests.support.web import ws_url


def reads(served: Running, tag_id: str, sensor_type: str) -> bool:
    """Whether the bridge has the tag's position and a reading of it."""
    latest = served.bridge.latest
    tags = () if latest is None else latest.snapshot.tags
    return bool(samples_of([tag for tag in tags if tag.tag_id == tag_id], sensor_type))


async def end_ros_thread(served: Running) -> None:
    """End the thread itself, which no callback should do, and which must be noticed."""
    waiting = asyncio.create_task(served.in_ros_thread(lambda _: sys.exit("the end")))
    await until(lambda: not served.twin.thread.is_alive, "the end of the ROS thread")
    waiting.cancel()


async def test_when_the_ros_thread_ends_health_reports_it_and_every_client_is_notified(
    domain: int,
) -> None:
    async with (
        running() as served,
        connect(ws_url(served.url), proxy=None, open_timeout=PATIENCE_S) as listener,
    ):
        assert json.loads(await listener.recv())["reason"] == "live"
        with Peer(domain) as peer:
            peer.observe(inspection("known", at=(1.0, 2.0)))
            peer.observe(scan("known", {"co2": 400.0}))
            await until(lambda: reads(served, "known", "co2"), "the last reading")
        await end_ros_thread(served)
        while (frame := json.loads(await listener.recv())).get("reason") != "thread_dead":
            pass
        schema.StatusFrame.model_validate(frame)
        assert (frame["twin"], "Restart" in frame["message"]) == ("offline", True)

        answer = await served.http.get("/healthz")
        assert answer.status_code == 503
        assert schema.Health.model_validate_json(answer.content).ok is False
        answer = await served.http.get("/readyz")
        assert (answer.status_code, answer.json()["reason"]) == (503, "thread_dead")
        # The last state and the log are still served, and a field that is first requested now is
        # computed from them; the status says that it is not live.
        assert (await served.http.get("/api/state")).status_code == 200
        answer = await served.http.get("/api/field?sensor_type=co2")
        found = answer.headers["x-field-sample-count"], answer.headers["x-field-value-max"]
        assert (answer.status_code, found) == (200, ("1", "400.0"))
        answer = await served.http.get("/api/estimate/quality?sensor_type=co2")
        assert (answer.status_code, "co2" in answer.text) == (200, True)
        async with connect(ws_url(served.url), proxy=None, open_timeout=PATIENCE_S) as late:
            assert json.loads(await late.recv())["reason"] == "thread_dead"
