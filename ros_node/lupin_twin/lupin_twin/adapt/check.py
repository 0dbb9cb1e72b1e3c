"""Runs `adapt`; `adapt --check` reports what it accepts and drops, or suggests a configuration."""

from __future__ import annotations

import signal
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

import yaml
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from lupin_twin.adapt.config import POSES, STANDARD, Config, read_config
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
from lupin_twin.core.parameters import ParameterError
from lupin_twin.ros.base_node import run_until_signal, running_ros
from lupin_twin.runtime import process
from lupin_twin.runtime.process import refuse

POLL_S: Final = 0.2
_KNOWN: Final = frozenset({*STANDARD, *POSES, TF_TYPE, DETECTIONS_TYPE})
# Frames of the robot's base: REP 105's name, and a common alternative.
_BASES: Final = ("base_link", "base_footprint")


def start(path: Path | None, ros_args: Sequence[str], check_s: float | None) -> int:
    """Run the adapter until a signal ends it or, with `check_s`, the check, which takes so long.

    Returns the exit code: 2 for an invalid configuration, 1 if the check found a fault.
    """
    try:
        config = None if path is None else read_config(path)
        with running_ros(["adapt", *ros_args]):
            if config is None or check_s is not None:
                return _check(config, check_s or 0.0)
            node = AdaptNode(config)
            node.get_logger().info(
                f"adapting sensors for {len(config.tags)} tags; "
                "/diagnostics shows what arrives and what is dropped"
            )
            return run_until_signal(node)
    except (ConfigError, ParameterError) as error:
        return refuse("adapt", str(error))


def _check(config: Config | None, seconds: float) -> int:
    """Listen for `seconds`, and write the report or, without a configuration, a suggestion."""
    node = Listener() if config is None else AdaptNode(config, is_check=True)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, process.STOP_SIGNALS)
    sys.stderr.write(f"listening for {seconds:g} s ...\n")
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    until_s = time.monotonic() + seconds
    while (left_s := until_s - time.monotonic()) > 0:
        executor.spin_once(timeout_sec=left_s)
    if isinstance(node, AdaptNode):
        lines = list(report(node, seconds))
        node.destroy_node()
        sys.stdout.writelines(f"{line}\n" for _, line in lines)
        return 0 if all(is_right for is_right, _ in lines) else 1
    sys.stderr.writelines(f"{why}\n" for why in node.missing.values())
    if not any(source.received for source in node.sources.values()):
        topics = ", ".join(sorted(name for name, _ in node.get_topic_names_and_types()))
        return refuse("adapt", f"no reading and no pose was received; topics: {topics or 'none'}")
    sys.stdout.write(f"# Fill in where each tag is: [x, y] in m.\n{suggestion(node)}")
    return 0


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
