"""What both sources over ROS have in common: a node of ours in a thread, and the topics' relay."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from typing import Any, Generic, TypeVar

from lupin_msgs.msg import Observation
from rclpy.context import Context

from lupin_bridge.feed.past_process import PastProcess
from lupin_bridge.feed.relay import Relay
from lupin_bridge.feed.relay_ros import RelayRos, names_of
from lupin_bridge.feed.robot import Robot
from lupin_bridge.feed.robot_ros import RobotTopics
from lupin_bridge.feed.ros_thread import BridgedNode, RosThread
from lupin_bridge.feed.source import TwinSource
from lupin_bridge.feed.topics import TwinNames
from lupin_twin.adapt.messages import observation
from lupin_twin.adapt.scans import BuiltScan
from lupin_twin.core import interfaces
from lupin_twin.field.engine import FieldRules
from lupin_twin.ros.base_node import qos_of
from lupin_twin.runtime.workers import Workers

NodeT = TypeVar("NodeT", bound=BridgedNode)
EventT = TypeVar("EventT")


class RosSource(TwinSource, Generic[NodeT, EventT]):
    """A source with a node; who extends it says which, and what its events are."""

    thread: RosThread[NodeT, EventT]

    def __init__(self, *, ros_args: Sequence[str], timeout_s: float) -> None:
        self._ros_args = ros_args
        self.timeout_s = timeout_s
        self.workers = Workers("work")
        self.past = PastProcess()
        self.relay = Relay(lambda: self.thread, RelayRos())
        # Of the ROS thread alone.
        self._robot_topics = RobotTopics()
        self._rules: FieldRules
        # Made at the first one: most bridges never publish any.
        self._observations: Any = None
        # The same for as long as the node lives.
        self._names: TwinNames

    async def _start_thread(
        self,
        make_node: Callable[[Context, Callable[[EventT], None]], NodeT],
        on_event: Callable[[EventT], None],
        on_death: Callable[[], None],
    ) -> None:
        self.thread = RosThread(
            make_node, ros_args=self._ros_args, on_event=on_event, on_death=on_death
        )
        await self.thread.start()
        self._names, parameters = await self.thread.call(
            lambda node: (names_of(node), node.parameters)
        )
        self._rules, self.buffer_len = FieldRules.of(parameters), parameters.buffer_len

    async def stop(self) -> None:
        """Stop the ROS thread, the workers and the process that looks back."""
        self.workers.close()
        await asyncio.gather(self.past.stop(), self.thread.stop())

    takes_observations = True

    async def publish_observation(self, scan: BuiltScan, source: str) -> None:
        """See `TwinSource`."""
        topic = self._names.observations_topic

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

    def rules(self) -> FieldRules:
        """The node's parameters for fields: the twin's, as far as it was given the same."""
        return self._rules

    def names(self) -> TwinNames:
        """The twin's, as ROS resolves and remaps them."""
        return self._names
