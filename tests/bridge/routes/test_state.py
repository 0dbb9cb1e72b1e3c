"""States, alarms and verdicts over WebSocket and HTTP, from a real twin that a real peer feeds."""

from __future__ import annotations

import asyncio
import io
import json
import math
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pytest
from lupin_msgs.msg import Observation
from PIL import Image
from websockets.asyncio.client import connect

from lupin_bridge.alarms.board import Change, board_of
from lupin_bridge.judge.judging import own_sensors
from lupin_bridge.judge.quantities import DERIVED
from lupin_bridge.routes.state import MAX_REASON_BYTES
from lupin_bridge.routes.status import MAX_ALARMS
from lupin_bridge.stream import schema
from lupin_twin.core.state import samples_of
from tests.support.inprocess import Running, running
from tests.support.messages import discovered, inspection, pose, scan
from tests.support.ros import Peer
from tests.support.rosbridge import ros_at
from tests.support.seen import S, alarm
from tests.support.waiting import PATIENCE_S, until, wait_for
from tests.support.web import Bridge, bridge, filled, ws_url
from tests.support.ws_client import last_word

# The twin publishes only once in 100 s: anything earlier is due to a change, or is the
# bridge's own heartbeat, which does not change the revision.
SILENT = ("--ros-args", "-p", "state_publish_rate_hz:=0.01", "-p", "buffer_len:=3")


@pytest.fixture(scope="module")
def twin() -> Iterator[Bridge]:
    """A bridge for many tests, each with its own tags."""
    with bridge(*SILENT) as running:
        yield running


def test_a_change_is_pushed_before_the_twins_next_publication(twin: Bridge) -> None:
    with twin.listen() as listener, twin.listen(max_rate_hz=0.01) as rare:
        listener.until("state")
        rare.until("state")
        twin.peer.observe(scan("pushed", {"co2": 500.0}, at=(1, 2)))
        listener.until_tag("pushed")
        twin.peer.discover(discovered({"seen": pose(3, 3)}))
        listener.until_tag("seen")
        twin.peer.observe(inspection("looked at", anomaly=True))
        listener.until_tag("looked at")
        assert not [frame for frame in rare.rest() if frame["type"] == "state"], "due in 100 s"


def test_an_invalid_request_is_refused_with_the_reason(twin: Bridge) -> None:
    reasons = {
        "rate": "parameter 'rate' is unknown, expected delta, max_rate_hz",
        "max_rate_hz": ("max_rate_hz is '" + r"\U0001f337" * 40)[:MAX_REASON_BYTES],
    }
    for name, reason in reasons.items():
        with twin.listen(**{name: "\U0001f337" * 40}) as refused:
            assert last_word(refused.connection) == (1008, reason)


def test_a_live_bridge_is_healthy_and_ready(twin: Bridge) -> None:
    health = schema.Health.model_validate(twin.json("/healthz"))
    assert (health.ok, health.callback_errors) == (True, 0)
    ready = schema.StatusFrame.model_validate(twin.json("/readyz"))
    assert (ready.twin, ready.reason) == ("live", "live")
    assert ready.state_age_seconds is not None
    for path in ("/healthz", "/readyz", "/api/state"):
        assert twin.get(path).headers["cache-control"] == "no-store"


@pytest.mark.parametrize("path", ["/api/tags/nobody", "/api/tags/nobody/history"])
def test_an_unknown_tag_is_a_404_with_its_name(twin: Bridge, path: str) -> None:
    known = len(twin.json("/api/state")["tags"])
    answer = twin.get(path)
    assert answer.status_code == 404
    message = schema.ErrorMessage.model_validate_json(answer.content)
    assert message.detail == f"no tag 'nobody' is known ({known} others are)"


