"""Verdicts over HTTP and WebSocket: the same, and by the file that the operator gave."""

import io
import json
import time
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from lupin_bridge.judge.judging import own_sensors
from lupin_bridge.judge.quantities import vapour_pressure_deficit_kpa
from lupin_bridge.stream import schema
from tests.support.messages import scan
from tests.support.waiting import wait_for
from tests.support.web import Bridge, bridge


def verdicts(live: Bridge) -> dict[str, str]:
    health = schema.Judgement.model_validate(live.json("/api/health"))
    return {tag_id: one.verdict for tag_id, one in health.tags.items()}


def test_the_verdict_is_in_the_frames_and_over_http_and_deltas_tell_what_changes() -> None:
    def tells(tag_id: str) -> Any:
        return lambda frame: tag_id in frame["health"]["tags"]

    with bridge() as live, live.listen(delta=1) as changes, live.listen() as whole:
        changes.until("state")  # of before
        live.peer.observe(scan("tag_1", {"temperature": 22.0}))
        fine = changes.until("delta", tells("tag_1"))["health"]
        assert fine["tags"]["tag_1"] == {"verdict": "healthy"}
        assert fine["house"]["verdict"] == "healthy"
        live.peer.observe(scan("tag_2", {"temperature": 6.0}))
        cold = changes.until("delta", tells("tag_2"))["health"]
        assert list(cold["tags"]) == ["tag_2"]
        assert cold["house"]["verdict"] == "critical"
        (reason,) = cold["tags"]["tag_2"]["reasons"]
        assert (reason["kind"], reason["sensor"]) == ("range", "temperature")
        assert (reason["value"], reason["limit"]) == (6.0, 10.0)

        told = whole.until("state", tells("tag_2"))["health"]
        assert told == live.json("/api/health")
        assert verdicts(live) == {"tag_1": "healthy", "tag_2": "critical"}


def test_the_operators_own_ranges_hold_and_are_asked_for_once(tmp_path: Path) -> None:
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


def test_what_is_derived_has_a_field_of_its_own() -> None:
    with bridge() as live:
        readings = {"temperature": 25.0, "humidity": 60.0}
        live.peer.observe(scan("tag_1", readings, at=(0.25, 0.25)))
        live.tag("tag_1", lambda tag: len(tag["readings"]) == 2)
        box = {"bbox_min_x": 0, "bbox_min_y": 0, "bbox_max_x": 0.5, "bbox_max_y": 0.5}
        asked: dict[str, Any] = {"sensor_type": "vpd", "resolution": 0.5, **box}
        field = live.json("/api/field", **asked)
        deficit = vapour_pressure_deficit_kpa(25.0, 60.0)
        assert field["values"] == [pytest.approx(deficit, rel=1e-6)]
        answer = live.get("/api/field.png", **asked)
        assert answer.headers["x-field-unit"] == "kPa"
        etag = {"If-None-Match": answer.headers["etag"]}
        assert live.get("/api/field.png", etag, **asked).status_code == 304


def test_a_bridge_that_starts_learns_the_rhythm_from_the_journal(tmp_path: Path) -> None:
    options = ("--ros-args", "-p", f"journal:={tmp_path / 'j.sqlite'}")
    now_s = time.time()
    with bridge(*options) as live:
        for hours in (4, 3, 2, 1):
            live.peer.observe(scan("tag_1", {"temperature": 22.0}, stamp_s=now_s - 3600 * hours))
        newest = int(now_s - 3600)
        live.tag("tag_1", lambda tag: tag["last_observed"]["sec"] == newest)
        # The end of `with` kills it: what its journal has not written yet would be lost.
        assert live.process.stop() == 0
    with bridge(*options) as again:
        wait_for(lambda: verdicts(again) == {"tag_1": "healthy"}, "an hourly rhythm to be known")
