"""Destinations, topics, announcements to Home Assistant, and how long a channel waits."""

import logging
import re
import ssl
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lupin_bridge.notify.destinations import MAX_PREFIX, MAX_URL, MIN_SECRET_LENGTH, Targets
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
from lupin_bridge.settings import Secrets, SettingError, Settings
from tests.support.seen import HOLDS_NS, SENSORS, S
from tests.support.tls import certificate

SECRET = "s" * MIN_SECRET_LENGTH
SIGNED = Secrets(webhook_secret=SECRET)


def refusal(secrets: Secrets = SIGNED, **settings: Any) -> str:
    with pytest.raises(SettingError) as refused:
        Targets.of(Settings(**settings), secrets)
    return str(refused.value)


@pytest.mark.parametrize(
    ("url", "host", "port", "has_tls", "called"),
    [
        ("mqtt://broker.lan", "broker.lan", 1883, False, "mqtt://broker.lan:1883"),
        ("mqtt://10.0.0.1:1/", "10.0.0.1", 1, False, "mqtt://10.0.0.1:1"),
        ("mqtts://[::1]", "::1", 8883, True, "mqtts://[::1]:8883"),
    ],
)
def test_a_broker_is_logged_with_its_address(
    url: str, host: str, port: int, has_tls: bool, called: str
) -> None:
    target = Targets.of(Settings(mqtt_url=url), Secrets()).mqtt
    assert target is not None
    assert (target.host, target.port, target.called) == (host, port, called)
    assert (target.tls is not None) is has_tls
    assert (target.topics.prefix, target.topics.discovery) == ("lupin-twin", "homeassistant")


@pytest.mark.parametrize(
    ("url", "port", "path", "called"),
    [
        ("http://hook.lan", 80, "/", "http://hook.lan:80"),
        ("http://a/" + "b" * (MAX_URL - 9), 80, "/" + "b" * (MAX_URL - 9), "http://a:80"),
        ("https://hook.lan/a?b=c", 443, "/a?b=c", "https://hook.lan:443"),
        ("http://hook.lan:8080/secret-path", 8080, "/secret-path", "http://hook.lan:8080"),
    ],
)
def test_a_receiver_is_logged_without_its_path(url: str, port: int, path: str, called: str) -> None:
    target = Targets.of(Settings(webhook_url=url), SIGNED).webhook
    assert target is not None
    assert (target.port, target.path, target.called) == (port, path, called)
    assert SECRET not in repr(target)
    assert "secret-path" not in repr(target)


@pytest.mark.parametrize(
    ("url", "named"),
    [
        ("tcp://broker", "--mqtt-url must begin with mqtt:// or mqtts://"),
        ("mqtt://", "--mqtt-url names no host, or"),
        ("mqtt://a:0", "--mqtt-url names no host, or the port 0"),
        ("mqtt://a:65536", "--mqtt-url is not an address: Port out of range 0-65535"),
        ("mqtt://a/b", "--mqtt-url has a path: topics go below --mqtt-prefix"),
        ("mqtt://me:hunter2@a", "--mqtt-url has a user or a password in it"),
        ("mqtt://a b", "--mqtt-url is longer than 2000 characters, or has one that"),
        ("mqtt://" + "a" * (MAX_URL - 6), "--mqtt-url is longer than 2000 characters"),
        ("ftp://a", "--webhook-url must begin with http:// or https://"),
        ("http://a/#b", "--webhook-url has a fragment (#)"),
        ("http://a/\r\nX: y", "--webhook-url is longer than 2000 characters, or has one that"),
        ("https://me:hunter2@a", "--webhook-url has a user or a password in it"),
    ],
)
def test_an_invalid_address_is_refused(url: str, named: str) -> None:
    message = refusal(mqtt_url=url) if "mqtt" in named else refusal(webhook_url=url)
    assert message.startswith(named)
    assert "hunter2" not in message


def test_a_prefix_that_no_topic_may_have_is_refused_and_both_must_differ() -> None:
    for prefix in ("", "/a", "a/", "a/+/b", "a#", "$SYS/a", "a\nb", "a" * (MAX_PREFIX + 1)):
        assert "--mqtt-prefix is " in refusal(mqtt_url="mqtt://a", mqtt_prefix=prefix)
        if prefix:
            message = refusal(mqtt_url="mqtt://a", mqtt_discovery_prefix=prefix)
            assert "--mqtt-discovery-prefix is " in message
    for prefix in ("ferme/été 1", "a" * MAX_PREFIX):
        settings = Settings(mqtt_url="mqtt://a", mqtt_prefix=prefix, mqtt_discovery_prefix="")
        target = Targets.of(settings, Secrets()).mqtt
        assert target is not None
        assert (target.topics.prefix, target.topics.discovery) == (prefix, "")
    same = refusal(mqtt_url="mqtt://a", mqtt_prefix="x", mqtt_discovery_prefix="x")
    assert "both 'x', must differ" in same


def test_a_password_needs_a_user_and_a_warning_is_given_without_tls(
    caplog: pytest.LogCaptureFixture,
) -> None:
    secrets = Secrets(mqtt_password="hunter2")
    assert "no --mqtt-user" in refusal(secrets, mqtt_url="mqtt://a")
    with caplog.at_level(logging.WARNING):
        target = Targets.of(Settings(mqtt_url="mqtts://a", mqtt_user="me"), secrets).mqtt
        assert caplog.messages == []
        Targets.of(Settings(mqtt_url="mqtt://a", mqtt_user="me"), secrets)
    assert "--mqtt-url is without TLS" in caplog.text
    assert target is not None
    assert (target.user, target.password) == ("me", "hunter2")
    assert "hunter2" not in repr(target)


def test_an_unused_setting_is_reported_and_named_as_the_operator_wrote_it() -> None:
    for name, url in (
        ("mqtt_user", "mqtt_url"),
        ("mqtt_password_file", "mqtt_url"),
        ("mqtt_ca", "mqtt_url"),
        ("webhook_secret_file", "webhook_url"),
        ("webhook_ca", "webhook_url"),
    ):
        given: dict[str, Any] = {name: "x"}
        option, needed = (f"--{it.replace('_', '-')}" for it in (name, url))
        assert refusal(**given).startswith(f"{option} is given without {needed}")
    message = refusal(mqtt_url="x", given_as={"mqtt_url": "LUPIN_MQTT_URL"})
    assert message.startswith("LUPIN_MQTT_URL must begin with")
    assert "--webhook-secret-file" in refusal(Secrets(), webhook_url="http://a")
    message = refusal(Secrets(webhook_secret=SECRET[1:]), webhook_url="http://a")
    assert f"has {MIN_SECRET_LENGTH - 1} characters" in message


def test_a_private_authority_is_trusted_and_an_invalid_file_of_one_is_named(tmp_path: Path) -> None:
    made = certificate(tmp_path)
    target = Targets.of(Settings(mqtt_url="mqtts://a", mqtt_ca=str(made.cert)), Secrets()).mqtt
    assert target is not None
    assert target.tls is not None
    assert target.tls.verify_mode == ssl.CERT_REQUIRED
    assert target.tls.check_hostname
    none = tmp_path / "none.pem"
    none.write_text("nothing")
    assert "none.pem holds no PEM certificate" in refusal(mqtt_url="mqtts://a", mqtt_ca=str(none))
    assert "/no: No such file" in refusal(webhook_url="https://a", webhook_ca="/no")
    assert "--mqtt-url is without TLS" in refusal(mqtt_url="mqtt://a", mqtt_ca=str(made.cert))


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
