"""`adapt --check`: listens for a while, says what comes and what is missing, and what to write."""

from __future__ import annotations

import difflib
import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Final

import yaml
from rclpy.node import Node

from lupin_twin.adapt.config import POSES, STANDARD, TAG_FRAME, Config, Detections, Robot, Sensor
from lupin_twin.adapt.frames import FrameError, Frames
from lupin_twin.adapt.messages import (
    DETECTIONS_TYPE,
    TF,
    TF_STATIC,
    TF_TYPE,
    message_type,
    transform_of,
)
from lupin_twin.adapt.node import ANY_PUBLISHER, MAX_SKEW_S, TF_STATIC_QOS
from lupin_twin.adapt.scans import number_of
from lupin_twin.adapt.table import ConfigError

POLL_S: Final = 0.2
_KNOWN: Final = frozenset({*STANDARD, *POSES, TF_TYPE, DETECTIONS_TYPE})
# REP 105, and what navigation often has instead.
_BASES: Final = ("base_link", "base_footprint")


@dataclass(slots=True)
class ReceivedTopic:
    """What came on one topic: how many, the newest of them, and its stamp's distance from now."""

    type_name: str
    messages: int = 0
    newest: Any = None
    skew_s: float | None = None

    @property
    def frame_id(self) -> str | None:
        """The newest message's frame; None: it has no header."""
        header = getattr(self.newest, "header", None)
        return None if header is None else str(header.frame_id)


class Listener(Node):  # type: ignore[misc]  # rclpy is not typed
    """Hears every topic of a standard type, and those of a configuration."""

    def __init__(self, config: Config | None) -> None:
        super().__init__("lupin_adapt_check")
        self.topics: dict[str, str] = {}
        self.heard: dict[str, ReceivedTopic] = {}
        # Types that were seen, and why they cannot be read here.
        self.missing: dict[str, str] = {}
        self.frames = Frames()
        self._wanted: dict[str, str] = {}
        if config is not None:
            self._wanted = {sensor.topic: sensor.type_name for sensor in config.sensors}
            if config.robot is not None and config.robot.topic:
                self._wanted[config.robot.topic] = config.robot.type_name
        self.create_timer(POLL_S, self._look)

    def _look(self) -> None:
        for topic, types in self.get_topic_names_and_types():
            self.topics[topic] = types[0]
            wanted = self._wanted.get(topic, self._wanted.get(topic.removeprefix("/"), types[0]))
            is_known = wanted in _KNOWN or topic in self._wanted
            if topic not in self.heard and is_known and wanted in types:
                self._listen(topic, wanted)

    def _listen(self, topic: str, type_name: str) -> None:
        try:
            kind = message_type(type_name)
        except ConfigError as error:
            self.missing[type_name] = str(error)
            return
        heard = self.heard[topic] = ReceivedTopic(type_name)

        def take(message: Any) -> None:
            heard.messages += 1
            heard.newest = message
            for each in message.transforms if type_name == TF_TYPE else ():
                stamp = each.header.stamp
                stamp_ns = None if topic == TF_STATIC else stamp.sec * 10**9 + stamp.nanosec
                with suppress(FrameError):
                    self.frames.put(*transform_of(each, stamp_ns))
            header = getattr(message, "header", None)
            if header is not None and (header.stamp.sec or header.stamp.nanosec):
                now_ns = self.get_clock().now().nanoseconds
                heard.skew_s = header.stamp.sec + header.stamp.nanosec / 1e9 - now_ns / 1e9

        qos = TF_STATIC_QOS if topic == TF_STATIC else ANY_PUBLISHER
        self.create_subscription(kind, topic, take, qos)


def listen(executor: Any, seconds: float) -> None:
    """Spin for so long."""
    until_s = time.monotonic() + seconds
    while (left_s := until_s - time.monotonic()) > 0:
        executor.spin_once(timeout_sec=left_s)


def report(config: Config, listener: Listener, seconds: float) -> Iterator[tuple[bool, str]]:
    """A line a topic of the configuration, each with whether it is as it has to be."""
    if config.robot is not None:
        yield _robot(config, config.robot, listener, seconds)
    if config.detections is not None:
        yield _detections(config.detections, listener, seconds)
    for sensor in config.sensors:
        wrong = _why_silent(sensor.topic, sensor.type_name, listener, seconds)
        heard = _received(sensor.topic, listener)
        said = _rate(heard, seconds)
        if not wrong:
            value, wrong = _value(sensor, heard)
            said = f"{said}, {sensor.name} = {value:.4g}"
        what = sensor.name + (f" of tag {sensor.tag}" if sensor.tag else "")
        yield _line(what, sensor.topic, wrong or _skewed(heard), said)


