"""What all nodes have in common, with a node in this process; and how long they are spun."""

import threading
from collections.abc import Iterator
from typing import Any

import pytest
import rclpy
from lupin_msgs.msg import Observation
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy
from rclpy.serialization import serialize_message

from lupin_twin.core.drops import Drop, Reason
from lupin_twin.ros import base_node
from lupin_twin.ros.base_node import (
    BEHIND_S,
    BELIEVED_S,
    LEFT_OVER_S,
    WARNING_PERIOD_S,
    NodeUtilities,
    end_spinning,
    read_message,
    spin_until_shutdown,
    waker,
)
from lupin_twin.ros.message_limits import MessageShape
from tests.support.messages import INFO, scan
from tests.support.ros import Peer, node_in
from tests.support.waiting import PATIENCE_S, wait_for

SHAPE = MessageShape(Observation, max_bytes=1_000)


class Logged:
    """Stands in for a node's logger and for the clock of its rate limit."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.now_s = 100.0

    def warning(self, text: str) -> None:
        self.lines.append(text)

    error = warning


@pytest.fixture
def logged(monkeypatch: pytest.MonkeyPatch) -> Logged:
    made = Logged()
    monkeypatch.setattr("lupin_twin.ros.base_node.time.monotonic", lambda: made.now_s)
    return made


@pytest.fixture
def utilities(domain: int, logged: Logged) -> Iterator[NodeUtilities]:
    with node_in(domain, lambda it: rclpy.create_node("utilities", context=it)) as node:
        node.get_logger = lambda: logged
        yield NodeUtilities(node)


def test_a_message_is_read_up_to_its_limit_and_dropped_beyond_it() -> None:
    data = serialize_message(scan("1", {"co2": 1.0}))
    read: Any = read_message(data, MessageShape(Observation, max_bytes=len(data)))
    assert read.tag_reading.tag_id == "1"
    drop = read_message(data, MessageShape(Observation, max_bytes=len(data) - 1))
    assert drop == Drop(Reason.SIZE, f"{len(data)} bytes, the limit is {len(data) - 1}")


def test_a_subscription_passes_on_messages_and_counts_the_others(
    utilities: NodeUtilities, logged: Logged
) -> None:
    taken: list[Any] = []
    topic = utilities.subscribe(
        "observations_topic", "some/observations", SHAPE, depth=3, group=None, callback=taken.append
    )
    assert topic == "/some/observations"
    [subscription] = [s for s in utilities.node.subscriptions if s.topic_name == topic]
    subscription.callback(serialize_message(scan("1")), INFO)
    subscription.callback(bytes(1_001), INFO | {"received_timestamp": 1_500_000_000})
    assert utilities.published_ago_s == 1.5
    assert [msg.tag_reading.tag_id for msg in taken] == ["1"]
    assert logged.lines == [
        "dropped a message on /some/observations: 1001 bytes, the limit is 1000"
    ]


def test_waking_a_destroyed_node_does_nothing(utilities: NodeUtilities) -> None:
    node = utilities.node
    condition = node.create_guard_condition(lambda: None)
    wake = waker(condition)
    wake()
    condition.destroy()
    wake()


def test_warnings_are_limited_per_key_and_counted(utilities: NodeUtilities, logged: Logged) -> None:
    for _ in range(3):
        utilities.drop(Drop(Reason.FRAME, "no"), "/t")
    utilities.drop(Drop(Reason.KIND, "no", case="2"), "/t")
    utilities.drop(Drop(Reason.KIND, "no", case="9"), "/t")
    logged.now_s += WARNING_PERIOD_S
    utilities.drop(Drop(Reason.FRAME, "no"), "/t")
    wording = "dropped a message on /t: no"
    assert logged.lines == [wording, wording, wording, f"{wording} (2 more since the last warning)"]
    for _ in range(3600):
        logged.now_s += 1.0
        utilities.drop(Drop(Reason.FRAME, "no"), "/t")
    assert len(logged.lines) == 4 + 3 + 58  # after 10, 20 and 40 s, then once a minute
    assert logged.lines[-1] == f"{wording} (59 more since the last warning)"


def test_two_twins_are_two_once_a_dead_one_would_have_left_the_graph(
    utilities: NodeUtilities, logged: Logged
) -> None:
    for publishers, after_s, twins in (
        (2, 0.0, 1),
        (2, LEFT_OVER_S - 0.1, 1),
        (2, LEFT_OVER_S, 2),
        (3, LEFT_OVER_S + 1.0, 3),
        (1, LEFT_OVER_S + 2.0, 1),
        (2, LEFT_OVER_S + 3.0, 1),
    ):
        utilities.node.count_publishers = lambda _, found=publishers: found
        logged.now_s = 100.0 + after_s
        utilities.check_twins("/twin/state", "a mixture")
        assert utilities.twins == twins
    assert logged.lines[0].startswith("2 nodes publish /twin/state: a mixture; stop all")


def test_on_a_shared_topic_only_wanted_messages_are_read_and_the_others_not_counted(
    utilities: NodeUtilities,
) -> None:
    taken: list[str] = []
    utilities.subscribe(
        "a_topic",
        "shared",
        SHAPE,
        depth=5,
        group=None,
        callback=lambda msg: taken.append(msg.tag_reading.tag_id),
        is_wanted=lambda data: b"ours" in data,
    )
    (subscription,) = [s for s in utilities.node.subscriptions if s.topic_name == "/shared"]
    assert subscription.qos_profile.durability == DurabilityPolicy.VOLATILE
    for number, tag_id in ((1, "ours"), (9, "theirs"), (20, "ours")):
        info = {**INFO, "publication_sequence_number": number}
        subscription.callback(serialize_message(scan(tag_id)), info)
    subscription.callback(bytes(SHAPE.max_bytes + 1), INFO)
    assert taken == ["ours", "ours"]
    assert utilities.counts().dropped == {}
    subscription.callback(b"ours" + bytes(SHAPE.max_bytes), INFO)
    assert utilities.counts().dropped == {"size": 1}


def test_waiting_messages_are_taken_one_right_after_the_other(
    utilities: NodeUtilities, domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In one round of the executor, whatever else is due; and before any slow work."""
    received: list[float] = []
    flood: list[bool] = []

    def take(value: float) -> None:
        received.append(value)
        if flood:
            publish(range(1))

    large = MessageShape(Observation, max_bytes=10_000)
    group = utilities.node.default_callback_group
    utilities.subscribe(
        "topic",
        "many",
        large,
        depth=50,
        group=group,
        callback=lambda message: take(message.tag_reading.readings[0].value),
    )
    executor = SingleThreadedExecutor(context=utilities.node.context)
    executor.add_node(utilities.node)
    with Peer(domain) as peer:
        publisher = peer.publisher("/many", Observation)
        peer.until(lambda: utilities.node.count_publishers("/many"), "the publisher")

        def publish(values: range) -> None:
            for value in values:
                publisher.publish(scan("1", {"co2": float(value)}))
            # By then they are in the reader's queue.
            assert publisher.wait_for_all_acked(Duration(seconds=PATIENCE_S))

        publish(range(1))
        wait_for(lambda: received, "the first", meanwhile=executor.spin_once)
        publish(range(1, 40))
        executor.spin_once(PATIENCE_S)
        assert received == list(map(float, range(40)))
        publish(range(40, 90))
        utilities.drain()
        assert received == list(map(float, range(90)))
        publish(range(90, 130))
        monkeypatch.setattr(base_node, "WORK_DRAIN_S", 0.0)
        utilities.drain()
        assert len(received) == 91, "messages that take long do not hold up the work"
        monkeypatch.undo()
        utilities.drain()
        assert received == list(map(float, range(130)))
        flood.append(True)
        publish(range(1))
        utilities.drain()
        assert len(received) == 130 + 50, "a flood ends no later than a full queue"
        assert utilities.counts().dropped.get(Reason.LOST, 0) == 0
    executor.shutdown()


