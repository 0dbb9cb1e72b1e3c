"""What a query string asks of the past. Pure.

A query is refused, never guessed at: an unknown or repeated parameter is a typing error that would
otherwise go unseen.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from lupin_bridge.past.moments import moment
from lupin_bridge.query_string import values_of
from lupin_twin.bounds import MAX_TEXT_LENGTH
from lupin_twin.past import (
    DEFAULT_POINTS,
    MAX_POINTS,
    PastRefused,
    SeriesRequest,
    check_moment,
    seconds,
)

AT: Final = "at"
HISTORY_NAMES: Final = ("tag_id", "sensor_type", "from", "to", "points")
TIMELINE_NAMES: Final = ("from", "to", "points", "tag_id")
ALARMS_NAMES: Final = ("from", "to", "active")
EXPORT_NAMES: Final = ("from", "to", "tag_id", "sensor_type")

Parameters = Sequence[tuple[str, str]]


@dataclass(frozen=True, slots=True)
class TimelineQuery:
    """A period in at most so many buckets; 0 ns: from the oldest, to now. No tag: every one."""

    start_ns: int
    end_ns: int
    points: int
    tag_id: str | None


@dataclass(frozen=True, slots=True)
class ExportQuery:
    """The rows of a period; 0 ns: from the oldest, to now. None: every tag, every sensor."""

    start_ns: int
    end_ns: int
    tag_id: str | None
    sensor_type: str | None


@dataclass(frozen=True, slots=True)
class AlarmsQuery:
    """The alarms of a period; 0 ns: from the oldest, to now. `active` None: over or not."""

    start_ns: int
    end_ns: int
    active: bool | None


def alarms(parameters: Parameters, now_ns: int | None) -> AlarmsQuery:
    """What `/api/alarms` asks for.

    Raises:
        PastRefused: see `history`.

    """
    values = values_of(parameters, ALARMS_NAMES, PastRefused)
    active = values.get("active")
    if active not in (None, "0", "1"):
        raise PastRefused(f"active is {active[:64]!r}, not 0 or 1")
    return AlarmsQuery(*_period(values, now_ns), None if active is None else active == "1")


def at(parameters: Parameters, now_ns: int | None) -> int | None:
    """The moment that is asked for, ns; None: now. `now_ns` None: nobody knows when that is.

    Raises:
        PastRefused: anything but one `at`, or a moment that has not come.

    """
    return at_of(values_of(parameters, (AT,), PastRefused).get(AT), now_ns)


def at_of(text: str | None, now_ns: int | None) -> int | None:
    """`at`, where the other parameters are for somebody else.

    Raises:
        PastRefused: no moment, or one that has not come.

    """
    if text is None:
        return None
    at_ns = moment(AT, text)
    if now_ns is not None:
        check_moment(at_ns, now_ns)
    return at_ns


def history(parameters: Parameters, now_ns: int | None) -> SeriesRequest:
    """What `/api/history` asks for.

    Raises:
        PastRefused: an unknown or repeated parameter, or a value that cannot be.

    """
    values = values_of(parameters, HISTORY_NAMES, PastRefused)
    start_ns, end_ns = _period(values, now_ns)
    return SeriesRequest(
        _text(values, "tag_id") or "",
        _text(values, "sensor_type") or "",
        start_ns,
        end_ns,
        _points(values),
    )


def timeline(parameters: Parameters, now_ns: int | None) -> TimelineQuery:
    """What `/api/timeline` asks for.

    Raises:
        PastRefused: see `history`.

    """
    values = values_of(parameters, TIMELINE_NAMES, PastRefused)
    return TimelineQuery(*_period(values, now_ns), _points(values), _named(values, "tag_id"))


def export(parameters: Parameters, now_ns: int | None) -> ExportQuery:
    """What `/api/export.csv` asks for.

    Raises:
        PastRefused: see `history`.

    """
    values = values_of(parameters, EXPORT_NAMES, PastRefused)
    return ExportQuery(
        *_period(values, now_ns), _named(values, "tag_id"), _named(values, "sensor_type")
    )


def _period(values: Mapping[str, str], now_ns: int | None) -> tuple[int, int]:
    start_ns = moment("from", values["from"]) if "from" in values else 0
    if "to" in values:
        end_ns = moment("to", values["to"])
        if end_ns == 0:
            raise PastRefused("to is 0 s of ROS time, must be later")
        if end_ns < start_ns:
            raise PastRefused(f"to is {seconds(end_ns)} s, before from, {seconds(start_ns)} s")
        return start_ns, end_ns
    if now_ns is not None and start_ns > now_ns:
        raise PastRefused(f"from is {seconds(start_ns)} s, later than now, {seconds(now_ns)} s")
    return start_ns, 0


def _points(values: Mapping[str, str]) -> int:
    text = values.get("points", str(DEFAULT_POINTS))
    if not (text.isascii() and text.isdigit() and len(text) <= 9 and 1 <= int(text) <= MAX_POINTS):
        raise PastRefused(
            f"points is {text[:64]!r}, expected a whole number from 1 to {MAX_POINTS}"
        )
    return int(text)


def _named(values: Mapping[str, str], name: str) -> str | None:
    text = _text(values, name)
    if text == "":
        raise PastRefused(f"{name} is empty")
    return text


def _text(values: Mapping[str, str], name: str) -> str | None:
    text = values.get(name)
    if text is not None and len(text) > MAX_TEXT_LENGTH:
        raise PastRefused(
            f"{name} {text[:24]!r}… has {len(text)} characters, the limit is {MAX_TEXT_LENGTH}"
        )
    return text
