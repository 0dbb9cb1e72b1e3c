"""Where notifications are sent, as the operator chose it."""

from __future__ import annotations

import logging
import re
import ssl
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import time
from typing import Final
from urllib.parse import SplitResult, urlsplit

from lupin_bridge.notify.messages import Topics
from lupin_bridge.settings import Secrets, SettingError, Settings, one_of

log = logging.getLogger(__name__)

MIN_SECRET_LENGTH: Final = 16
MAX_PREFIX: Final = 128
MAX_URL: Final = 2_000
_MQTT_PORTS: Final = {"mqtt": 1883, "mqtts": 8883}
_HTTP_PORTS: Final = {"http": 80, "https": 443}
# What an address may be made of (RFC 3986): nothing that would end a line of HTTP.
_ADDRESS: Final = re.compile(r"[!-~]+")
# MQTT 5, section 4.7: `+` and `#` are for subscribers, what begins with `$` is the broker's own.
_PREFIX: Final = re.compile(r"[^$/+#\x00-\x1f\x7f]([^+#\x00-\x1f\x7f]*[^/+#\x00-\x1f\x7f])?")


@dataclass(frozen=True, slots=True)
class MqttTarget:
    """A broker, and the topics to publish at it."""

    host: str
    port: int
    topics: Topics
    user: str | None = None
    password: str | None = field(default=None, repr=False)
    tls: ssl.SSLContext | None = None

    @property
    def called(self) -> str:
        """The broker's address, for a person to read."""
        return f"{'mqtt' if self.tls is None else 'mqtts'}://{_authority(self.host, self.port)}"


@dataclass(frozen=True, slots=True)
class Endpoint:
    """Where to post; `path` holds the query too, and may be a secret.

    `address` is where to connect to in place of `host`, if that was looked up already.
    """

    host: str
    port: int
    path: str = field(repr=False)
    authority: str
    tls: ssl.SSLContext | None = None
    address: str = ""

    @property
    def called(self) -> str:
        """The receiver's address without its path, for a person to read."""
        return f"{'http' if self.tls is None else 'https'}://{_authority(self.host, self.port)}"


@dataclass(frozen=True, slots=True)
class WebhookTarget(Endpoint):
    """The receiver of alarms, and what they are signed with."""

    secret: bytes = field(default=b"", repr=False)


@dataclass(frozen=True, slots=True)
class PushTarget:
    """The contact for push services, and those of their hosts that may be in a private network."""

    contact: str
    private_hosts: frozenset[str]
    tls: ssl.SSLContext


@dataclass(frozen=True, slots=True)
class Targets:
    """Where the operator wants notifications; None: nowhere."""

    mqtt: MqttTarget | None = None
    webhook: WebhookTarget | None = None
    push: PushTarget | None = None
    report_at: time | None = None

    @classmethod
    def of(cls, settings: Settings, secrets: Secrets) -> Targets:
        """As the settings have it.

        Raises:
            SettingError: an address, a prefix or a secret is invalid, or lacks what it needs.

        """
        mqtt, webhook = _mqtt(settings, secrets.mqtt_password), _webhook(settings, secrets)
        report_at = _report_at(settings, has_target=bool(mqtt or webhook))
        return cls(mqtt, webhook, _push(settings), report_at)


# RFC 8292, section 2.1.
_CONTACT: Final = re.compile(r"(mailto:[!-?A-~]+@[!-~]+|https://[!-~]+)", re.ASCII)
_HOUR: Final = re.compile(r"(?:[01]\d|2[0-3]):[0-5]\d", re.ASCII)


def _report_at(settings: Settings, *, has_target: bool) -> time | None:
    called, text = settings.called("report_at"), settings.report_at
    if not text:
        return None
    if not _HOUR.fullmatch(text):
        raise SettingError(f"{called} is {text!r}, must be from 00:00 to 23:59, such as 06:00")
    if not has_target:
        raise SettingError(
            f"{called} is given without {settings.called('webhook_url')} or "
            f"{settings.called('mqtt_url')}, and has no use"
        )
    return time.fromisoformat(text)


def _mqtt(settings: Settings, password: str | None) -> MqttTarget | None:
    if not settings.mqtt_url:
        _needs(settings, "mqtt_url", "mqtt_user", "mqtt_password_file", "mqtt_ca")
        return None
    url, port = _address(settings, "mqtt_url", _MQTT_PORTS)
    if url.path not in ("", "/") or url.query:
        raise settings.wrong(
            "mqtt_url", f"has a path: topics go below {settings.called('mqtt_prefix')}"
        )
    if password is not None and not settings.mqtt_user:
        raise SettingError(
            f"a password is given for {settings.called('mqtt_url')}, but no "
            f"{settings.called('mqtt_user')}"
        )
    prefix, discovery = _prefix(settings, "mqtt_prefix"), settings.mqtt_discovery_prefix
    if discovery:
        discovery = _prefix(settings, "mqtt_discovery_prefix")
    if discovery == prefix:
        raise settings.wrong(
            "mqtt_prefix",
            f"and {settings.called('mqtt_discovery_prefix')} are both {prefix!r}, must differ",
        )
    tls = _tls(settings, "mqtt_ca", is_wanted=url.scheme == "mqtts", url="mqtt_url")
    if password is not None and tls is None:
        log.warning(
            "%s is without TLS: anyone who sees the packets can read the password, use mqtts://",
            settings.called("mqtt_url"),
        )
    return MqttTarget(
        host=url.hostname or "",
        port=port,
        topics=Topics(prefix, discovery),
        user=settings.mqtt_user or None,
        password=password,
        tls=tls,
    )


