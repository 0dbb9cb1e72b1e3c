"""Query strings: how they are parsed, moments in them, and the parameters of past queries. Pure.

Each kind has a dataclass of its parameters, which parses it and describes it to OpenAPI. pydantic
is imported only to parse: the process that reads the past uses this module without it. Moments are
exact to the nanosecond. Also reads If-None-Match, the other thing that a query of the past has.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import MISSING, dataclass, field, fields
from datetime import UTC, datetime, timedelta
from functools import cache
from typing import Annotated, Any, Final, Literal, TypeVar

from annotated_types import Interval, Len

from lupin_twin.core.drops import MAX_TEXT_LENGTH
from lupin_twin.core.past import (
    DEFAULT_POINTS,
    MAX_POINTS,
    Event,
    NotRemembered,
    PastRefused,
    check_moment,
    seconds,
)
from lupin_twin.core.state import NANOSECONDS_PER_SECOND

QueryT = TypeVar("QueryT")
# (name, value) of each.
Parameters = Sequence[tuple[str, str]]
MOMENT: Final = "ROS seconds as a decimal number, or ISO 8601 with an offset"
AT: Final = f"as of this moment: {MOMENT}; default: now"
_UNSAFE_IN_NAME: Final = re.compile(r"[^A-Za-z0-9._-]")
# The name of a tag or of a sensor.
Name = Annotated[str, Len(1, MAX_TEXT_LENGTH)]


def parameter(description: str, default: Any = None) -> Any:
    """An optional parameter of a query; a field named like a Python keyword ends in `_`."""
    return field(default=default, metadata={"description": description})


def needed(description: str) -> Any:
    """A required parameter of a query."""
    return field(metadata={"description": description})


def read(kind: type[QueryT], given: Parameters) -> QueryT:
    """Parse a query string's parameters into a query, a dataclass of this kind.

    An unknown or repeated parameter is refused: it is usually a typing error, which would otherwise
    go unseen.

    Raises:
        PastRefused: an unknown or repeated parameter, or an invalid value.

    """
    from pydantic import ValidationError  # noqa: PLC0415  # see above

    names = {spec.name.rstrip("_"): spec.name for spec in fields(kind)}  # type: ignore[arg-type]
    values: dict[str, str] = {}
    for name, value in given:
        if name not in names:
            raise PastRefused(
                f"parameter {name[:64]!r} is unknown, expected {', '.join(names) or 'none'}"
            )
        if names[name] in values:
            raise PastRefused(f"{name} is given more than once, expected one value")
        if "\0" in value:  # PostgreSQL has no such text, and ROS no such name
            raise PastRefused(f"{name} is {value[:64]!r}, which has a NUL character")
        values[names[name]] = value
    try:
        query: QueryT = _adapter(kind).validate_python(values)  # type: ignore[arg-type]  # hashable
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        name, why = str(first["loc"][0]).rstrip("_"), first["msg"]
        shown = f" is {first['input'][:64]!r}" if isinstance(first["input"], str) else ""
        raise PastRefused(f"{name}{shown}: {why[0].lower()}{why[1:]}") from None
    return query


@dataclass(frozen=True, slots=True)
class NoParameters:
    """The query of a route that has no parameters."""


def parameters_of(kind: type[Any]) -> list[dict[str, Any]]:
    """A query's parameters as OpenAPI describes them."""
    described = _adapter(kind).json_schema()["properties"]  # type: ignore[arg-type]  # as above
    return [
        {
            "name": spec.name.rstrip("_"),
            "in": "query",
            "required": spec.default is MISSING,
            "schema": _plain(described[spec.name]),
            "description": spec.metadata["description"],
        }
        for spec in fields(kind)
    ]


def safe_name(text: str) -> str:
    """A file name: characters that are special to a file system or a shell become underscores."""
    return _UNSAFE_IN_NAME.sub("_", text)


def matches(if_none_match: str | None, tag: str) -> bool:
    """Whether an If-None-Match header names this ETag (RFC 9110, section 13.1.2: weakly)."""
    if not if_none_match:
        return False
    candidates = [part.strip() for part in if_none_match.split(",")]
    return "*" in candidates or tag in [part.removeprefix("W/") for part in candidates]


