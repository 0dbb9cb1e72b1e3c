"""The ROS node `lupin_replay`: publishes what a player hands it, and watches whom it feeds.

One thread: whoever owns the node lets it listen (`listen`) between two beats.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any, Final

from lupin_msgs.msg import DiscoveredTags, Observation, TwinState
from nav_msgs.msg import OccupancyGrid
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.duration import Duration
from rclpy.exceptions import InvalidTopicNameException
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock

from lupin_bridge.bags.choosing import STATE_TYPE
from lupin_bridge.bags.live_twins import LiveTwins
from lupin_bridge.bags.offered_qos import Offered
from lupin_bridge.bags.recording import CLOCK_TOPIC
from lupin_twin import shapes
from lupin_twin.convert import time_msg
from lupin_twin.diagnostic_messages import findings_of
from lupin_twin.diagnostics import TOPIC as DIAGNOSTICS
from lupin_twin.habits import Habits
from lupin_twin.ros_parameters import naming_own_parameters

NODE_NAME: Final = "lupin_replay"
TYPES: Final[Mapping[str, Any]] = {
    "lupin_msgs/msg/Observation": Observation,
    "lupin_msgs/msg/DiscoveredTags": DiscoveredTags,
    "nav_msgs/msg/OccupancyGrid": OccupancyGrid,
    "lupin_msgs/msg/TwinState": TwinState,
}
# DDS finds who is there within 3 s, on a machine that is not idle a little later.
DISCOVERY_S: Final = 4.0
# A twin says of itself once a second; so long, s, it may take to be found and to say so.
SAYS_WITHIN_S: Final = 8.0
# How long it is waited for at the end that everybody has what was published, s: DDS asks for it
# every 3 s, and mostly has it long before.
DELIVERY_S: Final = 3.5
# The same before a loop begins again: for longer, the clock would not be heard.
LAST_WORDS_S: Final = 0.5
# What rmw says of a node of which DDS knows the topics already, and not yet the name.
_NOT_KNOWN_YET: Final = "_NODE_NAME_UNKNOWN_"
# How often it is looked at who is there, s.
LOOK_S: Final = 0.25


class NotPublishable(Exception):
    """A topic, by its `name`, that ROS does not let us publish; the message says why."""

    def __init__(self, name: str, why: str) -> None:
        super().__init__(f"{name!r}: {why}")
        self.name = name


class ReplayNode(Node):  # type: ignore[misc]  # rclpy is not typed
    """`Outlet` over ROS. `topics` are by their names in the recording: type and QoS.

    `names` has those that are published under another one. A remapping of ROS's holds behind that.
    `twins` is what those that hear it have said.

    Raises:
        NotPublishable: the name of a topic is none, or that of one of another type.

    """

    def __init__(
        self,
        topics: Mapping[str, tuple[str, Offered]],
        twins: LiveTwins,
        names: Mapping[str, str] | None = None,
        *,
        context: Any = None,
    ) -> None:
        with naming_own_parameters():
            super().__init__(NODE_NAME, context=context)
        self.habits = Habits(self)
        self._wanted = topics
        self._names = names or {}
        self.twins = twins
        self._twin_names: frozenset[str] = frozenset()
        self._looked_s = 0.0
        self._spinner = SingleThreadedExecutor(context=context)
        self._spinner.add_node(self)
        self._by_topic: dict[str, Any] = {}
        self.habits.subscribe(
            "diagnostics",
            DIAGNOSTICS,
            shapes.DIAGNOSTICS,
            depth=50,
            group=MutuallyExclusiveCallbackGroup(),
            callback=self._take_diagnostics,
            is_wanted=lambda data: any(name.encode() in data for name in self._twin_names),
        )
        self._clock_publisher = self.create_publisher(Clock, CLOCK_TOPIC, QoSProfile(depth=1))
        self._time = Clock()
        self._advertise()

    # --- Outlet -----------------------------------------------------------------------------------

    def tell_time(self, now_ns: int) -> None:
        """Publish `/clock`."""
        self._time.clock = time_msg(now_ns)
        self._clock_publisher.publish(self._time)

    def publish(self, topic: str, data: bytes) -> None:
        """Publish a serialised message as it is."""
        self._by_topic[topic].publish(data)

    def begin_again(self) -> None:
        """Publish by new publishers: who comes late must get nothing that lies ahead of then."""
        self.deliver(LAST_WORDS_S)
        for publisher in self._by_topic.values():
            self.destroy_publisher(publisher)
        self._advertise()
        self.wait_for_listeners()

    # --- whom it feeds ----------------------------------------------------------------------------

    def listen(self, for_s: float) -> None:
        """Hear what twins say, for so long."""
        until_s = time.monotonic() + for_s
        if time.monotonic() - self._looked_s > LOOK_S:
            self._looked_s = time.monotonic()
            self._look()
        while (rest_s := until_s - time.monotonic()) > 0.0:
            self._spinner.spin_once(timeout_sec=rest_s)

    def refusal(self, *, is_patient: bool = False) -> str | None:
        """Why it must not be replayed here; see `LiveTwins`."""
        return self.twins.refusal(self.context.get_domain_id(), is_patient=is_patient)

    @property
    def has_listeners(self) -> bool:
        """Whether each twin that is there is heard of by our publishers, and there is one."""
        topics = (topic for topic, (kind, _) in self._wanted.items() if kind != STATE_TYPE)
        return bool(self._twin_names) and all(
            self._by_topic[topic].get_subscription_count() for topic in topics
        )

    @property
    def twin_names(self) -> frozenset[str]:
        """The twins that hear us, by their nodes' full names."""
        return self._twin_names

    @property
    def awaits(self) -> bool:
        """Whether a twin has still to say whether it keeps a journal."""
        return bool(self.twins.awaited)

    def without_sim_time(self) -> list[str]:
        """Twins that do not listen to `/clock`."""
        told = {_full_name(info) for info in self.get_subscriptions_info_by_topic(CLOCK_TOPIC)}
        return sorted(self._twin_names - told)

    def rivals(self) -> list[str]:
        """Others that publish `/clock`, by their nodes' full names: a second replay has ours."""
        names = sorted(map(_full_name, self.get_publishers_info_by_topic(CLOCK_TOPIC)))
        own = self.get_fully_qualified_name()
        if own not in names:
            return []  # not even this one is known yet
        names.remove(own)
        return [name for name in names if not name.endswith(f"/{_NOT_KNOWN_YET}")]

    def wait_for_listeners(self, most_s: float = DISCOVERY_S) -> None:
        """Wait until a twin that is there gets what is published; no longer than that."""
        until_s = time.monotonic() + most_s
        while self._twin_names and not self.has_listeners and time.monotonic() < until_s:
            self.listen(0.02)

    def deliver(self, most_s: float) -> None:
        """Wait until everybody has said to have what was published; no longer than that."""
        until_s = time.monotonic() + most_s
        for publisher in self._by_topic.values():
            rest_s = max(0.0, until_s - time.monotonic())
            publisher.wait_for_all_acked(Duration(seconds=rest_s))

    def destroy_node(self) -> None:
        """End what listens, too."""
        self._spinner.shutdown(timeout_sec=1)
        super().destroy_node()

    # --- parts ------------------------------------------------------------------------------------

    def _advertise(self) -> None:
        self._by_topic = {
            topic: self._published(self._names.get(topic, topic), type_name, _profile(offered))
            for topic, (type_name, offered) in self._wanted.items()
        }

    def _published(self, name: str, type_name: str, profile: QoSProfile) -> Any:
        try:
            return self.create_publisher(TYPES[type_name], name, profile)
        except InvalidTopicNameException as error:
            raise NotPublishable(name, str(error)) from error
        except RuntimeError as error:  # rcl's; what comes behind the comma is its own source
            why = str(error).partition(", at ")[0]
            raise NotPublishable(
                name, f"no {type_name} can be published there, name another topic: {why}"
            ) from error

    def _look(self) -> None:
        nodes = {
            (info.node_namespace, info.node_name)
            for topic, (type_name, _) in self._wanted.items()
            if type_name != STATE_TYPE
            for info in self.get_subscriptions_info_by_topic(self._by_topic[topic].topic_name)
        }
        publishers = {
            (info.node_namespace, info.node_name)
            for topic, types in self.get_topic_names_and_types()
            if STATE_TYPE in types
            for info in self.get_publishers_info_by_topic(topic)
        }
        self._twin_names = frozenset(
            f"{namespace.rstrip('/')}/{name}"
            for namespace, name in nodes & publishers
            if name != _NOT_KNOWN_YET
        )
        self.twins.see(self._twin_names)

    def _take_diagnostics(self, msg: Any) -> None:
        for name in self._twin_names:
            said = list(findings_of(msg, name))
            if said:
                self.twins.hear(name, said)


def _full_name(info: Any) -> str:
    return f"{info.node_namespace.rstrip('/')}/{info.node_name}"


def _profile(offered: Offered) -> QoSProfile:
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=offered.depth,
        reliability=ReliabilityPolicy.RELIABLE
        if offered.is_reliable
        else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL
        if offered.is_latched
        else DurabilityPolicy.VOLATILE,
    )
