"""The bridge's settings: one table for the command line, environment, file, checks and docs.

A field's type states its valid values; `settings_from` has pydantic check them.

The command line takes precedence over the environment, and that over a file. An error message names
the setting as its operator gave it: as an option, a variable, or a key of a file.
"""

from __future__ import annotations

import logging
import re
import stat
import tomllib
from collections.abc import Iterable, Iterator, Mapping, MutableMapping
from dataclasses import Field, dataclass, field, fields
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Final, Literal, get_args, get_origin, get_type_hints

from annotated_types import Interval, MinLen


class SettingError(ValueError):
    """A setting is invalid; the message names the setting, its value and the limit."""


UNIX: Final = "unix:"


def unix_path(host: str) -> Path | None:
    """The file of a Unix socket, if `host` names one: `unix:PATH`."""
    return Path(host.removeprefix(UNIX)) if host.startswith(UNIX) else None


_groups: list[str] = []


def _setting(default: Any, help_text: str, *, group: str = "", is_private: bool = False) -> Any:
    """Declare a setting; its `group` also applies to the settings after it, until the next group.

    `is_private`: the value may hold a password, so no message shows it.
    """
    if group:
        _groups.append(group)
    metadata = {"group": _groups[-1], "help": help_text, "is_private": is_private}
    return field(default=default, metadata=metadata)


@dataclass(frozen=True, slots=True)
class Settings:
    """The bridge's settings, as validated by `settings_from`. Times are seconds."""

    host: Annotated[str, MinLen(1)] = _setting(
        "127.0.0.1",
        "address to listen on; to accept other machines: 0.0.0.0 or ::; behind a reverse proxy on "
        "this machine: a Unix socket, such as unix:/run/lupin-twin/http.sock",
        group="listening",
    )
    port: Annotated[int, Interval(ge=0, le=65_535)] = _setting(
        8000, "port to listen on; 0: any free port"
    )
    tls_cert: str = _setting("", "PEM file with the certificate chain; turns on https and wss")
    tls_key: str = _setting("", "PEM file with the certificate's private key, unencrypted")
    max_clients: Annotated[int, Interval(ge=1, le=100_000)] = _setting(
        5_000, "maximum number of WebSocket clients"
    )
    token_file: str = _setting(
        "", "file with the token that readers must present, as one line of text", group="access"
    )
    accounts: str = _setting(
        "",
        "file of accounts and API tokens, which `lupin-twin user` and `token` create; empty: "
        "accounts.sqlite in the folder of this user's journals",
    )
    http_observations: Literal["off", "on"] = _setting(
        "off",
        "on: programs whose token has the role writer may post readings to /api/observations; the "
        "bridge publishes them over ROS",
    )
    allow_host: tuple[str, ...] = _setting(
        (), "additional host name of the bridge, such as twin.example; may be given more than once"
    )
    allow_origin: tuple[str, ...] = _setting(
        (),
        "additional origin whose pages may read the bridge, such as https://panel.example; its "
        "host is then a host name of the bridge too; may be given more than once",
    )
    trusted_proxy: tuple[str, ...] = _setting(
        (),
        "address or network of a reverse proxy whose X-Forwarded-For and X-Forwarded-Proto are "
        "trusted, such as 127.0.0.1 or 10.0.0.0/24; may be given more than once",
        group="behind a proxy",
    )
    proxy_user_header: str = _setting(
        "", "header in which a trusted proxy names the user it signed in, such as Remote-User"
    )
    path_prefix: str = _setting("", "path under which a proxy serves the bridge, such as /gh1")
    sensors: str = _setting(
        "",
        "JSON file with every sensor's label, unit, colour and ranges; empty: the built-in one",
        group="status",
    )
    reading_validity_s: Annotated[float, Interval(ge=0.0, le=604_800.0)] = _setting(
        0.0, "how long a reading is valid, s; 0: three times the tag's usual scan interval"
    )
    day_hours: str = _setting(
        "06:00-20:00", "hours that count as day where no light is measured; 00:00-00:00: always"
    )
    time_zone: str = _setting(
        "", "time zone for times of day, such as Europe/Amsterdam; empty: this machine's"
    )
    mqtt_url: str = _setting(
        "",
        "MQTT broker that receives readings, verdicts and alarms, such as mqtt://broker.lan or "
        "mqtts://broker.lan:8883",
        group="MQTT",
        is_private=True,
    )
    mqtt_user: str = _setting("", "user name at the MQTT broker")
    mqtt_password_file: str = _setting("", "file with that user's password, as one line of text")
    mqtt_ca: str = _setting("", "PEM file with the CA certificate for the broker")
    mqtt_prefix: str = _setting("lupin-twin", "prefix of every topic, such as farm/gh1")
    mqtt_discovery_prefix: str = _setting(
        "homeassistant", "Home Assistant's discovery prefix; empty: devices are not announced"
    )
    webhook_url: str = _setting(
        "",
        "http or https address to which changes of alarms are posted",
        group="webhook",
        is_private=True,
    )
    webhook_secret_file: str = _setting(
        "", "file with the secret that signs the posts, as one line of text"
    )
    webhook_ca: str = _setting("", "PEM file with the CA certificate for the receiver")
    push_contact: str = _setting(
        "",
        "turns on Web Push; the address that push services contact about problems, such as "
        "mailto:grower@example.org",
        group="push",
    )
    push_private_host: tuple[str, ...] = _setting(
        (),
        "host of a push service of your own, which may be in a private network; may be given more "
        "than once",
    )
    report_at: str = _setting(
        "",
        "time of day at which the report of the last day is sent by MQTT and webhook, such as "
        "06:00; empty: never",
        group="report",
    )
    journal: str = _setting(
        "",
        "for web: its twin's journal, if this machine sees the file under a different path",
        group="history",
    )
    site: str = _setting(
        "",
        "name of the greenhouse in the archive, and of its database user, such as gh1",
        group="archive",
    )
    archive_url: str = _setting(
        "",
        "PostgreSQL database that the journal is forwarded to, or that fleet shows, such as "
        "postgresql://gh1@db.example/lupin; the password comes from PGPASSWORD or PGPASSFILE",
        is_private=True,
    )
    log_format: Literal["text", "json"] = _setting(
        "text", "lines for people, or JSON for a log collector", group="log"
    )
    log_level: Literal["debug", "info", "warning", "error"] = _setting(
        "info", "lowest level that is logged"
    )
    # How the operator gave each setting: an option, a variable, or a key of a file.
    given_as: Mapping[str, str] = field(
        default_factory=dict, repr=False, compare=False, kw_only=True
    )

    def called(self, name: str) -> str:
        """The name of a setting in messages: as its operator gave it."""
        return self.given_as.get(name, option(name))

    def wrong(self, name: str, why: str) -> SettingError:
        """An error about a setting, which names it as its operator gave it."""
        return SettingError(f"{self.called(name)} {why}")