def test_a_message_that_waited_long_marks_the_thread_as_behind_for_a_while(
    utilities: NodeUtilities, logged: Logged, monkeypatch: pytest.MonkeyPatch
) -> None:
    group = utilities.node.default_callback_group
    utilities.subscribe("topic", "many", SHAPE, depth=5, group=group, callback=lambda _: None)
    (subscription,) = [s for s in utilities.node.subscriptions if s.topic_name == "/many"]
    monkeypatch.setattr("lupin_twin.ros.base_node.time.time_ns", lambda: 10**18)
    one = serialize_message(scan("1"))
    for waited_s, is_behind in ((0.0, False), (BEHIND_S, False), (BEHIND_S + 0.001, True)):
        received_ns = 10**18 - int(waited_s * 1e9)
        subscription.callback(one, {**INFO, "received_timestamp": received_ns})
        assert utilities.is_behind == is_behind
    logged.now_s += BELIEVED_S - 0.001
    subscription.callback(one, {**INFO, "received_timestamp": 10**18})
    assert utilities.is_behind
    logged.now_s += 0.002
    assert not utilities.is_behind


class Spinning:
    """A node whose timer runs `work`, spun in a thread."""

    def __init__(self, node: Any) -> None:
        self.node = node
        self.executor = SingleThreadedExecutor(context=node.context)
        self.executor.add_node(self.node)
        self.errors: list[tuple[str, Exception]] = []
        self.thread = threading.Thread(target=spin_until_shutdown, args=(self.executor, self.note))

    def note(self, what: str, error: Exception) -> None:
        self.errors.append((what, error))

    def has_ended(self) -> bool:
        return not self.thread.is_alive()


@pytest.fixture
def spinning(domain: int) -> Iterator[Spinning]:
    with node_in(domain, lambda it: rclpy.create_node("spinning", context=it)) as node:
        it = Spinning(node)
        yield it
        if not it.has_ended():
            end_spinning(it.executor)
        it.thread.join(5)


def test_the_shutdown_breaks_no_spin_that_is_about_to_wait(
    spinning: Spinning, monkeypatch: pytest.MonkeyPatch
) -> None:
    """rclpy's own shutdown, called from here at that moment, breaks the spin."""
    about_to_wait, requested = threading.Event(), threading.Event()
    get_nodes = spinning.executor.get_nodes

    def pause() -> Any:
        if threading.current_thread() is spinning.thread and not requested.is_set():
            about_to_wait.set()
            requested.wait(20)
        return get_nodes()

    monkeypatch.setattr(spinning.executor, "get_nodes", pause)
    spinning.thread.start()
    assert about_to_wait.wait(20)
    end_spinning(spinning.executor)
    requested.set()
    wait_for(spinning.has_ended, "the end of the spinning")
    assert spinning.errors == []


def test_a_callback_ends_before_the_spinning_does(spinning: Spinning) -> None:
    runs, requested, ended = threading.Event(), threading.Event(), threading.Event()

    def work() -> None:
        runs.set()
        requested.wait(20)
        ended.set()

    spinning.node.create_timer(0.01, work)
    spinning.thread.start()
    assert runs.wait(20)
    end_spinning(spinning.executor)
    requested.set()
    wait_for(spinning.has_ended, "the end of the spinning")
    assert ended.is_set()
    assert spinning.errors == []
