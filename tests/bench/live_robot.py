"""The robot of the live bench: fills a twin with tags, then changes one of them at a steady rate.

Run as `python -m tests.bench.live_robot --domain D --url U --tags N --rate-hz R`, with the address
of the twin's bridge. It prints `filled` when the twin knows all tags, and goes on until it is
killed. Every change is an observation of the tag `beat`, whose reading `beat` is this machine's
CLOCK_MONOTONIC at the moment of its publication: a receiver can compute its delay.
"""

import argparse
import contextlib
import time
from collections.abc import Sequence
from typing import Any

import httpx

from tests.support.messages import inspection, scan
from tests.support.ros import Peer
from tests.support.waiting import wait_for

BEAT = "beat"
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
            fill(peer, http, [BEAT, *(str(number) for number in range(1, options.tags))])
        print("filled", flush=True)
        with contextlib.suppress(KeyboardInterrupt):
            beat(peer, 1.0 / options.rate_hz)


def fill(peer: Peer, http: httpx.Client, tag_ids: Sequence[str]) -> None:
    """Publish every tag, no faster than the twin takes them."""
    for start in range(0, len(tag_ids), BATCH):
        batch = tag_ids[start : start + BATCH]
        for tag_id in batch:
            peer.observe(*tag_messages(tag_id, 0 if tag_id == BEAT else int(tag_id)))
        wait_for(
            lambda last=batch[-1]: http.get(f"/api/tags/{last}").json().get("flowers"),  # type: ignore[misc]
            f"tag {batch[-1]} in the twin",
        )


def tag_messages(tag_id: str, number: int) -> tuple[Any, Any]:
    """A tag with three sensors, an outline and two blooms: as in the demo, on average."""
    x, y = 0.5 * (number % 100), 0.5 * (number // 100)
    readings = {"temperature": 21.3, "humidity": 64.0, "co2": 612.0}
    corners = [(x - 0.1, y - 0.1), (x + 0.1, y - 0.1), (x + 0.1, y + 0.1), (x - 0.1, y + 0.1)]
    blooms = [(x - 0.05, y), (x + 0.05, y)]
    return (
        scan(tag_id, {**readings, BEAT: 0.0} if tag_id == BEAT else readings, (x, y)),
        inspection(tag_id, at=(x, y), flower_count=2, blooms=blooms, footprint=corners),
    )


def beat(peer: Peer, period_s: float) -> None:
    """Publish for ever, on a grid of the monotonic clock."""
    due_s = time.monotonic()
    while True:
        due_s += period_s
        time.sleep(max(0.0, due_s - time.monotonic()))  # a load at a rate
        peer.observe(scan(BEAT, {BEAT: time.monotonic()}))


if __name__ == "__main__":
    main()
