"""Queries about the past: what may be requested, and the answers. Pure.

Times are nanoseconds of ROS time, intervals `start <= stamp < end`. Where the clock has gone
back, a moment belongs to the newest run that holds it.

Followers of a log ask for what was received, write by write, in that order: with the number of the
last one they get what has come since, late observations too, and nothing twice.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from lupin_twin.core.drops import too_long
from lupin_twin.core.state import NANOSECONDS_PER_SECOND, value

# How a message ends of what may be answered a little later, if it is requested again.
ASK_AGAIN: Final = "ask again later"

DEFAULT_POINTS: Final = 500
MAX_POINTS: Final = 5_000
# What is derived of a series is made of so many of its readings at most: four weeks, one a minute.
MAX_READINGS: Final = 8 * MAX_POINTS
# Longer buckets begin on whole ones.
SLOT_NS: Final = 300 * 1_000_000_000
# What is counted as it is written.
HOUR_NS: Final = 3_600 * 1_000_000_000
DAY_NS: Final = 24 * HOUR_NS
# Later than any stamp; the largest that SQLite counts to.
FOREVER_NS: Final = 2**63 - 1
# The `tag_id` of a query for events of the whole site.
EVERY_TAG: Final = "*"


class Event(StrEnum):
    """Requested like a sensor; units and values stand in GetHistory.srv."""

    SCANS = "~scans"
    FAILURES = "~failures"
    INSPECTIONS = "~looks"
    PESTS_SEEN = "~pests_seen"
    PESTS_CLEARED = "~pests_cleared"
    SILENCES = "~silences"
    RUNS = "~runs"


class PastRefused(ValueError):
    """A question that cannot be answered; the message names the field, the value and the limit."""


class NotRemembered(RuntimeError):
    """The past cannot be read now; the message says why.

    `damage` is what is wrong with the file, if something is.
    """

    def __init__(self, why: str, *, damage: str = "") -> None:
        super().__init__(why)
        self.damage = damage


class NotFound(NotRemembered):
    """What is asked for is not there, however often it is asked for."""


def check_moment(at_ns: int, now_ns: int) -> None:
    """Refuse a moment that has not come yet, by ROS time, or that no clock can show.

    Raises:
        PastRefused: see above.

    """
    if at_ns < 0:
        raise PastRefused(f"at is {seconds(at_ns)} s, before 0")
    if at_ns > now_ns:
        raise PastRefused(f"at is {seconds(at_ns)} s, later than now, {seconds(now_ns)} s")


def seconds(stamp_ns: int) -> str:
    """A moment in seconds of ROS time, every digit of it."""
    whole, part = divmod(abs(stamp_ns), NANOSECONDS_PER_SECOND)
    return f"{'-' if stamp_ns < 0 else ''}{whole}.{part:09d}"


def message_of(error: Exception) -> str:
    """Why there is no answer, as a service's `error_message` that `error_of` reads again."""
    why = str(error)
    if isinstance(error, PastRefused):
        return why
    if not isinstance(error, NotRemembered):
        why = f"the twin failed to answer: {why}"
    return why if why.endswith(ASK_AGAIN) else f"{why}: {ASK_AGAIN}"


def error_of(message: str) -> PastRefused | NotRemembered:
    """What a service's `error_message` says: the other direction of `message_of`."""
    return NotRemembered(message) if message.endswith(ASK_AGAIN) else PastRefused(message)


