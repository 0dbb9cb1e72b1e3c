"""What both sources over ROS have in common: a node in a thread, and what the relay needs."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, Generic, TypeVar

from lupin_msgs.msg import Observation
from rclpy.context import Context
from rclpy.exceptions import InvalidTopicNameException
from rclpy.qos import QoSProfile

from lupin_bridge.feed.past_process import PastProcess
from lupin_bridge.feed.relay import Relay, RosTime, Sample, Topic, TwinNames
from lupin_bridge.feed.robot import Robot
from lupin_bridge.feed.robot_ros import RobotTopics
from lupin_bridge.feed.ros_thread import BridgedNode, RosThread
from lupin_bridge.feed.source import TwinSource, TwinUpdate
from lupin_twin.adapt.messages import message_type, observation
from lupin_twin.adapt.scans import BuiltScan
from lupin_twin.core import interfaces
from lupin_twin.core.drops import Drop
from lupin_twin.core.state import NANOSECONDS_PER_SECOND
from lupin_twin.field.engine import FieldRules
from lupin_twin.ros import message_limits
from lupin_twin.ros.base_node import latched, qos_of, read_message
from lupin_twin.runtime.workers import Workers

# What is also made into messages here: the topics of `relay.topics_of`.
_SHAPES: Final = {
    "lupin_msgs/msg/TwinState": message_limits.STATE,
    "lupin_msgs/msg/Observation": message_limits.OBSERVATION,
    "lupin_msgs/msg/DiscoveredTags": message_limits.DISCOVERED_TAGS,
    "nav_msgs/msg/OccupancyGrid": message_limits.MAP,
    "diagnostic_msgs/msg/DiagnosticArray": message_limits.DIAGNOSTICS,
}


class RelayRos:
    """`relay.Ros` over rclpy."""

    def subscribe(
        self, node: Any, topic: Topic, take: Callable[[Sample], None]
    ) -> Callable[[], None]:
        """Subscribe raw: nothing is made of the bytes in this thread."""
        clock = node.get_clock()

        def hand_over(data: bytes) -> None:
            take(Sample(data, clock.now().nanoseconds))

        try:
            subscription = node.create_subscription(
                message_type(topic.type_name),
                topic.name,
                hand_over,
                latched(topic.depth) if topic.latched else QoSProfile(depth=topic.depth),
                raw=True,
            )
        except InvalidTopicNameException as error:
            raise ValueError(" ".join(str(error).split())) from error
        return lambda: node.destroy_subscription(subscription)

    def published(self, node: Any, is_wanted: Callable[[str, str], bool]) -> Mapping[str, str]:
        """Topics that somebody publishes as a type that is wanted, and that type.

        Whoever else uses the name with another type, or only listens to it, changes nothing.
        """
        return {
            name: type_name
            for name, types in node.get_topic_names_and_types()
            for type_name in types
            if is_wanted(name, type_name)
            and any(one.topic_type == type_name for one in node.get_publishers_info_by_topic(name))
        }

    def time(self, node: Any) -> RosTime:
        """By the node's clock."""
        clock = node.get_clock()
        return RosTime(clock.now().nanoseconds, bool(clock.ros_time_is_active))

    def read(self, topic: Topic, data: bytes) -> Any:
        """As the nodes read it: lengths are checked before anything is made of it."""
        message = read_message(data, _SHAPES[topic.type_name])
        if isinstance(message, Drop):
            raise ValueError(message.why)  # noqa: TRY004  # it is no wrong call
        return message


def names_of(node: Any) -> TwinNames:
    """What a twin's topics and service are called, as a node of ours resolves them."""
    parameters = node.parameters
    resolve = node.resolve_topic_name
    return TwinNames(
        state_topic=resolve(parameters.state_topic),
        field_service=node.resolve_service_name(parameters.field_service_name),
        observations_topic=resolve(parameters.observations_topic),
        discovered_tags_topic=resolve(parameters.discovered_tags_topic),
        map_topic=resolve(parameters.map_topic),
        diagnostics_topic=resolve(interfaces.DIAGNOSTICS.name),
        field_layers=resolve(interfaces.LAYERS_BELOW + "x")[:-1],
        tags_layer=resolve(interfaces.TAGS.name),
        planters_layer=resolve(interfaces.PLANTERS.name),
    )


NodeT = TypeVar("NodeT", bound=BridgedNode)
# Hands an update over to the loop.
Post = Callable[[TwinUpdate], None]


class RosSource(TwinSource, Generic[NodeT]):
    """A source with a node; who extends it says which."""

    thread: RosThread[NodeT, TwinUpdate]

    def __init__(self, *, ros_args: Sequence[str], timeout_s: float) -> None:
        self._ros_args = ros_args
        self.timeout_s = timeout_s
        self.workers = Workers("work")
        self.past = PastProcess()
        self.relay = Relay(lambda: self.thread, RelayRos())

    async def _start_thread(
        self,
        make_node: Callable[[Context, Post], NodeT],
        on_state: Callable[[TwinUpdate], None],
        on_death: Callable[[], None],
    ) -> None:
        def take(update: TwinUpdate) -> None:
            before, self.update = self.update, update
            if update.rules is not None:
                self.rules = update.rules
            # A map alone is no sign of life of the twin.
            if before is None or update.made_s != before.made_s:
                on_state(update)

        # Both of the ROS thread alone; the publisher is made at the first observation: most bridges
        # never publish any.
        self._robot_topics = RobotTopics()
        self._observations: Any = None
        self.thread = RosThread(
            make_node, ros_args=self._ros_args, on_event=take, on_death=on_death
        )
        await self.thread.start()
        self.names, parameters = await self.thread.call(
            lambda node: (names_of(node), node.parameters)
        )
        self.rules, self.buffer_len = FieldRules.of(parameters), parameters.buffer_len

    async def stop(self) -> None:
        """Stop the ROS thread, the workers and the process that reads the past."""
        self.workers.close()
        await asyncio.gather(self.past.stop(), self.thread.stop())

    takes_observations = True

    async def publish_observation(self, scan: BuiltScan, source: str) -> None:
        """See `TwinSource`."""
        topic = self.names.observations_topic

        def publish(node: Any) -> None:
            if self._observations is None:
                self._observations = node.create_publisher(
                    Observation, topic, qos_of(interfaces.OBSERVATIONS)
                )
            self._observations.publish(observation(scan, "", source))

        await self._in_time(self.thread.call(publish))

    async def robot(self, now_ns: int | None) -> Robot | None:
        """From the robot's own topics, the newest message of each."""
        return await self.thread.call(lambda node: self._robot_topics.look(node, now_ns))


def now_ns_of(update: TwinUpdate) -> int:
    """ROS time now: an update may be a heartbeat old."""
    snapshot = update.snapshot
    if snapshot.clock != "running":
        return snapshot.stamp_ns
    return snapshot.stamp_ns + int((time.monotonic() - update.made_s) * NANOSECONDS_PER_SECOND)
