"""The node of `lupin-twin record`: hears what the twin hears and says, and reads none of it."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, Final

from lupin_msgs.msg import DiscoveredTags, Observation, TwinState
from nav_msgs.msg import OccupancyGrid
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock

from lupin_bridge.bags.bag_writer import Heard
from lupin_bridge.bags.topics import Topic
from lupin_twin.gaps import Gaps
from lupin_twin.habits import Habits
from lupin_twin.ros_parameters import declare, naming, naming_own_parameters

NODE_NAME: Final = "lupin_recorder"
# The twin's parameter with the topic's name, its type, how many a late subscriber gets, and how
# many may wait for this node's thread.
_INPUTS: Final = (
    ("observations_topic", Observation, 50, 1_000),
    ("discovered_tags_topic", DiscoveredTags, 50, 50),
    ("map_topic", OccupancyGrid, 1, 5),
    ("state_topic", TwinState, 1, 10),
)
# Not latched, and everybody's: no namespace moves it.
_CLOCK_TOPIC: Final = "/clock"
_CLOCK_DEPTH: Final = 1_000


class RecordNode(Node):  # type: ignore[misc]  # rclpy is not typed
    """Hands on each message as it came, in this node's thread; `topics` is what it listens to.

    Raises:
        lupin_twin.parameters.ParameterError: a parameter out of its range.

    """

    def __init__(self, *, context: Any = None) -> None:
        with naming_own_parameters():
            super().__init__(NODE_NAME, context=context)
        self.habits = Habits(self)
        self.topics: list[Topic] = []
        self._put: Callable[[Heard], None] = lambda _: None
        self._lose: Callable[[int], None] = lambda _: None
        parameters = declare(self, [name for name, *_ in _INPUTS])
        for parameter, kind, latched, depth in _INPUTS:
            name = getattr(parameters, parameter)
            qos = QoSProfile(
                depth=depth,
                reliability=ReliabilityPolicy.RELIABLE,
                durability=DurabilityPolicy.TRANSIENT_LOCAL,
            )
            with naming(parameter, name):
                self._listen(kind, name, qos, latched)
        # As ROS's own clock subscribers ask for it: who publishes it may offer no more.
        clock = QoSProfile(depth=_CLOCK_DEPTH, reliability=ReliabilityPolicy.BEST_EFFORT)
        self._listen(Clock, _CLOCK_TOPIC, clock, 0)

    def hand_to(self, put: Callable[[Heard], None], lose: Callable[[int], None]) -> None:
        """From now on; `lose(count)` is told of what came too fast to be heard."""
        self._put, self._lose = put, lose

    def _listen(self, kind: Any, name: str, qos: QoSProfile, latched: int) -> None:
        index = len(self.topics)
        gaps = Gaps()

        def hear(data: bytes, info: dict[str, Any]) -> None:
            log_ns = int(info["received_timestamp"]) or time.time_ns()
            publish_ns = int(info["source_timestamp"]) or log_ns
            number = info["publication_sequence_number"]
            if latched and number is not None:
                lost = gaps.see(number, lambda: int(self.count_publishers(topic)))
                if lost:
                    self._lose(lost)
            self._put(Heard(index, log_ns, publish_ns, data))

        subscription = self.create_subscription(kind, name, hear, qos, raw=True)
        topic = str(subscription.topic_name)
        package = kind.__module__.partition(".")[0]
        self.topics.append(Topic(topic, f"{package}/msg/{kind.__name__}", latched))
