"""The ROS node of `adapt`: subscribes to what is configured, publishes observations of it.

The twin's rules stay the twin's: what is made here is `lupin_msgs/Observation`, as from any robot.
"""

from __future__ import annotations

import importlib
import time
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Point, Pose, Quaternion
from lupin_msgs.msg import DiscoveredTag, DiscoveredTags, Observation, SensorReading
from rclpy.exceptions import InvalidTopicNameException
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from std_msgs.msg import Header

from lupin_twin.adapt.config import POSES, Config, Place, Sensor
from lupin_twin.adapt.mqtt import Message, MqttClient
from lupin_twin.adapt.mqtt_topics import Pattern, PayloadError, measured
from lupin_twin.adapt.scans import MadeScan, Scans, number_of
from lupin_twin.adapt.table import ConfigError
from lupin_twin.core import interfaces
from lupin_twin.core.diagnostics import OK, WARN, Finding
from lupin_twin.core.drops import RECENT_S, Drop, Reason
from lupin_twin.core.state import NANOSECONDS_PER_SECOND
from lupin_twin.ros import convert
from lupin_twin.ros.base_node import NodeUtilities, latched, qos_of, waker

SOURCE: Final = "adapt"
MQTT: Final = "MQTT"
# Matches every publisher, also those that drop messages rather than wait.
ANY_PUBLISHER: Final = QoSProfile(depth=50, reliability=ReliabilityPolicy.BEST_EFFORT)
MAX_MESSAGE_BYTES: Final = 1_000_000
# A reading whose stamp is farther from now was stamped by a clock that is wrong.
MAX_SKEW_S: Final = 10.0
# Odometry comes a hundred times a second: tags are looked for as often as anybody can drive.
POSE_PERIOD_S: Final = 0.1
# A topic that says nothing for so long is named on `/diagnostics`.
SILENT_S: Final = 10.0


def message_type(name: str) -> Any:
    """The class of a message type such as `sensor_msgs/msg/Temperature`.

    Raises:
        ConfigError: its package is not installed, or has no such message.

    """
    package, _, message = name.partition("/msg/")
    try:
        return getattr(importlib.import_module(f"{package}.msg"), message)
    except ImportError:
        raise ConfigError(
            f"type {name}: the package {package} is not installed here, "
            f"on a robot: apt install ros-jazzy-{package.replace('_', '-')}"
        ) from None
    except AttributeError:
        raise ConfigError(f"type {name}: the package {package} has no message {message}") from None


@dataclass(frozen=True, slots=True)
class _Dropped:
    """How often something was wrong, and the last time in words; `last_s` by the steady clock."""

    count: int
    text: str
    last_s: float


