"""The ROS node of `adapt`: subscribes to the configured topics, and publishes observations.

It applies none of the twin's rules: it publishes `lupin_msgs/Observation`, as any robot does.
"""

from __future__ import annotations

import difflib
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from functools import partial
from typing import Any, Final

from diagnostic_msgs.msg import DiagnosticArray
from lupin_msgs.msg import DiscoveredTags
from lupin_msgs.msg import Observation as ObservationMsg
from rclpy.exceptions import InvalidTopicNameException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from std_msgs.msg import Header

from lupin_twin.adapt.config import POSES, TAG_FRAME, Config, Robot, Sensor
from lupin_twin.adapt.messages import (
    DETECTIONS_TYPE,
    MQTT,
    TF,
    TF_STATIC,
    TF_TYPE,
    FrameError,
    Frames,
    Sightings,
    Source,
    message_type,
    transform_of,
)
from lupin_twin.adapt.mqtt import MqttClient, Pattern, measured
from lupin_twin.adapt.scans import Scans
from lupin_twin.adapt.table import ConfigError, number_of
from lupin_twin.core import interfaces
from lupin_twin.core.diagnostics import OK, WARN, Finding
from lupin_twin.core.drops import Drop, Reason, Rejected
from lupin_twin.core.parameters import FARTHEST_M
from lupin_twin.core.state import NANOSECONDS_PER_SECOND, Observation, Pose
from lupin_twin.ros import convert
from lupin_twin.ros.base_node import NodeUtilities, latched, qos_of, waker

# Matching a pattern takes time linear or quadratic in the length of the topic.
MAX_TOPIC_LENGTH: Final = 1_000
# Matches every publisher, also BEST_EFFORT ones.
ANY_PUBLISHER: Final = QoSProfile(depth=50, reliability=ReliabilityPolicy.BEST_EFFORT)
# A message of this size that claims one element per byte takes 45 MB before it is refused.
MAX_MESSAGE_BYTES: Final = 200_000
# A stamp that is farther than this from now comes from a wrong clock.
MAX_SKEW_S: Final = 10.0
# Odometry arrives at 100 Hz; the nearest tag is searched only as often as a robot can reach one.
POSE_PERIOD_S: Final = 0.05
# Each of several publishers sends its latched message.
TF_STATIC_QOS: Final = latched(100)
# A topic without messages for this long is reported on `/diagnostics`.
SILENT_S: Final = 10.0