@pytest.mark.parametrize(
    "tag_id", ["ä 日本", "100%", "a?b=c#d", "..", '"a\\b', "%2F", " ", "/", "../x"]
)
def test_any_tag_id_is_found_by_its_percent_encoded_name(twin: Bridge, tag_id: str) -> None:
    twin.peer.observe(scan(tag_id, {"co2": 1.0}))
    twin.tag(tag_id)
    encoded = quote(tag_id, safe="").replace("..", "%2E%2E")
    assert twin.json(f"/api/tags/{encoded}")["tag_id"] == tag_id
    assert twin.json(f"/api/tags/{encoded}/history")["tag_id"] == tag_id


@pytest.mark.parametrize("tag_id", ["%00", "%FF%FE", "%0d%0aSet-Cookie:x=1", "x" * 4_000, "a%2Fb"])
def test_a_hostile_tag_id_is_a_plain_404(twin: Bridge, tag_id: str) -> None:
    for path in (f"/api/tags/{tag_id}", f"/api/tags/{tag_id}/history"):
        answer = twin.get(path)
        assert answer.status_code == 404
        assert len(schema.ErrorMessage.model_validate_json(answer.content).detail) < 400
        assert "set-cookie" not in answer.headers
        assert answer.headers["content-type"] == "application/json"


def history(twin: Bridge, tag_id: str) -> dict[str, list[Any]]:
    """The past values of each sensor of a tag, oldest first."""
    sensors = twin.json(f"/api/tags/{tag_id}/history")["sensors"]
    return {sensor["name"]: [v["value"] for v in sensor["values"]] for sensor in sensors}


def test_a_history_holds_the_last_scans_and_no_inspection(twin: Bridge) -> None:
    for number, value in enumerate((0.0, 1.0, 2.0, 3.0, math.nan)):
        twin.peer.observe(scan("past", {"co2": value}, stamp_s=100.25 + number))
    air = {"temperature": 25.0, "humidity": 60.0}
    twin.peer.observe(scan("past", {"light": 900.0, **air}, stamp_s=110.0), inspection("past"))
    twin.tag("past", lambda tag: tag["species"])
    # `buffer_len` is 3.
    expected = {"co2": [3.0, None], "light": [900.0], "temperature": [25.0], "humidity": [60.0]}
    expected |= {it.name: [pytest.approx(it.formula(25.0, 60.0))] for it in DERIVED.values()}
    wait_for(lambda: history(twin, "past") == expected, "all in the log")
    values = twin.json("/api/tags/past/history")["sensors"][0]["values"]
    assert values[0]["stamp"] == {"sec": 103, "nanosec": 250_000_000}


def test_attempts_and_their_times_are_reported(twin: Bridge) -> None:
    """10 s: a scan; 3610 s: an inspection; 7210 s: a scan of light; 7300 s: a failed attempt."""
    failed = scan("told", status=Observation.STATUS_SCAN_FAILED, stamp_s=7300.0)
    failed.status_detail = "not decoded"
    twin.peer.observe(
        scan("told", {"co2": 400.0, "light": 1.0}, stamp_s=10.0),
        inspection("told", stamp_s=3610.0),
        scan("told", {"light": 2.0}, stamp_s=7210.0),
        failed,
        scan("told", {"light": 2.0}, stamp_s=7210.0),
    )
    tag = twin.tag("told", lambda tag: bool(filled(tag)["last_try_status"]))
    assert [reading["observed_at"]["sec"] for reading in tag["readings"]] == [10, 7210]
    assert (tag["last_observed"]["sec"], tag["looked_at"]["sec"]) == (7210, 3610)
    assert (tag["last_try"]["sec"], tag["last_try_status"]) == (7300, 2)
    assert tag["last_try_detail"] == "not decoded"
    expected = {"co2": [400.0], "light": [1.0, 2.0]}
    wait_for(lambda: history(twin, "told") == expected, "all readings in the log")
    path = "/api/tags/told/history"
    wait_for(lambda: twin.json(path)["tries"][-1]["status"] == 2, "the failed attempt too")
    past = twin.json(path)
    schema.TagHistory.model_validate(past)
    assert (past["tag_id"], past["source"]) == ("told", "test")
    assert [(each["stamp"]["sec"], each["status"], each["kind"]) for each in past["tries"]] == [
        (3610, 0, 1), (7210, 0, 0), (7300, 2, 0),
    ]  # fmt: skip
    assert past["tries"][-1]["status_detail"] == "not decoded"


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
        # computed from them; the status says that it is not twin.
        assert (await served.http.get("/api/state")).status_code == 200
        answer = await served.http.get("/api/field?sensor_type=co2")
        found = answer.headers["x-field-sample-count"], answer.headers["x-field-value-max"]
        assert (answer.status_code, found) == (200, ("1", "400.0"))
        answer = await served.http.get("/api/estimate/quality?sensor_type=co2")
        assert (answer.status_code, "co2" in answer.text) == (200, True)
        async with connect(ws_url(served.url), proxy=None, open_timeout=PATIENCE_S) as late:
            assert json.loads(await late.recv())["reason"] == "thread_dead"