@dataclass(frozen=True, slots=True, repr=False)
class Secrets:
    """Secrets, which must not be on a command line, where others can read them; None: not given.

    Readers need `token`, the broker asks for `mqtt_password`, and `webhook_secret` signs what is
    posted.
    """

    token: str | None = None
    mqtt_password: str | None = None
    webhook_secret: str | None = None


def table() -> tuple[Field[Any], ...]:
    """The settings as dataclass fields; their metadata has `group` and `help`."""
    return tuple(spec for spec in fields(Settings) if spec.metadata)


@cache
def types() -> Mapping[str, Any]:
    """The annotated type of each setting."""
    return get_type_hints(Settings, include_extras=True)


def limits_of(name: str) -> str:
    """The valid values of a setting, in words; empty: any text."""
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


# --- where they come from: the command line, the environment, a file, in this order ---------------

log = logging.getLogger(__name__)

CONFIG_VARIABLE: Final = variable("config")
# Each is given by a variable of its name, or in the file that the setting NAME_file names.
SECRETS: Final = tuple(spec.name for spec in fields(Secrets))
_NOT_IN_THE_TABLE: Final = (CONFIG_VARIABLE, *map(variable, SECRETS))
# No name, address or path contains one, and C functions truncate such text, or fail.
_CONTROL: Final = re.compile(r"[\x00-\x1f\x7f]")
_BARE: Final = re.compile(r"[A-Za-z0-9_-]{1,64}")
# More than anybody writes: a device or disk image given by mistake is not read whole.
MAX_FILE_BYTES: Final = 65_536

# The setting, its name as the operator gave it, and its value.
_Given = tuple[str, str, Any]


def settings_from(
    options: Mapping[str, Any], environment: Mapping[str, str], config: str | None = None
) -> Settings:
    """The settings, each from the first source that has it.

    `options` maps each option of the command line to its text, or to None if it is not given;
    `config` is the value of --config.

    Raises:
        SettingError: a value is invalid, a key is no setting, or a file cannot be read.

    """
    path, called = (
        (config, "--config")
        if config is not None
        else (environment.get(CONFIG_VARIABLE), CONFIG_VARIABLE)
    )
    values: dict[str, Any] = {}
    given_as: dict[str, str] = {}

    def take(given: Iterable[_Given], *, is_text: bool) -> None:
        for name, called, value in given:
            values[name], given_as[name] = _checked(name, called, value, is_text=is_text), called

    take(() if path is None else _of_file(path, called), is_text=False)
    take(_of_environment(environment), is_text=True)
    given = ((name, value) for name, value in options.items() if value is not None)
    take(((name, option(name), value) for name, value in given), is_text=True)
    settings = Settings(**values, given_as=given_as)
    if bool(settings.tls_cert) != bool(settings.tls_key):
        one, other = ("tls_cert", "tls_key") if settings.tls_cert else ("tls_key", "tls_cert")
        raise settings.wrong(one, f"is given without {option(other)}, TLS needs both")
    return settings


