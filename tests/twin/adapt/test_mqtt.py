"""MQTT in: topics and payloads of fixed sensors, and every mistake that they can contain."""

import json
from pathlib import Path
from typing import Any

import pytest

from lupin_twin.adapt.mqtt import Broker, Measured, broker_of, measured
from lupin_twin.adapt.table import ConfigError, Table
from lupin_twin.core.drops import Rejected


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
        ("A/t", b"1" * 70_000, "more than 65536 bytes, the limit"),
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
