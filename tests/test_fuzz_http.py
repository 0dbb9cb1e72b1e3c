"""Requests of every kind: schemathesis over the whole OpenAPI document, and bytes that are no HTTP.

One check of schemathesis is left out: that valid values are not refused. The document cannot say
which values go together, and a box may be inverted or have too many cells.
"""

import json
import random
import socket
from collections.abc import Iterator
from typing import Any

import pytest
import schemathesis
from hypothesis import HealthCheck, settings
from schemathesis.specs.openapi.checks import positive_data_acceptance

from lupin_bridge.access.middleware import MAX_TARGET_BYTES
from lupin_bridge.app import document
from tests.support.messages import inspection, occupancy_grid, scan
from tests.support.proc_stat import open_files, peak_mb, reset_peak, resident_mb
from tests.support.processes import limits
from tests.support.waiting import PATIENCE_S, wait_for
from tests.support.web import Bridge, bridge

NO_LIMITS = limits(answers_per_s=10_000, concurrency=1_000)
BROKEN_REQUESTS = 1_500
MEMORY_MB = 5.0


@pytest.fixture(scope="module")
def live() -> Iterator[Bridge]:
    with bridge(*NO_LIMITS, afresh=True) as running:
        running.peer.observe(
            scan("1", {"co2": 400.0, "temperature": 20.0}, (0, 0)),
            inspection("1", blooms=[(0.1, 0.1)], footprint=[(0, 0), (1, 0), (1, 1)]),
            scan("2", {"co2": float("nan")}, (1, 1)),
            scan("no pose", {"co2": 1.0}),
        )
        running.peer.publish_map(occupancy_grid([[0, -1], [100, 0]]))
        running.tag("no pose")
        wait_for(lambda: running.get("/api/map").status_code == 200, "the map")
        yield running
        assert "Traceback" not in running.process.output
        assert running.json("/healthz")["callback_errors"] == 0


schema = schemathesis.openapi.from_dict(json.loads(document()))


@schema.parametrize()
@settings(max_examples=10, derandomize=True, suppress_health_check=list(HealthCheck))
def test_every_answer_is_described_by_the_document(case: Any, live: Bridge) -> None:
    answer = case.call(base_url=live.url)
    if answer.status_code == 414:  # the acceptor's answer, whatever the route
        assert len(answer.request.url) - len(live.url) > MAX_TARGET_BYTES
        return
    if answer.status_code == 413 and answer.request.method != "POST":  # no body is expected there
        assert answer.request.body
        return
    case.validate_response(answer, excluded_checks=[positive_data_acceptance])


GOOD = b"GET /api/state HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n"
PIECES = (
    *(b"GET", b"POST", b"\x00", b" ", b"/", b"//", b"/../..", b"/%00", b"/%ff", b"?", b"?a=%zz"),
    *(
        b" HTTP/1.1",
        b" HTTP/2.0",
        b" HTTP/9",
        b"\r\n",
        b"\n",
        b"Host: 127.0.0.1\r\n",
        b"Host: \r\n",
    ),
    *(b"Host: a\r\nHost: b\r\n", b"Content-Length: -1\r\n", b"Content-Length: 99999999999\r\n"),
    *(b"Transfer-Encoding: chunked\r\n", b"ffffffffffffffff\r\n", b"Upgrade: websocket\r\n"),
    *(b"Connection: Upgrade\r\n", b"Sec-WebSocket-Version: 7\r\n", b"Sec-WebSocket-Key: x\r\n"),
    *(b"If-None-Match: " + b'"' * 999 + b"\r\n", b"Accept: " + b"*/*;q=" * 99 + b"\r\n"),
    *(b"X: " + b"\xff" * 9 + b"\r\n", b"X" * 20_000, b"\x16\x03\x01\x02\x00\x01\x00"),
)


def broken_request(chance: random.Random) -> bytes:
    """A request that was damaged, put together at random, or never was one."""
    kind = chance.randrange(3)
    if kind == 0:
        return chance.randbytes(chance.randrange(1, 400))
    if kind == 1:
        return b"".join(chance.choices(PIECES, k=chance.randrange(1, 12))) + b"\r\n\r\n"
    damaged = bytearray(GOOD)
    for _ in range(chance.randrange(1, 5)):
        damaged[chance.randrange(len(damaged))] = chance.randrange(256)
    return bytes(damaged)


def answer_to(address: tuple[str, int], request: bytes) -> bytes:
    """The server's answer until it closes; the client sends nothing after its request."""
    with socket.create_connection(address, timeout=PATIENCE_S) as client:
        try:
            client.sendall(request)
            client.shutdown(socket.SHUT_WR)
            answer = b""
            while block := client.recv(65_536):
                answer += block
        except OSError:  # reset: it has not read all of what we sent
            return b""
        return answer


def test_bytes_that_are_no_http_are_refused_and_leave_nothing_behind(live: Bridge) -> None:
    address = (live.http.base_url.host, int(live.http.base_url.port or 0))
    chance = random.Random(5)
    pid = live.process.pid
    before_mb, files = 0.0, 0
    for number in range(BROKEN_REQUESTS):
        if number == BROKEN_REQUESTS // 10:  # warm
            before_mb, files = resident_mb(pid), open_files(pid)
            reset_peak(pid)
        answer = answer_to(address, broken_request(chance))
        assert not answer or answer.startswith(b"HTTP/1.1 ")
        assert not answer.startswith(b"HTTP/1.1 5")
    assert peak_mb(pid) - before_mb < MEMORY_MB
    wait_for(lambda: open_files(pid) <= files, "the end of all connections")
    # Not by `answer_to`: a client that half-closes its connection counts as gone, as in nginx.
    assert live.get("/api/state").status_code == 200