@pytest.fixture(scope="module")
def live() -> Iterator[Bridge]:
    """With a journal that is deleted at the end."""
    with bridge("--ros-args", "-p", "journal:=off") as running:
        running.peer.wait_for_twin()
        running.peer.observe(inspection("a", anomaly=True, bug_count=2))
        wait_for(lambda: alarms(running), "the alarm")
        yield running


def alarms(live: Bridge, **query: Any) -> list[schema.Alarm]:
    body = schema.Alarms.model_validate(live.json("/api/alarms", **query))
    return body.alarms


def test_alarms_come_from_the_journal_and_the_answer_names_it(live: Bridge) -> None:
    body = schema.Alarms.model_validate(live.json("/api/alarms"))
    [pest] = body.alarms
    assert (pest.tag_id, pest.reason.kind, pest.worst, pest.cleared_at) == ("a", "pest", 2.0, None)
    assert (body.source, body.since) == ("journal", pest.raised_at)
    with live.listen() as page:
        frame = page.until("alarms", lambda frame: bool(frame["alarms"]))
    schema.AlarmsFrame.model_validate(frame)
    assert list(frame) == ["type", "notes", "alarms", "source", "since"]
    answer = live.json("/api/alarms")
    assert {name: frame[name] for name in answer} == answer
    assert list(answer["alarms"][0]) == [
        *("id", "reason", "tag_id", "raised_at", "cleared_at", "worst")
    ]
    with ros_at(live.url) as ros:
        ros.subscribe()
        live.peer.observe(inspection("b"))
        live.peer.observe(inspection("a"))
        live.peer.observe(inspection("a"))
        wait_for(lambda: not alarms(live, active=1), "it to be cleared")
        # roslib receives the ROS message without alarms.
        ros.send(op="call_service", service="/rosapi/topics", id="the end")
        while (message := ros.next()).get("id") != "the end":
            assert message["op"] == "publish"
    [over] = alarms(live, active=0)
    assert (over.id, over.cleared_at is not None) == (pest.id, True)
    assert over.cleared_at is not None
    until = over.cleared_at.sec + over.cleared_at.nanosec / 1e9
    assert alarms(live, to=pest.raised_at.sec) == []
    assert len(alarms(live, **{"from": until - 1.0})) == 1
    assert "lupin_alarms_active 0" in live.get("/metrics").text


@pytest.mark.parametrize(
    ("query", "says"),
    [
        ({"active": "yes"}, "active is 'yes': input should be '0' or '1'"),
        ({"from": "x"}, "from"),
        ({"from": 2, "to": 1}, "from"),
        ({"tag_id": "a"}, "tag_id"),
    ],
)
def test_an_impossible_query_is_refused(live: Bridge, query: dict[str, Any], says: str) -> None:
    answer = live.get("/api/alarms", **query)
    assert (answer.status_code, says in answer.json()["detail"]) == (400, True)


