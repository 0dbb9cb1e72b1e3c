"""`lupin-twin adapt` and a twin, each in its own process; only standard messages come in."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import pytest
import rclpy
import yaml
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from lupin_msgs.msg import Observation
from nav_msgs.msg import Odometry
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import RelativeHumidity, Temperature
from std_msgs.msg import Float32

from lupin_twin.adapt.check import Listener, report, suggestion
from lupin_twin.adapt.config import config_of, read_config
from lupin_twin.adapt.node import AdaptNode
from tests.support import standard_robot
from tests.support.domains import ros_env
from tests.support.inprocess import ros_domain
from tests.support.processes import Process, constants, twin_node
from tests.support.ros import Peer, latched
from tests.support.waiting import wait_for

CONFIG = """
robot: {topic: /amcl_pose, type: geometry_msgs/msg/PoseWithCovarianceStamped}
tags: {A: [0.0, 0.0], B: [3.0, 0.0]}
reach_m: 0.8
window_s: 0.5
sensors:
  temperature: {topic: /temperature, type: sensor_msgs/msg/Temperature, field: temperature, max: 60}
  humidity: {topic: /humidity, type: sensor_msgs/msg/RelativeHumidity}
  co2: {topic: /b/co2, type: std_msgs/msg/Float32, tag: B}