class AdaptNode(Node):  # type: ignore[misc]  # rclpy is not typed
    """Makes observations from readings. Belongs to the thread that spins it.

    With `is_check`, it publishes nothing; `findings` report what it would publish.

    Raises:
        ConfigError: a topic's name is invalid, or a message type is not installed.

    """

    def __init__(self, config: Config, *, is_check: bool = False) -> None:
        super().__init__("lupin_adapt_check" if is_check else "lupin_adapt")
        self._is_check = is_check
        self.utilities = NodeUtilities(self)
        self._config = config
        self._scans = Scans(config)
        self._frames = Frames()
        self._sightings = Sightings()
        # The robot's position, m; None if unknown.
        self._at: tuple[float, float] | None = None
        # By topic as configured, or `MQTT`.
        self._sources: dict[str, Source] = {}
        self._built = 0
        self._moved_s = 0.0
        self._started_s = time.monotonic()
        self._observations = self.create_publisher(
            ObservationMsg, interfaces.OBSERVATIONS.name, qos_of(interfaces.OBSERVATIONS)
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
            topics = (it.topic for it in config.broker.patterns if not it.is_availability)
            self._sources[MQTT] = Source(MQTT, shown=dict.fromkeys(topics, "nothing yet"))
            self._mqtt.start()
        self.utilities.every(None, 1.0, "the second", self._each_second)

    def _subscribe(self) -> None:
        robot, detections = self._config.robot, self._config.detections
        if robot is not None and robot.topic:
            self._listen(robot.topic, robot.type_name, self._on_pose)
        if detections is not None or self._config.frames or (robot is not None and robot.tf):
            self._listen(TF, TF_TYPE, partial(self._on_tf, False))
            self._listen(TF_STATIC, TF_TYPE, partial(self._on_tf, True), TF_STATIC_QOS)
        if detections is not None:
            self._listen(detections.topic, DETECTIONS_TYPE, self._on_detections)
        topics: dict[tuple[str, str], list[Sensor]] = {}
        for sensor in self._config.sensors:
            topics.setdefault((sensor.topic, sensor.type_name), []).append(sensor)
        for (topic, type_name), sensors in topics.items():
            self._listen(topic, type_name, partial(self._on_message, sensors))

    def _listen(
        self,
        topic: str,
        type_name: str,
        callback: Callable[[str, Any], None],
        qos: QoSProfile = ANY_PUBLISHER,
    ) -> None:
        kind = message_type(type_name)
        source = self._sources[topic] = Source(topic, type_name)

        def read(data: bytes) -> None:
            source.received += 1
            source.received_s = time.monotonic()
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

        try:
            source.name = self.create_subscription(
                kind, topic, self.utilities.guarded(topic, read), qos, raw=True
            ).topic_name
        except (InvalidTopicNameException, ValueError) as error:  # the latter for `{unknown}`
            raise ConfigError(f"topic {topic!r}: {str(error).partition(chr(10))[0]}") from None

    def _drop(self, reason: Reason, topic: str, why: str, case: str = "") -> None:
        drop = Drop(reason, why, case=case)
        # A broker may have any number of topics, so all of them share one warning per period.
        known = topic if topic in self._sources else MQTT
        self.utilities.warn((reason, (known, case)), drop.on(topic))
        self._sources[known].dropped.add(case or reason.value, drop.on(topic), time.monotonic())

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
        pose = POSES[self._config.robot.type_name](message)  # type: ignore[union-attr]
        x, y = pose.position.x, pose.position.y
        if not (abs(x) < FARTHEST_M and abs(y) < FARTHEST_M):  # NaN is neither
            self._drop(Reason.POSE, topic, f"its position is ({x:g}, {y:g}) m")
            return
        self._moved_s = now_s
        self._move(topic, x, y)

    def _move(self, topic: str, x: float, y: float) -> None:
        self._sources[topic].used += 1
        self._sources[topic].shown["robot at"] = f"({x:.2f}, {y:.2f}) m"
        self._at = x, y
        self._publish(self._scans.move(x, y, self._now_ns()))

    def _on_tf(self, is_static: bool, topic: str, message: Any) -> None:
        for each in message.transforms:
            stamp_ns = None if is_static else self._stamp_ns(topic, each)
            if stamp_ns is None and not is_static:
                continue
            try:
                self._frames.put(*transform_of(each, stamp_ns))
            except FrameError as error:
                self._drop(Reason.POSE, topic, str(error))
        now_s = time.monotonic()
        if now_s - self._moved_s >= POSE_PERIOD_S:
            self._moved_s = now_s
            self._move_by_tf()
        self._find_tags()

    def _place(self, frame: str) -> tuple[float, float, float]:
        robot = self._config.robot or Robot()
        max_age_ns = int(robot.max_age_s * NANOSECONDS_PER_SECOND)
        return self._frames.place(frame, self._config.frame_id, self._now_ns(), max_age_ns)

    def _why_no_place(self, frame: str) -> str:
        try:
            self._place(frame)
        except FrameError as error:
            return str(error)
        return ""

    def _move_by_tf(self) -> None:
        robot = self._config.robot
        if robot is None or not robot.tf:
            return
        try:
            x, y, _ = self._place(robot.tf)
        except FrameError:
            self._at = None
            self._publish(self._scans.lose(self._now_ns()))
        else:
            self._move(TF, x, y)

    def _on_detections(self, topic: str, message: Any) -> None:
        stamp_ns = self._stamp_ns(topic, message)
        if stamp_ns is None:
            return
        seen = []
        for each in message.detections:
            tag_id = self._config.detections.tag_id(each.family, each.id)  # type: ignore[union-attr]
            seen.append(tag_id)
            # Bit correction turns shadows into tags, and a tag's first position is final.
            if each.hamming == 0 and tag_id not in self._scans.places:
                frame = TAG_FRAME.format(family=each.family, id=each.id)
                self._sightings.see(frame, tag_id, stamp_ns, self._now_ns())
        self._sources[topic].used += 1
        self._sources[topic].shown["tags"] = ", ".join(seen[:8]) or "none"
        self._find_tags()

    def _find_tags(self) -> None:
        known = len(self._scans.places)
        for tag_id, frame in self._sightings.come(self._frames):
            try:
                place = Pose.at(*self._place(frame))
            except FrameError:  # a frame in between is missing, but may still arrive
                continue
            self._sightings.end(frame)
            if self._at is not None:
                self._scans.discover(tag_id, place, *self._at)
        for tag_id, frame in self._frames_to_find():
            with suppress(FrameError):
                self._scans.places[tag_id] = Pose.at(*self._place(frame))
        if len(self._scans.places) > known:
            self._publish_tags()

    def _frames_to_find(self) -> list[tuple[str, str]]:
        """Tag and frame of each tag configured by frame whose position is not known yet."""
        frames, places = self._config.frames, self._scans.places
        return [(tag_id, frame) for tag_id, frame in frames.items() if tag_id not in places]

    def _on_message(self, sensors: list[Sensor], topic: str, message: Any) -> None:
        stamp_ns = self._stamp_ns(topic, message)
        if stamp_ns is None:
            return
        for sensor in sensors:
            try:
                raw = number_of(message, sensor.value.path)
                value = sensor.value.reading(raw, sensor.name)
            except Rejected as error:
                self._drop(Reason.REJECTED, topic, str(error), case=sensor.name)
                continue
            self._sources[topic].shown[sensor.name] = f"{value:g}"
            if self._scans.take(sensor.name, sensor.tag, value, stamp_ns, self._now_ns()):
                self._sources[topic].used += 1

    def _stamp_ns(self, topic: str, message: Any) -> int | None:
        """Time of measurement: the header's, or now; None (counted as a drop): wrong clock."""
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
        """Destroy the node, and close the connection to the broker."""
        if self._mqtt is not None:
            self._mqtt.stop()
        super().destroy_node()

    def _on_mqtt(self) -> None:
        assert self._mqtt is not None
        assert self._config.broker is not None
        for message in self._mqtt.take():
            self._sources[MQTT].received += 1
            try:
                topic = message.topic
            except UnicodeDecodeError as error:  # some brokers let it pass
                self._drop(Reason.UNREADABLE, MQTT, f"topic is not UTF-8: {error}", case="topic")
                continue
            if len(topic) > MAX_TOPIC_LENGTH:
                why = f"its topic has {len(topic)} characters, the limit: {MAX_TOPIC_LENGTH}"
                self._drop(Reason.SIZE, f"MQTT {topic[:80]}", why, case="topic")
                continue
            for pattern in self._config.broker.patterns:
                found = pattern.match(topic)
                if found is not None:
                    self._on_measured(pattern, *found, message)

    def _on_measured(self, pattern: Pattern, tag: str, sensor: str, message: Any) -> None:
        topic, now_ns = f"MQTT {message.topic[:80]}", self._now_ns()
        try:
            said = measured(pattern, tag, sensor, message.payload)
        except Rejected as error:
            self._drop(Reason.REJECTED, topic, str(error), case="payload")
            return
        if said.is_away:
            self._publish([self._scans.failed(tag, "its sensor is offline", now_ns, is_fixed=True)])
            return
        if said.stamp_s is None and message.retain and said.readings:
            self._drop(
                Reason.REJECTED,
                topic,
                "it is retained and has no time (time): its age is not known",
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
                self._sources[MQTT].used += 1
                self._sources[MQTT].shown[pattern.topic] = f"{said.tag} {name} {value:g}"
            else:
                self._drop(Reason.SIZE, topic, "it is one tag or sensor too many", case="many")

    def _each_second(self) -> None:
        self._publish(self._scans.due(self._now_ns()))
        self._move_by_tf()
        for frame in self._sightings.missed(self._now_ns()):
            why = f"TF has no {frame!r}: is tag.frames set in apriltag_ros?"
            if frame in self._frames:
                why = self._why_no_place(frame) or f"{frame!r} is from an earlier picture in TF"
            self._drop(Reason.FRAME, TF, f"a tag was detected, but {why}", case="tag")
        self._send(
            self._diagnostics,
            convert.diagnostics(
                self.findings(SILENT_S), self.get_fully_qualified_name(), self._now_ns()
            ),
        )

    def findings(self, silent_s: float) -> list[Finding]:
        """Report each source's messages and faults, and the number of observations made.

        A topic without messages for `silent_s` is silent.
        """
        for topic, source in self._sources.items():
            if topic == TF:
                source.problem = self._why_not_in_tf()
            elif topic == MQTT and self._mqtt is not None:
                source.problem = self._mqtt.problem
                source.shown["lost"] = str(self._mqtt.lost)
            else:
                source.problem = self._why_silent(source, silent_s)
            # A standing robot or a slow sensor is not worth a log entry.
            if source.problem and (source.received == 0 or topic in (MQTT, TF)):
                self.utilities.warn(("problem", topic), f"{topic}: {source.problem}")
        errors = self.utilities.callback_errors
        made = Finding(
            "observations",
            WARN if errors else OK,
            f"at {self._scans.tag or 'no tag'}",
            {"made": str(self._built), "errors": str(errors)},
        )
        return [*(source.finding(topic) for topic, source in self._sources.items()), made]

    def _why_not_in_tf(self) -> str:
        robot = self._config.robot
        frames = [frame for _, frame in self._frames_to_find()]
        if robot is not None and robot.tf:
            frames = [robot.tf, *frames]
        return next(filter(None, map(self._why_no_place, frames)), "")

    def _why_silent(self, source: Source, silent_s: float) -> str:
        quiet_s = time.monotonic() - max(source.received_s, self._started_s)
        if quiet_s < silent_s:
            return ""
        publishers = self.get_publishers_info_by_topic(source.name)
        is_static = source.name == TF_STATIC
        # Static frames are sent once, and a robot may have none.
        if is_static and (source.received or not publishers):
            return ""
        if not publishers:
            published = (
                name
                for name, types in self.get_topic_names_and_types()
                if source.type_name in types and self.count_publishers(name)
            )
            near = difflib.get_close_matches(source.name, published, n=1, cutoff=0.5)
            return "nobody publishes it" + (f", did you mean {near[0]}?" if near else "")
        types = {publisher.topic_type for publisher in publishers}
        if source.type_name not in types:
            return f"it is published as {', '.join(types)}, configured is {source.type_name}"
        durability = DurabilityPolicy.TRANSIENT_LOCAL
        if is_static and all(it.qos_profile.durability != durability for it in publishers):
            return "its QoS is VOLATILE, expected TRANSIENT_LOCAL"
        return f"nothing for {quiet_s:.0f} s"

    def _send(self, publisher: Any, message: Any) -> None:
        if not self._is_check:
            publisher.publish(message)

    def _publish(self, scans: Iterable[Observation]) -> None:
        for scan in scans:
            self._built += 1
            self._send(self._observations, convert.observation_message(scan, self._config.frame_id))

    def _publish_tags(self) -> None:
        if self._scans.places:
            header = Header(stamp=self.get_clock().now().to_msg(), frame_id=self._config.frame_id)
            self._send(self._tags, convert.discovered_tags_message(self._scans.places, header))
