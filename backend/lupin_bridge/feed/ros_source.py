"""`RosSource`, the base of both sources over ROS; also the robot's topics and the relay's ROS side.

The robot's topics are polled, not waited for by the executor: DDS keeps the newest message of each
until it is taken. So localisation that publishes a hundred times a second costs the ROS thread one
message a second.
"""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from struct import Struct
from typing import Any, Final, Generic

from builtin_interfaces.msg import Time
from lupin_msgs.msg import Observation as ObservationMsg
from rclpy.callback_groups import CallbackGroup
from rclpy.context import Context
from rclpy.exceptions import InvalidTopicNameException
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from std_msgs.msg import Header

from lupin_bridge.feed.past_process import PastProcess
from lupin_bridge.feed.relay import Relay, Sample, TwinNames
from lupin_bridge.feed.ros_thread import NodeT, RosThread
from lupin_bridge.feed.source import (
    MAX_AHEAD_NS,
    Battery,
    Plan,
    Position,
    Robot,
    TwinSource,
    TwinUpdate,
    ValueT,
)
from lupin_twin.adapt.config import POSES
from lupin_twin.adapt.messages import message_type
from lupin_twin.core import ingest, interfaces
from lupin_twin.core.drops import Drop, Reason
from lupin_twin.core.interfaces import Topic
from lupin_twin.core.parameters import FARTHEST_M
from lupin_twin.core.state import NANOSECONDS_PER_SECOND, Observation
from lupin_twin.field.engine import FieldRules
from lupin_twin.ros import convert, message_limits
from lupin_twin.ros.base_node import latched, qos_of, read_message
from lupin_twin.ros.message_limits import MessageShape
from lupin_twin.runtime.workers import Workers

# Poses of a plan at most: 250 m by Nav2's planners. Reading more would take too long.
MAX_POSES: Final = 5_000
# Points of a plan that are shown at most: each frame holds all of them.
SHOWN_POINTS: Final = 60

# CDR (OMG DDS-XTypes, 7.4): a 4-byte header; then each number is aligned to its own size.
_CDR_HEADER_BYTES: Final = 4
# Three coordinates and a quaternion.
_POSE_BYTES: Final = 56


class _OnDemand(CallbackGroup):  # type: ignore[misc]  # rclpy is not typed
    """The callback group of polled subscriptions, which no executor runs."""

    def can_execute(self, _entity: Any) -> bool:
        return False

    def beginning_execution(self, _entity: Any) -> bool:
        return False

    def ending_execution(self, _entity: Any) -> None:
        pass


@dataclass(slots=True)
class _ReceivedTopic:
    """A topic and its subscription; `how` is its type and whether it is latched, as published."""

    name: str
    types: tuple[str, ...]
    how: tuple[str, bool] | None = None
    subscription: Any = None
    shape: MessageShape | None = None


