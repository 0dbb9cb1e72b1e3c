"""Hostile input over ROS and HTTP: it is survived, and each answer is one of the document.

After each batch of ROS messages both bridges serve the next state, and after some of them
everything that they serve is valid: states, fields, the map.

One check of schemathesis is left out: that valid values are not refused. The document cannot say
which values go together, and a box may be inverted or have too many cells.
"""

import json
import random
import socket
from collections.abc import Callable, Iterator
from itertools import count
from typing import Any

import pytest
import schemathesis
from hypothesis import HealthCheck, settings
from lupin_msgs.msg import SensorReading, TwinState
from lupin_msgs.srv import GetField
from schemathesis.specs.openapi.checks import positive_data_acceptance

from lupin_bridge.access.middleware import MAX_TARGET_BYTES
from lupin_bridge.app import document
from lupin_bridge.stream import schema
from lupin_twin.core.drops import MAX_BLOOMS_PER_TAG, MAX_SENSORS_PER_TAG, MAX_TAGS, MAX_TEXT_LENGTH
from tests.support.domains import own_domain
from tests.support.hostile import ANY, MEGABYTE, NAN, TEXTS, anything, damaged, long_lies
from tests.support.live import attached, field_of, serve_and_web, wait_until_ready
from tests.support.messages import discovered, inspection, occupancy_grid, pose, scan
from tests.support.proc_stat import open_files, peak_mb, reset_peak, resident_mb
from tests.support.processes import limits, lupin_twin
from tests.support.ros import Peer
from tests.support.waiting import PATIENCE_S, wait_for
from tests.support.web import Bridge, bridge

# Of the process with the twin: for one batch at any time, and stored of everything sent here (which
# is bounded tag by tag, and there are some 30), with the cache of fields. In one arena: what the C
# library retains of more of them grows with the threads, not with what is sent.
MEMORY_MB = 40.0
STORED_MB = 150.0
ONE_ARENA = {"MALLOC_ARENA_MAX": "1"}
NO_LIMITS = limits(answers_per_s=10_000)
# Often enough that no batch waits for a state, which is large here, and is published twice.
RATE = ("--ros-args", "-p", "state_publish_rate_hz:=10.0")
# A topic holds 50 messages; a batch that was waited for has lost none.
LOT = 40
LOTS = 5
# Everything that is served is checked after this number of them.
FULLY = 5


@pytest.fixture(scope="module")
def both() -> Iterator[tuple[Bridge, Bridge]]:
    """`serve` with the twin, and a `web` that receives everything over `/twin/state`."""
    with serve_and_web(*RATE, of_both=NO_LIMITS, afresh=True, **ONE_ARENA) as (twin, apart):
        twin.peer.observe(scan("first", {"co2": 400.0}, (0, 0)))
        for live in (twin, apart):
            wait_until_ready(live)
            live.tag("first")
            field_of(live, sensor_type="co2")
        memory = resident_mb(twin.process.pid)
        yield twin, apart
        assert resident_mb(twin.process.pid) - memory < STORED_MB


_marks = count(1)


def survive(
    both: tuple[Bridge, Bridge], hostile: Callable[[Peer], object], *, fully: bool = True
) -> None:
    """Both bridges have the next observation after what `hostile` publishes.

    With `fully`, everything else that they serve is valid too: states, fields, the map.
    """
    twin, _ = both
    memory = resident_mb(twin.process.pid)
    reset_peak(twin.process.pid)
    hostile(twin.peer)
    mark = float(next(_marks))
    twin.peer.observe(scan("mark", {"co2": mark}, (1, 1)))
    for live in both:
        live.tag("mark", lambda tag: [r["value"] for r in tag["readings"]] == [mark])
        if fully:
            check(live)
    assert peak_mb(twin.process.pid) - memory < MEMORY_MB


def check(live: Bridge) -> None:
    """Everything that the bridge serves is of the contract's types."""
    answer = live.get("/api/state")
    assert answer.status_code == 200
    state = schema.TwinState.model_validate(json.loads(answer.content, parse_constant=refuse))
    for tag in state.tags:
        assert len(tag.readings) <= MAX_SENSORS_PER_TAG
        assert len(tag.flowers) <= MAX_BLOOMS_PER_TAG
        assert 0 < len(tag.tag_id) <= MAX_TEXT_LENGTH
    for sensor in ("co2", "nan", TEXTS[5]):
        # Where the tags are 1e300 m apart there is no grid, which is an error; else there is.
        assert live.get("/api/field", sensor_type=sensor).status_code in (200, 400)
        box: dict[str, Any] = {"bbox_min_x": 0, "bbox_min_y": 0, "bbox_max_x": 2, "bbox_max_y": 2}
        assert live.get("/api/field", sensor_type=sensor, **box).status_code == 200
    assert live.get("/api/map").status_code in (200, 404)
    assert live.get("/api/map.png").status_code in (200, 404)
    health = live.json("/healthz")
    assert (health["ok"], health["callback_errors"]) == (True, 0)


def refuse(constant: str) -> None:
    raise AssertionError(f"{constant} is no JSON")


def past_every_bound() -> Iterator[Any]:
    """Observations; `test_cdr` and `test_state` have each bound at its limit."""
    for many, name in ((100_000, ""), (40_000, "same")):
        msg = scan("many readings")
        msg.tag_reading.readings = [SensorReading(name=name, value=1.0) for _ in range(many)]
        yield msg
    yield scan("sensors", {f"s{n}": 1.0 for n in range(MAX_SENSORS_PER_TAG + 1)})
    yield scan(MEGABYTE, {"co2": 1.0})
    yield scan("megabyte", {MEGABYTE: 1.0})
    yield inspection("megabyte", species=MEGABYTE)
    for where in ("status_detail", "mission_id"):
        msg = scan("megabyte")
        setattr(msg, where, MEGABYTE)
        yield msg
    yield inspection("blooms", blooms=[(0, 0)] * 20_000)
    yield inspection("outline", footprint=[(0, 0)] * 5_000)
    yield scan("", {"co2": 1.0})
    yield scan("far", {"co2": 1.0}, (1e300, -1e300))
    yield scan("nan", {"co2": NAN, "": NAN}, (NAN, 0))


