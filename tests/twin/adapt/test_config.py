"""Configurations of the adapter and the payloads that they read; each mistake is named."""

import json
import math
from pathlib import Path
from typing import Any

import pytest
import yaml

from lupin_twin.adapt.config import Robot, Sensor, config_of, read_config
from lupin_twin.adapt.mqtt import Broker, Measured, broker_of, measured
from lupin_twin.adapt.table import ConfigError, Table, Value
from lupin_twin.core.drops import Rejected
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
        ("robot.max_age_s", 0, "robot.max_age_s is 0, expected 0.1 to 86400"),
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
        ("reach_m", 0, "reach_m is 0, expected 0.01 to 100"),
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


def broker(*topics: dict[str, Any], **more: Any) -> Broker:
    content = {"url": "mqtt://broker.lan", "topics": list(topics), **more}
    return broker_of(Table("mqtt", content), Path())


def message(configured: Broker, topic: str, payload: object) -> list[Measured]:
    raw = payload if isinstance(payload, bytes) else json.dumps(payload).encode()
    return [
        measured(pattern, *found, raw)
        for pattern in configured.patterns
        if (found := pattern.match(topic)) is not None
    ]


def test_a_plain_number_is_a_reading_of_the_tag_and_sensor_in_its_topic() -> None:
    configured = broker({"topic": "gh/{tag}/{sensor}", "factor": 0.1})
    assert configured.patterns[0].filter == "gh/+/+"
    assert message(configured, "gh/A 1/co2", b" 8000 ") == [Measured("A 1", (("co2", 800.0),))]
    assert message(configured, "gh/A/co2/more", b"1") == []


def test_json_is_read_by_paths_with_its_own_time() -> None:
    configured = broker(
        {
            "topic": "house/+/climate",
            "tag": "A",
            "values": {
                "temperature": {"path": "air.t", "factor": 5 / 9, "offset": -160 / 9},
                "co2": "list.1",
            },
            "time": "at",
        }
    )
    payload = {"air": {"t": 212}, "list": [1, 2], "at": "2024-05-01T10:00:00Z"}
    (found,) = message(configured, "house/x/climate", payload)
    assert dict(found.readings) == {"temperature": 100.0, "co2": 2.0}
    assert found.stamp_s == 1_714_557_600.0
    for at, seconds in (
        (1_700_000_000.5, 1_700_000_000.5),
        (1_700_000_000_000, 1.7e9),
        ("2024-05-01T12:00:00+02:00", 1_714_557_600.0),
        ("2024-05-01T10:00:00", 1_714_557_600.0),  # in UTC, in any local zone
    ):
        assert (
            message(configured, "house/x/climate", {"list": [0, 1], "at": at})[0].stamp_s == seconds
        )


def test_a_tag_or_a_sensor_as_long_as_a_topic_may_be_is_refused() -> None:
    configured = broker({"topic": "gh/{tag}/{sensor}"})
    for what, topic in (("tag", f"gh/{'x' * 257}/co2"), ("sensor", f"gh/A/{'x' * 257}")):
        with pytest.raises(Rejected, match=f"^{what} 'x+'… has 257 characters, the limit is 256"):
            message(configured, topic, b"1")


def test_zigbee2mqtts_payloads_need_no_paths() -> None:
    configured = broker({"topic": "zigbee2mqtt/{tag}", "preset": "zigbee2mqtt"})
    payload = {
        "battery": 100,
        "temperature": 21.4,
        "humidity": 55.5,
        "soil_moisture": 33,
        "illuminance": 1200,
        "linkquality": 120,
        "last_seen": 1_700_000_000_000,
        "update": {"state": "idle"},
    }
    (found,) = message(configured, "zigbee2mqtt/bench 3", payload)
    assert found.tag == "bench 3"
    assert dict(found.readings) == {
        "temperature": 21.4,
        "humidity": 55.5,
        "soil_moisture": 33.0,
        "light": 1200.0,
    }
    assert found.stamp_s == 1.7e9
    away = message(configured, "zigbee2mqtt/bench 3/availability", {"state": "offline"})
    assert away == [Measured("bench 3", is_away=True)]
    back = message(configured, "zigbee2mqtt/bench 3/availability", b"online")
    assert back == [Measured("bench 3")]


def test_home_assistants_entities_are_tag_and_sensor() -> None:
    configured = broker({"topic": "ha/sensor/{tag}_{sensor}/state", "preset": "homeassistant"})
    for entity, tag, sensor in (
        ("north_bay_temperature", "north_bay", "temperature"),
        ("a_soil_moisture", "a", "soil_moisture"),
        ("a_carbon_dioxide", "a", "co2"),
        ("a_illuminance", "a", "light"),
    ):
        assert message(configured, f"ha/sensor/{entity}/state", b"5") == [
            Measured(tag, ((sensor, 5.0),))
        ]
    assert message(configured, "ha/sensor/north_bay_battery/state", b"5") == []
    assert message(configured, "ha/sensor/a_humidity/state", b"unknown") == [Measured("a")]


def test_a_preset_yields_to_explicit_settings_and_a_topic_may_carry_availability() -> None:
    configured = broker(
        {
            "topic": "zigbee2mqtt/{tag}",
            "preset": "zigbee2mqtt",
            "values": {"light": "lux"},
            "availability": "there/{tag}",
        }
    )
    (found,) = message(configured, "zigbee2mqtt/A", {"lux": 5, "illuminance": 7})
    assert found.readings == (("light", 5.0),)
    assert message(configured, "there/A", b"Offline") == [Measured("A", is_away=True)]


