"""Answers of a twin: those that DDS cannot deliver yet, and those to a flood of requests."""

import signal
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import suppress
from types import SimpleNamespace
from typing import Any

import pytest
from builtin_interfaces.msg import Time
from lupin_msgs.srv import GetEstimate, GetEstimateReport, GetField, GetHistory
from rcl_interfaces.srv import GetParameters
from rclpy.qos import DurabilityPolicy, QoSProfile

from lupin_twin.ros import services as module
from lupin_twin.ros.base_node import SERVICE_QOS
from lupin_twin.ros.services import MAX_ATTEMPT_S, MAX_UNSENT, UNSENT, Responses
from lupin_twin.runtime.workers import MAX_JOBS
from tests.support import messages
from tests.support.domains import own_domain
from tests.support.journal import select
from tests.support.messages import scan
from tests.support.proc_stat import waited_s
from tests.support.processes import OFTEN, Process, twin_node
from tests.support.ros import Peer
from tests.support.waiting import wait_for


class Stage:
    """A service whose answers reach clients once DDS has found them, for rclpy's; and a clock."""

    service_name = "/ask"

    def __init__(self) -> None:
        self.now_s = 100.0
        self.found: set[Any] = set()
        self.takes_s = 0.125
        self.attempted: list[Any] = []
        self.sent: list[tuple[Any, Any]] = []
        self.warned: list[str] = []
        self.drained = 0
        stage: Any = self
        self.responses = Responses(stage)
        self.responses.watch(self)

    def warn(self, _: object, text: str) -> None:
        self.warned.append(text)

    def drain(self) -> None:
        self.drained += 1

    def send_response(self, response: Any, header: Any) -> None:
        self.attempted.append(header)
        self.now_s += 0.0 if header in self.found else self.takes_s
        if header in self.found:
            self.sent.append((response, header))
        else:
            warnings.warn(f"{UNSENT}: client will not receive", RuntimeWarning, stacklevel=1)

    def go_on(self) -> list[Any]:
        """Continue; returns the clients that were attempted."""
        del self.attempted[:]
        self.now_s += 0.5
        self.responses.go_on()
        return self.attempted


@pytest.fixture
def stage(monkeypatch: pytest.MonkeyPatch) -> Iterator[Stage]:
    with warnings.catch_warnings():  # without pytest's own rule, none is an error
        warnings.resetwarnings()
        made = Stage()
        monkeypatch.setattr(module, "time", SimpleNamespace(monotonic=lambda: made.now_s))
        yield made


def test_an_answer_is_sent_once_as_soon_as_its_reader_is_found(stage: Stage) -> None:
    stage.send_response("response", "a")
    assert stage.drained == 1, "what came meanwhile"
    assert stage.go_on() == ["a"]
    assert stage.drained == 2
    stage.found = {"a"}
    assert stage.go_on() == ["a"]
    assert stage.sent == [("response", "a")]
    assert stage.go_on() == []
    assert stage.warned == []


def test_an_answer_that_can_be_sent_does_not_wait_for_those_that_never_can(stage: Stage) -> None:
    for who in range(MAX_UNSENT - 1):
        stage.send_response("response", who)
    for _ in range(3):
        stage.go_on()
    stage.send_response("response", "late")
    stage.found = {"late"}
    assert stage.go_on()[0] == "late"
    assert stage.sent == [("response", "late")]
    assert stage.warned == []


def test_a_too_large_answer_is_not_retained(stage: Stage) -> None:
    stage.takes_s = MAX_ATTEMPT_S + 0.125
    stage.send_response("response", "a")
    assert stage.go_on() == []
    assert "gave up a response of /ask: it is too large to be retained" in stage.warned[0]


def test_an_answer_without_a_reader_is_dropped_with_a_warning(stage: Stage) -> None:
    stage.send_response("response", "a")
    stage.now_s += module.PATIENCE_S - 1.0
    assert stage.go_on() == ["a"]
    assert stage.go_on() == []
    [message] = stage.warned
    assert message == (
        "gave up a response of /ask: for 30 s DDS has found no reader for it; does a "
        "client use a QoS other than the default of services?"
    )


