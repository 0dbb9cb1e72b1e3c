"""Alarms and verdicts over HTTP and WebSocket: equal, and by the operator's file."""

from __future__ import annotations

import io
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from lupin_bridge.alarms.board import Change, board_of
from lupin_bridge.judge.judging import own_sensors
from lupin_bridge.routes.status import MAX_ALARMS
from lupin_bridge.stream import schema
from tests.support.inprocess import running
from tests.support.messages import inspection, scan
from tests.support.rosbridge import ros_at
from tests.support.seen import S, alarm
from tests.support.waiting import wait_for
from tests.support.web import Bridge, bridge


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


# --- verdicts -------------------------------------------------------------------------------------


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
