"""The HTTP answers of a bridge about a journal from elsewhere, in a form to compare.

Parts that depend on the current time are removed.
"""

import base64
import re
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import httpx

from tests.support.live import serve_and_web, wait_until_ready
from tests.support.processes import OFTEN, limits
from tests.support.waiting import wait_for
from tests.support.web import Bridge

T0 = 1_763_683_200
HOUR = 3_600
# The journals are of a day long ago: nothing in them may be deleted at the start.
_STORED = ("-p", "journal_days:=36500")
# Parts that depend on the current time: ages, and moments long after the journals' own.
_NOW = re.compile(r'\{"sec":1(?:7[89]|[89]\d)\d{7},"nanosec":\d+\}|later than now, [0-9.]+ s')
_AGE = re.compile(r'"(stale_seconds|age_s|since_s)":[-+.0-9e]+')


# With the ranges of the build that answered first.
OPTIONS = (
    *("--sensors", str(Path(__file__).parents[1] / "fixtures" / "journals" / "sensors.json")),
    *("--time-zone", "UTC", "--day-hours", "06:00-20:00"),
    *limits(alarm_days=3_652, answers_per_s=10_000),
)


@contextmanager
def bridges(journal: Path) -> Iterator[tuple[Bridge, Bridge]]:
    """`serve` on a journal, and `web` beside it."""
    recorded = (*OFTEN, "-p", f"journal:={journal}", *_STORED)
    with serve_and_web(*recorded, of_both=OPTIONS) as both:
        for bridge in both:
            wait_until_ready(bridge)
            wait_for(partial(_remembers, bridge), "the past")
        yield both


def _remembers(bridge: Bridge) -> bool:
    return bridge.http.get(f"/api/state?at={T0}").status_code == 200


def query(http: httpx.Client, path: str) -> list[Any]:
    """[status, media type, body] of an answer; a body that is not text in base64."""
    response = http.get(path)
    kind = response.headers.get("content-type", "")
    if not kind.startswith(("text/", "application/json")):
        return [response.status_code, kind, base64.b64encode(response.content).decode()]
    return [response.status_code, kind, _still(path, response)]


def _still(path: str, response: httpx.Response) -> str:
    text = _NOW.sub("now", response.text)
    return text if "at=" in path else _AGE.sub(r'"\1":0', text)