def _webhook(settings: Settings, secrets: Secrets) -> WebhookTarget | None:
    if not settings.webhook_url:
        _needs(settings, "webhook_url", "webhook_secret_file", "webhook_ca")
        return None
    url, port = _address(settings, "webhook_url", _HTTP_PORTS)
    secret = secrets.webhook_secret
    if secret is None:
        raise settings.wrong(
            "webhook_url",
            "is given without a secret to sign with: name its file with --webhook-secret-file",
        )
    if len(secret) < MIN_SECRET_LENGTH:
        raise SettingError(
            f"the webhook's secret has {len(secret)} characters, must have at least "
            f"{MIN_SECRET_LENGTH}: make one with `openssl rand -hex 32`"
        )
    return WebhookTarget(
        host=url.hostname or "",
        port=port,
        path=path_of(url),
        authority=url.netloc,
        secret=secret.encode(),
        tls=_tls(settings, "webhook_ca", is_wanted=url.scheme == "https", url="webhook_url"),
    )


def _push(settings: Settings) -> PushTarget | None:
    contact = settings.push_contact
    if not contact:
        _needs(settings, "push_contact", "push_private_host")
        return None
    if not _CONTACT.fullmatch(contact):
        raise settings.wrong(
            "push_contact",
            f"is {contact[:128]!r}, must be mailto: and an address, or https:// and a page",
        )
    hosts = frozenset(host.lower() for host in settings.push_private_host)
    return PushTarget(contact, hosts, ssl.create_default_context())


def _address(settings: Settings, name: str, ports: dict[str, int]) -> tuple[SplitResult, int]:
    try:
        return address_of(getattr(settings, name), ports)
    except ValueError as error:
        raise SettingError(f"{settings.called(name)} {error}") from None


def address_of(text: str, ports: Mapping[str, int]) -> tuple[SplitResult, int]:
    """An address and its port, of one of these schemes, which have these ports.

    Raises:
        ValueError: it is invalid; what may be secret in it is not in the message.

    """
    if len(text) > MAX_URL or not _ADDRESS.fullmatch(text):
        raise ValueError(
            f"is longer than {MAX_URL} characters, or has one that is invalid in an address: write "
            "it in ASCII, without spaces"
        )
    try:
        url = urlsplit(text)
        port = url.port
    except ValueError as error:
        raise ValueError(f"is not an address: {error}") from None
    if url.scheme not in ports:
        raise ValueError(f"must begin with {one_of([f'{scheme}://' for scheme in ports])}")
    if "@" in url.netloc:
        raise ValueError(
            "has a user or a password in it: others can read a command line, they have settings "
            "and files of their own"
        )
    if not url.hostname or port == 0:
        raise ValueError("names no host, or the port 0")
    if url.fragment:
        raise ValueError("has a fragment (#), must have none")
    return url, port or ports[url.scheme]


def path_of(url: SplitResult) -> str:
    """What a request asks for there."""
    return (url.path or "/") + (f"?{url.query}" if url.query else "")


def _prefix(settings: Settings, name: str) -> str:
    prefix: str = getattr(settings, name)
    if len(prefix) > MAX_PREFIX or not _PREFIX.fullmatch(prefix):
        raise settings.wrong(
            name,
            f"is {prefix[:MAX_PREFIX]!r}, must be 1 to {MAX_PREFIX} "
            "characters without + and #, that begin and end with no /, and begin with no $",
        )
    return prefix


def _tls(settings: Settings, ca: str, *, is_wanted: bool, url: str) -> ssl.SSLContext | None:
    file = getattr(settings, ca)
    if not is_wanted:
        if file:
            raise settings.wrong(ca, f"is given, but {settings.called(url)} is without TLS")
        return None
    try:
        return ssl.create_default_context(cafile=file or None)
    except ssl.SSLError:  # before OSError, which it is
        raise settings.wrong(ca, f"{file} holds no PEM certificate") from None
    except OSError as error:
        raise settings.wrong(ca, f"{file}: {error.strerror}") from None


def _needs(settings: Settings, url: str, *names: str) -> None:
    for name in names:
        if getattr(settings, name):
            raise settings.wrong(name, f"is given without {settings.called(url)}, and has no use")


def _authority(host: str, port: int) -> str:
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"
