"""Moments of ROS time as text, exact to the nanosecond: never through a float. Pure."""

from __future__ import annotations

import re
from datetime import UTC, date, datetime
from typing import Final

from lupin_bridge.query_string import MOMENT
from lupin_twin.past import PastRefused
from lupin_twin.state import NANOSECONDS_PER_SECOND

# builtin_interfaces/Time has its seconds as int32.
MAX_SECONDS: Final = 2**31 - 1

_SECONDS: Final = re.compile(r"([0-9]+)(?:\.([0-9]+))?", re.ASCII)
# In a query string, `+01:00` reads ` 01:00`.
_ISO: Final = re.compile(
    r"([0-9]{4})-([0-9]{2})-([0-9]{2})[Tt]([0-9]{2}):([0-9]{2})(?::([0-9]{2})(?:\.([0-9]+))?)?"
    r"(?:[Zz]|([+ -])([0-9]{2}):?([0-9]{2}))",
    re.ASCII,
)
_EPOCH: Final = date(1970, 1, 1).toordinal()
_SECONDS_A_DAY: Final = 86_400


def moment(name: str, text: str) -> int:
    """A moment in a query string, ns of ROS time; what is finer than a nanosecond is cut off.

    Raises:
        PastRefused: no moment, one before 0, or past what ROS time holds.

    """
    text = text.strip(" ")
    if plain := _SECONDS.fullmatch(text):
        whole, fraction = plain.groups()
        # As text: int() takes its time for a thousand digits.
        seconds = int(whole) if len(whole.lstrip("0")) <= len(str(MAX_SECONDS)) else None
    elif iso := _ISO.fullmatch(text):
        seconds, fraction = _unix_seconds(name, text, iso), iso.group(7)
    else:
        raise PastRefused(f"{name} is {text[:64]!r}, expected {MOMENT}")
    if seconds is None or seconds > MAX_SECONDS:
        raise PastRefused(f"{name} is {text[:64]!r}, the limit is {MAX_SECONDS} s of ROS time")
    if seconds < 0:
        raise PastRefused(f"{name} is {text[:64]!r}, which is before 0 s of ROS time")
    return seconds * NANOSECONDS_PER_SECOND + int(f"{fraction or '':<09.9}")


def _unix_seconds(name: str, text: str, iso: re.Match[str]) -> int:
    year, month, day, hour, minute = (int(part) for part in iso.groups()[:5])
    second, sign = int(iso.group(6) or 0), iso.group(8)
    offset_hours, offset_minutes = int(iso.group(9) or 0), int(iso.group(10) or 0)
    try:
        days = date(year, month, day).toordinal() - _EPOCH
    except ValueError as error:
        raise PastRefused(f"{name} is {text[:64]!r}: {error}") from None
    if hour > 23 or minute > 59 or second > 59 or offset_hours > 23 or offset_minutes > 59:
        raise PastRefused(f"{name} is {text[:64]!r}, which no clock shows")
    offset = (offset_hours * 60 + offset_minutes) * 60
    local = days * _SECONDS_A_DAY + (hour * 60 + minute) * 60 + second
    return local + offset if sign == "-" else local - offset


def iso(stamp_ns: int) -> str:
    """A moment as ISO 8601 in UTC, to the nanosecond: `2026-11-21T14:15:00.000000000Z`."""
    whole, rest = divmod(stamp_ns, NANOSECONDS_PER_SECOND)
    return f"{datetime.fromtimestamp(whole, UTC):%Y-%m-%dT%H:%M:%S}.{rest:09d}Z"


def compact(stamp_ns: int) -> str:
    """A moment for a file's name, to the second: `20261121T141500Z`."""
    whole = stamp_ns // NANOSECONDS_PER_SECOND
    return f"{datetime.fromtimestamp(whole, UTC):%Y%m%dT%H%M%SZ}"