def _plain(schema: dict[str, Any]) -> dict[str, Any]:
    """A JSON schema without null: a query string omits the parameter instead."""
    kinds = schema.get("anyOf", [schema])
    plain = next(kind for kind in kinds if kind.get("type") != "null")
    if schema.get("default") is not None:
        plain = {**plain, "default": schema["default"]}
    return {name: value for name, value in plain.items() if name not in ("title", "description")}


@cache
def _adapter(kind: type[Any]) -> Any:
    from pydantic import TypeAdapter  # noqa: PLC0415  # as above

    return TypeAdapter(kind)


# --- moments --------------------------------------------------------------------------------------

# builtin_interfaces/Time has its seconds as int32.
MAX_SECONDS: Final = 2**31 - 1

_SECONDS: Final = re.compile(r"([0-9]+)(?:\.([0-9]+))?", re.ASCII)
# In a query string, `+01:00` is decoded as ` 01:00`.
_ISO: Final = re.compile(
    r"(\d{4}-\d\d-\d\d[Tt](?:[01]\d|2[0-3]):\d\d(?::\d\d(?:\.(\d+))?)?)"
    r"([Zz]|[+ -]\d\d:?[0-5]\d)",
    re.ASCII,
)
_EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)
_SECONDS_A_DAY: Final = 86_400


def moment(name: str, text: str) -> int:
    """Parse a moment in a query string, ns of ROS time; finer fractions are truncated.

    Raises:
        PastRefused: not a moment, one before 0, or past the range of ROS time.

    """
    text = text.strip(" ")
    if plain := _SECONDS.fullmatch(text):
        whole, fraction = plain.groups()
        # Compare lengths first: int() is slow for a thousand digits.
        seconds = int(whole) if len(whole.lstrip("0")) <= len(str(MAX_SECONDS)) else None
    elif iso := _ISO.fullmatch(text):
        shown, fraction, offset = iso.groups()
        shown = shown.partition(".")[0] + offset.replace(" ", "+")
        try:
            seconds = (datetime.fromisoformat(shown.upper()) - _EPOCH) // timedelta(seconds=1)
        except ValueError as error:
            raise PastRefused(f"{name} is {text[:64]!r}: {error}") from None
    else:
        raise PastRefused(f"{name} is {text[:64]!r}, expected {MOMENT}")
    if seconds is None or seconds > MAX_SECONDS:
        raise PastRefused(f"{name} is {text[:64]!r}, the limit is {MAX_SECONDS} s of ROS time")
    if seconds < 0:
        raise PastRefused(f"{name} is {text[:64]!r}, which is before 0 s of ROS time")
    return seconds * NANOSECONDS_PER_SECOND + int(f"{fraction or '':<09.9}")


def iso(stamp_ns: int) -> str:
    """A moment as ISO 8601 in UTC, to the nanosecond: `2026-11-21T14:15:00.000000000Z`."""
    whole, rest = divmod(stamp_ns, NANOSECONDS_PER_SECOND)
    return f"{datetime.fromtimestamp(whole, UTC):%Y-%m-%dT%H:%M:%S}.{rest:09d}Z"


def compact(stamp_ns: int) -> str:
    """A moment for a file's name, to the second: `20261121T141500Z`."""
    whole = stamp_ns // NANOSECONDS_PER_SECOND
    return f"{datetime.fromtimestamp(whole, UTC):%Y%m%dT%H%M%SZ}"


# --- parameters of queries about the past ---------------------------------------------------------

_FROM: Final = f"start of the period: {MOMENT}; default: the oldest in the journal"
_TO: Final = "end of the period, exclusive, in the form of `from`; default: now"
_POINTS: Final = "maximum number of readings or buckets"
_ONE_TAG: Final = "this tag only; default: all"
Points = Annotated[int, Interval(ge=1, le=MAX_POINTS)]


@dataclass(frozen=True, slots=True)
class OfMoment:
    """A query string whose only parameter is a moment."""

    at: str | None = parameter(AT)


