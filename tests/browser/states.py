"""The page in each state of `tests/bridge/judge/states.json`, as one picture a colour scheme.

Nothing runs behind it: the states' own frames are handed to the page, and the field is computed
here. What the bridge makes of each state is what the judge's tests hold, and what the page's words
are those of `states.test.tsx`; here it is to be looked at, as a grower would.
"""

from __future__ import annotations

import io
import json
import mimetypes
from datetime import UTC, datetime, time
from pathlib import Path
from typing import Any, Final
from urllib.parse import parse_qs, urlsplit

import numpy as np
from PIL import Image
from playwright.sync_api import Browser, Page, Route, expect

import lupin_bridge
from lupin_twin.field.idw import compute_idw_field

HOME: Final = Path(lupin_bridge.__file__).parent
TABLE: Final = Path(__file__).parents[1] / "bridge/judge/states.json"
ORIGIN: Final = "http://states.test"
WIDTH, HEIGHT = 1000, 800
COLUMNS: Final = 4
Json = dict[str, Any]

# In the place of the page's connection: all at once, then a heartbeat, or it would be stale.
SOCKET: Final = """
window.WebSocket = class {
  constructor() {
    const frames = FRAMES;
    const [status, state] = frames;
    const say = (frame) => this.onmessage?.({ data: JSON.stringify(frame) });
    let seq = 1;
    setTimeout(() => {
      this.onopen?.();
      frames.forEach(say);
      setInterval(() => {
        say(status);
        if (state && status.twin === 'live') say({
          type: 'delta', seq: ++seq, base: seq - 1, revision: state.revision,
          header: state.state.header, changed: [], removed: [],
          health: { house: state.health.house, tags: {} },
        });
      }, 500);
    }, 1);
  }
  close() {}
};
"""


def time_of(seconds: float) -> Json:
    return {"sec": int(seconds), "nanosec": 0}


