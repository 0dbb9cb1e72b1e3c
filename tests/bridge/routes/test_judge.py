"""Verdicts over HTTP and WebSocket: equal, and by the operator's file."""

import io
import json
from pathlib import Path
from typing import Any

from PIL import Image

from lupin_bridge.judge.judging import own_sensors
from lupin_bridge.stream import schema
from tests.support.messages import scan
from tests.support.waiting import wait_for
from tests.support.web import Bridge, bridge


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
