"""The configuration of `adapt`: each mistake is reported with its key, value and limit."""

import math
from pathlib import Path
from typing import Any

import pytest
import yaml

from lupin_twin.adapt.config import Robot, Sensor, config_of, read_config
from lupin_twin.adapt.table import ConfigError, Value
from lupin_twin.core.state import Pose
from tests.support.docs import block_named

LEAST = """
robot: {topic: /amcl_pose, type: geometry_msgs/msg/PoseWithCovarianceStamped}
tags: {A: [0.0, 0.0], B: [3.0, 0.0, 0.4], 12: [1, 2]}
reach_m: 0.8
sensors:
  temperature: {topic: /temperature, type: sensor_msgs/msg/Temperature, field: temperature}
  humidity: {topic: /humidity, type: sensor_msgs/msg/RelativeHumidity}
"""


def test_the_smallest_configuration_works(tmp_path: Path) -> None:
    path = tmp_path / "adapt.yaml"
    path.write_text(LEAST)
    config = read_config(path)
    assert config.robot == Robot("/amcl_pose", "geometry_msgs/msg/PoseWithCovarianceStamped")
    assert config.tags == {"A": Pose.at(0, 0), "B": Pose.at(3, 0, 0.4), "12": Pose.at(1, 2)}
    assert (config.frame_id, config.reach_m) == ("map", 0.8)
    temperature, humidity = config.sensors
    assert temperature == Sensor(
        "temperature", "/temperature", "sensor_msgs/msg/Temperature", Value("temperature")
    )
    # A standard message's ratio becomes our percent without configuration.
    assert (humidity.value.path, humidity.value.factor) == ("relative_humidity", 100.0)


def test_tags_may_be_in_a_file_of_their_own(tmp_path: Path) -> None:
    (tmp_path / "tags.yaml").write_text("A: [1.5, 2.5]")
    (tmp_path / "adapt.yaml").write_text(LEAST.replace("{A: [0.0, 0.0],", "tags.yaml #"))
    assert read_config(tmp_path / "adapt.yaml").tags == {"A": Pose.at(1.5, 2.5)}


def test_a_tag_may_be_a_frame_of_tf() -> None:
    config = config_of(changed("tags", {"A": [1, 2], "B": "bench_b"}))
    assert (config.tags, config.frames) == ({"A": Pose.at(1, 2)}, {"B": "bench_b"})


def test_one_quantity_may_have_several_fixed_sensors() -> None:
    content = {
        "tags": {"A": [0, 0], "B": [1, 0]},
        "sensors": {
            "co2": [
                {"topic": "/a/co2", "type": "std_msgs/msg/Float32", "tag": "A", "max": 5000},
                {"topic": "/b/co2", "type": "std_msgs/msg/Float32", "tag": "B", "offset": -20},
            ]
        },
    }
    first, second = config_of(content).sensors
    assert (first.name, first.tag, first.value.high) == ("co2", "A", 5000.0)
    assert (second.name, second.tag, second.value.offset) == ("co2", "B", -20.0)


def test_the_examples_of_the_docs_are_valid() -> None:
    config = config_of(yaml.safe_load(block_named("adapt").text))
    assert (len(config.tags), len(config.sensors)) == (2, 2)
    config = config_of(yaml.safe_load(block_named("adapt-mqtt").text))
    assert config.broker is not None
    # Zigbee2MQTT's availability is a topic of its own.
    assert (len(config.tags), len(config.broker.patterns)) == (2, 4)


def test_another_field_of_a_standard_message_has_its_own_unit() -> None:
    content = changed("sensors.humidity.field", "variance")
    assert config_of(content).sensors[1].value.factor == 1.0


def test_detections_need_a_robot_and_no_tags() -> None:
    content = changed("tags", {}) | {"detections": {"topic": "/d"}}
    detections = config_of(content).detections
    assert detections is not None
    assert detections.tag_id("tag36h11", 7) == "tag36h11:7"
    fixed = {"topic": "/t", "type": "std_msgs/msg/Float32", "tag": "A"}
    content = {"tags": {"A": [0, 0]}, "sensors": {"co2": fixed}, "detections": {"topic": "/d"}}
    with pytest.raises(ConfigError, match="detections: robot is not given"):
        config_of(content)


def changed(path: str, value: Any) -> dict[str, Any]:
    """The smallest configuration with another value; `...` removes the key."""
    content: dict[str, Any] = yaml.safe_load(LEAST)
    *parents, key = path.split(".")
    table = content
    for parent in parents:
        table = table[parent]
    if value is ...:
        del table[key]
    else:
        table[key] = value
    return content


