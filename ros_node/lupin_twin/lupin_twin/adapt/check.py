"""`adapt --check`: reports what a configuration would accept and drop, or suggests one."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from typing import Any, Final

import yaml
from rclpy.node import Node

from lupin_twin.adapt.config import POSES, STANDARD
from lupin_twin.adapt.messages import (
    DETECTIONS_TYPE,
    TF_STATIC,
    TF_TYPE,
    FrameError,
    Frames,
    Source,
    message_type,
    transform_of,
)
from lupin_twin.adapt.node import ANY_PUBLISHER, TF_STATIC_QOS, AdaptNode
from lupin_twin.adapt.table import ConfigError
from lupin_twin.core.diagnostics import OK

POLL_S: Final = 0.2
_KNOWN: Final = frozenset({*STANDARD, *POSES, TF_TYPE, DETECTIONS_TYPE})
# Frames of the robot's base: REP 105's name, and a common alternative.
_BASES: Final = ("base_link", "base_footprint")


def report(node: AdaptNode, seconds: float) -> Iterator[tuple[bool, str]]:
    """Yield a line for each source of the configuration, and whether that source is all right."""
    for finding in node.findings(seconds):
        is_right = finding.level == OK
        values = ", ".join(f"{key} {value}" for key, value in finding.values.items())
        begin = "ok   " if is_right else "WRONG"
        yield is_right, f"{begin} {finding.name}: {finding.message}; {values}"


class Listener(Node):  # type: ignore[misc]  # rclpy is not typed
    """Subscribes to every topic of a standard type."""

    def __init__(self) -> None:
        super().__init__("lupin_adapt_check")
        self.sources: dict[str, Source] = {}
        # Types that were seen but cannot be read here, with the reason.
        self.missing: dict[str, str] = {}
        self.frames = Frames()
        self.create_timer(POLL_S, self._look)

    def _look(self) -> None:
        for topic, types in self.get_topic_names_and_types():
            if topic not in self.sources and types[0] in _KNOWN:
                self._listen(topic, types[0])

    def _listen(self, topic: str, type_name: str) -> None:
        try:
            kind = message_type(type_name)
        except ConfigError as error:
            self.missing[type_name] = str(error)
            return
        source = self.sources[topic] = Source(topic, type_name)

        def take(message: Any) -> None:
            source.received += 1
            if type_name == TF_TYPE:
                for each in message.transforms:
                    with suppress(FrameError):
                        self.frames.put(*transform_of(each, None))
            elif hasattr(message, "header"):
                source.shown["frame_id"] = message.header.frame_id

        qos = TF_STATIC_QOS if topic == TF_STATIC else ANY_PUBLISHER
        self.create_subscription(kind, topic, take, qos)


def suggestion(listener: Listener) -> str:
    """Return a configuration to start from, as YAML, based on what was received."""
    poses = [topic for topic, source in listener.sources.items() if source.type_name in POSES]
    sensors: dict[str, Any] = {}
    for topic, source in sorted(listener.sources.items()):
        known = STANDARD.get(source.type_name)
        if known is not None and source.received:
            name = known[0] or topic.rpartition("/")[2]
            entry = {"topic": topic, "type": source.type_name}
            sensors.setdefault(name, []).append(entry)
    content: dict[str, Any] = {}
    if poses:
        source = listener.sources[poses[0]]
        if frame_id := source.shown.get("frame_id"):
            content["frame_id"] = frame_id
        content["robot"] = {"topic": poses[0], "type": source.type_name}
    elif base := next((name for name in _BASES if name in listener.frames), ""):
        content["robot"] = {"tf": base}
    content["tags"] = {"A": [0.0, 0.0]}
    for topic, source in listener.sources.items():
        if source.type_name == DETECTIONS_TYPE:
            content["detections"] = {"topic": topic}
            content["tags"] = {}
    content["reach_m"] = 0.8
    content["sensors"] = {
        name: entries[0] if len(entries) == 1 else entries for name, entries in sensors.items()
    }
    return yaml.safe_dump(content, sort_keys=False, default_flow_style=None, width=200)
