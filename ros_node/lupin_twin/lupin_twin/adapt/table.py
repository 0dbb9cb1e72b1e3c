"""Checked access to a configuration file's mappings, and parsing of numbers and times. Pure.

Every error names the key, its value and the limit.
"""

from __future__ import annotations

import math
import reprlib
from collections.abc import Collection
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime, tzinfo
from decimal import Decimal
from typing import Any, Final

from lupin_twin.core.drops import MAX_SENSORS_PER_TAG, MAX_TEXT_LENGTH, Rejected, cut


class ConfigError(ValueError):
    """The configuration is invalid; the message names the key, the value and the limit."""


class Table:
    """A mapping of the file, consumed key by key; a key that is left at the end is an error."""

    def __init__(self, name: str, content: Any) -> None:
        if not isinstance(content, dict):
            raise wrong(name or "the file", content, "keys and values")
        self.name = name
        self.content: dict[Any, Any] = dict(content)
        self._known: list[str] = []

    def has(self, key: str) -> bool:
        """Whether the key is given, and was not taken yet."""
        self._known.append(key)
        return key in self.content

    def take(self, key: Any, *default: Any) -> Any:
        """Remove and return the value, unchecked; without a default, the key is required."""
        self._known.append(key)
        if key not in self.content and not default:
            raise ConfigError(f"{self._called(key)} is missing")
        return self.content.pop(key, *default)

    def text(self, key: str, default: str | None = None) -> str:
        """Take a text that is not empty; only the default may be empty."""
        if not self.has(key) and default is not None:
            return default
        return check_text(self._called(key), self.take(key))

    def one_of(self, key: str, names: Collection[str]) -> str:
        """Take a value that is one of `names`."""
        value = self.take(key)
        if value not in names:
            raise wrong(self._called(key), value, f"one of {', '.join(names)}")
        return str(value)

    def number(
        self, key: str, default: float, low: float = -math.inf, high: float = math.inf
    ) -> float:
        """Take a number from `low` to `high`."""
        value = self.take(key, default)
        if value is not default and not is_number(value):
            raise wrong(self._called(key), value, "a number")
        if not low <= value <= high:
            raise wrong(self._called(key), value, f"{low:g} to {high:g}")
        return float(value)

    def end(self) -> None:
        """Raise ConfigError if a key was not taken."""
        known = ", ".join(dict.fromkeys(self._known))
        for key in self.content:
            raise ConfigError(f"{self._called(shown(key))} is not known, expected one of {known}")

    def _called(self, key: object) -> str:
        return f"{self.name}.{key}" if self.name else str(key)


def wrong(what: str, value: Any, expected: str) -> ConfigError:
    """Return the error about a key, its value, and what was expected."""
    return ConfigError(f"{what} is {shown(value)}, expected {expected}")


def check_text(what: str, value: Any) -> str:
    """Return the value, or raise ConfigError unless it is printable text of a valid length."""
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
    """The value for an error message; long text and nested content are cut."""
    try:
        text = _SHORT.repr(value)
    except ValueError:  # an integer of thousands of digits
        text = f"a very large {type(value).__name__}"
    return cut(text, 80)


@dataclass(frozen=True, slots=True)
class Value:
    """Where a sensor's number is in a source's data, and how to convert it to our unit.

    A reading is raw * factor + offset; one below `low` or above `high` is rejected.
    """

    path: str = ""
    factor: float = 1.0
    offset: float = 0.0
    low: float = -math.inf
    high: float = math.inf

    def convert(self, raw: float) -> float:
        """Convert a number to the sensor's unit, without noise: 0.55 * 100 is 55 to people."""
        if (self.factor, self.offset) == (1.0, 0.0) or not math.isfinite(raw):
            return raw * self.factor
        of, factor, offset = (Decimal(repr(it)) for it in (raw, self.factor, self.offset))
        return float(f"{of * factor + offset:.15g}")

    def reading(self, raw: Any, what: str) -> float:
        """Convert a number, or its text, to the sensor's unit.

        Raises:
            Rejected: it is not a number, or out of range; `what` names it in the message.

        """
        try:
            # In Python, true is a number; as a temperature, it is not.
            number = self.convert(float("" if isinstance(raw, bool) else raw))
        except (TypeError, ValueError, OverflowError):
            raise Rejected(f"{what} is {shown(raw)}, expected a number") from None
        if not math.isfinite(number):
            raise Rejected(f"{what} is {number:g}, expected a finite number")
        if not self.low <= number <= self.high:
            raise Rejected(f"{what} is {number:g}, must be from {self.low:g} to {self.high:g}")
        return number