def test_the_broker_and_its_credentials_are_configurable(tmp_path: Path) -> None:
    (tmp_path / "secret").write_text(" hush \n")
    content = {
        "url": "mqtts://broker.lan",
        "topics": [{"topic": "{tag}/{sensor}"}],
        "user": "twin",
        "password_file": "secret",
        "ca": "/ca.pem",
    }
    found = broker_of(Table("mqtt", content), tmp_path)
    assert (found.host, found.port, found.is_tls) == ("broker.lan", 8883, True)
    assert (found.user, found.password, found.ca) == ("twin", "hush", "/ca.pem")
    plain = broker({"topic": "{tag}/{sensor}"}, url="mqtt://broker.lan:1884")
    assert (plain.port, plain.is_tls) == (1884, False)


@pytest.mark.parametrize(
    ("topic", "payload", "complaint"),
    [
        ("A/t", b"unavailable", "the payload is b'unavailable', expected a number"),
        ("A/t", b"nan", "the payload is nan, expected a finite number"),
        ("A/t", b"51", "the payload is 51, must be from 0 to 50"),
        ("A/t", b"9" * 400, "the payload is inf, expected a finite number"),
        ("A/t", b"\xff\xfe", "expected a number"),
        ("A/j", b"{", "it is not JSON: b'{'"),
        ("A/j", b"[" * 50_000, "it is not JSON"),
        ("A/j", b"[1]", "it has none of t"),
        ("A/j", b'{"t": true}', "t is True, expected a number"),
        ("A/j", b'{"t": {}}', "t is {}, expected a number"),
        (
            "A/j",
            b'{"t": 1, "at": "yesterday"}',
            "its time is 'yesterday': the time is neither ISO 8601",
        ),
        ("A/j", b'{"t": 1, "at": -5}', "its time is -5"),
        ("A/j", b'{"t": 1, "at": 1e999}', "its time is inf"),
        ("A/j", b'{"t": 1, "at": true}', "its time is True"),
        ("A/j", b'{"t": 1, "at": "1970-01-01T00:01:00Z"}', "before 2001: was its clock"),
    ],
)
def test_a_message_without_a_value_is_named(topic: str, payload: bytes, complaint: str) -> None:
    configured = broker(
        {"topic": "{tag}/t", "sensor": "temperature", "min": 0, "max": 50},
        {"topic": "{tag}/j", "values": {"temperature": "t"}, "time": "at"},
    )
    with pytest.raises(Rejected) as refused:
        message(configured, topic, payload)
    assert complaint in str(refused.value)
    assert len(str(refused.value)) < 250


@pytest.mark.parametrize(
    ("topic", "more", "complaint"),
    [
        ({"topic": "a/#", "tag": "A", "sensor": "t"}, {}, "mqtt.topics[0].topic is 'a/#'"),
        ({"topic": "/a/{tag}", "sensor": "t"}, {}, "mqtt.topics[0].topic is '/a/{tag}'"),
        ({"topic": "$SYS/{tag}", "sensor": "t"}, {}, "mqtt.topics[0].topic is '$SYS/{tag}'"),
        ({"topic": "{tag}"}, {"topics": [{}] * 101}, "expected a list of 1 to 100"),
        ({"topic": "a"}, {}, "expected {tag} in 'a', or the key tag; one of them"),
        ({"topic": "{tag}", "tag": "A"}, {}, "expected {tag} in '{tag}', or the key tag"),
        ({"topic": "{tag}", "sensor": "t", "availability": "lwt"}, {}, "expected {tag} in 'lwt'"),
        ({"topic": "{tag}"}, {}, "a payload that is a number needs {sensor} in its topic"),
        ({"topic": "{tag}", "preset": "zwave"}, {}, "preset is 'zwave', expected one of zigbee"),
        ({"topic": "{tag}", "sensor": "t", "unit": "C"}, {}, "'unit' is not known, expected one"),
        ({"topic": "{tag}", "values": {"t": 5}}, {}, "mqtt.topics[0].values.t is 5"),
        ({"topic": "{tag}", "sensor": "t"}, {"url": "http://x"}, "mqtt.url is 'http://x'"),
        ({"topic": "{tag}", "sensor": "t"}, {"url": "mqtt://x:99999"}, "mqtt.url is"),
        ({"topic": "{tag}", "sensor": "t"}, {"url": "mqtt://[::1"}, "mqtt.url is"),
        ({"topic": "{tag}/{tag}", "sensor": "t"}, {}, "'{tag}/{tag}' has one of them twice"),
        ({"topic": "a\0/{tag}", "sensor": "t"}, {}, "printable characters"),
        ({"topic": "{tag}", "sensor": "t"}, {"url": "mqtt://u:p@x"}, "has a user in it"),
        ({"topic": "{tag}", "sensor": "t"}, {"password_file": "/none"}, "No such file"),
        ({"topic": "{tag}", "sensor": "t"}, {"topics": []}, "mqtt.topics is [], expected a list"),
    ],
)
def test_an_invalid_topic_configuration_is_reported_by_name(
    topic: dict[str, Any], more: dict[str, Any], complaint: str
) -> None:
    with pytest.raises(ConfigError) as refused:
        broker(topic, **more)
    assert complaint in str(refused.value)
    assert "u:p" not in str(refused.value)