@dataclass(frozen=True, slots=True)
class SeriesRequest:
    """One sensor of one tag, or one event, see GetHistory.srv: `end_ns` 0 is now, `start_ns` 0 all.

    Raises:
        PastRefused: an empty name, an interval that is inverted, more points than are given.

    """

    tag_id: str
    sensor_type: str
    start_ns: int = 0
    end_ns: int = 0
    max_points: int = DEFAULT_POINTS

    def __post_init__(self) -> None:
        """Refuse what cannot be answered."""
        if not self.tag_id:
            raise PastRefused("tag_id is empty")
        if not self.sensor_type:
            raise PastRefused("sensor_type is empty")
        for name in ("tag_id", "sensor_type"):
            if why := too_long(name, getattr(self, name)):
                raise PastRefused(why)
        self._check_event()
        if self.start_ns < 0 or self.end_ns < 0:
            raise PastRefused(f"start or end is {min(self.start_ns, self.end_ns)} ns, before 0")
        if self.end_ns and self.end_ns < self.start_ns:
            raise PastRefused(f"end {self.end_ns} ns is before start {self.start_ns} ns")
        if not 1 <= self.max_points <= MAX_READINGS:
            raise PastRefused(
                f"max_points is {self.max_points}, the limits are 1 and {MAX_READINGS}"
            )

    def _check_event(self) -> None:
        if self.sensor_type.startswith("~") and self.sensor_type not in set(Event):
            raise PastRefused(
                f"sensor_type {self.sensor_type[:64]!r} is none of {', '.join(Event)}"
            )
        if self.event is Event.RUNS and self.tag_id != EVERY_TAG:
            raise PastRefused(
                f"tag_id is {self.tag_id[:64]!r}, and ~runs are those of {EVERY_TAG!r}"
            )
        if self.event is None and self.tag_id == EVERY_TAG:
            raise PastRefused(
                f"tag_id is {EVERY_TAG!r}, which has events alone, and sensor_type is "
                f"{self.sensor_type[:64]!r}: expected one tag, or one of {', '.join(Event)}"
            )

    @property
    def event(self) -> Event | None:
        """The event that is requested, None for a sensor."""
        return Event(self.sensor_type) if self.sensor_type.startswith("~") else None


@dataclass(frozen=True, slots=True)
class Grid:
    """Buckets of one length that cover a period: the first begins at `start_ns`."""

    start_ns: int
    end_ns: int
    bucket_ns: int