class RobotTopics:
    """The robot's topics as one node receives them. Use it on that node's thread only."""

    def __init__(self) -> None:
        self._group = _OnDemand()
        self._pose = _ReceivedTopic(interfaces.ROBOT_POSE.name, tuple(POSES))
        self._plan = _ReceivedTopic(interfaces.ROBOT_PLAN.name, (interfaces.ROBOT_PLAN.type_name,))
        self._battery = _ReceivedTopic(
            interfaces.ROBOT_BATTERY.name, (interfaces.ROBOT_BATTERY.type_name,)
        )

    def look(self, node: Any, now_ns: int | None) -> Robot:
        """What has come since the last call; `now_ns` is the twin's time; None: not known.

        Unusable messages are dropped, with a warning, and counted among the node's drops.
        """
        return Robot(
            self._read(node, self._pose, _position, now_ns),
            self._read(node, self._plan, _plan, now_ns),
            self._read(node, self._battery, _battery, now_ns),
        )

    def _read(
        self,
        node: Any,
        topic: _ReceivedTopic,
        read: Callable[[_ReceivedTopic, Any, int], ValueT | Drop | None],
        now_ns: int | None,
    ) -> ValueT | None:
        message = self._take(node, topic)
        if message is None:
            return None
        value: ValueT | Drop | None = message if isinstance(message, Drop) else None
        # A battery's frame is its place in the robot.
        if value is None and topic is not self._battery:
            value = ingest.wrong_frame(message.header.frame_id, node.parameters.frame_id)
        if value is None:
            stamp_ns = _stamp_ns(message, now_ns)
            value = stamp_ns if isinstance(stamp_ns, Drop) else read(topic, message, stamp_ns)
        if isinstance(value, Drop):
            node.utilities.drop(value, topic.subscription.topic_name)
            return None
        return value

    def _take(self, node: Any, topic: _ReceivedTopic) -> Any:
        self._subscribe(node, topic)
        if topic.subscription is None or topic.shape is None:
            return None
        handle = topic.subscription.handle
        with handle:
            taken = handle.take_message(topic.subscription.msg_type, True)
        if taken is None:
            return None
        read = _read_path if topic is self._plan else deserialize_message
        return read_message(taken[0], topic.shape, read)

    def _subscribe(self, node: Any, topic: _ReceivedTopic) -> None:
        """Subscribe with the publishers' type and QoS, and again when these have changed."""
        try:
            found = node.get_publishers_info_by_topic(topic.name)
        except InvalidTopicNameException as error:
            node.utilities.warn(("robot", topic.name), f"{topic.name}: {error}")
            return
        usable = [it for it in found if it.topic_type in topic.types]
        if not usable:
            if found:
                node.utilities.warn(
                    ("robot", topic.name),
                    f"{topic.name} is published as {found[0].topic_type}, and not used: "
                    f"expected {' or '.join(topic.types)}",
                )
            return  # the publisher of a subscribed topic may come back
        type_name = min((it.topic_type for it in usable), key=topic.types.index)
        how = (
            type_name,
            all(
                it.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL
                and it.qos_profile.reliability == ReliabilityPolicy.RELIABLE
                for it in usable
                if it.topic_type == type_name
            ),
        )
        if how == topic.how:
            return
        if topic.subscription is not None:
            node.destroy_subscription(topic.subscription)
        kind = message_type(type_name)
        limits = {"poses": MAX_POSES} if type_name == interfaces.ROBOT_PLAN.type_name else {}
        topic.how = how
        topic.shape = MessageShape(kind, max_bytes=1_000_000, limits=limits)
        topic.subscription = node.create_subscription(
            kind,
            topic.name,
            lambda _: None,
            latched(1)
            if how[1]
            else QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT),
            callback_group=self._group,
            raw=True,
        )


@dataclass(frozen=True, slots=True)
class _Path:
    """nav_msgs/Path, reduced to the x and y of each pose, m."""

    header: Any
    points: list[tuple[float, float]]


def _read_path(data: bytes, _: Any) -> _Path:
    """Parse the CDR itself: rclpy makes eight objects per pose, 70 ms for a thousand poses."""
    order = "<" if data[1] & 1 else ">"
    length_at, place_at = Struct(f"{order}I").unpack_from, Struct(f"{order}dd").unpack_from
    body = data[_CDR_HEADER_BYTES:]

    def behind_header(at: int) -> int:
        # sec and nanosec, then the length of frame_id and its text.
        return int(at + 12 + length_at(body, at + 8)[0])

    at = behind_header(0)
    frame_id = body[12 : at - 1].decode("utf-8", "replace")
    at += -at % 4
    (count,), points = length_at(body, at), []
    at += 4
    for _ in range(count):
        at = behind_header(at + -at % 4)
        at += -at % 8
        points.append(place_at(body, at))
        at += _POSE_BYTES
    sec, nanosec = Struct(f"{order}iI").unpack_from(body)
    stamp = Time(sec=sec, nanosec=nanosec)
    return _Path(Header(stamp=stamp, frame_id=frame_id), points)


def _stamp_ns(message: Any, now_ns: int | None) -> int | Drop:
    """A message's time, ns of ROS time: its header's stamp, at most now; now if that is 0."""
    stamp_ns = convert.nanoseconds(message.header.stamp)
    if now_ns is None:
        return stamp_ns
    if stamp_ns > now_ns + MAX_AHEAD_NS:
        ahead_s = (stamp_ns - now_ns) / NANOSECONDS_PER_SECOND
        limit_s = MAX_AHEAD_NS / NANOSECONDS_PER_SECOND
        return Drop(
            Reason.REJECTED,
            f"its stamp is {ahead_s:.0f} s ahead of the twin's time, the limit is {limit_s:g} s: "
            "is a clock wrong, or use_sim_time?",
            case="clock",
        )
    return min(stamp_ns, now_ns) or now_ns


def _position(topic: _ReceivedTopic, message: Any, stamp_ns: int) -> Position | Drop:
    assert topic.how is not None
    at = POSES[topic.how[0]](message)
    x, y, turned = at.position.x, at.position.y, at.orientation
    if (far := _far("its position", x, y)) is not None:
        return far
    length = math.hypot(turned.x, turned.y, turned.z, turned.w)
    has_heading = 0.5 < length < 2.0  # all zeros: none was given; false for NaN too
    return Position(x, y, convert.yaw(turned) if has_heading else None, stamp_ns)


