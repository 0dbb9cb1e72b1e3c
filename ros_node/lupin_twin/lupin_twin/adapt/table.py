"""A file's mappings, taken key by key; a number or a moment of a source as a reading. Pure.

Every complaint names the key, its value and the limit.
"""

from __future__ import annotations

import math
import reprlib
from collections.abc import Collection
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime, tzinfo
from typing import Any, Final

from lupin_twin.core.drops import MAX_SENSORS_PER_TAG, MAX_TEXT_LENGTH, Rejected


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
        """A text that is not empty; the default may be."""
        if not self.has(key) and default is not None:
            return default
        return check_text(self._called(key), self.take(key))

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


@dataclass(frozen=True, slots=True)
class Value:
    """Where a source has a sensor's number, and how that becomes our unit.

    The number is value * factor + offset; what is then below `low` or above `high` is no reading.
    """

    path: str = ""
    factor: float = 1.0
    offset: float = 0.0
    low: float = -math.inf
    high: float = math.inf

    def reading(self, raw: Any, what: str) -> float:
        """The number in the sensor's unit, also of one that is written as text.

        Raises:
            Rejected: it is none, or out of range; `what` is its name.

        """
        try:
            # true is a number to Python, and none to who reads a temperature.
            number = float("" if isinstance(raw, bool) else raw) * self.factor + self.offset
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
    """A moment in seconds since 1970: of ISO 8601, or of such a number, or of ms, µs or ns.

    What has no offset is in `zone`.

    Raises:
        Rejected: it is none.

    """
    number = None
    # Most are dates: to find by an error that they are no numbers is slow.
    if not isinstance(stamp, bool) and not (isinstance(stamp, str) and stamp[4:5] == "-"):
        with suppress(TypeError, ValueError, OverflowError):
            number = float(stamp)
    if number is not None:
        unit = next((size for size in (1e9, 1e6, 1e3) if number > _MILLISECONDS * size / 1e3), 1.0)
        seconds = number / unit
        if not 0 < seconds < _MILLISECONDS:
            raise Rejected("the time is no moment since 1970")
        return seconds
    try:
        moment = datetime.fromisoformat(stamp.strip())
    except (AttributeError, ValueError):
        raise Rejected("the time is no ISO 8601, and no seconds since 1970") from None
    if moment.tzinfo is None:
        if zone is None:
            raise Rejected("the time has no offset, and time_zone is not given")
        moment = moment.replace(tzinfo=zone)
    seconds = moment.timestamp()
    if seconds <= 0:
        raise Rejected("the time is before 1970")
    return seconds


def number_of(message: object, path: str) -> float:
    """The number at a field's path of a message, such as `data` or `axes[2].value`.

    Raises:
        Rejected: there is none.

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
    """The keys `factor`, `offset`, `min` and `max` of a table.

    Raises:
        ConfigError: one of them cannot be.

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
    """By sensor its path alone, or a table with the path under `key`.

    Raises:
        ConfigError: there are too many, or one of them cannot be.

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
