"""The bridge's settings: one table for the command line, environment, file, checks and docs.

A type here says what a value may be; `configuration` has pydantic check it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import Field, dataclass, field, fields
from functools import cache
from typing import Annotated, Any, Final, Literal, get_args, get_origin, get_type_hints

from annotated_types import Interval, MinLen


class SettingError(ValueError):
    """A setting that cannot be; the message names it, its value and the limit."""


def _setting(default: Any, group: str, help_text: str, *, is_private: bool = False) -> Any:
    """A line of the table; `is_private`: a password may be in it, so no message repeats it."""
    metadata = {"group": group, "help": help_text, "is_private": is_private}
    return field(default=default, metadata=metadata)


@dataclass(frozen=True, slots=True)
class Settings:
    """How the bridge serves, as `configuration.settings_from` found it right. Times are seconds."""

    host: Annotated[str, MinLen(1)] = _setting(
        "127.0.0.1", "listening", "address to listen on; other machines need 0.0.0.0 or ::"
    )
    port: Annotated[int, Interval(ge=0, le=65_535)] = _setting(
        8000, "listening", "port to listen on; 0: any free one"
    )
    tls_cert: str = _setting(
        "", "listening", "PEM file with the certificate chain: serve https and wss"
    )
    tls_key: str = _setting(
        "", "listening", "PEM file with the certificate's private key, not encrypted"
    )
    max_clients: Annotated[int, Interval(ge=1, le=100_000)] = _setting(
        5_000, "listening", "WebSocket clients at most"
    )
    token_file: str = _setting(
        "", "access", "file with the token that readers have to know, a line of text"
    )
    accounts: str = _setting(
        "",
        "access",
        "file of accounts and API tokens, which `lupin-twin user` and `token` make; empty: "
        "accounts.sqlite in the folder of this user's journals",
    )
    http_observations: Literal["off", "on"] = _setting(
        "off",
        "access",
        "on: programs with a token of the role writer post readings to /api/observations, and the "
        "bridge publishes them over ROS",
    )
    allow_host: tuple[str, ...] = _setting(
        (),
        "access",
        "another name of the bridge, such as twin.example; may be given more than once",
    )
    allow_origin: tuple[str, ...] = _setting(
        (),
        "access",
        "origin whose pages may read the bridge too, and whose host is a name of the bridge, such "
        "as https://panel.example; may be given more than once",
    )
    trusted_proxy: tuple[str, ...] = _setting(
        (),
        "behind a proxy",
        "address or network of a reverse proxy whose X-Forwarded-For and X-Forwarded-Proto are "
        "believed, such as 127.0.0.1 or 10.0.0.0/24; may be given more than once",
    )
    proxy_user_header: str = _setting(
        "",
        "behind a proxy",
        "header in which such a proxy names who has signed in there, such as Remote-User",
    )
    path_prefix: str = _setting(
        "", "behind a proxy", "path that a proxy serves the bridge below, such as /gh1"
    )
    sensors: str = _setting(
        "",
        "judgement",
        "JSON file with every sensor's label, unit, colour and ranges, instead of our own",
    )
    reading_validity_s: Annotated[float, Interval(ge=0.0, le=604_800.0)] = _setting(
        0.0,
        "judgement",
        "how long a reading is valid, s; 0: three times the tag's own usual interval",
    )
    day_hours: str = _setting(
        "06:00-20:00",
        "judgement",
        "from when to when it is day where no light is measured; 00:00-00:00: always",
    )
    time_zone: str = _setting(
        "",
        "judgement",
        "such as Europe/Amsterdam: for the hours of the day; empty: this machine's",
    )
    mqtt_url: str = _setting(
        "",
        "MQTT",
        "MQTT broker, such as mqtt://broker.lan or mqtts://broker.lan:8883: readings, verdicts and "
        "alarms go there",
        is_private=True,
    )
    mqtt_user: str = _setting("", "MQTT", "who the bridge is to the broker")
    mqtt_password_file: str = _setting("", "MQTT", "file with that user's password, a line of text")
    mqtt_ca: str = _setting("", "MQTT", "PEM file with who signs the broker's certificate")
    mqtt_prefix: str = _setting(
        "lupin-twin", "MQTT", "what the topics begin with, such as farm/gh1"
    )
    mqtt_discovery_prefix: str = _setting(
        "homeassistant",
        "MQTT",
        "where Home Assistant looks for devices; empty: they are not announced",
    )
    webhook_url: str = _setting(
        "",
        "webhook",
        "http or https address that changes of alarms are posted to",
        is_private=True,
    )
    webhook_secret_file: str = _setting(
        "", "webhook", "file with the secret that signs them, a line of text"
    )
    webhook_ca: str = _setting("", "webhook", "PEM file with who signs the receiver's certificate")
    push_contact: str = _setting(
        "",
        "push",
        "turns on Web Push, and is whom push services write to if it goes wrong, such as "
        "mailto:grower@example.org",
    )
    push_private_host: tuple[str, ...] = _setting(
        (), "push", "a push service of your own, which may be in a private network, may be repeated"
    )
    report_at: str = _setting(
        "",
        "report",
        "when the report of the last day is sent, by MQTT and webhook, such as 06:00 in the time "
        "zone of the hours of the day; empty: never",
    )
    journal: str = _setting(
        "",
        "past",
        "for web: the file of its twin's journal, where this machine knows it by another path",
    )
    site: str = _setting(
        "", "archive", "the greenhouse's name in the archive, and its user's, such as gh1"
    )
    archive_url: str = _setting(
        "",
        "archive",
        "PostgreSQL that the journal is forwarded to, or that fleet shows, such as "
        "postgresql://gh1@db.example/lupin; its password: PGPASSWORD or PGPASSFILE",
        is_private=True,
    )
    log_format: Literal["text", "json"] = _setting(
        "text", "log", "lines for people, or JSON for a collector"
    )
    log_level: Literal["debug", "info", "warning", "error"] = _setting(
        "info", "log", "the least that is logged"
    )
    # What the operator called a setting: the option, a variable, a file's line.
    given_as: Mapping[str, str] = field(
        default_factory=dict, repr=False, compare=False, kw_only=True
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
    """The settings themselves; of each the metadata has `group` and `help`."""
    return tuple(spec for spec in fields(Settings) if spec.metadata)


@cache
def types() -> Mapping[str, Any]:
    """What each setting may be."""
    return get_type_hints(Settings, include_extras=True)


def limits_of(name: str) -> str:
    """What a setting may be, in words; empty: any text."""
    hint = types()[name]
    for limit in getattr(hint, "__metadata__", ()):
        if isinstance(limit, Interval):
            return f"from {limit.ge:.15g} to {limit.le:.15g}"
    return one_of(get_args(hint)) if get_origin(hint) is Literal else ""


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
