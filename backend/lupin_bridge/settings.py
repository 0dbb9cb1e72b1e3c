"""The bridge's settings: one table for the command line, environment, file, checks and docs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import Field, dataclass, field, fields
from typing import Any, Final

from lupin_bridge.logs import FORMATS, LEVELS, TEXT


class SettingError(ValueError):
    """A setting that cannot be; the message names it, its value and the limit."""


def _setting(
    default: Any,
    help_text: str,
    low: float | None = None,
    high: float = 0.0,
    choices: Iterable[str] = (),
) -> Any:
    metadata = {"help": help_text, "low": low, "high": high, "choices": tuple(choices)}
    return field(default=default, metadata=metadata)


@dataclass(frozen=True, slots=True)
class Settings:
    """How the bridge serves. Ranges are closed; times are seconds.

    Raises:
        SettingError: a value out of its range.

    """

    host: str = _setting("127.0.0.1", "address to listen on; other machines need 0.0.0.0 or ::")
    port: int = _setting(8000, "port to listen on; 0: any free one", 0, 65_535)
    max_rate_hz: float = _setting(
        10.0, "state frames a second on average at most, however fast the twin changes", 0.1, 100.0
    )
    max_clients: int = _setting(5_000, "WebSocket clients at most", 1, 100_000)
    client_timeout_s: float = _setting(
        30.0, "a client that takes nothing for this long is closed", 1.0, 3_600.0
    )
    field_timeout_s: float = _setting(
        10.0, "a computed answer that takes longer ends in 504, and its work with it", 0.1, 600.0
    )
    # A page that is dragged through the past asks for ten moments a second, each for a state and a
    # field or two; and behind one address there may be two such pages.
    field_rate_hz: float = _setting(
        50.0,
        "fields and other answers computed a second and client; two seconds' worth at once",
        0.01,
        10_000.0,
    )
    field_concurrency: int = _setting(
        8, "such requests in flight for one client; a browser makes six", 1, 1_000
    )
    field_total_concurrency: int = _setting(
        32,
        "answers being computed for all clients together; large ones take three quarters at most",
        1,
        10_000,
    )
    allow_host: tuple[str, ...] = _setting(
        (), "another name of the bridge, such as twin.example; may be given more than once"
    )
    allow_origin: tuple[str, ...] = _setting(
        (),
        "origin whose pages may read the bridge too, and whose host is a name of the bridge, such "
        "as https://panel.example; may be given more than once",
    )
    trusted_proxy: tuple[str, ...] = _setting(
        (),
        "address or network of a reverse proxy whose X-Forwarded-For and X-Forwarded-Proto are "
        "believed, such as 127.0.0.1 or 10.0.0.0/24; may be given more than once",
    )
    path_prefix: str = _setting("", "path that a proxy serves the bridge below, such as /gh1")
    tls_cert: str = _setting("", "PEM file with the certificate chain: serve https and wss")
    tls_key: str = _setting("", "PEM file with the certificate's private key, not encrypted")
    token_file: str = _setting("", "file with the token that readers have to know, a line of text")
    sensors: str = _setting(
        "", "JSON file with every sensor's label, unit, colour and ranges, instead of our own"
    )
    recent_s: float = _setting(
        0.0, "how long a reading holds; 0: three times the tag's own usual interval", 0.0, 604_800.0
    )
    time_zone: str = _setting(
        "", "such as Europe/Amsterdam: for the hours of the day; empty: this machine's"
    )
    day_hours: str = _setting(
        "06:00-20:00", "from when to when it is day where no light is measured; 00:00-00:00: always"
    )
    alarm_days: float = _setting(7.0, "how far back alarms are worked out, in days", 0.01, 3_652.0)
    mqtt_url: str = _setting(
        "",
        "MQTT broker, such as mqtt://broker.lan or mqtts://broker.lan:8883: readings, verdicts and "
        "alarms go there",
    )
    mqtt_user: str = _setting("", "who the bridge is to the broker")
    mqtt_password_file: str = _setting("", "file with that user's password, a line of text")
    mqtt_ca: str = _setting("", "PEM file with who signs the broker's certificate")
    mqtt_prefix: str = _setting("lupin-twin", "what the topics begin with, such as farm/gh1")
    mqtt_discovery_prefix: str = _setting(
        "homeassistant", "where Home Assistant looks for devices; empty: they are not announced"
    )
    webhook_url: str = _setting("", "http or https address that changes of alarms are posted to")
    webhook_secret_file: str = _setting("", "file with the secret that signs them, a line of text")
    webhook_ca: str = _setting("", "PEM file with who signs the receiver's certificate")
    log_format: str = _setting(TEXT, "lines for people, or JSON for a collector", choices=FORMATS)
    log_level: str = _setting("info", "the least that is logged", choices=LEVELS)
    # What the operator called a setting, where it is not the option: a variable, a file's line.
    given_as: Mapping[str, str] = field(
        default_factory=dict, repr=False, compare=False, kw_only=True
    )

    def __post_init__(self) -> None:
        for spec in table():
            check(spec, getattr(self, spec.name), self.called(spec.name))
        if bool(self.tls_cert) != bool(self.tls_key):
            given, missing = ("tls_cert", "tls_key") if self.tls_cert else ("tls_key", "tls_cert")
            raise SettingError(
                f"{self.called(given)} is given without {option(missing)}, TLS needs both"
            )

    def called(self, name: str) -> str:
        """What a message should call a setting: as its operator gave it."""
        return self.given_as.get(name, option(name))


@dataclass(frozen=True, slots=True, repr=False)
class Secrets:
    """What must not stand on a command line, for others can read it; None: not given.

    `token` is what readers have to know, `mqtt_password` what the broker asks for, `webhook_secret`
    signs what is posted.
    """

    token: str | None = None
    mqtt_password: str | None = None
    webhook_secret: str | None = None


def table() -> tuple[Field[Any], ...]:
    """The settings themselves."""
    return tuple(spec for spec in fields(Settings) if spec.metadata)


def check(spec: Field[Any], value: Any, called: str) -> None:
    """Refuse a value out of its range.

    Raises:
        SettingError: it is, or it is empty where there has to be something.

    """
    low, high, choices = (spec.metadata[name] for name in ("low", "high", "choices"))
    if low is not None and not low <= value <= high:
        raise SettingError(f"{called} is {value}, must be from {low:.15g} to {high:.15g}")
    if choices and value not in choices:
        raise SettingError(f"{called} is {value!r}, must be {one_of(choices)}")
    if spec.name == "host" and not value:
        raise SettingError(f"{called} is empty, must be an address")


def one_of(names: Iterable[str]) -> str:
    """Names as a choice between them, for a message."""
    *most, last = names
    return f"{', '.join(most)} or {last}" if most else last


def option(name: str) -> str:
    """The command-line option of a setting."""
    return "--" + name.replace("_", "-")


ENV_PREFIX: Final = "LUPIN_"


def variable(name: str) -> str:
    """The environment variable of a setting."""
    return ENV_PREFIX + name.upper()