class AdaptNode(Node):  # type: ignore[misc]  # rclpy is not typed
    """Readings in, observations out. Belongs to the thread that spins it.

    Raises:
        ConfigError: a topic that ROS does not take, or a message type that is not installed.

    """

    def __init__(self, config: Config) -> None:
        super().__init__("lupin_adapt")
        self.utilities = NodeUtilities(self)
        self._config = config
        self._scans = Scans(config)
        # By topic, since the start.
        self.received: Counter[str] = Counter()
        self.used: Counter[str] = Counter()
        self._heard_s: dict[str, float] = {}
        # By case: what was wrong with one sensor must not hide what is wrong with another.
        self._dropped: dict[str, _Dropped] = {}
        self._made = 0
        self._moved_s = 0.0
        self._started_s = time.monotonic()
        self._observations = self.create_publisher(
            Observation, interfaces.OBSERVATIONS.name, qos_of(interfaces.OBSERVATIONS)
        )
        self._tags = self.create_publisher(
            DiscoveredTags, interfaces.DISCOVERED_TAGS.name, latched(1)
        )
        self._diagnostics = self.create_publisher(
            DiagnosticArray, interfaces.DIAGNOSTICS.name, qos_of(interfaces.DIAGNOSTICS)
        )
        self._mqtt: MqttClient | None = None
        self._subscribe()
        self._publish_tags()
        if config.broker is not None:
            arrived = self.create_guard_condition(self.utilities.guarded("MQTT", self._on_mqtt))
            self._mqtt = MqttClient(config.broker, waker(arrived))
            self._mqtt.start()
        self.utilities.every(None, 1.0, "the second", self._each_second)

    def _subscribe(self) -> None:
        robot = self._config.robot
        if robot is not None:
            self._listen(robot.topic, robot.type_name, self._on_pose)
        topics: dict[tuple[str, str], list[Sensor]] = {}
        for sensor in self._config.sensors:
            topics.setdefault((sensor.topic, sensor.type_name), []).append(sensor)
        for (topic, type_name), sensors in topics.items():
            self._listen(topic, type_name, partial(self._on_message, sensors))

    def _listen(self, topic: str, type_name: str, callback: Callable[[str, Any], None]) -> None:
        kind = message_type(type_name)

        def read(data: bytes) -> None:
            self.received[topic] += 1
            self._heard_s[topic] = time.monotonic()
            if len(data) > MAX_MESSAGE_BYTES:
                self._drop(
                    Reason.SIZE, topic, f"{len(data)} bytes, the limit is {MAX_MESSAGE_BYTES}"
                )
                return
            try:
                message = deserialize_message(data, kind)
            except Exception as error:  # noqa: BLE001  # rclpy raises several kinds
                self._drop(Reason.UNREADABLE, topic, str(error))
                return
            callback(topic, message)

        self._heard_s[topic] = -SILENT_S
        try:
            self.create_subscription(
                kind, topic, self.utilities.guarded(topic, read), ANY_PUBLISHER, raw=True
            )
        except InvalidTopicNameException as error:
            raise ConfigError(f"topic {topic!r}: {str(error).partition(chr(10))[0]}") from None

    def _drop(self, reason: Reason, topic: str, why: str, case: str = "") -> None:
        drop = Drop(reason, why, case=case)
        self.utilities.drop(drop, topic)
        key = case or reason.value
        count = self._dropped[key].count if key in self._dropped else 0
        self._dropped[key] = _Dropped(count + 1, drop.on(topic), time.monotonic())

    def _now_ns(self) -> int:
        return int(self.get_clock().now().nanoseconds)

    def _on_pose(self, topic: str, message: Any) -> None:
        now_s = time.monotonic()
        if now_s - self._moved_s < POSE_PERIOD_S:
            return
        frame_id = message.header.frame_id
        if frame_id != self._config.frame_id:
            self._drop(
                Reason.FRAME,
                topic,
                f"its frame is {frame_id!r}, expected {self._config.frame_id!r} (frame_id)",
            )
            return
        if self._stamp_ns(topic, message) is None:
            return
        at = message
        for part in POSES[self._config.robot.type_name].split("."):  # type: ignore[union-attr]
            at = getattr(at, part)
        x, y = at.position.x, at.position.y
        if not (abs(x) < 1e6 and abs(y) < 1e6):  # NaN is neither
            self._drop(Reason.POSE, topic, f"its position is ({x:g}, {y:g}) m")
            return
        self._moved_s = now_s
        self.used[topic] += 1
        self._publish(self._scans.move(x, y, self._now_ns()))

    def _on_message(self, sensors: list[Sensor], topic: str, message: Any) -> None:
        stamp_ns = self._stamp_ns(topic, message)
        if stamp_ns is None:
            return
        for sensor in sensors:
            try:
                raw = number_of(message, sensor.field)
            except (AttributeError, LookupError, TypeError) as error:
                self._drop(
                    Reason.REJECTED, topic, f"{sensor.name}: {error}", case=f"field {sensor.name}"
                )
                continue
            value = raw * sensor.factor + sensor.offset
            if not sensor.low <= value <= sensor.high:  # NaN is in no range
                self._drop(
                    Reason.REJECTED,
                    topic,
                    f"{sensor.name} is {value:g}, must be from {sensor.low:g} to {sensor.high:g}",
                    case=f"range {sensor.name}",
                )
            elif self._scans.take(sensor.name, sensor.tag, value, stamp_ns, self._now_ns()):
                self.used[topic] += 1

    def _stamp_ns(self, topic: str, message: Any) -> int | None:
        """When it was measured: by its header, or now; None, counted: its clock is wrong."""
        now_ns = self._now_ns()
        header = getattr(message, "header", None)
        stamp_ns = 0 if header is None else convert.nanoseconds(header.stamp)
        if not stamp_ns:
            return now_ns
        skew_s = (stamp_ns - now_ns) / NANOSECONDS_PER_SECOND
        if abs(skew_s) > MAX_SKEW_S:
            self._drop(
                Reason.REJECTED,
                topic,
                f"its stamp is {abs(skew_s):.0f} s {'ahead of' if skew_s > 0 else 'behind'} ROS "
                f"time here, the limit is {MAX_SKEW_S:g} s: is a clock wrong, or use_sim_time?",
                case="clock",
            )
            return None
        return min(stamp_ns, now_ns)

    def destroy_node(self) -> None:
        """End the connection to the broker, too."""
        if self._mqtt is not None:
            self._mqtt.stop()
        super().destroy_node()

    def _on_mqtt(self) -> None:
        assert self._mqtt is not None
        assert self._config.broker is not None
        for message in self._mqtt.take():
            self.received[MQTT] += 1
            for pattern in self._config.broker.patterns:
                found = pattern.match(message.topic)
                if found is not None:
                    self._on_measured(pattern, *found, message)

    def _on_measured(self, pattern: Pattern, tag: str, sensor: str, message: Message) -> None:
        topic, now_ns = f"MQTT {message.topic[:80]}", self._now_ns()
        try:
            said = measured(pattern, tag, sensor, message.payload)
        except PayloadError as error:
            self._drop(Reason.REJECTED, topic, str(error), case="payload")
            return
        if said.is_away:
            self._publish([self._scans.failed(tag, "its sensor is offline", now_ns)])
            return
        if said.stamp_s is None and message.is_retained and said.readings:
            self._drop(
                Reason.REJECTED,
                topic,
                "it is retained and says no time (time): nobody knows how old it is",
                case="retained",
            )
            return
        stamp_ns = now_ns
        if said.stamp_s is not None:
            ahead_s = said.stamp_s - time.time()
            if ahead_s > MAX_SKEW_S:
                why = f"its time is {ahead_s:.0f} s ahead, the limit is {MAX_SKEW_S:g} s"
                self._drop(Reason.REJECTED, topic, f"{why}: is a clock wrong?", case="clock")
                return
            stamp_ns += int(min(ahead_s, 0.0) * NANOSECONDS_PER_SECOND)
        for name, value in said.readings:
            if self._scans.take(name, said.tag, value, stamp_ns, now_ns):
                self.used[MQTT] += 1

    def _each_second(self) -> None:
        self._publish(self._scans.due(self._now_ns()))
        findings = [self._finding(topic) for topic in sorted(self._heard_s)]
        if self._mqtt is not None:
            if self._mqtt.problem:
                self.utilities.warn(("mqtt", self._mqtt.problem), f"MQTT: {self._mqtt.problem}")
            findings.append(
                Finding(
                    MQTT,
                    WARN if self._mqtt.problem else OK,
                    self._mqtt.problem or "connected",
                    {
                        "received": str(self.received[MQTT]),
                        "used": str(self.used[MQTT]),
                        "lost": str(self._mqtt.lost),
                    },
                )
            )
        self._diagnostics.publish(
            convert.diagnostics(
                [*findings, self._summary()], self.get_fully_qualified_name(), self._now_ns()
            )
        )

    def _finding(self, topic: str) -> Finding:
        silent_s = time.monotonic() - max(self._heard_s[topic], self._started_s)
        is_silent = silent_s > SILENT_S
        return Finding(
            topic,
            WARN if is_silent else OK,
            f"nothing for {silent_s:.0f} s" if is_silent else "receiving",
            {"received": str(self.received[topic]), "used": str(self.used[topic])},
        )

    def _summary(self) -> Finding:
        now_s, errors = time.monotonic(), self.utilities.callback_errors
        recent = [it.text for it in self._dropped.values() if now_s - it.last_s < RECENT_S]
        return Finding(
            "observations",
            WARN if recent or errors else OK,
            "; ".join(recent) or f"at {self._scans.tag or 'no tag'}",
            {
                "made": str(self._made),
                "errors": str(errors),
                **{f"dropped: {case}": str(it.count) for case, it in self._dropped.items()},
            },
        )

    def _publish(self, scans: Iterable[MadeScan]) -> None:
        for scan in scans:
            self._made += 1
            self._observations.publish(observation(scan, self._config.frame_id))

    def _publish_tags(self) -> None:
        if self._config.tags:
            header = Header(stamp=self.get_clock().now().to_msg(), frame_id=self._config.frame_id)
            tags = [
                DiscoveredTag(tag_id=tag_id, pose_in_map=_pose(place))
                for tag_id, place in self._config.tags.items()
            ]
            self._tags.publish(DiscoveredTags(header=header, tags=tags))


def observation(scan: MadeScan, frame_id: str) -> Observation:
    """A scan as lupin_msgs/Observation; without readings, a failed one."""
    stamp = convert.time_msg(scan.stamp_ns)
    message = Observation(
        header=Header(stamp=stamp, frame_id=frame_id),
        source=SOURCE,
        kind=Observation.KIND_TAG_READING,
        status=Observation.STATUS_OK if scan.readings else Observation.STATUS_SCAN_FAILED,
        status_detail=scan.detail[:256],
        tag_pose_in_map=_pose(scan.place),
    )
    message.tag_reading.tag_id = scan.tag_id
    message.tag_reading.stamp = stamp
    message.tag_reading.readings = [
        SensorReading(name=name, value=float(value)) for name, value in scan.readings
    ]
    return message


def _pose(place: Place | None) -> Pose:
    if place is None:  # `w` is 1 in ROS 2 unless it is set: a pose at the origin
        return Pose(orientation=Quaternion(x=0.0, y=0.0, z=0.0, w=0.0))
    return Pose(position=Point(x=float(place.x), y=float(place.y), z=float(place.z)))