def _robot(config: Config, robot: Robot, listener: Listener, seconds: float) -> tuple[bool, str]:
    topic, type_name = (TF, TF_TYPE) if robot.tf else (robot.topic, robot.type_name)
    wrong = _why_silent(topic, type_name, listener, seconds)
    heard = _received(topic, listener)
    said = _rate(heard, seconds)
    if wrong:
        pass
    elif robot.tf:
        now_ns = int(listener.get_clock().now().nanoseconds)
        try:
            x, y, _ = listener.frames.place(
                robot.tf, config.frame_id, now_ns, int(robot.max_age_s * 1e9)
            )
            said += f", {robot.tf} is at ({x:.2f}, {y:.2f}) m in {config.frame_id}"
        except FrameError as error:
            wrong = str(error)
    elif heard.frame_id != config.frame_id:
        wrong = (
            f"its frame is {heard.frame_id!r}, expected {config.frame_id!r}: "
            "set frame_id, or have it published in that frame"
        )
    return _line("robot", topic, wrong or _skewed(heard), said)


def _detections(what: Detections, listener: Listener, seconds: float) -> tuple[bool, str]:
    wrong = _why_silent(what.topic, DETECTIONS_TYPE, listener, seconds)
    heard = _received(what.topic, listener)
    tags = [] if wrong else heard.newest.detections
    for tag in tags:
        frame = TAG_FRAME.format(family=tag.family, id=tag.id)
        if frame not in listener.frames:
            wrong = f"TF has no {frame!r}: is tag.frames set in apriltag_ros?"
    seen = ", ".join(what.tag_id(tag.family, tag.id) for tag in tags) or "none"
    said = f"{_rate(heard, seconds)}, tags in the last: {seen}"
    return _line("detections", what.topic, wrong or _skewed(heard), said)


def suggestion(listener: Listener) -> str:
    """A configuration to start from, of what was heard, as YAML."""
    poses = [topic for topic, heard in listener.heard.items() if heard.type_name in POSES]
    sensors: dict[str, Any] = {}
    for topic, heard in sorted(listener.heard.items()):
        known = STANDARD.get(heard.type_name)
        if known is not None and heard.messages:
            name = known.sensor or topic.rpartition("/")[2]
            entry = {"topic": topic, "type": heard.type_name}
            sensors.setdefault(name, []).append(entry)
    content: dict[str, Any] = {}
    if poses:
        heard = listener.heard[poses[0]]
        if heard.frame_id:
            content["frame_id"] = heard.frame_id
        content["robot"] = {"topic": poses[0], "type": heard.type_name}
    elif base := next((name for name in _BASES if name in listener.frames), ""):
        content["robot"] = {"tf": base}
    content["tags"] = {"A": [0.0, 0.0]}
    for topic, heard in listener.heard.items():
        if heard.type_name == DETECTIONS_TYPE:
            content["detections"] = {"topic": topic}
            content["tags"] = {}
    content["reach_m"] = 0.8
    content["sensors"] = {
        name: entries[0] if len(entries) == 1 else entries for name, entries in sensors.items()
    }
    return yaml.safe_dump(content, sort_keys=False)


def _line(what: str, topic: str, wrong: str, said: str) -> tuple[bool, str]:
    return not wrong, f"{'WRONG' if wrong else 'ok   '} {what}: {topic}: {wrong or said}"


def _received(topic: str, listener: Listener) -> ReceivedTopic:
    return listener.heard.get(listener.resolve_topic_name(topic), ReceivedTopic(""))


def _why_silent(topic: str, type_name: str, listener: Listener, seconds: float) -> str:
    """Why nothing came that could be used; empty: something came."""
    try:
        message_type(type_name)
    except ConfigError as error:
        return str(error)
    name = listener.resolve_topic_name(topic)
    if name not in listener.topics or not listener.count_publishers(name):
        near = difflib.get_close_matches(name, _published(listener), n=1, cutoff=0.5)
        return "nobody publishes it" + (f", did you mean {near[0]}?" if near else "")
    if listener.topics[name] != type_name:
        return f"its type is {listener.topics[name]}, configured is {type_name}"
    if not _received(topic, listener).messages:
        return f"nothing came in {seconds:g} s"
    return ""


def _published(listener: Listener) -> Mapping[str, str]:
    return {
        topic: kind for topic, kind in listener.topics.items() if listener.count_publishers(topic)
    }


def _value(sensor: Sensor, heard: ReceivedTopic) -> tuple[float, str]:
    try:
        value = number_of(heard.newest, sensor.field) * sensor.factor + sensor.offset
    except (AttributeError, LookupError, TypeError) as error:
        return 0.0, f"field {sensor.field}: {error}"
    if not sensor.low <= value <= sensor.high:
        return value, f"{value:.4g} is not from {sensor.low:g} to {sensor.high:g}: is it the unit?"
    return value, ""


def _skewed(heard: ReceivedTopic) -> str:
    if heard.skew_s is None or abs(heard.skew_s) <= MAX_SKEW_S:
        return ""
    direction = "ahead of" if heard.skew_s > 0 else "behind"
    return f"its stamps are {abs(heard.skew_s):.0f} s {direction} ROS time here: is a clock wrong?"


def _rate(heard: ReceivedTopic, seconds: float) -> str:
    return f"{heard.messages} messages in {seconds:g} s"