def _checked(name: str, called: str, value: Any, *, is_text: bool) -> Any:
    from pydantic import TypeAdapter, ValidationError  # noqa: PLC0415  # `--help` does not need it

    try:
        found = TypeAdapter(types()[name]).validate_python(
            tuple(value) if isinstance(value, list) else value, strict=not is_text
        )
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        why = f"{first['msg'][0].lower()}{first['msg'][1:]}"
        if first["type"] == "tuple_type":
            why = f"expected a list, such as [{_shown(name, value)}]"
        raise SettingError(f"{called} is {_shown(name, value)}: {why}") from None
    texts = found if isinstance(found, tuple) else (found,)
    if any(isinstance(text, str) and _CONTROL.search(text) for text in texts):
        raise SettingError(f"{called} is {_shown(name, value)}: it contains a control character")
    return found


def _shown(name: str, value: Any) -> str:
    """A value as messages show it; of a private one, only its type."""
    if any(spec.name == name and spec.metadata["is_private"] for spec in table()):
        kind = {"str": "text", "list": "a list", "dict": "a table"}.get(
            type(value).__name__, "a number or date"
        )
        return f"{kind} that may hold a password, and is not shown"
    return repr(str(value)[:128])


def _of_environment(environment: Mapping[str, str]) -> Iterator[_Given]:
    for spec in table():
        called = variable(spec.name)
        if called in environment:
            text = environment[called]
            parts = [part for word in text.split(",") if (part := word.strip())]
            yield spec.name, called, parts if spec.default == () else text


def take_secrets(settings: Settings, environment: MutableMapping[str, str]) -> Secrets:
    """Read the secrets, and remove them from the environment.

    The processes that the bridge starts do not need them.

    Raises:
        SettingError: a secret is given twice, or its file cannot be read.

    """
    return Secrets(**{name: _take_secret(name, settings, environment) for name in SECRETS})


def _take_secret(
    name: str, settings: Settings, environment: MutableMapping[str, str]
) -> str | None:
    secret = environment.pop(variable(name), None)
    file = getattr(settings, f"{name}_file")
    if not file:
        return secret
    called = settings.called(f"{name}_file")
    if secret is not None:
        raise SettingError(f"{variable(name)} and {called} are both given, expected one of them")
    text = read_text(file, called).strip()
    mode = Path(file).stat().st_mode
    if mode & stat.S_IROTH:
        log.warning(
            "%s %s has mode %o: anyone on this machine can read the %s, make it 600",
            called,
            file,
            stat.S_IMODE(mode),
            name.rpartition("_")[2],
        )
    return text


def strange_variables(environment: Iterable[str]) -> list[str]:
    """Warnings about variables that look like settings but are none.

    They are no error: Kubernetes and other programs may set variables with our prefix.
    """
    known = {*_NOT_IN_THE_TABLE, *(variable(spec.name) for spec in table())}
    return [
        f"environment variable {name} is not a setting of the bridge"
        for name in sorted(environment)
        if name.startswith(ENV_PREFIX) and name not in known
    ]


def _of_file(path: str, called: str) -> Iterator[_Given]:
    text = read_text(path, called)
    try:
        content = tomllib.loads(text)
    except ValueError as error:
        raise SettingError(f"{path} is not TOML: {error}") from None
    names = {spec.name for spec in table()}
    for key, value in content.items():
        place = f"{path}: {key if _BARE.fullmatch(key) else repr(key[:64])}"
        if key in SECRETS:
            raise SettingError(
                f"{place} is not a setting: put the {key.rpartition('_')[2]} into a file of its "
                f"own, and name that file with {key}_file"
            )
        if key not in names:
            raise SettingError(f"{place} is not a setting of the bridge")
        yield key, place, value


def read_text(path: str, called: str, max_bytes: int = MAX_FILE_BYTES) -> str:
    """A small file's text; `called` is the setting that names it.

    Raises:
        SettingError: it cannot be read, is too large, or is no text.

    """
    try:
        with Path(path).open("rb") as file:
            content = file.read(max_bytes + 1)
    except OSError as error:
        raise SettingError(f"{called} {path}: {error.strerror}") from None
    if len(content) > max_bytes:
        raise SettingError(f"{called} {path} has more than {max_bytes} bytes, the limit")
    try:
        return content.decode()
    except UnicodeDecodeError:
        raise SettingError(f"{called} {path} is not UTF-8 text") from None