class State:
    """One of the table, as the page gets it."""

    def __init__(self, state: Json, alike: Json) -> None:
        hour = time.fromisoformat(state.get("clock", "12:00"))
        moment = datetime(2026, 6, 21, hour.hour, hour.minute, tzinfo=UTC)
        self.now_s = moment.timestamp()
        self.twin: str = state.get("twin", "live")
        self.house: Json = state["house"]
        self.alarms: list[list[str]] = state["alarms"]
        self.tags: dict[str, Json] = {
            tag_id: alike[tag] if isinstance(tag, str) else tag
            for tag_id, tag in state["tags"].items()
        }

    def frames(self) -> list[Json]:
        """All that comes over a new connection."""
        offline = self.twin != "live"
        status: Json = {
            "type": "status",
            "twin": "offline" if offline else "live",
            "reason": {"live": "live", "silent": "stale"}.get(self.twin, self.twin),
            "message": "",
            "state_age_seconds": 60.0 if offline else 0.0,
            "has_map": False,
            "origin": "robot",
            "drops": [],
            "journal": {
                "state": "recording",
                "detail": "recording",
                "set_aside": "",
                "simulated": None,
            },
            "outward": [],
            "input_problems": [],
        }
        if self.twin == "never_seen":
            return [status]
        state = {
            "type": "state",
            "seq": 1,
            "revision": "1",
            "state": {
                "header": {"stamp": time_of(self.now_s), "frame_id": "map"},
                "tags": [self.tag(index, tag_id) for index, tag_id in enumerate(self.tags)],
            },
            "health": self.health(),
        }
        alarms = {
            "type": "alarms",
            "alarms": [self.alarm(*alarm) for alarm in self.alarms],
            "source": "journal",
            "since": time_of(self.now_s - 86_400),
        }
        return [status, state, alarms]

    def tag(self, index: int, tag_id: str) -> Json:
        tag = self.tags[tag_id]
        x, y = self.place(index)
        read_at = [self.now_s - age_s for _, age_s in tag["readings"].values()]
        failed = tag.get("failed", [])
        has_looked = "species" in tag or "pest" in tag
        looked_s = self.now_s - tag.get("looked_s", 90)
        last_s = max([*read_at, *([looked_s] if has_looked else [])], default=0.0)
        newest = min(failed, key=lambda each: each[1], default=None)
        tried = max(read_at, default=None)
        if newest is not None:
            tried = self.now_s - newest[1]
        return {
            "tag_id": tag_id,
            "pose": {
                "position": {"x": x, "y": y, "z": 0},
                "orientation": {"x": 0, "y": 0, "z": 0, "w": 1},
            },
            "readings": [
                {
                    "name": name,
                    "value": value,
                    "observed_at": time_of(self.now_s - age_s),
                }
                for name, (value, age_s) in tag["readings"].items()
            ],
            "last_observed": time_of(last_s),
            "stale_seconds": self.now_s - last_s if last_s else None,
            "species": tag.get("species", ""),
            "species_confidence": 0.9 if tag.get("species") else None,
            "anomaly": tag.get("pest", 0) > 0,
            "flower_count": 0,
            "bug_count": tag.get("pest", 0),
            "flowers": [],
            "box_footprint": {"points": []},
            "looked_at": time_of(looked_s) if has_looked else None,
            "last_try": None if tried is None else time_of(tried),
            "last_try_status": None if tried is None else (newest[0] if newest else 0),
            "last_try_detail": "",
        }

    def place(self, index: int) -> tuple[float, float]:
        return 1.0 + 1.2 * (index % 3), 1.0 + 1.2 * (index // 3)

    def reason(self, kind: str, verdict: str, sensor: str, value: Any, limit: Any) -> Json:
        return {
            "kind": kind,
            "verdict": verdict,
            "sensor": sensor,
            "value": value,
            "limit": limit,
            "since": time_of(self.now_s - 540),
        }

    def health(self) -> Json:
        is_day, source = self.house["day"]
        ages = [age_s for tag in self.tags.values() for _, age_s in tag["readings"].values()]
        return {
            "house": {
                "verdict": self.house["verdict"],
                "reasons": [
                    self.reason(kind, "unknown", "", None, None) for kind in self.house["reasons"]
                ],
                "day": {"is_day": is_day, "source": source},
                "patrol": {
                    "interval_s": 120.0,
                    "last_scan": time_of(self.now_s - min(ages)) if ages else None,
                    "overdue": self.house["overdue"],
                },
            },
            "tags": {
                tag_id: {
                    "verdict": tag["verdict"],
                    "reasons": [self.reason(*reason) for reason in tag["reasons"]],
                }
                for tag_id, tag in self.tags.items()
            },
        }

    def alarm(self, tag_id: str, kind: str, sensor: str, verdict: str) -> Json:
        reasons = self.tags[tag_id]["reasons"] if tag_id else []
        value, limit = next(
            (reason[3:5] for reason in reasons if [reason[0], reason[2]] == [kind, sensor]),
            (None, None),
        )
        return {
            "id": f"{tag_id} {kind} {sensor}",
            "reason": self.reason(kind, verdict, sensor, value, limit),
            "tag_id": tag_id,
            "raised_at": time_of(self.now_s - 540),
            "cleared_at": None,
            "worst": None,
        }

    def field(self, sensor: str, resolution: float) -> tuple[bytes, dict[str, str]]:
        """The heat map of a sensor as `/api/field.npy` gives it."""
        samples = [
            (*self.place(index), float(tag["readings"][sensor][0]))
            for index, tag in enumerate(self.tags.values())
            if tag["readings"].get(sensor, [None])[0] is not None
        ]
        grid = compute_idw_field(
            samples,
            bbox_min_x=-0.5,
            bbox_min_y=-0.5,
            bbox_max_x=4.9,
            bbox_max_y=3.7,
            resolution=resolution,
            falloff_radius_m=1.5,
            max_distance_m=1.5,
            power=2.0,
        )
        body = io.BytesIO()
        np.save(body, np.asarray(grid.values, "<f4").reshape(grid.height, grid.width))
        facts = {
            "Width": grid.width,
            "Height": grid.height,
            "Origin-X": grid.origin_x,
            "Origin-Y": grid.origin_y,
            "Resolution": grid.resolution,
            "Value-Min": grid.value_min,
            "Value-Max": grid.value_max,
            "Sample-Count": grid.sample_count,
        }
        return body.getvalue(), {f"X-Field-{name}": str(value) for name, value in facts.items()}


def serve(page: Page, state: State) -> None:
    """Answer for the bridge."""

    def on_request(route: Route) -> None:
        url = urlsplit(route.request.url)
        path = url.path.lstrip("/") or "index.html"
        if path == "api/sensors":
            route.fulfill(
                body=(HOME / "sensors.json").read_bytes(), content_type="application/json"
            )
        elif path == "api/field.npy":
            query = parse_qs(url.query)
            body, headers = state.field(query["sensor_type"][0], float(query["resolution"][0]))
            route.fulfill(body=body, headers=headers, content_type="application/octet-stream")
        elif (file := HOME / "static" / path).is_file():
            kind = mimetypes.guess_type(path)[0] or "application/octet-stream"
            route.fulfill(body=file.read_bytes(), content_type=kind)
        else:
            route.fulfill(status=404, json={"detail": "not in this double"})

    page.add_init_script(SOCKET.replace("FRAMES", json.dumps(state.frames())))
    page.route("**/*", on_request)


def shoot_states(browser: Browser, folder: Path) -> None:
    """All states, light and dark, each as one picture of many."""
    table = json.loads(TABLE.read_text(encoding="utf-8"))
    for scheme in ("light", "dark"):
        pictures = []
        for said in table["states"]:
            with browser.new_context(
                viewport={"width": WIDTH, "height": HEIGHT},
                color_scheme="dark" if scheme == "dark" else "light",
                reduced_motion="reduce",
            ) as context:
                page = context.new_page()
                state = State(said, table["alike"])
                serve(page, state)
                page.goto(ORIGIN)
                expect(page.locator("tbody tr[data-tag-id]")).to_have_count(len(state.tags))
                expect(page.get_by_test_id("house-health")).to_have_attribute(
                    "data-health", said["house"]["verdict"]
                )
                page.evaluate("name => document.title = name", said["name"])
                page.wait_for_load_state("networkidle")
                pictures.append(Image.open(io.BytesIO(page.screenshot())).convert("RGB"))
        for first in range(0, len(pictures), 4 * COLUMNS):
            montage(pictures[first : first + 4 * COLUMNS]).save(
                folder / f"states-{scheme}-{first // (4 * COLUMNS) + 1}.png"
            )


def montage(pictures: list[Image.Image]) -> Image.Image:
    rows = -(-len(pictures) // COLUMNS)
    whole = Image.new("RGB", (COLUMNS * WIDTH // 2, rows * HEIGHT // 2), "white")
    for index, picture in enumerate(pictures):
        small = picture.resize((WIDTH // 2, HEIGHT // 2), Image.Resampling.LANCZOS)
        whole.paste(small, (index % COLUMNS * WIDTH // 2, index // COLUMNS * HEIGHT // 2))
    return whole
