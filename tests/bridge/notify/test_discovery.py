"""What is announced to Home Assistant: valid devices, units and classes, and expiry times."""

from dataclasses import replace
from typing import Any

import pytest

from lupin_bridge.notify.messages import (
    STEPS_S,
    Topics,
    expire_after_s,
    greenhouse_configs,
    tag_configs,
)
from tests.support.seen import HOLDS_NS, SENSORS, S

TOPICS = Topics("lupin-twin", "homeassistant")


def announced(tag_id: str, *sensors: str) -> dict[str, dict[str, Any]]:
    return dict(tag_configs(TOPICS, tag_id, [SENSORS.named(it) for it in sensors], HOLDS_NS))


def test_a_sensor_has_the_fields_that_home_assistant_needs() -> None:
    found = announced("12", "temperature")
    config = found["homeassistant/sensor/lupin-twin/tag_12_-_reading_temperature/config"]
    assert config == {
        "unique_id": "lupin-twin_tag_12_-_reading_temperature",
        "name": "Temperature",
        "state_topic": "lupin-twin/tags/12/readings/temperature",
        "json_attributes_topic": "lupin-twin/tags/12/readings/temperature",
        "value_template": "{{ value_json.value }}",
        "unit_of_measurement": "°C",
        "device_class": "temperature",
        "state_class": "measurement",
        "expire_after": 600,
        "availability": [{"topic": "lupin-twin/status"}],
        "availability_mode": "all",
        "qos": 1,
        "device": {
            "identifiers": ["lupin-twin_tag_12"],
            "name": "Tag 12",
            "manufacturer": "lupin-twin",
            "model": "Tag",
            "via_device": "lupin-twin_house",
        },
        "origin": {"name": "lupin-twin"},
    }


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("humidity", "humidity"),
        ("soil_moisture", "moisture"),
        ("co2", "carbon_dioxide"),
        ("light", "illuminance"),
        ("vpd", "pressure"),
        ("dew_point", "temperature"),
        ("ph", None),
    ],
)
def test_each_of_our_sensors_has_its_class(name: str, expected: str | None) -> None:
    config = next(iter(announced("12", name).values()))
    assert config.get("device_class") == expected
    assert ("unit_of_measurement" in config) is (expected is not None)


def test_a_unit_that_does_not_fit_the_class_removes_it() -> None:
    odd = replace(SENSORS.named("temperature"), unit="mK")
    config = next(iter(dict(tag_configs(TOPICS, "12", [odd], HOLDS_NS)).values()))
    assert "device_class" not in config
    assert config["unit_of_measurement"] == "mK"


def test_a_tag_and_the_greenhouse_have_a_verdict_and_an_alarm() -> None:
    for found in (announced("12"), dict(greenhouse_configs(TOPICS))):
        by_name = {config["name"]: config for config in found.values()}
        assert by_name["Verdict"]["options"] == ["critical", "stressed", "healthy"]
        assert by_name["Alarm"]["device_class"] == "problem"
        assert by_name["Alarm"]["json_attributes_topic"] == by_name["Alarm"]["state_topic"]


def test_a_silent_twin_makes_only_the_verdicts_of_tags_unavailable() -> None:
    tags = {it["name"]: it for it in announced("12", "co2").values()}
    greenhouse = {it["name"]: it for it in dict(greenhouse_configs(TOPICS)).values()}
    for name in ("Verdict", "Alarm"):
        topics = [it["topic"] for it in tags[name]["availability"]]
        assert topics == ["lupin-twin/status", "lupin-twin/house/twin"]
        assert [it["topic"] for it in greenhouse[name]["availability"]] == ["lupin-twin/status"]
    assert len(tags["CO₂"]["availability"]) == 1
    assert greenhouse["Twin"]["device_class"] == "connectivity"


def test_readings_expire_no_sooner_than_they_hold() -> None:
    assert expire_after_s(600 * S) == 600
    assert expire_after_s(600 * S + 1) == 900
    assert expire_after_s(STEPS_S[-1] * S) == STEPS_S[-1] == 604_800
