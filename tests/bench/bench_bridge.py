"""How fast the bridge answers: real `lupin-twin serve` processes, real DDS, loopback.

Times are what a client sees, medians and 95th percentiles; server time is what is left of a
request when that of an empty one (`/healthz`) on the same connection is taken off.
"""

import statistics
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import httpx
from lupin_msgs.srv import GetField

from tests.support.domains import own_domain
from tests.support.messages import scan
from tests.support.processes import Process, limits, lupin_twin, url_of
from tests.support.ros import Peer

TAGS = 30
SIDE_M = 5.0
GRID: dict[str, Any] = {
    "sensor_type": "co2",
    "bbox_min_x": 0,
    "bbox_min_y": 0,
    "bbox_max_x": SIDE_M,
}
GRID_200 = {**GRID, "bbox_max_y": SIDE_M, "resolution": SIDE_M / 200}
GRID_1000 = {**GRID, "bbox_max_y": SIDE_M, "resolution": SIDE_M / 1000}


def timed(run: Callable[[], object], times: int) -> list[float]:
    """How long each of `times` runs took, s; one more before them does not count."""
    run()
    result = []
    for _ in range(times):
        start = time.perf_counter()
        run()
        result.append(time.perf_counter() - start)
    return result


def row(name: str, seconds: list[float], note: str = "") -> None:
    ordered = sorted(seconds)
    p95 = ordered[min(len(ordered) - 1, round(0.95 * len(ordered)))]
    print(f"{name:<52}{statistics.median(seconds) * 1e3:>9.2f} ms{p95 * 1e3:>9.2f} ms  {note}")


def http(process: Process) -> None:
    with httpx.Client(base_url=url_of(process), timeout=30.0) as client:

        def get(path: str, parameters: dict[str, Any], **headers: str) -> httpx.Response:
            response = client.get(path, params=parameters, headers=headers)
            assert response.status_code in (200, 304), response.text
            return response

        empty = timed(lambda: get("/healthz", {}), 300)
        row("HTTP: an empty answer (/healthz)", empty, "what a request costs in itself")
        etag = get("/api/field.json", GRID_200).headers["etag"]
        known = {"If-None-Match": etag}
        not_modified = timed(lambda: get("/api/field.json", GRID_200, **known), 300)
        server = statistics.median(not_modified) - statistics.median(empty)
        row("HTTP: 304", not_modified, f"{server * 1e3:+.2f} ms against an empty answer")

        def fields(cells: str, query: dict[str, Any], times: int) -> None:
            for kind in ("json", "png", "npy"):
                path = f"/api/field.{kind}"
                size = len(get(path, query).content) / 1e3
                took = timed(partial(get, path, query), times)
                row(f"HTTP: {cells} as {kind}, cached", took, f"{size:.0f} kB")

        fresh = iter(range(10_000))

        def computed() -> None:
            get("/api/field.npy", {**GRID_200, "bbox_max_x": SIDE_M + 1e-4 * next(fresh)})

        fields("200 x 200", GRID_200, 100)
        row("HTTP: 200 x 200 as npy, computed", timed(computed, 50))
        fields("1000 x 1000", GRID_1000, 5)


def service(peer: Peer) -> None:
    request = GetField.Request(**GRID_200)
    client = peer.node.create_client(GetField, "/twin/get_field")
    peer.until(client.service_is_ready, "the service")

    def call() -> None:
        future = client.call_async(request)
        peer.until(future.done, "an answer")

    row("ROS service: 200 x 200, cached", timed(call, 100))


def main() -> None:
    print(f"\n{'The bridge, ' + str(TAGS) + ' tags':<52}{'median':>12}{'p95':>12}")
    # The bounds on field requests are for strangers; here they would be what is measured.
    unbounded = limits(answers_per_s=10_000)
    silent = (*unbounded, "--ros-args", "-p", "state_publish_rate_hz:=0.01")
    with (
        own_domain() as domain,
        lupin_twin(domain, "serve", *silent) as process,
        Peer(domain) as peer,
    ):
        url_of(process)
        peer.wait_for_twin()
        for i in range(TAGS):
            at = (i * 0.17 % SIDE_M, i * 0.61 % SIDE_M)
            peer.observe(scan(str(i), {"co2": 400.0 + i}, at=at))
        with httpx.Client(base_url=url_of(process)) as client:
            peer.until(lambda: len(client.get("/api/state").json()["tags"]) == TAGS, "all tags")
        http(process)
        service(peer)


if __name__ == "__main__":
    main()