AS_IT_IS: Final = Value()
# A number above this is milliseconds since the epoch, not seconds: as seconds, the year 5138.
_MILLISECONDS: Final = 1e11


def seconds_of(stamp: Any, zone: tzinfo | None) -> float:
    """Parse a time, given as ISO 8601 or in s, ms, µs or ns since 1970; returns s since 1970.

    ISO 8601 without an offset is in `zone`.

    Raises:
        Rejected: it is not a time since 1970, or needs a `zone`.

    """
    number = None
    # Most stamps are dates; failing to parse each as a number first would be slow.
    if not isinstance(stamp, bool) and not (isinstance(stamp, str) and stamp[4:5] == "-"):
        with suppress(TypeError, ValueError, OverflowError):
            number = float(stamp)
    if number is not None:
        unit = next((size for size in (1e9, 1e6, 1e3) if number > _MILLISECONDS * size / 1e3), 1.0)
        seconds = number / unit
        if not 0 < seconds < _MILLISECONDS:
            raise Rejected("the time is not a moment since 1970")
        return seconds
    try:
        moment = datetime.fromisoformat(stamp.strip())
    except (AttributeError, ValueError):
        raise Rejected("the time is neither ISO 8601 nor seconds since 1970") from None
    if moment.tzinfo is None:
        if zone is None:
            raise Rejected("the time has no offset, and time_zone is not given")
        moment = moment.replace(tzinfo=zone)
    seconds = moment.timestamp()
    if seconds <= 0:
        raise Rejected("the time is before 1970")
    return seconds


def number_of(message: object, path: str) -> float:
    """Return the number at a path in a message, such as `data` or `axes[2].value`.

    Raises:
        Rejected: there is no number.

    """
    value: Any = message
    try:
        for part in path.split("."):
            name, _, index = part.partition("[")
            value = getattr(value, name)
            if index:
                value = value[int(index[:-1])]
        if isinstance(value, str | bytes):
            raise TypeError(f"it is {shown(value)}, expected a number")  # noqa: TRY301
        return float(value)
    except (AttributeError, LookupError, TypeError, ValueError) as error:
        raise Rejected(f"field {path}: {error}") from None


def value_of(table: Table, path: str = "", factor: float = 1.0) -> Value:
    """Read the keys `factor`, `offset`, `min` and `max` of a table.

    Raises:
        ConfigError: one of them is invalid.

    """
    value = Value(
        path,
        factor=table.number("factor", factor),
        offset=table.number("offset", 0.0),
        low=table.number("min", -math.inf),
        high=table.number("max", math.inf),
    )
    if value.low > value.high:
        raise ConfigError(f"{table.name}.min is {value.low:g}, above max, {value.high:g}")
    return value


def values_of(table: Table, key: str) -> dict[str, Value]:
    """Read the values by sensor, each a path alone or a table with the path under `key`.

    Raises:
        ConfigError: there are too many, or one of them is invalid.

    """
    if len(table.content) > MAX_SENSORS_PER_TAG:
        raise ConfigError(f"{table.name}: more than {MAX_SENSORS_PER_TAG}, the limit")
    values = {}
    for name in tuple(table.content):
        given = table.take(name)
        if isinstance(given, str):
            values[str(name)] = Value(given)
            continue
        each = Table(f"{table.name}.{name}", given)
        values[str(name)] = value_of(each, each.text(key))
        each.end()
    return values
