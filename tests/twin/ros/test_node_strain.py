"""The node over real DDS under load: the state keeps its rate, nothing is lost."""

import signal
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Any

import pytest
from lupin_msgs.srv import GetEstimate, GetField, GetHistory

from lupin_twin.ros.base_node import SERVICE_QOS
from tests.support.domains import own_domain
from tests.support.messages import scan
from tests.support.proc_stat import waited_s
from tests.support.processes import Process, twin_node
from tests.support.ros import Peer
from tests.support.waiting import wait_for

BEAT_S = 0.1
BEAT = ("--ros-args", "-p", f"state_publish_rate_hz:={1 / BEAT_S}")


class Strained:
    """A twin at ten states a second, and a peer that measures the pauses between them."""

    def __init__(self, process: Process, peer: Peer) -> None:
        self.process, self.peer = process, peer

    def longest_pause_s(self, done: Callable[[], object], what: str) -> float:
        """The longest time without a state until `done` returns something true."""
        last_s, longest_s, seen = time.monotonic(), 0.0, len(self.peer.states)

        def check() -> object:
            nonlocal last_s, longest_s, seen
            if len(self.peer.states) > seen:
                now_s = time.monotonic()
                longest_s, last_s, seen = (
                    max(longest_s, now_s - last_s),
                    now_s,
                    len(self.peer.states),
                )
            return done()

        self.peer.until(check, what)
        return max(longest_s, time.monotonic() - last_s)


@pytest.fixture(scope="module")
def strained() -> Iterator[Strained]:
    with (
        own_domain() as domain,
        twin_node(domain, *BEAT, afresh=True) as process,
        Peer(domain) as peer,
    ):
        peer.wait_for_twin()
        peer.listen()
        peer.until(lambda: peer.states, "a state")
        yield Strained(process, peer)


HEAVY = {
    "resolution": 0.01,
    "bbox_min_x": 0.0,
    "bbox_min_y": 0.0,
    "bbox_max_x": 10.0,
    "bbox_max_y": 10.0,
}


@pytest.fixture
def wide() -> Iterator[Strained]:
    """A twin whose every tag reaches every cell: 10^6 cells with 150 tags take seconds."""
    reach = ("-p", "idw_falloff_radius_m:=20.0", "-p", "idw_max_distance_m:=20.0")
    rate = ("-p", f"state_publish_rate_hz:={1 / BEAT_S}")
    with (
        own_domain() as domain,
        twin_node(domain, "--ros-args", *rate, *reach, "-p", "idw_power:=2.5") as process,
        Peer(domain) as peer,
    ):
        peer.wait_for_twin()
        peer.listen()
        for number in range(150):
            peer.observe(scan(f"tag {number}", {"co2": 400.0}, (number % 15, number // 15)))
            if number % 40 == 39:
                peer.tag(f"tag {number}")
        peer.tag("tag 149")
        yield Strained(process, peer)


def query(strained: Strained, **request: float) -> Any:
    """Start a call of the service; returns the future of its response."""
    client = strained.peer.node.create_client(GetField, "/twin/get_field")
    strained.peer.until(client.service_is_ready, "the service")
    return client.call_async(GetField.Request(sensor_type="co2", **{**HEAVY, **request}))


def test_a_heavy_field_delays_no_observation_no_state_and_not_the_shutdown(wide: Strained) -> None:
    peer = wide.peer
    heavy = [query(wide), query(wide)]
    start_s = time.monotonic()
    sent = 0

    def send_and_check() -> bool:
        # Two hundred within a second or so, and for as long as it computes.
        nonlocal sent
        if sent < 200:
            peer.observe(scan("counted", {f"s{sent % 50}": float(sent)}))
            sent += 1
        return sent == 200 and all(future.done() for future in heavy)

    pause_s = wide.longest_pause_s(send_and_check, "the heavy fields")
    took_s = time.monotonic() - start_s
    peer.tag("counted", lambda tag: readings(tag) == {f"s{n}": 150.0 + n for n in range(50)})
    assert "lost" not in wide.process.output
    # On a busy machine, a share; of a thread that computes, all of it.
    assert pause_s < max(1.0, took_s / 2)
    first, second = (future.result() for future in heavy)
    assert first.ok
    assert first.width * first.height == 1_000_000
    assert first.values == second.values

    for x in range(4):
        # Another field of the same size.
        query(wide, bbox_min_x=-0.25 * x, bbox_max_x=10.0 - 0.25 * x)
    cheap = query(wide, resolution=1.0)
    peer.until(cheap.done, "the cheap field: the heavy ones are being computed")
    pid = wide.process.pid
    start_s, before_s = time.monotonic(), waited_s(pid)
    waited = [before_s]
    wide.process.send(signal.SIGTERM)

    def has_ended() -> bool:
        with suppress(FileNotFoundError):  # gone between two checks
            waited.append(waited_s(pid))
        return wide.process.exit_code is not None

    wait_for(has_ended, "its end")
    # Time that the machine withholds is no delay of its own.
    assert time.monotonic() - start_s - (max(waited) - before_s) < 2.0
    assert wide.process.exit_code == 0


def readings(tag: Any) -> dict[str, float]:
    return {reading.name: reading.value for reading in tag.readings}


def test_all_requests_made_while_the_twin_stands_still_are_answered(strained: Strained) -> None:
    node = strained.peer.node
    clients = [
        node.create_client(kind, name, qos_profile=SERVICE_QOS)
        for kind, name in (
            (GetField, "/twin/get_field"),
            (GetHistory, "/twin/get_history"),
            (GetEstimate, "/twin/get_estimate"),
        )
    ]
    for client in clients:
        strained.peer.until(client.service_is_ready, client.service_name)
    strained.process.freeze()
    # An empty request is refused, and that is an answer.
    requested = [
        client.call_async(client.srv_type.Request()) for client in clients * SERVICE_QOS.depth
    ]
    strained.process.thaw()
    strained.peer.until(lambda: all(future.done() for future in requested), "all answers")
