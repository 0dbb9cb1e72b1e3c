"""The other side of the topics: a ROS node of the test's own, in the test's own process."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Self, TypeVar

import rclpy
from lupin_msgs.msg import TwinState
from lupin_msgs.srv import GetField
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock

from tests.support.waiting import PATIENCE_S, wait_for

T = TypeVar("T")


def latched(depth: int) -> QoSProfile:
    """Written out again: the tests compare the node with the contract, not with its own code."""
    return QoSProfile(
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL,
    )


def clock_at(seconds: float) -> Clock:
    clock = Clock()
    clock.clock.sec = int(seconds)
    clock.clock.nanosec = int((seconds % 1) * 1e9)
    return clock


@contextmanager
def node_in(domain: int, make: Callable[[Context], T], *args: str) -> Iterator[T]:
    """A node in this process, with a context of its own; nobody spins it."""
    context = Context()
    rclpy.init(args=list(args), context=context, domain_id=domain)
    try:
        node: Any = make(context)
        yield node
        node.destroy_node()
    finally:
        rclpy.try_shutdown(context=context)


class Peer:
    """A node that publishes what a robot would and subscribes to the twin."""

    def __init__(self, domain: int, name: str = "peer") -> None:
        self._context = Context()
        rclpy.init(args=[], context=self._context, domain_id=domain)
        # Neither is needed here, and each adds endpoints that all others have to discover.
        self.node = rclpy.create_node(
            name, context=self._context, enable_rosout=False, start_parameter_services=False
        )
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._publishers: dict[str, Any] = {}
        self.states: list[Any] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._executor.shutdown(timeout_sec=2)
        self.node.destroy_node()
        rclpy.try_shutdown(context=self._context)

    def publish(self, topic: str, message: Any, depth: int = 50) -> Any:
        """Publish latched, without waiting for subscribers; returns the publisher."""
        publisher = self.publisher(topic, type(message), depth)
        publisher.publish(message)
        return publisher

    def publisher(self, topic: str, message_type: Any, depth: int = 50) -> Any:
        """The latched publisher on a topic, created at the first call."""
        if topic not in self._publishers:
            self._publishers[topic] = self.node.create_publisher(
                message_type, topic, latched(depth)
            )
        return self._publishers[topic]

    def observe(self, *messages: Any) -> None:
        for message in messages:
            self.publish("/floranova/observations", message)

    def discover(self, message: Any) -> None:
        self.publish("/perception/discovered_tags", message)

    def publish_map(self, message: Any) -> None:
        self.publish("/map", message, depth=1)

    def set_clock(self, seconds: float) -> None:
        """Publish simulated time until a state has it: `/clock` is not latched."""
        clock = clock_at(seconds)

        def tick() -> Any:
            self.publish("/clock", clock, depth=1)
            return self._newest(lambda state: state.header.stamp == clock.clock)

        if not self.states:
            self.listen()
        self.until(tick, f"a state at {seconds} s")

    def listen(self, durability: DurabilityPolicy = DurabilityPolicy.TRANSIENT_LOCAL) -> None:
        """Subscribe to `/twin/state`; states are appended to `states`."""
        qos = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=durability)
        self.node.create_subscription(TwinState, "/twin/state", self.states.append, qos)

    def until(self, check: Callable[[], T], what: str, timeout_s: float = PATIENCE_S) -> T:
        """Spin until `check` returns something true, and return that."""
        return wait_for(check, what, timeout_s, meanwhile=self.spin_briefly)

    def spin_briefly(self, timeout_s: float = 0.05) -> None:
        """Handle what is there, or wait a moment for it."""
        self._executor.spin_once(timeout_sec=timeout_s)

    def wait_for_twin(self) -> None:
        """Wait until a twin subscribes to the three topics, so that no volatile message is lost."""
        for topic in ("/floranova/observations", "/perception/discovered_tags", "/map"):
            self.until(lambda topic=topic: self.node.count_subscribers(topic), f"a twin on {topic}")  # type: ignore[misc]

    def state(self, accept: Callable[[Any], bool], what: str) -> Any:
        """The first state that `accept` takes, from now on (the latest one included)."""
        if not self.states:
            self.listen()
        return self.until(lambda: self._newest(accept), what)

    def _newest(self, accept: Callable[[Any], bool]) -> Any:
        return self.states[-1] if self.states and accept(self.states[-1]) else None

    def tag(self, tag_id: str, accept: Callable[[Any], bool] = lambda _: True) -> Any:
        """The tag in the first state that has it and that `accept` takes."""
        state = self.state(
            lambda state: any(t.tag_id == tag_id and accept(t) for t in state.tags),
            f"tag {tag_id} as expected",
        )
        return next(tag for tag in state.tags if tag.tag_id == tag_id)

    def get_field(self, **request: Any) -> Any:
        return self.call(GetField, "/twin/get_field", **request)

    def call(self, kind: Any, service: str, **request: Any) -> Any:
        [answer] = self.call_all(kind, service, [kind.Request(**request)])
        return answer

    def call_all(self, kind: Any, service: str, requests: Sequence[Any]) -> list[Any]:
        """Call a service with all of these at once, and return the responses in order."""
        client = self.node.create_client(kind, service)
        self.until(client.service_is_ready, f"the service {service}")
        futures = [client.call_async(request) for request in requests]
        self.until(lambda: all(future.done() for future in futures), f"answers of {service}")
        self.node.destroy_client(client)
        return [future.result() for future in futures]
