"""Whether another twin publishes the same state, as one node hears it: counted, and told of."""

from __future__ import annotations

from typing import Any

from lupin_msgs.msg import TwinState
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy

from lupin_twin.habits import Habits
from lupin_twin.numbering import TwinCount


class OtherTwins:
    """Looks who publishes the topic `name`, the node's own state, and listens where it is several.

    Ours is heard too then; a dead twin's shadow publishes nothing.
    """

    def __init__(self, node: Node, habits: Habits, count: TwinCount, name: str, group: Any) -> None:
        self._node, self._habits, self._count = node, habits, count
        self._name, self._group = name, group
        self._subscription: Any = None

    def look(self, topic: str) -> None:
        """Count who publishes it; `topic` is the name as ROS has resolved it."""
        publishers = int(self._node.count_publishers(topic))
        self._listen(publishers > 1)
        if self._count.see(publishers):
            self._habits.warn(
                ("twins", 0),
                f"{self._count.value} nodes publish {topic}: consumers get a mixture; "
                "stop all twins but one, or give them ROS domains of their own",
            )

    def _listen(self, wanted: bool) -> None:
        if wanted and self._subscription is None:
            self._subscription = self._node.create_subscription(
                TwinState,
                self._name,
                lambda _, info: self._count.hear(int(info["publication_sequence_number"])),
                QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE),
                callback_group=self._group,
                raw=True,
            )
        elif not wanted and self._subscription is not None:
            self._node.destroy_subscription(self._subscription)
            self._subscription = None
