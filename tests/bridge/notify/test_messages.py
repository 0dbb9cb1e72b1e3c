"""Topics, announcements to Home Assistant, and how long a channel waits."""

import re
from dataclasses import replace
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from lupin_bridge.notify.messages import (
    MAX_PLAIN,
    STEPS_S,
    Backoff,
    Topics,
    expire_after_s,
    greenhouse_configs,
    safe,
    tag_configs,
)
from tests.support.seen import HOLDS_NS, SENSORS, S


def test_a_name_is_used_whole_up_to_the_limit_and_past_it_by_a_digest() -> None:
    assert safe("x" * MAX_PLAIN) == "x" * MAX_PLAIN
    long = safe("x" * (MAX_PLAIN + 1))
    assert long.startswith("x" * 24 + "__")
    assert len(long) == 24 + 2 + 32
    assert long != safe("x" * MAX_PLAIN + "y")
    assert "_-_" not in long


@given(st.text(), st.text())
def test_no_two_names_have_the_same_part(one: str, other: str) -> None:
    assert (safe(one) == safe(other)) is (one == other)
    assert re.fullmatch(r"[A-Za-z0-9_-]{1,64}", safe(one))
    # The separator between a prefix and what is announced below it.
    assert "_-" not in safe(one)


@given(st.text(alphabet="/+#_ éx", min_size=20, max_size=80))
def test_long_unusual_names_are_cut_between_characters(name: str) -> None:
    assert re.fullmatch(r"(?:[A-Za-z0-9-]|_[0-9A-F]{2})*(?:__[0-9a-f]{32})?", safe(name))


def test_topics_start_with_the_prefix_and_a_tag_called_house_is_not_the_greenhouse() -> None:
    topics = Topics("farm/gh1", "homeassistant")
    assert topics.status == "farm/gh1/status"
    assert topics.birth == "homeassistant/status"
    assert topics.of(None, "health") == "farm/gh1/house/health"
    assert topics.of("a/b", "alarms") == "farm/gh1/tags/a_2Fb/alarms"
    assert topics.reading("12", "co2") == "farm/gh1/tags/12/readings/co2"
    assert topics.config("sensor", "12", "verdict") == (
        "homeassistant/sensor/farm_2Fgh1/tag_12_-_verdict/config"
    )
    assert topics.device("house") != topics.device(None)
    assert topics.of("house", "health") != topics.of(None, "health")
    assert topics.config("sensor", "house", "x") != topics.config("sensor", None, "x")


# --- announcements to Home Assistant --------------------------------------------------------------


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


def test_each_of_our_sensors_has_its_class_unless_its_unit_does_not_fit() -> None:
    classes = {
        "humidity": "humidity",
        "soil_moisture": "moisture",
        "co2": "carbon_dioxide",
        "light": "illuminance",
        "vpd": "pressure",
        "dew_point": "temperature",
        "ph": None,
    }
    for name, expected in classes.items():
        config = next(iter(announced("12", name).values()))
        assert config.get("device_class") == expected
        assert ("unit_of_measurement" in config) is (expected is not None)
    odd = replace(SENSORS.named("temperature"), unit="mK")
    config = next(iter(dict(tag_configs(TOPICS, "12", [odd], HOLDS_NS)).values()))
    assert "device_class" not in config
    assert config["unit_of_measurement"] == "mK"


def test_a_tag_and_the_greenhouse_have_a_verdict_and_an_alarm_and_silence_takes_the_tags() -> None:
    for found in (announced("12"), dict(greenhouse_configs(TOPICS))):
        by_name = {config["name"]: config for config in found.values()}
        assert by_name["Verdict"]["options"] == ["critical", "stressed", "healthy"]
        assert by_name["Alarm"]["device_class"] == "problem"
        assert by_name["Alarm"]["json_attributes_topic"] == by_name["Alarm"]["state_topic"]
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


def test_each_failure_doubles_the_wait_up_to_the_limit_with_a_half_at_random() -> None:
    backoff = Backoff(1.0, 60.0)
    for whole_s in (1, 2, 4, 8, 16, 32, 60, *[60] * 5_000):
        assert whole_s / 2 <= backoff.wait_s() <= whole_s
    backoff.succeeded()
    assert backoff.wait_s() <= 1.0