def test_a_client_that_dds_never_finds_is_reported_and_delays_nobody() -> None:
    # Its reader needs QoS that the service's writer does not offer: they never match, and rclpy
    # behaves as with a reader that is found too late.
    never = QoSProfile(depth=50, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    query, parameters = "/twin/get_field", "/lupin_twin/get_parameters"
    with own_domain() as domain, twin_node(domain) as twin, Peer(domain, "robot") as robot:
        futures = []
        for kind, name in ((GetField, query), (GetParameters, parameters)):
            client = robot.node.create_client(kind, name, qos_profile=never)
            message = f"gave up a response of {name}: too much else waits to be sent again"

            def is_reported(client: Any = client, kind: Any = kind, message: str = message) -> bool:
                # A service queues ten requests: more at once would be lost.
                futures.append(client.call_async(kind.Request()))
                return message in twin.output

            robot.until(is_reported, message)
        assert robot.get_field(sensor_type="co2").sample_count == 0
        assert not any(future.done() for future in futures)
        assert "Error" not in twin.output
        assert "RuntimeWarning" not in twin.output


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


SERVICE = "/twin/get_estimate"
REPORT_SERVICE = "/twin/get_estimate_report"
BOX: dict[str, Any] = {
    "sensor_type": "temperature",
    "resolution": 0.5,
    "bbox_min_x": 0.0,
    "bbox_min_y": 0.0,
    "bbox_max_x": 2.0,
    "bbox_max_y": 3.0,
}


@pytest.fixture(scope="module")
def peer(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Peer]:
    journal = tmp_path_factory.mktemp("journal") / "j.sqlite"
    arguments = (*OFTEN, "-p", f"journal:={journal}")
    with own_domain() as domain, twin_node(domain, *arguments), Peer(domain) as peer:
        peer.wait_for_twin()
        peer.observe(
            messages.scan("a", {"temperature": 21.0}, at=(0.25, 0.25)),
            messages.scan("b", {"temperature": 25.0}, at=(1.75, 2.75)),
        )
        rows = "SELECT count(*) FROM scan"
        wait_for(lambda: select(journal, rows) == [(2,)], "both in the journal")
        yield peer


def request(peer: Peer, **changes: Any) -> Any:
    return peer.call(GetEstimate, SERVICE, **{**BOX, **changes})


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"sensor_type": ""}, "sensor_type is empty"),
        ({"resolution": 0.0}, "resolution is 0.0"),
        ({"resolution": 0.0001}, "cells"),
        ({"sensor_type": "ph"}, "no tag has a reading of this sensor_type in the 86400 s"),
        ({"at": Time(sec=2**31 - 1)}, "at is 2147483647.000000000 s, later than now"),
    ],
)
def test_an_impossible_estimate_is_refused_by_name(
    peer: Peer, changes: dict[str, Any], complaint: str
) -> None:
    answer = request(peer, **changes)
    assert complaint in answer.error_message
    assert answer == GetEstimate.Response(error_message=answer.error_message)


def test_a_flood_of_expensive_requests_delays_no_observation_and_no_field(peer: Peer) -> None:
    dearest = {**BOX, "resolution": 0.003}
    clients = [
        peer.node.create_client(kind, name)
        for kind, name in ((GetEstimate, SERVICE), (GetEstimateReport, REPORT_SERVICE))
    ]
    for client in clients:
        peer.until(client.service_is_ready, "the service")
    requested: list[Any] = []

    def query_both() -> None:
        place = {**dearest, "bbox_max_x": 2.0 + len(requested) / 1000.0}
        requested.append(clients[0].call_async(GetEstimate.Request(**place)))
        requested.append(
            clients[1].call_async(GetEstimateReport.Request(sensor_type="temperature"))
        )

    for _ in range(MAX_JOBS + 8):
        query_both()
        peer.spin_briefly()
    peer.observe(messages.scan("in the flood", {"co2": 400.0}, at=(1.0, 1.0)))
    peer.tag("in the flood")
    assert peer.get_field(**{**BOX, "sensor_type": "co2"}).sample_count == 1

    def answers(ok: bool) -> list[Any]:
        return [one.result() for one in requested if one.done() and one.result().ok is ok]

    def are_there() -> bool:
        # A service queues ten requests: DDS loses some of such a flood, and all but twenty for a
        # twin that stands still meanwhile, which are too few to be refused.
        if not answers(False):
            query_both()
        return bool(answers(True) and answers(False))

    peer.until(are_there, "an answer and a refusal")
    assert all(one.error_message.endswith("ask again later") for one in answers(False))
    for client in clients:
        peer.node.destroy_client(client)