@dataclass(frozen=True, slots=True)
class OfPeriod:
    """The parameters of a period."""

    from_: str | None = parameter(_FROM)
    to: str | None = parameter(_TO)

    def span(self, now_ns: int | None) -> tuple[int, int]:
        """Start and end, ns of ROS time; start 0: the oldest; end 0: now; `now_ns` None: not known.

        Raises:
            PastRefused: not a moment, or an invalid period.

        """
        start_ns = 0 if self.from_ is None else moment("from", self.from_)
        if self.to is not None:
            end_ns = moment("to", self.to)
            if end_ns == 0:
                raise PastRefused("to is 0 s of ROS time, must be later")
            if end_ns < start_ns:
                raise PastRefused(f"to is {seconds(end_ns)} s, before from, {seconds(start_ns)} s")
            return start_ns, end_ns
        if now_ns is not None and start_ns > now_ns:
            raise PastRefused(f"from is {seconds(start_ns)} s, later than now, {seconds(now_ns)} s")
        return start_ns, 0


@dataclass(frozen=True, slots=True, kw_only=True)
class OfHistory(OfPeriod):
    """The parameters of `/api/history`."""

    tag_id: Name = needed("id of a tag; for events, `*` is the whole greenhouse")
    sensor_type: Name = needed(
        f"name of a sensor, as in a reading; or an event: {', '.join(Event)}"
    )
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
        "1: only active alarms; 0: only cleared ones; default: all"
    )


@dataclass(frozen=True, slots=True)
class OfNotes(OfPeriod):
    """The parameters of `/api/notes`."""

    subject: str | None = parameter("only about this: `alarm:ID`, `tag:ID` or `site`; default: all")


# The default length of a report's period: a shift.
SHIFT_S: Final = 8 * 3_600
MAX_REPORT_DAYS: Final = 31


@dataclass(frozen=True, slots=True)
class OfReport:
    """The parameters of `/api/report`."""

    from_: str | None = parameter(f"start of the period: {MOMENT}; default: 8 h before `to`")
    to: str | None = parameter(_TO)


@dataclass(frozen=True, slots=True)
class OfReportPage(OfReport):
    """The parameters of `/api/report.html`."""

    lang: Literal["en", "de", "nl", "es"] = parameter("language of the page", "en")
    time_zone: str | None = parameter(
        "time zone of the page's times, such as Europe/Amsterdam; default: the setting "
        "`time_zone`, also if this machine does not know the zone"
    )


@dataclass(frozen=True, slots=True)
class OfExport(OfPeriod):
    """The parameters of an export."""

    tag_id: Name | None = parameter(_ONE_TAG)
    sensor_type: Name | None = parameter("this sensor only; default: all")


def at(parameters: Parameters, now_ns: int | None) -> int | None:
    """The moment of `at`, ns of ROS time; None: now. `now_ns` None: not known.

    Raises:
        PastRefused: anything but one `at`, or a moment in the future.

    """
    return at_of(read(OfMoment, parameters).at, now_ns)


def at_of(text: str | None, now_ns: int | None) -> int | None:
    """As `at`, of a query that is already parsed.

    Raises:
        PastRefused: not a moment, or one in the future.

    """
    if text is None:
        return None
    at_ns = moment("at", text)
    if now_ns is not None:
        check_moment(at_ns, now_ns)
    return at_ns


def report(given: OfReport, now_ns: int | None) -> tuple[int, int]:
    """The period of a report, ns of ROS time; it ends now at the latest.

    Raises:
        PastRefused: the period is empty or too long.
        NotRemembered: what time it is now is not known.

    """
    to_ns = None if given.to is None else moment("to", given.to)
    if now_ns is None:
        to = "missing" if to_ns is None else f"{seconds(to_ns)} s"
        raise NotRemembered(f"to is {to}, and what time it is now is not known here")
    end_ns = now_ns if to_ns is None else min(to_ns, now_ns)
    shift_ns = SHIFT_S * NANOSECONDS_PER_SECOND
    start_ns = max(0, end_ns - shift_ns) if given.from_ is None else moment("from", given.from_)
    if start_ns >= end_ns:
        raise PastRefused(f"from is {seconds(start_ns)} s, must be before to, {seconds(end_ns)} s")
    days = (end_ns - start_ns) / (_SECONDS_A_DAY * NANOSECONDS_PER_SECOND)
    if days > MAX_REPORT_DAYS:
        raise PastRefused(f"from and to are {days:.1f} days apart, the limit is {MAX_REPORT_DAYS}")
    return start_ns, end_ns
