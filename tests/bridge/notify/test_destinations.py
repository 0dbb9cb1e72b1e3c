"""Destinations: an invalid one is refused at the start, and no message contains a secret."""

import logging
import ssl
from pathlib import Path
from typing import Any

import pytest

from lupin_bridge.notify.destinations import MAX_PREFIX, MAX_URL, MIN_SECRET_LENGTH, Targets
from lupin_bridge.settings import Secrets, SettingError, Settings
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
