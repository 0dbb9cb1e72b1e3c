"""The robot of the live bench: fills a twin with tags, then scans some of them at a steady rate.

Run as `python -m tests.bench.live_robot --domain D --url U --tags N --rate-hz R`, with the address
of the twin's bridge. It prints `filled` when the twin knows all tags, and goes on until it is
killed. It scans the first `SCANNED` tags in turn. A scan has five sensors, and the reading of
`beat` is this machine's CLOCK_MONOTONIC at its publication: a receiver can compute its delay.
"""

import argparse
import contextlib
import itertools
import time
from typing import Any

import httpx

from tests.support.messages import inspection, scan
from tests.support.ros import Peer
from tests.support.waiting import wait_for

BEAT = "beat"
# As many as a robot reaches in a small greenhouse, however many the twin knows.
SCANNED = 30
# Two messages a tag, and the topic holds 50: a confirmed batch has lost none.
BATCH = 20


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--domain", type=int, required=True)
    parser.add_argument("--url", required=True)
    parser.add_argument("--tags", type=int, required=True)
    parser.add_argument("--rate-hz", type=float, required=True)
    options = parser.parse_args()
    with Peer(options.domain, "bench_robot") as peer:
        peer.wait_for_twin()
        with httpx.Client(base_url=options.url, trust_env=False) as http:
            fill(peer, http, options.tags)
        print("filled", flush=True)
        with contextlib.suppress(KeyboardInterrupt):
            beat(peer, 1.0 / options.rate_hz, min(options.tags, SCANNED))


def fill(peer: Peer, http: httpx.Client, tags: int) -> None:
    """Publish every tag, no faster than the twin takes them."""
    for start in range(0, tags, BATCH):
        last = min(start + BATCH, tags) - 1
        for number in range(start, last + 1):
            peer.observe(*tag_messages(number))
        wait_for(
            lambda last=last: http.get(f"/api/tags/{last}").json().get("flowers"),  # type: ignore[misc]
            f"tag {last} in the twin",
        )


def tag_messages(number: int) -> tuple[Any, Any]:
    """A tag with its sensors, an outline and two blooms: as in the demo, on average."""
    x, y = 0.5 * (number % 100), 0.5 * (number // 100)
    corners = [(x - 0.1, y - 0.1), (x + 0.1, y - 0.1), (x + 0.1, y + 0.1), (x - 0.1, y + 0.1)]
    blooms = [(x - 0.05, y), (x + 0.05, y)]
    return (
        scan(str(number), readings(number), (x, y)),
        inspection(str(number), at=(x, y), flower_count=2, blooms=blooms, footprint=corners),
    )


def readings(number: int) -> dict[str, float]:
    """Five sensors; `BEAT` only where the robot goes on scanning."""
    climate = {"temperature": 21.3, "humidity": 64.0, "co2": 612.0, "light": 8210.0}
    return climate | ({BEAT: 0.0} if number < SCANNED else {"soil_moisture": 38.5})


def beat(peer: Peer, period_s: float, tags: int) -> None:
    """Scan one tag after the other for ever, on a grid of the monotonic clock."""
    due_s = time.monotonic()
    for number in itertools.cycle(range(tags)):
        due_s += period_s
        time.sleep(max(0.0, due_s - time.monotonic()))  # a load at a rate
        peer.observe(scan(str(number), {**readings(number), BEAT: time.monotonic()}))


if __name__ == "__main__":
    main()
