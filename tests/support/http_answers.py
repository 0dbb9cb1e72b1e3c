"""What a bridge answers over HTTP about a journal from elsewhere, as it can be compared.

Answers that go by this moment's clock have that taken out.
"""

from __future__ import annotations

import base64
import re
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from typing import Any
from urllib.parse import quote, urlencode

import httpx

from tests.support.domains import own_domain
from tests.support.live import attached, wait_until_ready
from tests.support.processes import OFTEN, limits, lupin_twin
from tests.support.ros import Peer
from tests.support.waiting import wait_for
from tests.support.web import Bridge

T0 = 1_763_683_200
HOUR = 3_600
# The journals are of a day long ago: nothing of them is to be given up at the start.
_KEPT = ("-p", "journal_days:=36500")
# What goes by this moment: ages, and moments long after the journals' own.
_NOW = re.compile(r'\{"sec":1(?:7[89]|[89]\d)\d{7},"nanosec":\d+\}|later than now, [0-9.]+ s')
_AGE = re.compile(r'"(stale_seconds|age_s|since_s)":[-+.0-9e]+')


@contextmanager
def bridges(journal: Path) -> Iterator[tuple[Bridge, Bridge]]:
    """`serve` on a journal, and `web` beside it."""
    with ExitStack() as stack:
        domain = stack.enter_context(own_domain())
        # The ranges of the build that answered first.
        sensors = Path(__file__).parents[1] / "fixtures" / "journals" / "sensors.json"
        options = (
            *("--sensors", str(sensors)),
            *("--time-zone", "UTC", "--day-hours", "06:00-20:00"),
            *limits(alarm_days=3_652, answers_per_s=10_000),
        )
        serve = stack.enter_context(
            lupin_twin(domain, "serve", *options, *OFTEN, "-p", f"journal:={journal}", *_KEPT)
        )
        peer = stack.enter_context(Peer(domain))
        web = stack.enter_context(lupin_twin(domain, "web", *options))
        found = [stack.enter_context(attached(process, peer)) for process in (serve, web)]
        for bridge in found:
            wait_until_ready(bridge)
            wait_for(partial(_remembers, bridge), "the past")
        yield found[0], found[1]


def _remembers(bridge: Bridge) -> bool:
    return bridge.http.get(f"/api/state?at={T0}").status_code == 200


def ask(bridge: Bridge, path: str) -> list[Any]:
    """[status, media type, body] of an answer, of any but texts the body in base64."""
    response = bridge.http.get(path)
    kind = response.headers.get("content-type", "")
    if not kind.startswith(("text/", "application/json")):
        return [response.status_code, kind, base64.b64encode(response.content).decode()]
    return [response.status_code, kind, _still(path, response)]


def _still(path: str, response: httpx.Response) -> str:
    text = _NOW.sub("now", response.text)
    return text if "at=" in path else _AGE.sub(r'"\1":0', text)


def questions(tags: list[str], sensors: list[str], hours: int) -> list[str]:
    """Paths with a query over every route that looks back."""

    def path(route: str, **query: Any) -> str:
        query = {name.rstrip("_"): value for name, value in query.items()}
        return f"{route}?{urlencode(query)}" if query else route

    moments = [T0 - HOUR, T0, T0 + 0.5, *(T0 + HOUR * hours * k // 6 for k in range(1, 7))]
    day = {"from_": T0, "to": T0 + HOUR * hours}
    part = {"from_": T0 + HOUR, "to": T0 + 2.5 * HOUR}
    wide = {"from_": T0 - 40 * HOUR, "to": T0 + 2000 * HOUR}
    asked = [path("/api/state"), path("/api/sensors"), path("/api/map"), path("/api/map.png")]
    for at in moments:
        asked += [path("/api/state", at=at), path("/api/health", at=at)]
        asked += [path(f"/api/tags/{quote(tag)}", at=at) for tag in tags[:2]]
        asked.append(path("/api/field.json", sensor_type=sensors[0], resolution=0.5, at=at))
        asked.append(path("/api/field/quality", sensor_type=sensors[0], at=at))
    at = moments[-2]
    for sensor in (*sensors[:2], "vpd", "dew_point"):
        for form in ("json", "png", "npy"):
            asked.append(path(f"/api/field.{form}", sensor_type=sensor, resolution=1, at=at))
        for form in ("json", "npy"):
            asked.append(path(f"/api/estimate.{form}", sensor_type=sensor, resolution=1, at=at))
    asked.append(path("/api/estimate/tags", sensor_type=sensors[0], at=at))
    asked.append(path("/api/estimate/advice", sensor_type=sensors[0], at=at))
    for period in (day, part, wide):
        for tag in tags:
            for sensor in (*sensors[:2], "~scans", "~failures", "~pests_seen", "~silences"):
                asked.append(path("/api/history", tag_id=tag, sensor_type=sensor, **period))
        asked.append(
            path("/api/history", tag_id=tags[0], sensor_type=sensors[0], points=10, **period)
        )
        asked.append(path("/api/history", tag_id="*", sensor_type="~looks", **period))
        asked.append(path("/api/timeline", **period))
        asked.append(path("/api/timeline", points=24, tag_id=tags[1], **period))
        asked.append(path("/api/export.csv", **period))
        asked.append(path("/api/export.csv", tag_id=tags[0], sensor_type=sensors[0], **period))
        asked += [path("/api/alarms", **period), path("/api/alarms", active=1, **period)]
    asked += [path(f"/api/tags/{quote(tag)}/history") for tag in tags]
    asked += [
        path("/api/state", at="soon"),
        path("/api/state", at=2**31 - 1),
        path("/api/state", at="2025-11-21T06:00:00Z"),
        path("/api/tags/nobody", at=at),
        path("/api/field.json", sensor_type="", at=at),
        path("/api/field.json", sensor_type="nothing", at=at, resolution=1),
        path("/api/history", tag_id="", sensor_type=sensors[0]),
        path("/api/history", tag_id=tags[0], sensor_type="~moons"),
        path("/api/history", tag_id=tags[0], sensor_type=sensors[0], from_=5, to=4),
        path("/api/history", tag_id=tags[0], sensor_type=sensors[0], points=5001, **day),
        path("/api/timeline", points=0, **day),
        path("/api/export.csv", from_="yesterday"),
        path("/api/alarms", active=2),
    ]
    return asked