@pytest.mark.parametrize(
    ("path", "value", "complaint"),
    [
        ("sensors", ..., "sensors and mqtt are both missing"),
        ("sensors.temperature.topic", ..., "sensors.temperature.topic is missing"),
        ("sensors.temperature.factr", 2, "sensors.temperature.'factr' is not known, expected one"),
        ("sensors.temperature.factor", "2", "sensors.temperature.factor is '2', expected a number"),
        ("sensors.temperature.factor", math.nan, "sensors.temperature.factor is nan, expected a"),
        ("sensors.temperature.factor", 10**400, "expected a number"),
        ("sensors.temperature.type", "Temperature", "expected such as sensor_msgs/msg/Temp"),
        ("sensors.temperature.field", "a b", "sensors.temperature.field is 'a b', expected a path"),
        ("sensors.temperature.min", 1e300, None),
        ("sensors.temperature.tag", "Z", "sensors.temperature.tag is 'Z', which is not one of"),
        ("sensors.temperature", 5, "sensors.temperature is 5, expected keys and values"),
        (
            "sensors.temperature",
            {"topic": "/t", "type": "std_msgs/msg/Float32", "min": 5, "max": 4},
            "sensors.temperature.min is 5, above max, 4",
        ),
        ("robot", ..., "sensors.temperature has no tag, so it is the robot's, but robot is not"),
        ("robot.type", "nav_msgs/msg/Path", "robot.type is 'nav_msgs/msg/Path', expected one of"),
        ("robot.max_age_s", 0, "robot.max_age_s is 0, must be from 0.1 to 86400"),
        ("tags", {}, "tags: none is given, no detections, and cell_m is 0"),
        ("tags", {str(n): [0, 0] for n in range(20_001)}, "tags: 20001, the limit is"),
        ("sensors", {f"s{n}": {} for n in range(65)}, "sensors: 65, the limit is"),
        ("sensors.temperature.max", -1e400, "sensors.temperature.max is -inf, expected a number"),
        ("robot.tf", "base_link", "robot.'topic' is not known, expected one of tf, max_age_s"),
        ("robot.colour", 1, "robot.'colour' is not known, expected one of tf, topic, type"),
        ("detections", {"topic": "/d", "name": "{family}"}, "detections.name is '{family}', exp"),
        ("detections", {"topic": "/d", "frame": 1}, "detections.'frame' is not known, expected"),
        ("tags.A", [1], "tags.A is [1], expected [x, y] or [x, y, z] in m"),
        ("tags.A", [1, math.inf], "tags.A is [1, inf], expected [x, y]"),
        ("tags.A", [1, 1e308], "tags.A is [1, 1e+308], expected [x, y]"),
        ("tags", {True: [0, 0]}, "tags: True is no text of 1 to 256 printable characters"),
        ("tags", {"a\0b": [0, 0]}, "is no text of 1 to 256 printable characters"),
        ("tags", {"a\ud800b": [0, 0]}, "is no text of 1 to 256 printable characters"),
        ("tags", "none.yaml", "tags: none.yaml: No such file or directory"),
        ("reach_m", 0, "reach_m is 0, must be from 0.01 to 100"),
        ("window_s", True, "window_s is True, expected a number"),
        ("frame_id", "", "frame_id: '' is no text"),
        ("colour", 1, "'colour' is not known, expected one of robot, tags"),
    ],
)
def test_an_invalid_configuration_is_named(path: str, value: Any, complaint: str | None) -> None:
    content = changed(path, value)
    if complaint is None:
        config_of(content)
        return
    with pytest.raises(ConfigError) as refused:
        config_of(content)
    assert complaint in str(refused.value)
    assert len(str(refused.value)) < 400


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("a: [", "adapt.yaml: not YAML"),
        ("[" * 5000, "not YAML"),
        ("a: " + "9" * 5000, "not YAML"),
        ("\x00", "not YAML"),
        ("- 1", "adapt.yaml: the file is [1], expected keys"),
        ("reach_m: 0x" + "f" * 5000, "reach_m is a very large int, expected a number"),
        # A thousand million entries, in ten lines.
        (
            "a0: &a0 [1]\n" + "".join(f"a{n + 1}: &a{n + 1} [{f'*a{n},' * 9}]\n" for n in range(9)),
            "the alias *a0 is not taken",
        ),
        ("sensors: " + "[" * 99 + "]" * 99, ", expected keys and values"),
        ("x" * 4_000_001, "has more than 4000000 bytes"),
    ],
)
def test_an_invalid_file_is_reported_by_name(tmp_path: Path, text: str, complaint: str) -> None:
    path = tmp_path / "adapt.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError) as refused:
        read_config(path)
    assert complaint in str(refused.value)
