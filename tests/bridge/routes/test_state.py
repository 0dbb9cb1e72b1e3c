"""The state over WebSocket and HTTP, from a real twin that a real peer feeds."""

import asyncio
import json
import math
import sys
from collections.abc import Iterator
from typing import Any
from urllib.parse import quote

import pytest
from lupin_msgs.msg import Observation
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosedError

from lupin_bridge.routes.state import MAX_REASON_BYTES
from lupin_bridge.stream import schema
from lupin_twin.core.state import samples_of
from tests.support.inprocess import Running, running
from tests.support.messages import discovered, inspection, pose, scan
from tests.support.ros import Peer
from tests.support.waiting import PATIENCE_S, until, wait_for
from tests.support.web import Bridge, bridge, filled, ws_url

# The twin publishes only once in 100 s: anything earlier is due to a change, or is the
# bridge's own heartbeat, which does not change the revision.
SILENT = ("--ros-args", "-p", "state_publish_rate_hz:=0.01", "-p", "buffer_len:=3")


@pytest.fixture(scope="module")
def live() -> Iterator[Bridge]:
    """A bridge for many tests, each with its own tags."""
    with bridge(*SILENT) as running:
        yield running


# --- WebSocket ----------------------------------------------------------------------------------


def test_a_change_is_pushed_before_the_twins_next_publication(live: Bridge) -> None:
    with live.listen() as listener, live.listen(max_rate_hz=0.01) as rare:
        listener.until("state")
        rare.until("state")
        live.peer.observe(scan("pushed", {"co2": 500.0}, at=(1, 2)))
        listener.until_tag("pushed")
        live.peer.discover(discovered({"seen": pose(3, 3)}))
        listener.until_tag("seen")
        live.peer.observe(inspection("looked at", anomaly=True))
        listener.until_tag("looked at")
        assert not [frame for frame in rare.rest() if frame["type"] == "state"], "due in 100 s"


def test_an_invalid_request_is_refused_with_the_reason(live: Bridge) -> None:
    reasons = {
        "rate": "parameter 'rate' is unknown, expected delta, max_rate_hz",
        "max_rate_hz": ("max_rate_hz is '" + r"\U0001f337" * 40)[:MAX_REASON_BYTES],
    }
    for name, reason in reasons.items():
        with live.listen(**{name: "\U0001f337" * 40}) as refused:
            with pytest.raises(ConnectionClosedError) as closed:
                refused.next()
            assert closed.value.rcvd is not None
            assert closed.value.rcvd.code == 1008
            assert closed.value.rcvd.reason == reason


# --- one tag ------------------------------------------------------------------------------------


def test_a_live_bridge_is_healthy_and_ready(live: Bridge) -> None:
    health = schema.Health.model_validate(live.json("/healthz"))
    assert (health.ok, health.callback_errors) == (True, 0)
    ready = schema.StatusFrame.model_validate(live.json("/readyz"))
    assert (ready.twin, ready.reason) == ("live", "live")
    assert ready.state_age_seconds is not None
    for path in ("/healthz", "/readyz", "/api/state"):
        assert live.get(path).headers["cache-control"] == "no-store"


@pytest.mark.parametrize("path", ["/api/tags/nobody", "/api/tags/nobody/history"])
def test_an_unknown_tag_is_a_404_with_its_name(live: Bridge, path: str) -> None:
    known = len(live.json("/api/state")["tags"])
    answer = live.get(path)
    assert answer.status_code == 404
    message = schema.ErrorMessage.model_validate_json(answer.content)
    assert message.detail == f"no tag 'nobody' is known ({known} others are)"