"""


@pytest.fixture
def config(tmp_path: Path) -> Path:
    path = tmp_path / "adapt.yaml"
    path.write_text(CONFIG)
    return path


def adapt(domain: int, *args: str) -> Process:
    command = [sys.executable, "-m", "tests.support.limited", "adapt", *args]
    return Process(command, ros_env(domain))


class Watched:
    """A robot with a thermometer, and what the adapter makes and says of it."""

    def __init__(self, peer: Peer) -> None:
        self.peer, self.node = peer, peer.node
        self.reports: list[Any] = []
        self.observations: list[Any] = []
        sensor = qos_profile_sensor_data
        self._temperature = self.node.create_publisher(Temperature, "/temperature", sensor)
        self.node.create_subscription(DiagnosticArray, "/diagnostics", self.reports.append, 10)
        self.node.create_subscription(
            Observation, "/floranova/observations", self.observations.append, latched(50)
        )

    def now(self) -> Any:
        return self.node.get_clock().now().to_msg()

    def read(self, temperature: float, stamp: Any = None) -> None:
        message = Temperature(temperature=temperature)
        message.header.stamp = stamp or self.now()
        self._temperature.publish(message)

    def _statuses(self, text: str) -> list[Any]:
        return [
            status
            for report in self.reports
            for status in report.status
            if status.hardware_id == "/lupin_adapt" and text in status.message
        ]

    def reported(self, text: str) -> bool:
        """Whether the adapter reports it on `/diagnostics`."""
        return bool(self._statuses(text))

    def dropped(self, text: str) -> int:
        """How many messages were dropped, by the diagnostic of that source."""
        values = self._statuses(text)[-1].values
        return sum(int(each.value) for each in values if each.key.startswith("dropped: "))


class Robot(Watched):
    """What a robot that knows nothing of the twin publishes."""

    def __init__(self, peer: Peer, pose: Any = PoseWithCovarianceStamped) -> None:
        super().__init__(peer)
        self.pose = self.node.create_publisher(pose, "/amcl_pose", QoSProfile(depth=1))
        sensor = qos_profile_sensor_data
        self._humidity = self.node.create_publisher(RelativeHumidity, "/humidity", sensor)
        self._co2 = self.node.create_publisher(Float32, "/b/co2", sensor)

    def be_at(self, x: float, frame_id: str = "map") -> None:
        message = PoseWithCovarianceStamped()
        message.header.stamp, message.header.frame_id = self.now(), frame_id
        message.pose.pose.position.x = x
        self.pose.publish(message)

    def read(self, temperature: float, stamp: Any = None, humidity: float = 0.6) -> None:
        super().read(temperature, stamp)
        message = RelativeHumidity(relative_humidity=humidity)
        message.header.stamp = stamp or self.now()
        self._humidity.publish(message)

    def fixed(self, value: float) -> None:
        self._co2.publish(Float32(data=value))


def each_is_reported(robot: Any, wrong: list[tuple[Callable[[Any], object], str]]) -> None:
    """Let the robot do each, until the adapter says what is wrong with it."""
    for do, text in wrong:

        def has_reported(do: Callable[[Any], object] = do, text: str = text) -> bool:
            do(robot)
            return bool(robot.reported(text))

        robot.peer.until(has_reported, f"{text!r} on /diagnostics")


def test_a_robot_with_standard_messages_alone_is_in_the_twins_state(
    domain: int, config: Path
) -> None:
    with twin_node(domain), adapt(domain, "--config", str(config)) as process, Peer(domain) as peer:
        robot = Robot(peer)
        peer.listen()
        # Surveyed tags are known before the robot has been anywhere.
        peer.tag("B", lambda tag: tag.pose.position.x == 3.0)

        def at_a() -> Any:
            robot.be_at(0.2)
            robot.read(21.5)
            tags = {tag.tag_id: tag for tag in peer.states[-1].tags}
            return tags["A"].readings and tags

        tags = peer.until(at_a, "readings at tag A")
        values = {reading.name: reading.value for reading in tags["A"].readings}
        assert values == {"temperature": 21.5, "humidity": pytest.approx(60.0)}
        assert not tags["B"].readings

        def fixed_at_b() -> Any:
            robot.fixed(800.0)
            tags = {tag.tag_id: tag for tag in peer.states[-1].tags}
            return tags["B"].readings and tags

        tags = peer.until(fixed_at_b, "the fixed sensor's reading")
        assert [(each.name, each.value) for each in tags["B"].readings] == [("co2", 800.0)]
        sources = {each.tag_reading.tag_id: each.source for each in robot.observations}
        assert sources == {"A": "adapt", "B": "adapt/fixed"}
        assert process.stop() == 0


def test_the_robot_that_the_tutorial_starts_is_in_the_twins_state(
    domain: int, tmp_path: Path
) -> None:
    path = tmp_path / "adapt.yaml"
    path.write_text(CONFIG)
    robot = Process([sys.executable, standard_robot.__file__], ros_env(domain))
    with twin_node(domain), robot, adapt(domain, "--config", str(path)), Peer(domain) as peer:
        for tag_id, celsius in (("A", 21.5), ("B", 24.0)):
            peer.tag(tag_id, partial(has_read, celsius))


def has_read(value: float, tag: Any) -> bool:
    return any(reading.value == value for reading in tag.readings)


@pytest.mark.parametrize("kind", [PoseStamped, Odometry])
def test_other_pose_types_locate_the_robot_too(domain: int, config: Path, kind: Any) -> None:
    package = kind.__module__.partition(".")[0]
    was = "geometry_msgs/msg/PoseWithCovarianceStamped"
    config.write_text(CONFIG.replace(was, f"{package}/msg/{kind.__name__}"))
    message = kind()
    message.header.frame_id = "map"
    pose = message.pose if kind is PoseStamped else message.pose.pose
    pose.position.x = 3.2
    with adapt(domain, "--config", str(config)), Peer(domain) as peer:
        robot = Robot(peer, kind)

        def is_there() -> bool:
            robot.pose.publish(message)
            return robot.reported("at B")

        peer.until(is_there, "the robot at its tag")


WRONG: list[tuple[Callable[[Any], object], str]] = [
    (lambda robot: robot.be_at(0.0, "odom"), "its frame is 'odom', expected 'map' (frame_id)"),
    (lambda robot: robot.be_at(float("nan")), "its position is (nan, 0) m"),
    (lambda robot: robot.read(290.0), "temperature is 290, must be from -inf to 60"),
    (lambda robot: robot.read(float("nan")), "temperature is nan, expected a finite number"),
    (
        lambda robot: robot.read(20.0, stamp=Time(sec=7)),
        "behind ROS time here, the limit is 10 s: is a clock wrong",
    ),
    (lambda robot: robot.read(20.0, humidity=6e307), "humidity is inf, expected a finite number"),
    (lambda robot: robot.be_at(0.0, "m" * 250_000), "bytes, the limit is 200000"),
    (lambda robot: robot.fixed(800.0), "field value: 'Float32' object has no attribute"),
]


def test_bad_messages_are_dropped_counted_and_reported(domain: int, config: Path) -> None:
    with config.open("a") as file:
        file.write("  wrong: {topic: /b/co2, type: std_msgs/msg/Float32, field: value, tag: B}\n")
    with adapt(domain, "--config", str(config)) as process, Peer(domain) as peer:
        robot = Robot(peer)
        each_is_reported(robot, WRONG)
        assert all(robot.dropped(text) for _, text in WRONG)
        wait_for(lambda: WRONG[0][1] in process.output, "a line of it")
        assert process.exit_code is None


def test_a_wrong_name_or_type_is_reported_with_the_right_one(domain: int, config: Path) -> None:
    text = CONFIG.replace("/temperature,", "/temprature,").replace("Float32", "Float64")
    config.write_text(text)
    soon = constants(**{"lupin_twin.adapt.node:SILENT_S": 2.0})
    with adapt(domain, *soon, "--config", str(config)) as process, Peer(domain) as peer:
        robot = Robot(peer)
        for text in (
            "nobody publishes it, did you mean /temperature?",
            "it is published as std_msgs/msg/Float32, configured is std_msgs/msg/Float64",
        ):
            peer.until(lambda text=text: robot.reported(text), f"{text!r} on /diagnostics")  # type: ignore[misc]
            wait_for(lambda text=text: text in process.output, "a line of it")  # type: ignore[misc]


@contextmanager
def listening(domain: int, make: Callable[[], Any]) -> Iterator[tuple[Any, Callable[[], None]]]:
    """A node that checks, in this process, and a function that spins it for a moment."""
    with ros_domain(domain):
        rclpy.init(args=[])
        try:
            node = make()
            executor = SingleThreadedExecutor()
            executor.add_node(node)
            yield node, lambda: executor.spin_once(timeout_sec=0.05)
        finally:
            rclpy.try_shutdown()


def test_check_reports_for_each_topic_whether_it_is_right(domain: int, config: Path) -> None:
    config.write_text(CONFIG.replace("/humidity", "/humiditi"))
    made = partial(AdaptNode, read_config(config), is_check=True)
    with Peer(domain) as peer, listening(domain, made) as (node, spin):
        robot = Robot(peer)
        lines: list[str] = []

        def publish() -> bool:
            robot.be_at(0.0, "odom")
            robot.read(21.5)
            spin()
            lines[:] = [line for _, line in report(node, 0.0)]
            return "its frame is 'odom', expected 'map'" in lines[0] and "21.5" in lines[1]

        peer.until(publish, "enough to be received")
        # A topic with a recent message is not silent; one without any is.
        position, temperature, _, co2, made_of = (line for _, line in report(node, 60.0))
        assert position.startswith("WRONG /amcl_pose: dropped a message on /amcl_pose: its frame")
        assert temperature.startswith("ok    /temperature: receiving; received ")
        assert temperature.endswith("temperature 21.5")
        assert lines[2].startswith(
            "WRONG /humiditi: nobody publishes it, did you mean /humidity?; received 0"
        )
        assert co2.startswith("ok    /b/co2: ")
        assert made_of == "ok    observations: at no tag; made 0, errors 0"
        assert robot.observations == robot.reports == []


def test_check_without_a_configuration_finds_a_working_one(domain: int) -> None:
    with Peer(domain) as peer, listening(domain, Listener) as (node, spin):
        robot = Robot(peer)

        def publish() -> bool:
            robot.be_at(0.0, "odom")
            robot.read(21.5)
            spin()
            return sum(bool(each.received) for each in node.sources.values()) == 3

        peer.until(publish, "enough to be received")
        found = config_of(yaml.safe_load(suggestion(node)))
    assert found.frame_id == "odom"
    assert found.robot is not None
    assert found.robot.topic == "/amcl_pose"
    assert [(it.name, it.topic, it.value.factor) for it in found.sensors] == [
        ("humidity", "/humidity", 100.0),
        ("temperature", "/temperature", 1.0),
    ]


def test_check_ends_by_itself_with_an_exit_code(domain: int, config: Path) -> None:
    with adapt(domain, "--config", str(config), "--check", "--seconds", "0.1") as process:
        assert process.wait() == 1
        assert "WRONG /amcl_pose: nobody publishes it; received 0" in process.output


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (("/temperature,", "'/1 bad',"), "topic '/1 bad'"),
        (("/temperature,", "'/{bad}',"), "topic '/{bad}'"),
        (("sensor_msgs/msg/Temperature", "radar_msgs/msg/X"), "the package radar_msgs is"),
        (("sensor_msgs/msg/Temperature", "sensor_msgs/msg/Warmth"), "has no message Warmth"),
    ],
)
def test_an_invalid_configuration_is_refused_in_one_line(
    domain: int, config: Path, change: tuple[str, str], complaint: str
) -> None:
    config.write_text(config.read_text().replace(*change))
    with adapt(domain, "--config", str(config)) as process:
        assert process.wait() == 2
        wait_for(lambda: complaint in process.output, complaint)
        assert "Traceback" not in process.output
