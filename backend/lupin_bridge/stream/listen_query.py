"""What a WebSocket client asks for in its query string. Pure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from lupin_bridge.field.query import plain_number

_SWITCH: Final = {"0": False, "1": True}
MIN_RATE_HZ: Final = 0.01


class ListenRefused(ValueError):
    """A query that cannot be served; the message names the parameter, the value and the limit.

    It goes into a close frame, which has room for 123 bytes (RFC 6455, section 5.5).
    """


@dataclass(frozen=True, slots=True)
class ListenQuery:
    """How a client wants its frames."""

    delta: bool = False
    max_rate_hz: float = math.inf

    @property
    def min_interval_s(self) -> float:
        """The least time between two frames, s."""
        return 1.0 / self.max_rate_hz


def parse(parameters: Sequence[tuple[str, str]]) -> ListenQuery:
    """Read the query string's (name, value) pairs.

    Raises:
        ListenRefused: an unknown or repeated parameter, or a value out of its range.

    """
    values: dict[str, str] = {}
    for name, value in parameters:
        if name not in ("delta", "max_rate_hz"):
            raise ListenRefused(
                f"parameter {_shown(name)} is unknown, expected delta or max_rate_hz"
            )
        if name in values:
            raise ListenRefused(f"{name} is given more than once, expected one value")
        values[name] = value
    delta = values.get("delta", "0")
    if delta not in _SWITCH:
        raise ListenRefused(f"delta is {_shown(delta)}, expected 0 or 1")
    return ListenQuery(_SWITCH[delta], _rate(values.get("max_rate_hz")))


def _rate(text: str | None) -> float:
    if text is None:
        return math.inf
    rate = plain_number(text)
    if rate is None or not rate >= MIN_RATE_HZ:  # false for NaN too
        raise ListenRefused(f"max_rate_hz is {_shown(text)}, expected a number from {MIN_RATE_HZ}")
    return rate


def _shown(text: str) -> str:
    return f"{text!a:.40}"