def grid(start_ns: int, end_ns: int, max_points: int, least_ns: int = 0) -> Grid:
    """At most `max_points` buckets of at least `least_ns` over a period.

    Up to five minutes they begin at `start_ns` and are as short as they can be. Longer ones are of
    whole five minutes, beyond an hour of whole hours, and the period is widened to those: what is
    counted already is not read again.
    """
    needed_ns = max(1, -(-(end_ns - start_ns) // max_points))
    if max(needed_ns, least_ns) < SLOT_NS:
        return Grid(start_ns, end_ns, needed_ns)
    for unit_ns in (SLOT_NS, HOUR_NS):
        start = start_ns // unit_ns * unit_ns
        end = -(-end_ns // unit_ns) * unit_ns
        needed_ns = max(1, -(-(end - start) // max_points))
        bucket_ns = -(-max(needed_ns, least_ns) // unit_ns) * unit_ns
        if bucket_ns < HOUR_NS:
            break
    return Grid(start, end, bucket_ns)


@dataclass(frozen=True, slots=True)
class SeriesPast:
    """Readings, or buckets of `bucket_ns` from `start_ns` on; all tuples have one length.

    Of a reading the count is 1, and mean, minimum and maximum are its value, which may be NaN. A
    bucket counts finite readings; one without any is absent. Stamps ascend. The period of buckets
    is that of their `grid`: it may begin earlier and end later than what was requested.
    """

    start_ns: int
    end_ns: int
    bucket_ns: int | None = None
    stamps_ns: tuple[int, ...] = ()
    counts: tuple[int, ...] = ()
    means: tuple[float, ...] = ()
    minima: tuple[float, ...] = ()
    maxima: tuple[float, ...] = ()

    @property
    def is_bucketed(self) -> bool:
        """Whether entries are buckets."""
        return self.bucket_ns is not None


@value
class PastRow:
    """One reading, or one try that brought none (`sensor` is empty, `value` NaN), for an export.

    `x` and `y` are m in the map frame, NaN for a tag without a place. `status` and `source` as in
    lupin_msgs/Observation; `source` is empty where it is not known.
    """

    stamp_ns: int
    tag_id: str
    x: float
    y: float
    sensor: str
    value: float
    status: int
    source: str


DEFAULT_WRITES: Final = 1_000
MAX_WRITES: Final = 2_000
# Of each tag, what is recent at a moment: its last scans and inspections, so many of each, and no
# older.
RECENT_COUNT: Final = 9
RECENT_NS: Final = 3 * DAY_NS
# Scans of one answer: some seconds of one core.
MAX_SCANS: Final = 200_000


@dataclass(frozen=True, slots=True)
class WritesRequest:
    """Writes with a number above `after`, at most `max_count`; 0: from the beginning.

    From the beginning, what was received more than `reach_s` before now is left out, and all but
    the newest `reach_count` writes; 0: nothing is.

    Raises:
        PastRefused: a number that cannot be, or more than is given.

    """

    after: int = 0
    reach_s: float = 0.0
    reach_count: int = 0
    max_count: int = DEFAULT_WRITES

    def __post_init__(self) -> None:
        """Refuse what cannot be answered."""
        if self.after > FOREVER_NS:
            raise PastRefused(f"after is {self.after}, the limit is {FOREVER_NS}")
        if not 0.0 <= self.reach_s <= 1e9:
            raise PastRefused(f"reach_s is {self.reach_s}, the limits are 0 and 1e9 s")
        if not 1 <= self.max_count <= MAX_WRITES:
            raise PastRefused(f"max_count is {self.max_count}, the limits are 1 and {MAX_WRITES}")


@dataclass(frozen=True, slots=True)
class RecentRequest:
    """What was recent at a moment, ns of ROS time: see `RECENT_COUNT`.

    Of the run that has the moment, without the copies that a run begins with. The answer is a tuple
    of `PastWrite`, by stamp and number: scans with readings, inspections that saw flowers.
    """

    at_ns: int


@dataclass(frozen=True, slots=True)
class ScansRequest:
    """All scans of one of `sensors` from `since_ns` to `at_ns`, both included, ns of ROS time.

    Of the run that has `at_ns`, without copies. The answer is a tuple of `PastWrite`, by stamp and
    number; it is empty if there are more than `MAX_SCANS`.
    """

    since_ns: int
    at_ns: int
    sensors: frozenset[str]


@dataclass(frozen=True, slots=True)
class PeriodRequest:
    """All that was observed in `start_ns <= stamp < end_ns`, by stamp and number, without copies.

    The answer is `PastWrites`. Who requests it knows that it is not too much at once.
    """

    start_ns: int
    end_ns: int


@dataclass(frozen=True, slots=True)
class PastWrite:
    """One scan or inspection, or an attempt; `kind` and `status` as in lupin_msgs/Observation.

    `sensors` and `values` have one length. `has_seen`: it saw the flowers; the last three
    are what it saw. A species that the camera was not sure of is left out.
    """

    number: int
    run: int
    tag_id: str
    stamp_ns: int
    kind: int
    status: int
    sensors: tuple[str, ...] = ()
    values: tuple[float, ...] = ()
    has_seen: bool = False
    species: str = ""
    anomaly: bool = False
    bug_count: int = 0


@dataclass(frozen=True, slots=True)
class RunSpan:
    """A stretch of the axis of time, `start_ns <= stamp < end_ns`, and the run that has it."""

    run: int
    start_ns: int
    end_ns: int


def recent_of(writes: Iterable[PastWrite], at_ns: int) -> tuple[PastWrite, ...]:
    """What is recent at a moment, of writes of one run in any order."""
    by_tag: dict[tuple[str, int], list[PastWrite]] = {}
    for write in writes:
        is_in_time = at_ns - RECENT_NS <= write.stamp_ns <= at_ns
        if is_in_time and (write.values or write.has_seen):
            by_tag.setdefault((write.tag_id, write.kind), []).append(write)
    found: list[PastWrite] = []
    for mine in by_tag.values():
        mine.sort(key=_in_time)
        stamps = sorted({write.stamp_ns for write in mine})[-RECENT_COUNT:]
        found += [write for write in mine if write.stamp_ns >= stamps[0]]
    return tuple(sorted(found, key=_in_time))


def _in_time(write: PastWrite) -> tuple[int, int]:
    return write.stamp_ns, write.number


@dataclass(frozen=True, slots=True)
class PastWrites:
    """Some writes, in the order of their numbers; ask on after `last`, until `is_all`.

    `journal` identifies the file: numbers of two are not comparable.
    """

    journal: str
    spans: tuple[RunSpan, ...]
    writes: tuple[PastWrite, ...]
    last: int
    is_all: bool