async def test_a_period_has_the_alarms_that_were_active_in_it_and_their_number_is_limited(
    domain: int,
) -> None:
    over, still = alarm("1", raised_ns=20 * S, cleared_ns=30 * S), alarm("2", raised_ns=40 * S)
    async with running() as it:

        async def found(query: str = "") -> str:
            answer = await it.http.get(f"/api/alarms?{query}")
            return "".join(sorted(alarm["tag_id"] for alarm in answer.json()["alarms"]))

        # The bridge's own alarms, none, replace others when they are first known.
        await until(lambda: it.bridge.alarms.now.source == "journal", "the journal's alarms")
        it.bridge.alarms.put(board_of([over, still]), Change((over, still)), "journal", 0)
        assert await found() == await found("from=30&to=41") == "12"
        assert await found("from=31&to=41") == await found("from=31") == await found("active=1")
        assert await found("active=1") == "2"
        assert await found("from=21&to=40") == await found("to=21") == await found("active=0")
        assert await found("active=0") == "1"
        assert await found("to=20") == await found("from=31&to=40") == ""
        many = [alarm(str(number)) for number in range(MAX_ALARMS + 1)]
        it.bridge.alarms.put(board_of(many), Change(tuple(many)), "journal", 0)
        assert len((await it.http.get("/api/alarms")).json()["alarms"]) == MAX_ALARMS


def verdicts(live: Bridge) -> dict[str, str]:
    health = schema.Judgement.model_validate(live.json("/api/health"))
    return {tag_id: one.verdict for tag_id, one in health.tags.items()}


def test_frames_and_http_have_the_verdict_and_deltas_its_changes() -> None:
    def reports(tag_id: str) -> Any:
        return lambda frame: tag_id in frame["health"]["tags"]

    with bridge() as live, live.listen(delta=1) as changes, live.listen() as whole:
        changes.until("state")  # from before
        live.peer.observe(scan("tag_1", {"temperature": 22.0}))
        delta = changes.until("delta", reports("tag_1"))
        schema.DeltaFrame.model_validate(delta)
        fine = delta["health"]
        assert fine["tags"]["tag_1"] == {"verdict": "healthy"}
        assert fine["house"]["verdict"] == "healthy"
        live.peer.observe(scan("tag_2", {"temperature": 6.0}))
        cold = changes.until("delta", reports("tag_2"))["health"]
        assert list(cold["tags"]) == ["tag_2"]
        assert cold["house"]["verdict"] == "critical"
        last_scan = live.tag("tag_2")["last_observed"]
        assert cold["tags"]["tag_2"]["reasons"] == [
            {
                "kind": "range",
                "verdict": "critical",
                "sensor": "temperature",
                "value": 6.0,
                "limit": 10.0,
                "since": last_scan,
            }
        ]
        reported = whole.until("state", reports("tag_2"))["health"]
        assert reported == live.json("/api/health")
        assert reported["house"]["patrol"]["last_scan"] == last_scan
        assert verdicts(live) == {"tag_1": "healthy", "tag_2": "critical"}


def test_the_operators_own_ranges_apply_and_are_queried_once(tmp_path: Path) -> None:
    file = tmp_path / "sensors.json"
    text = own_sensors().text.replace('"critical": [10, 35],', '"critical": [-30, 35],')
    text = text.replace('"ideal": [18, 26]', '"ideal": [-20, 26]')
    text = text.replace('"unit": "°C", "hue": 8,', '"unit": "K", "hue": 120,')
    file.write_text(text, "utf-8")
    with bridge(f"--sensors={file}") as live:
        live.peer.observe(scan("tag_1", {"temperature": -10.0}, at=(0.5, 0.5)))
        wait_for(lambda: verdicts(live) == {"tag_1": "healthy"}, "the verdict by these ranges")
        picture = live.get("/api/field.png", sensor_type="temperature")
        assert picture.headers["x-field-unit"] == "K"
        with Image.open(io.BytesIO(picture.content)) as image:
            pixel = image.convert("RGBA").getpixel((15, 15))
        assert isinstance(pixel, tuple)
        red, green, blue, alpha = pixel
        assert green > 2 * max(red, blue)
        assert alpha > 0
        answer = live.get("/api/sensors")
        assert answer.text == text
        assert answer.json() == json.loads(text)
        again = live.get("/api/sensors", {"If-None-Match": answer.headers["etag"]})
        assert (again.status_code, again.content) == (304, b"")
