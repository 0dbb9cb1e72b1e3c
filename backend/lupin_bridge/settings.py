"""The bridge's settings: one table for the command line, the checks and the docs."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any

from lupin_bridge.logs import FORMATS, TEXT


class SettingError(ValueError):
    """A setting that cannot be; the message names it, its value and the limit."""


def _setting(default: Any, help_text: str, low: float | None = None, high: float = 0.0) -> Any:
    return field(default=default, metadata={"help": help_text, "low": low, "high": high})


@dataclass(frozen=True, slots=True)
class Settings:
    """How the bridge serves. Ranges are closed; times are seconds.

    Raises:
        SettingError: a value out of its range.

    """

    host: str = _setting("127.0.0.1", "address to listen on; other machines need 0.0.0.0 or ::")
    port: int = _setting(8000, "port to listen on; 0: any free one", 0, 65_535)
    max_rate_hz: float = _setting(
        10.0, "state frames a second at most, however fast the twin changes", 0.1, 100.0
    )
    max_clients: int = _setting(5_000, "WebSocket clients at most", 1, 100_000)
    client_timeout_s: float = _setting(
        30.0, "a client that takes nothing for this long is closed", 1.0, 3_600.0
    )
    field_timeout_s: float = _setting(
        10.0, "a field request that takes longer ends in 504", 0.1, 600.0
    )
    field_rate_hz: float = _setting(
        20.0, "field requests a second and client; two seconds' worth at once", 0.1, 10_000.0
    )
    field_concurrency: int = _setting(
        8, "field requests in flight for one client; a browser makes six", 1, 1_000
    )
    field_total_concurrency: int = _setting(
        32, "field requests being computed for all clients together", 1, 10_000
    )
    allow_origin: tuple[str, ...] = _setting(
        (),
        "origin whose pages may read the bridge too, and whose host is a name of the bridge, such "
        "as https://panel.example; may be given more than once",
    )
    tls_cert: str = _setting("", "PEM file with the certificate chain: serve https and wss")
    tls_key: str = _setting("", "PEM file with the certificate's private key, not encrypted")
    log_format: str = _setting(TEXT, f"{' or '.join(FORMATS)}: lines for people or for a collector")

    def __post_init__(self) -> None:
        for spec in fields(self):
            low, high = spec.metadata["low"], spec.metadata["high"]
            value = getattr(self, spec.name)
            if low is not None and not low <= value <= high:
                raise SettingError(
                    f"{option(spec.name)} is {value}, must be from {low:g} to {high:g}"
                )
        if self.log_format not in FORMATS:
            raise SettingError(
                f"--log-format is {self.log_format!r}, must be {' or '.join(FORMATS)}"
            )
        if not self.host:
            raise SettingError("--host is empty, must be an address")
        if bool(self.tls_cert) != bool(self.tls_key):
            given, missing = ("cert", "key") if self.tls_cert else ("key", "cert")
            raise SettingError(f"--tls-{given} is given without --tls-{missing}, TLS needs both")


def option(name: str) -> str:
    """The command-line option of a setting."""
    return "--" + name.replace("_", "-")
