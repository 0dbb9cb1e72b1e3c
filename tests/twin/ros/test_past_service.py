"""The two services of the past: over stand-ins, and over DDS of a twin without a journal."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Future
from dataclasses import dataclass, field
from typing import Any

import pytest
from builtin_interfaces.msg import Time
from lupin_msgs.srv import GetHistory, GetStateAt

from lupin_twin.core.interfaces import GET_HISTORY, GET_STATE_AT
from lupin_twin.core.past import (
    NotRemembered,
    PastRefused,
    SeriesPast,
)
from lupin_twin.core.state import NANOSECONDS_PER_SECOND, Snapshot, TwinStore
from lupin_twin.ros.base_node import SERVICE_QOS
from lupin_twin.ros.past_service import PastService
from lupin_twin.runtime.workers import JobQueue, Workers
from tests.support import messages
from tests.support.domains import own_domain
from tests.support.processes import OFTEN, twin_node
from tests.support.ros import Peer
from tests.support.waiting import wait_for

S = NANOSECONDS_PER_SECOND
NOW_NS = 100 * S


# --- with stand-ins: no ROS runs ----------------------------------------------------------------


class Log:
    """A log in which is found what a test says."""

    def __init__(self) -> None:
        self.found: Future[Any] = Future()
        self.asked = 0

    def query(self, _search: object, _cost_s: float) -> Future[Any]:
        self.asked += 1
        return self.found


@dataclass
class Reports:
    """What a node reports."""

    reported: list[Exception] = field(default_factory=list)

    def report(self, _what: str, error: Exception) -> None:
        self.reported.append(error)


class Node:
    """As much of a node as the services need: it is asked by the services' names."""

    def __init__(self) -> None:
        self.memory, self.utilities = Log(), Reports()
        self.workers = Workers("test")
        self.queue = JobQueue(self.workers, lambda: None)
        self.callbacks: dict[str, Callable[..., Any]] = {}
        utilities: Any = self.utilities
        recall: Any = self.memory
        service = PastService(
            utilities, self.queue, recall, TwinStore(), now_ns=lambda: NOW_NS, frame_id="map"
        )
        service.offer(self, None)

    def create_service(
        self, kind: Any, name: str, callback: Any, qos_profile: Any, callback_group: Any
    ) -> Any:
        assert (callback_group, qos_profile) == (None, SERVICE_QOS)
        self.callbacks[name] = lambda **request: callback(kind.Request(**request), kind.Response())
        return None

    def answer(self, name: str, **request: Any) -> Any:
        """The response, now or as soon as the queue has it."""
        answer = self.callbacks[name](**request)
        if hasattr(answer, "ok"):
            return answer
        sent: list[Any] = []
        answer.goes_to(sent.append)

        def look() -> bool:
            self.queue.deliver()
            return bool(sent)

        wait_for(look, "the answer")
        return sent[0]


@pytest.fixture
def node() -> Iterator[Node]:
    node = Node()
    yield node
    node.workers.close()


def test_a_state_is_asked_for_by_its_moment(node: Node) -> None:
    node.memory.found.set_result(Snapshot(5 * S + 3, "map", ()))
    response = node.answer(GET_STATE_AT.name, at=Time(sec=5, nanosec=3))
    assert response.ok
    assert response.state.header == response.times.header
    assert node.memory.asked == 1


@pytest.mark.parametrize(
    ("at", "says"),
    [
        (Time(sec=100, nanosec=1), "at is 100.000000001 s, later than now, 100.000000000 s"),
        (Time(sec=-1), "at is -1.000000000 s, before 0"),
    ],
)
def test_a_moment_that_has_not_passed_is_refused_and_nothing_is_looked_up(
    node: Node, at: Time, says: str
) -> None:
    response = node.answer(GET_STATE_AT.name, at=at)
    assert response == GetStateAt.Response(error_message=says)
    assert node.memory.asked == 0
    assert node.utilities.reported == []


def test_a_series_is_asked_for_as_it_stands_in_the_request(node: Node) -> None:
    node.memory.found.set_result(SeriesPast(S, 9 * S, None, (S,), (1,), (2.5,), (2.5,), (2.5,)))
    response = node.answer(
        GET_HISTORY.name,
        tag_id="1",
        sensor_type="co2",
        start=Time(sec=1),
        end=Time(sec=9),
        max_points=3,
    )
    assert response.ok
    assert response.stamps == [Time(sec=1)]
    assert list(response.means) == [2.5]
    assert node.memory.asked == 1


@pytest.mark.parametrize(
    ("error", "says", "is_reported"),
    [
        (PastRefused("at is too far back"), "at is too far back", False),
        (NotRemembered("no journal", is_lasting=True), "not remembered: no journal", False),
        (NotRemembered("busy", is_lasting=False), "busy: ask again later", False),
        (OSError("disk"), "the twin failed to answer: disk: ask again later", True),
    ],
)
def test_what_the_memory_meets_is_told_and_what_it_should_not_is_reported(
    node: Node, error: Exception, says: str, is_reported: bool
) -> None:
    node.memory.found.set_exception(error)
    response = node.answer(GET_STATE_AT.name, at=Time(sec=5))
    assert response == GetStateAt.Response(error_message=says)
    assert bool(node.utilities.reported) is is_reported


# --- over DDS, without a journal ----------------------------------------------------------------


@pytest.fixture(scope="module")
def peer() -> Iterator[Peer]:
    with (
        own_domain() as domain,
        twin_node(domain, *OFTEN, "-p", "journal:=off"),
        Peer(domain) as peer,
    ):
        peer.wait_for_twin()
        for second in (10.0, 20.5, 30.0):
            peer.observe(messages.scan("a", {"co2": 400.0 + second}, stamp_s=second))
        peer.observe(messages.scan("a", status=2, stamp_s=40.0))
        peer.observe(messages.scan("last", {"co2": 1.0}))
        peer.tag("last")
        # What is shown is in the log within 100 ms.
        wait_for(
            lambda: peer.ask(GetHistory, GET_HISTORY.name, tag_id="last", sensor_type="co2").stamps,
            "the last scan in the log",
        )
        yield peer


def test_the_last_scans_of_a_twin_without_a_journal_can_be_asked_for(peer: Peer) -> None:
    response = peer.ask(GetHistory, "/twin/get_history", tag_id="a", sensor_type="co2")
    assert response.ok, response.error_message
    assert [(stamp.sec, stamp.nanosec) for stamp in response.stamps] == [
        (10, 0),
        (20, 500_000_000),
        (30, 0),
    ]
    assert list(response.means) == [410.0, 420.5, 430.0]
    assert list(response.counts) == [1, 1, 1]
    events = peer.ask(GetHistory, "/twin/get_history", tag_id="*", sensor_type="~failures")
    assert [stamp.sec for stamp in events.stamps] == [40]
    assert list(events.means) == [2.0]


def test_a_state_of_then_is_known_without_a_journal_too(peer: Peer) -> None:
    response = peer.ask(GetStateAt, "/twin/get_state_at", at=Time(sec=15))
    assert response.ok, response.error_message
    [tag] = response.state.tags
    assert (tag.tag_id, tag.readings[0].value) == ("a", 410.0)