def test_observations_past_every_bound_are_survived(both: tuple[Bridge, Bridge]) -> None:
    for message in past_every_bound():
        survive(both, lambda peer, message=message: peer.observe(message), fully=False)  # type: ignore[misc]
    survive(both, lambda _: None)


def test_a_discovery_of_more_tags_than_allowed_is_survived(both: tuple[Bridge, Bridge]) -> None:
    # As a batch, and as one message that is too large: 30,000 tags of long names have 11 MB.
    survive(both, lambda peer: peer.discover(discovered({"": pose(), "twice": pose(NAN)})))
    before = len(both[0].json("/api/state")["tags"])
    too_large = {f"{number}-{'x' * 250}": pose() for number in range(MAX_TAGS + 10_000)}
    survive(both, lambda peer: peer.discover(discovered(too_large)))
    assert len(both[0].json("/api/state")["tags"]) == before


@pytest.mark.parametrize("topic", ANY)
def test_any_content_is_survived(both: tuple[Bridge, Bridge], topic: str) -> None:
    chance = random.Random(topic)
    for number in range(1, LOTS + 1):
        lot = [ANY[topic](chance) for _ in range(LOT)]
        survive(
            both,
            lambda peer, lot=lot: [peer.publish(topic, message) for message in lot],  # type: ignore[misc]
            fully=number % FULLY == 0,
        )


@pytest.mark.parametrize("topic", ANY)
def test_bytes_that_are_no_message_are_survived(both: tuple[Bridge, Bridge], topic: str) -> None:
    chance = random.Random(topic)

    def publish(peer: Peer) -> None:
        whole = ANY[topic](chance)
        publisher = peer.publisher(topic, type(whole))
        for _ in range(LOT):
            publisher.publish(damaged(ANY[topic](chance), chance))

    for number in range(1, LOTS + 1):
        survive(both, publish, fully=number % FULLY == 0)


def test_requests_for_fields_of_any_numbers_are_answered(both: tuple[Bridge, Bridge]) -> None:
    chance = random.Random(3)
    numbers = (NAN, float("inf"), -1.0, 0.0, 1e-45, 0.1, 3e38, -3e38)
    names = ("resolution", "bbox_min_x", "bbox_min_y", "bbox_max_x", "bbox_max_y")

    def query(peer: Peer) -> None:
        for _ in range(LOT):
            answer = peer.get_field(
                sensor_type=chance.choice((*TEXTS, MEGABYTE)),
                **{name: chance.choice(numbers) for name in names},
            )
            if not answer.ok:
                assert answer == GetField.Response(error_message=answer.error_message)
                assert answer.error_message

    survive(both, query)


def test_a_bridge_apart_survives_an_invalid_twin() -> None:
    chance = random.Random(11)
    with (
        own_domain() as domain,
        lupin_twin(domain, "web", afresh=True) as process,
        Peer(domain) as peer,
        attached(process, peer) as live,
    ):
        topic = "/twin/state"
        state_lies = long_lies(TwinState)
        peer.until(lambda: peer.node.count_subscribers(topic), "the bridge")
        memory = None
        for number in range(LOTS * LOT):
            state = anything(TwinState, chance)
            if number % LOT == 0:
                peer.publisher(topic, TwinState, depth=1).publish(chance.choice(state_lies))
            elif number % 2:
                peer.publisher(topic, TwinState, depth=1).publish(damaged(state, chance))
            else:
                peer.publish(topic, state, depth=1)
            if number % LOT == LOT - 1:
                sane = TwinState()
                sane.header.stamp.sec = number

                def is_reported(sane: TwinState = sane, number: int = number) -> bool:
                    # As a twin publishes: again and again.
                    peer.publish(topic, sane, depth=1)
                    return has_stamp(live, number)

                wait_for(is_reported, "the sane state")
                if memory is None:
                    memory = resident_mb(process.pid)
                    reset_peak(process.pid)
        assert memory is not None
        assert peak_mb(process.pid) - memory < MEMORY_MB
        assert live.json("/healthz")["ok"]


def has_stamp(live: Bridge, seconds: int) -> bool:
    answer = live.get("/api/state")
    if answer.status_code != 200:
        return False
    state = json.loads(answer.content, parse_constant=refuse)
    schema.TwinState.model_validate(state)
    return bool(state["header"]["stamp"]["sec"] == seconds)


def test_the_log_of_all_that_is_short(both: tuple[Bridge, Bridge]) -> None:
    for live in both:
        assert "Traceback" not in live.process.output
        assert live.process.output.count("\n") < 500


UNLIMITED = limits(answers_per_s=10_000, concurrency=1_000)
BROKEN_REQUESTS = 1_500
REFUSALS_MB = 5.0


@pytest.fixture(scope="module")
def live() -> Iterator[Bridge]:
    with bridge(*UNLIMITED, afresh=True) as running:
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


described = schemathesis.openapi.from_dict(json.loads(document()))


@described.parametrize()
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
    assert peak_mb(pid) - before_mb < REFUSALS_MB
    wait_for(lambda: open_files(pid) <= files, "the end of all connections")
    # Not by `answer_to`: a client that half-closes its connection counts as gone, as in nginx.
    assert live.get("/api/state").status_code == 200
