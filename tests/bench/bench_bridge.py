"""What a 304 costs beside an empty answer (`/healthz`) on the same connection, as a client sees it.

A real `lupin-twin serve`, real DDS, loopback.
"""

import statistics
import time
from collections.abc import Callable
from typing import Any

import httpx

from tests.support.domains import own_domain
from tests.support.messages import scan
from tests.support.processes import limits, lupin_twin, url_of
from tests.support.ros import Peer

TAGS = 30
SIDE_M = 5.0
FIELD: dict[str, Any] = {
    "sensor_type": "co2",
    "bbox_min_x": 0,
    "bbox_min_y": 0,
    "bbox_max_x": SIDE_M,
    "bbox_max_y": SIDE_M,
    "resolution": SIDE_M / 200,
}


def median_ms(run: Callable[[], httpx.Response], times: int = 300) -> float:
    """Of so many runs; one more before them does not count."""
    took = []
    for _ in range(times + 1):
        start = time.perf_counter()
        assert run().status_code in (200, 304)
        took.append(time.perf_counter() - start)
    return 1e3 * statistics.median(took[1:])


def main() -> None:
    """Print both."""
    # The bounds on field requests are for strangers; here they would be what is measured.
    silent = ("--ros-args", "-p", "state_publish_rate_hz:=0.01")
    with (
        own_domain() as domain,
        lupin_twin(domain, "serve", *limits(answers_per_s=10_000), *silent) as process,
        Peer(domain) as peer,
        httpx.Client(base_url=url_of(process), timeout=30.0) as client,
    ):
        peer.wait_for_twin()
        for i in range(TAGS):
            at = (i * 0.17 % SIDE_M, i * 0.61 % SIDE_M)
            peer.observe(scan(str(i), {"co2": 400.0 + i}, at=at))
        peer.until(lambda: len(client.get("/api/state").json()["tags"]) == TAGS, "all tags")
        known = {"If-None-Match": client.get("/api/field.json", params=FIELD).headers["etag"]}
        empty = median_ms(lambda: client.get("/healthz"))
        not_modified = median_ms(lambda: client.get("/api/field.json", params=FIELD, headers=known))
        print(f"an empty answer {empty:.2f} ms, a 304 {not_modified - empty:+.2f} ms")


if __name__ == "__main__":
    main()
