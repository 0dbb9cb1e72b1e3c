"""What a query string asks of the past. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Final, Literal

from annotated_types import Interval

from lupin_bridge.past.moments import moment
from lupin_bridge.query_string import AT, MOMENT, Name, needed, parameter, read
from lupin_twin.past import (
    DEFAULT_POINTS,
    MAX_POINTS,
    Event,
    PastRefused,
    SeriesRequest,
    check_moment,
    seconds,
)

Parameters = Sequence[tuple[str, str]]

_FROM: Final = f"{MOMENT}; default: the oldest that is kept"
_TO: Final = "as `from`; this moment itself is not in the period; default: now"
_POINTS: Final = "at most so many readings or buckets"
_ONE_TAG: Final = "one tag alone; default: all"
Points = Annotated[int, Interval(ge=1, le=MAX_POINTS)]


@dataclass(frozen=True, slots=True)
class OfMoment:
    """A query string that has a moment alone."""

    at: str | None = parameter(AT)


@dataclass(frozen=True, slots=True)
class OfPeriod:
    """The parameters of a period."""

    from_: str | None = parameter(_FROM)
    to: str | None = parameter(_TO)


@dataclass(frozen=True, slots=True)
class OfHistory:
    """The parameters of `/api/history`."""

    tag_id: Name = needed("one tag; for events, `*` is the whole greenhouse")
    sensor_type: Name = needed(
        f"name of a sensor, as in a reading; or an event: {', '.join(Event)}"
    )
    from_: str | None = parameter(_FROM)
    to: str | None = parameter(_TO)
    points: Points = parameter(_POINTS, DEFAULT_POINTS)


@dataclass(frozen=True, slots=True)
class OfTimeline(OfPeriod):
    """The parameters of `/api/timeline`."""

    points: Points = parameter(_POINTS, DEFAULT_POINTS)
    tag_id: Name | None = parameter(_ONE_TAG)


@dataclass(frozen=True, slots=True)
class OfAlarms(OfPeriod):
    """The parameters of `/api/alarms`."""

    active: Literal["0", "1"] | None = parameter(
        "1: only those that have not been cleared, 0: only the others; default: all"
    )


@dataclass(frozen=True, slots=True)
class OfExport(OfPeriod):
    """The parameters of `/api/export.csv`."""

    tag_id: Name | None = parameter(_ONE_TAG)
    sensor_type: Name | None = parameter("one sensor alone; default: all")


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
    given = read(OfAlarms, parameters, PastRefused)
    active = None if given.active is None else given.active == "1"
    return AlarmsQuery(*_period(given, now_ns), active)


def at(parameters: Parameters, now_ns: int | None) -> int | None:
    """The moment that is asked for, ns; None: now. `now_ns` None: nobody knows when that is.

    Raises:
        PastRefused: anything but one `at`, or a moment that has not come.

    """
    return at_of(read(OfMoment, parameters, PastRefused).at, now_ns)


def at_of(text: str | None, now_ns: int | None) -> int | None:
    """`at`, where the other parameters are for somebody else.

    Raises:
        PastRefused: no moment, or one that has not come.

    """
    if text is None:
        return None
    at_ns = moment("at", text)
    if now_ns is not None:
        check_moment(at_ns, now_ns)
    return at_ns


def history(parameters: Parameters, now_ns: int | None) -> SeriesRequest:
    """What `/api/history` asks for.

    Raises:
        PastRefused: an unknown or repeated parameter, or a value that cannot be.

    """
    given = read(OfHistory, parameters, PastRefused)
    return SeriesRequest(given.tag_id, given.sensor_type, *_period(given, now_ns), given.points)


def timeline(parameters: Parameters, now_ns: int | None) -> TimelineQuery:
    """What `/api/timeline` asks for.

    Raises:
        PastRefused: see `history`.

    """
    given = read(OfTimeline, parameters, PastRefused)
    return TimelineQuery(*_period(given, now_ns), given.points, given.tag_id)


def export(parameters: Parameters, now_ns: int | None) -> ExportQuery:
    """What `/api/export.csv` asks for.

    Raises:
        PastRefused: see `history`.

    """
    given = read(OfExport, parameters, PastRefused)
    return ExportQuery(*_period(given, now_ns), given.tag_id, given.sensor_type)


def _period(given: OfPeriod | OfHistory, now_ns: int | None) -> tuple[int, int]:
    start_ns = 0 if given.from_ is None else moment("from", given.from_)
    if given.to is not None:
        end_ns = moment("to", given.to)
        if end_ns == 0:
            raise PastRefused("to is 0 s of ROS time, must be later")
        if end_ns < start_ns:
            raise PastRefused(f"to is {seconds(end_ns)} s, before from, {seconds(start_ns)} s")
        return start_ns, end_ns
    if now_ns is not None and start_ns > now_ns:
        raise PastRefused(f"from is {seconds(start_ns)} s, later than now, {seconds(now_ns)} s")
    return start_ns, 0
