"""`lupin-twin adapt` with a robot that publishes its pose by TF and tags by apriltag_ros."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest
import yaml
from geometry_msgs.msg import TransformStamped
from rclpy.qos import QoSProfile, qos_profile_sensor_data

from lupin_twin.adapt.check import Listener, report, suggestion
from lupin_twin.adapt.config import config_of
from lupin_twin.adapt.node import AdaptNode
from tests.support.docs import block_named
from tests.support.processes import twin_node
from tests.support.ros import Peer, latched
from tests.twin.adapt.test_adapt import Watched, adapt, each_is_reported, listening

CONFIG = """
robot: {tf: base_link, max_age_s: 2}
detections: {topic: /detections}
tags: {"tag36h11:1": [9.0, 9.0]}
reach_m: 0.8
window_s: 0.5
sensors:
  temperature: {topic: /temperature, type: sensor_msgs/msg/Temperature}
"""


@pytest.fixture
def config(tmp_path: Path) -> Path:
    path = tmp_path / "adapt.yaml"
    path.write_text(CONFIG)
    return path


class Robot(Watched):
    """Nav2's frames, apriltag_ros's detections, a thermometer."""

    def __init__(self, peer: Peer) -> None:
        from apriltag_msgs.msg import AprilTagDetectionArray
        from tf2_msgs.msg import TFMessage

        super().__init__(peer)
        node = peer.node
        self._tf = node.create_publisher(TFMessage, "/tf", QoSProfile(depth=100))
        self._static = node.create_publisher(TFMessage, "/tf_static", latched(1))
        self._seen = node.create_publisher(
            AprilTagDetectionArray, "/detections", qos_profile_sensor_data
        )
        # Once, latched; the camera looks along the robot's left.
        self.stand(self.step("base_link", "camera", (0.0, 0.2, 0.5)))

    def step(self, parent: str, child: str, at: tuple[float, float, float]) -> TransformStamped:
        step = TransformStamped(child_frame_id=child)
        step.header.frame_id = parent
        step.header.stamp = self.now()
        move = step.transform.translation
        move.x, move.y, move.z = at
        return step

    def stand(self, *steps: TransformStamped) -> None:
        from tf2_msgs.msg import TFMessage

        self._static.publish(TFMessage(transforms=steps))

    def be_at(self, x: float, *steps: TransformStamped) -> None:
        from tf2_msgs.msg import TFMessage

        self._tf.publish(TFMessage(transforms=[self.step("map", "odom", (x - 1.0, 0.0, 0.0))]))
        own = self.step("odom", "/base_link", (1.0, 0.0, 0.0))  # as ROS 1 wrote it
        self._tf.publish(TFMessage(transforms=[own, *steps]))

    def see(
        self, number: int, ahead_m: float, *, hamming: int = 0, frame: str = "tag36h11:{}"
    ) -> TransformStamped:
        """As apriltag_ros does: first the detection, then the transform, of the same moment."""
        from apriltag_msgs.msg import AprilTagDetection, AprilTagDetectionArray

        step = self.step("camera", frame.format(number), (ahead_m, 0.0, 0.0))
        detection = AprilTagDetection(family="tag36h11", id=number, hamming=hamming)
        self._seen.publish(AprilTagDetectionArray(header=step.header, detections=[detection]))
        return step


def test_a_seen_tag_is_on_the_map_with_the_readings_taken_there(domain: int, config: Path) -> None:
    with twin_node(domain), adapt(domain, "--config", str(config)) as process, Peer(domain) as peer:
        robot = Robot(peer)
        peer.listen()

        def at_the_tag() -> Any:
            robot.be_at(
                5.0,
                robot.see(7, 0.3),
                robot.see(8, 2.0),  # out of reach: too far for a position
                robot.see(9, 0.3, hamming=1),  # a shadow
                robot.see(1, 0.3),  # it was surveyed
            )
            robot.read(21.5)
            tags = {tag.tag_id: tag for tag in peer.states[-1].tags} if peer.states else {}
            return "tag36h11:7" in tags and tags["tag36h11:7"].readings and tags

        tags = peer.until(at_the_tag, "the tag with its readings")
        assert set(tags) == {"tag36h11:7", "tag36h11:1"}
        at = tags["tag36h11:7"].pose.position
        assert (at.x, at.y, at.z) == pytest.approx((5.3, 0.2, 0.5))
        assert [(it.name, it.value) for it in tags["tag36h11:7"].readings] == [
            ("temperature", 21.5)
        ]
        assert tags["tag36h11:1"].pose.position.x == 9.0

        # The first position stays, and between tags nothing is read.
        robot.observations.clear()

        def elsewhere() -> bool:
            robot.be_at(7.0, robot.see(7, 0.1), robot.see(8, 0.1))
            return any(tag.tag_id == "tag36h11:8" for tag in peer.states[-1].tags)

        peer.until(elsewhere, "the other tag")
        tags = {tag.tag_id: tag for tag in peer.states[-1].tags}
        assert tags["tag36h11:8"].pose.position.x == pytest.approx(7.1)
        assert tags["tag36h11:7"].pose.position.x == pytest.approx(5.3)
        assert process.stop() == 0


WRONG: list[tuple[Callable[[Any], object], str]] = [
    (lambda robot: None, "TF has no path from 'base_link' to 'map' (frame_id)"),
    (
        lambda robot: robot.be_at(0.0, robot.see(7, 0.3, frame="bench")),
        "a tag was detected, but TF has no 'tag36h11:7': is tag.frames set in apriltag_ros?",
    ),
    (lambda robot: robot.be_at(float("nan")), "the transform to 'odom' has (nan, 0.0,"),
]


def test_mistakes_in_tf_are_reported_by_name(domain: int, config: Path) -> None:
    with adapt(domain, "--config", str(config)) as process, Peer(domain) as peer:
        robot = Robot(peer)
        each_is_reported(robot, WRONG)
        assert process.exit_code is None


def test_a_fixed_sensor_is_where_its_frame_is(domain: int, config: Path) -> None:
    config.write_text(
        "tags: {bench: bench_sensor, lost: nowhere}\nwindow_s: 0.2\nsensors:\n  temperature: "
        "{topic: /temperature, type: sensor_msgs/msg/Temperature, tag: bench}\n"
    )
    with twin_node(domain), adapt(domain, "--config", str(config)) as process, Peer(domain) as peer:
        robot = Robot(peer)
        peer.listen()
        frames = [
            robot.step("map", "bench_row", (4.0, 0.0, 0.0)),
            robot.step("bench_row", "bench_sensor", (0.0, 1.5, 0.8)),
        ]

        def is_there() -> Any:
            robot.stand(*frames)
            robot.read(21.5)
            tags = {tag.tag_id: tag for tag in peer.states[-1].tags} if peer.states else {}
            tag = tags.get("bench")
            return tag if tag and tag.readings and tag.pose.orientation.w else None

        at = peer.until(is_there, "the sensor where its frame is").pose.position
        assert (at.x, at.y, at.z) == pytest.approx((4.0, 1.5, 0.8))
        peer.until(
            lambda: robot.reported("TF has no path from 'nowhere' to 'map'"), "the other one"
        )
        robot.stand(*frames, robot.step("map", "nowhere", (1.0, 0.0, 0.0)))
        robot.reports.clear()

        def is_right() -> bool:
            every = (status for each in robot.reports for status in each.status)
            return any((it.name, it.message) == ("/lupin_adapt: /tf", "receiving") for it in every)

        peer.until(is_right, "nothing to be wrong any more")
        assert process.exit_code is None


def test_check_reports_the_robots_position_in_tf_and_the_seen_tags(domain: int) -> None:
    made = partial(AdaptNode, config_of(yaml.safe_load(CONFIG)), is_check=True)
    with Peer(domain) as peer, listening(domain, made) as (node, spin):
        robot = Robot(peer)
        lines: list[tuple[bool, str]] = []

        def publish() -> bool:
            robot.be_at(5.0, robot.see(7, 0.3))
            robot.read(21.5)
            spin()
            lines[:] = report(node, 60.0)
            text = " ".join(line for _, line in lines)
            return "robot at" in text and "tags tag36h11:7" in text and "temperature 21.5" in text

        peer.until(publish, "what TF and the camera say")
        assert all(is_right for is_right, _ in lines)
        tf = next(line for _, line in lines if line.startswith("ok    /tf: "))
        assert tf.endswith("robot at (5.00, 0.00) m")


def test_check_names_static_transforms_that_are_not_latched(domain: int) -> None:
    from tf2_msgs.msg import TFMessage

    made = partial(AdaptNode, config_of(yaml.safe_load(CONFIG)), is_check=True)
    with Peer(domain) as peer, listening(domain, made) as (node, spin):
        publisher = peer.node.create_publisher(TFMessage, "/tf_static", QoSProfile(depth=1))

        def is_named() -> bool:
            publisher.publish(TFMessage())
            spin()
            lines = [line for _, line in report(node, 0.0)]
            return any("/tf_static: its QoS is VOLATILE, expected TRANSIENT" in it for it in lines)

        peer.until(is_named, "the QoS")


def test_check_without_a_configuration_finds_tf_and_detections(domain: int) -> None:
    with Peer(domain) as peer, listening(domain, Listener) as (node, spin):
        robot = Robot(peer)

        def publish() -> bool:
            robot.be_at(5.0, robot.see(7, 0.3))
            robot.read(21.5)
            spin()
            found = {topic for topic, source in node.sources.items() if source.received}
            return "base_link" in node.frames and found >= {"/detections", "/temperature"}

        peer.until(publish, "transforms, a sighting and a reading")
        found = config_of(yaml.safe_load(suggestion(node)))
    assert found.robot is not None
    assert (found.robot.tf, found.tags) == ("base_link", {})
    assert found.detections is not None
    assert found.detections.topic == "/detections"


def test_the_tf_examples_of_the_docs_are_valid() -> None:
    config = config_of(yaml.safe_load(block_named("adapt-tf").text))
    assert config.robot is not None
    assert config.robot.tf == "base_link"
    assert config.detections is not None
    assert config.detections.tag_id("tag36h11", 7) == "7"
