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
    field_rate_hz: float = _setting(
        20.0,
        "fields and other answers computed a second and client; two seconds' worth at once",
        0.1,
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
        raise SettingError(f"{called} is {value}, must be from {low:g} to {high:g}")
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