def _plan(_topic: _ReceivedTopic, message: Any, stamp_ns: int) -> Plan | Drop:
    points = message.points
    for x, y in points:
        if (far := _far("a position of it", x, y)) is not None:
            return far
    steps = -(-(len(points) - 1) // (SHOWN_POINTS - 1)) if len(points) > 1 else 1
    shown = points[:-1:steps] + points[-1:]
    return Plan(tuple(shown), stamp_ns)


def _battery(_topic: _ReceivedTopic, message: Any, stamp_ns: int) -> Battery | Drop | None:
    share = float(message.percentage)
    if math.isnan(share):  # not measured, by the message's definition
        return None
    if not 0.0 <= share <= 1.0:
        return Drop(
            Reason.REJECTED, f"its percentage is {share:g}, must be from 0 to 1", case="battery"
        )
    return Battery(100.0 * share, stamp_ns)


def _far(what: str, x: float, y: float) -> Drop | None:
    if abs(x) < FARTHEST_M and abs(y) < FARTHEST_M:  # false for NaN
        return None
    return Drop(Reason.POSE, f"{what} is ({x:g}, {y:g}) m, the limit is {FARTHEST_M:g} m")


# --- the source -----------------------------------------------------------------------------------

# Types that are also deserialized here: those of the topics of `relay.topics_of`.
_SHAPES: Final = {
    "lupin_msgs/msg/TwinState": message_limits.STATE,
    "lupin_msgs/msg/Observation": message_limits.OBSERVATION,
    "lupin_msgs/msg/DiscoveredTags": message_limits.DISCOVERED_TAGS,
    "nav_msgs/msg/OccupancyGrid": message_limits.MAP,
    "diagnostic_msgs/msg/DiagnosticArray": message_limits.DIAGNOSTICS,
}


class RelayRos:
    """The relay's calls to rclpy."""

    def subscribe(
        self, node: Any, topic: Topic, take: Callable[[Sample], None]
    ) -> Callable[[], None]:
        """Subscribe raw, so that this thread deserializes nothing; returns what unsubscribes.

        Raises:
            ValueError: the topic's type is not installed, or its name is invalid.

        """
        clock = node.get_clock()

        def hand_over(data: bytes) -> None:
            take(Sample(data, clock.now().nanoseconds))

        try:
            subscription = node.create_subscription(
                message_type(topic.type_name),
                topic.name,
                hand_over,
                qos_of(topic),
                raw=True,
            )
        except InvalidTopicNameException as error:
            raise ValueError(" ".join(str(error).split())) from error
        return lambda: node.destroy_subscription(subscription)

    def published(self, node: Any, is_wanted: Callable[[str, str], bool]) -> Mapping[str, str]:
        """The topics that are published with a wanted type, and that type.

        Subscribers, and publishers of another type under the same name, do not matter.
        """
        return {
            name: type_name
            for name, types in node.get_topic_names_and_types()
            for type_name in types
            if is_wanted(name, type_name)
            and any(one.topic_type == type_name for one in node.get_publishers_info_by_topic(name))
        }

    def read(self, topic: Topic, data: bytes) -> Any:
        """Deserialize as the nodes do, in any thread; lengths are checked first.

        Raises:
            ValueError: not a message of this type, or too large.

        """
        message = read_message(data, _SHAPES[topic.type_name])
        if isinstance(message, Drop):
            raise ValueError(message.why)  # noqa: TRY004  # it is no wrong call
        return message


def names_of(node: Any) -> TwinNames:
    """The names of a twin's topics and service, as our own node resolves them."""
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


# Hands an update over to the loop.
Post = Callable[[TwinUpdate], None]


class RosSource(TwinSource, Generic[NodeT]):
    """A source with a ROS node; the subclass makes the node."""

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

        # Both are used in the ROS thread only; most bridges never publish an observation.
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

    async def publish_observation(self, scan: Observation) -> None:
        """See `TwinSource`."""
        topic = self.names.observations_topic

        def publish(node: Any) -> None:
            if self._observations is None:
                self._observations = node.create_publisher(
                    ObservationMsg, topic, qos_of(interfaces.OBSERVATIONS)
                )
            self._observations.publish(convert.observation_message(scan, ""))

        await self._in_time(self.thread.call(publish))

    async def robot(self, now_ns: int | None) -> Robot | None:
        """See `TwinSource`: the newest message of each of the robot's topics."""
        return await self.thread.call(lambda node: self._robot_topics.look(node, now_ns))


def now_ns_of(update: TwinUpdate) -> int:
    """ROS time now, ns: the update's stamp plus its age, which may be a heartbeat."""
    snapshot = update.snapshot
    if snapshot.clock != "running":
        return snapshot.stamp_ns
    return snapshot.stamp_ns + int((time.monotonic() - update.made_s) * NANOSECONDS_PER_SECOND)