@pytest.mark.parametrize(
    "tag_id", ["ä 日本", "100%", "a?b=c#d", "..", '"a\\b', "%2F", " ", "/", "../x"]
)
def test_any_tag_id_is_found_by_its_percent_encoded_name(live: Bridge, tag_id: str) -> None:
    live.peer.observe(scan(tag_id, {"co2": 1.0}))
    live.tag(tag_id)
    encoded = quote(tag_id, safe="").replace("..", "%2E%2E")
    assert live.json(f"/api/tags/{encoded}")["tag_id"] == tag_id
    assert live.json(f"/api/tags/{encoded}/history")["tag_id"] == tag_id


@pytest.mark.parametrize("tag_id", ["%00", "%FF%FE", "%0d%0aSet-Cookie:x=1", "x" * 4_000, "a%2Fb"])
def test_a_hostile_tag_id_is_a_plain_404(live: Bridge, tag_id: str) -> None:
    for path in (f"/api/tags/{tag_id}", f"/api/tags/{tag_id}/history"):
        answer = live.get(path)
        assert answer.status_code == 404
        assert len(schema.ErrorMessage.model_validate_json(answer.content).detail) < 400
        assert "set-cookie" not in answer.headers
        assert answer.headers["content-type"] == "application/json"


# --- history ------------------------------------------------------------------------------------


def history(live: Bridge, tag_id: str) -> dict[str, list[Any]]:
    """The past values of each sensor of a tag, oldest first."""
    sensors = live.json(f"/api/tags/{tag_id}/history")["sensors"]
    return {sensor["name"]: [v["value"] for v in sensor["values"]] for sensor in sensors}


def test_a_history_holds_the_last_scans_and_no_inspection(live: Bridge) -> None:
    for number, value in enumerate((0.0, 1.0, 2.0, 3.0, math.nan)):
        live.peer.observe(scan("past", {"co2": value}, stamp_s=100.25 + number))
    live.peer.observe(scan("past", {"light": 900.0}, stamp_s=110.0), inspection("past"))
    live.tag("past", lambda tag: tag["species"])
    expected = {"co2": [3.0, None], "light": [900.0]}  # `buffer_len` is 3
    wait_for(lambda: history(live, "past") == expected, "all in the log")
    values = live.json("/api/tags/past/history")["sensors"][0]["values"]
    assert values[0]["stamp"] == {"sec": 103, "nanosec": 250_000_000}


def test_attempts_and_their_times_are_reported(live: Bridge) -> None:
    """10 s: a scan; 3610 s: an inspection; 7210 s: a scan of light; 7300 s: a failed attempt."""
    failed = scan("told", status=Observation.STATUS_SCAN_FAILED, stamp_s=7300.0)
    failed.status_detail = "not decoded"
    live.peer.observe(
        scan("told", {"co2": 400.0, "light": 1.0}, stamp_s=10.0),
        inspection("told", stamp_s=3610.0),
        scan("told", {"light": 2.0}, stamp_s=7210.0),
        failed,
        scan("told", {"light": 2.0}, stamp_s=7210.0),
    )
    tag = live.tag("told", lambda tag: bool(filled(tag)["last_try_status"]))
    assert [reading["observed_at"]["sec"] for reading in tag["readings"]] == [10, 7210]
    assert (tag["last_observed"]["sec"], tag["looked_at"]["sec"]) == (7210, 3610)
    assert (tag["last_try"]["sec"], tag["last_try_status"]) == (7300, 2)
    assert tag["last_try_detail"] == "not decoded"
    expected = {"co2": [400.0], "light": [1.0, 2.0]}
    wait_for(lambda: history(live, "told") == expected, "all in the log")
    past = live.json("/api/tags/told/history")
    schema.TagHistory.model_validate(past)
    assert (past["tag_id"], past["source"]) == ("told", "test")
    assert [(each["stamp"]["sec"], each["status"], each["kind"]) for each in past["tries"]] == [
        (3610, 0, 1), (7210, 0, 0), (7300, 2, 0),
    ]  # fmt: skip
    assert past["tries"][-1]["status_detail"] == "not decoded"


# --- a bridge whose ROS thread has ended ----------------------------------------------------------


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
