"""A file's mappings, taken key by key; every complaint names the key, its value and the limit."""

from __future__ import annotations

import math
import reprlib
from collections.abc import Collection
from typing import Any, Final

from lupin_twin.core.drops import MAX_TEXT_LENGTH


class ConfigError(ValueError):
    """A configuration that cannot be; the message names the key, the value and the limit."""


class Table:
    """A mapping of the file, taken key by key; what is left at the end is a mistake."""

    def __init__(self, name: str, content: Any) -> None:
        if not isinstance(content, dict):
            raise ConfigError(f"{name or 'the file'} is {shown(content)}, expected keys and values")
        self.name = name
        self.content: dict[Any, Any] = dict(content)
        self._known: list[str] = []

    def has(self, key: str) -> bool:
        """Whether the key is given, and was not taken yet."""
        self._known.append(key)
        return key in self.content

    def take(self, key: Any, *default: Any) -> Any:
        """The value as it is; without a default, one has to be given."""
        self._known.append(key)
        if key not in self.content and not default:
            raise ConfigError(f"{self._called(key)} is missing")
        return self.content.pop(key, *default)

    def text(self, key: str, default: str | None = None) -> str:
        """A text that is not empty."""
        value = self.take(key) if default is None else self.take(key, default)
        return check_text(self._called(key), value)

    def one_of(self, key: str, names: Collection[str]) -> str:
        """One of these."""
        value = self.take(key)
        if value not in names:
            raise ConfigError(
                f"{self._called(key)} is {shown(value)}, expected one of {', '.join(names)}"
            )
        return str(value)

    def number(
        self, key: str, default: float, low: float = -math.inf, high: float = math.inf
    ) -> float:
        """A number in a range."""
        value = self.take(key, default)
        if value is not default and not is_number(value):
            raise ConfigError(f"{self._called(key)} is {shown(value)}, expected a number")
        if not low <= value <= high:
            raise ConfigError(
                f"{self._called(key)} is {shown(value)}, must be from {low:g} to {high:g}"
            )
        return float(value)

    def end(self) -> None:
        """All has been taken: what is left is a mistake."""
        known = ", ".join(dict.fromkeys(self._known))
        for key in self.content:
            raise ConfigError(f"{self._called(shown(key))} is not known, expected one of {known}")

    def _called(self, key: object) -> str:
        return f"{self.name}.{key}" if self.name else str(key)


def check_text(what: str, value: Any) -> str:
    """The value, where it is a printable text that is neither empty nor too long."""
    if (
        not isinstance(value, str)
        or not 0 < len(value) <= MAX_TEXT_LENGTH
        or not value.isprintable()
    ):
        raise ConfigError(
            f"{what}: {shown(value)} is no text of 1 to {MAX_TEXT_LENGTH} printable characters; "
            "YAML takes yes, on and numbers for something else, unless they are in quotes"
        )
    return value


def is_number(value: Any) -> bool:
    """Whether it is a finite number."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:  # an integer of hundreds of digits
        return False


_SHORT: Final = reprlib.Repr()
_SHORT.maxstring = 80


def shown(value: Any) -> str:
    """The value as a complaint repeats it: its beginning, of text and of what is nested."""
    try:
        text = _SHORT.repr(value)
    except ValueError:  # an integer of thousands of digits
        text = f"a very large {type(value).__name__}"
    return text if len(text) <= 80 else f"{text[:79]}…"
