"""Answers that DDS cannot deliver yet: with a stand-in, and from a real twin to a real client."""

import warnings
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import pytest
from lupin_msgs.srv import GetField
from rcl_interfaces.srv import GetParameters
from rclpy.qos import DurabilityPolicy, QoSProfile

from lupin_twin.ros import services as module
from lupin_twin.ros.services import (
    MAX_ATTEMPT_S,
    MAX_UNSENT,
    PATIENCE_S,
    UNSENT,
    Responses,
)
from tests.support.domains import own_domain
from tests.support.processes import twin_node
from tests.support.ros import Peer


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
    stage.now_s += PATIENCE_S - 1.0
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
