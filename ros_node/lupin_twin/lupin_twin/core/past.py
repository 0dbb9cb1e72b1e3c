"""Queries about the past: what may be requested, and the answers. Pure.

Times are nanoseconds of ROS time, intervals `start <= stamp < end`. If the clock went back, a
moment belongs to the latest run that contains it.

A follower of a journal requests the writes in the order in which they were received. With the
number of the last one, it gets all that followed, late observations included, and none twice.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise
from statistics import median
from typing import Final

from lupin_twin.core.drops import too_long
from lupin_twin.core.state import NANOSECONDS_PER_SECOND, Observation, value

# Ending of an error message if the same request may succeed a little later.
ASK_AGAIN: Final = "ask again later"

DEFAULT_POINTS: Final = 500
MAX_POINTS: Final = 5_000
# A derived series is made from at most this many readings: four weeks, one a minute.
MAX_READINGS: Final = 8 * MAX_POINTS
# Buckets from this length on start at multiples of it.
SLOT_NS: Final = 300 * 1_000_000_000
# The journal counts by the hour while it writes.
HOUR_NS: Final = 3_600 * 1_000_000_000
DAY_NS: Final = 24 * HOUR_NS
# A shorter time without an attempt is no silence, whatever scan interval is usual.
SILENCE_NS: Final = 600 * 1_000_000_000
# A silence is longer than this many scan intervals.
SILENT_INTERVALS: Final = 3
# Later than any stamp: the largest integer of SQLite.
FOREVER_NS: Final = 2**63 - 1
# The `tag_id` of a query for events of the whole site.
EVERY_TAG: Final = "*"


class Event(StrEnum):
    """Events, which are requested like a sensor; their units and values are in GetHistory.srv."""

    SCANS = "~scans"
    FAILURES = "~failures"
    INSPECTIONS = "~looks"
    PESTS_SEEN = "~pests_seen"
    PESTS_CLEARED = "~pests_cleared"
    SILENCES = "~silences"
    RUNS = "~runs"


class PastRefused(ValueError):
    """A request is invalid; the message names the field, the value and the limit."""


class NotRemembered(RuntimeError):
    """The past cannot be read now; the message says why.

    `damage` tells what is wrong with the file; empty if nothing is.
    """

    def __init__(self, why: str, *, damage: str = "") -> None:
        super().__init__(why)
        self.damage = damage


class NotFound(NotRemembered):
    """The requested data does not exist; repeating the request does not help."""


def interval_ns(scans_ns: Sequence[int]) -> int | None:
    """The median of the intervals between scans, oldest first; None: there are fewer than two."""
    if len(scans_ns) < 2:
        return None
    return int(median(after - before for before, after in pairwise(scans_ns)))


def usual_ns(tags: Iterable[Sequence[int]]) -> int | None:
    """The usual interval between two scans of the same tag, by each tag's last scans.

    Not of any two tags: a robot that rests after each round would seem to scan all the time.
    """
    found = [usual for scans_ns in tags if (usual := interval_ns(scans_ns)) is not None]
    return int(median(found)) if found else None


def silence_ns(tags: Iterable[Sequence[int]]) -> int:
    """How long a time without an attempt has to be to be a silence, by each tag's last scans."""
    return max(SILENCE_NS, SILENT_INTERVALS * (usual_ns(tags) or 0))


def check_moment(at_ns: int, now_ns: int) -> None:
    """Check a moment of ROS time.

    Raises:
        PastRefused: it is later than now, or before 0.

    """
    if at_ns < 0:
        raise PastRefused(f"at is {seconds(at_ns)} s, before 0")
    if at_ns > now_ns:
        raise PastRefused(f"at is {seconds(at_ns)} s, later than now, {seconds(now_ns)} s")


def seconds(stamp_ns: int) -> str:
    """A stamp in seconds, as text with all nine decimals."""
    whole, part = divmod(abs(stamp_ns), NANOSECONDS_PER_SECOND)
    return f"{'-' if stamp_ns < 0 else ''}{whole}.{part:09d}"


def message_of(error: Exception) -> str:
    """Make a service's `error_message`, which `error_of` reads, from an error."""
    why = str(error)
    if isinstance(error, PastRefused):
        return why
    if not isinstance(error, NotRemembered):
        why = f"the twin failed to answer: {why}"
    return why if why.endswith(ASK_AGAIN) else f"{why}: {ASK_AGAIN}"


def error_of(message: str) -> PastRefused | NotRemembered:
    """Make an error from a service's `error_message`: the inverse of `message_of`."""
    return NotRemembered(message) if message.endswith(ASK_AGAIN) else PastRefused(message)


@dataclass(frozen=True, slots=True)
class SeriesRequest:
    """Request for a tag's sensor or event; `start_ns` 0: from the beginning, `end_ns` 0: to now.

    Raises:
        PastRefused: a name is empty, the interval is inverted, or `max_points` is out of range.

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
                f"tag_id is {self.tag_id[:64]!r}, but ~runs are only those of {EVERY_TAG!r}"
            )
        if self.event is None and self.tag_id == EVERY_TAG:
            raise PastRefused(
                f"tag_id is {EVERY_TAG!r}, which has only events, but sensor_type is "
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
    """Cover a period with at most `max_points` buckets of at least `least_ns`.

    Buckets below five minutes begin at `start_ns` and are as short as possible. Longer ones are
    whole multiples of five minutes, from an hour on of an hour, and the period is widened to fit.
    So the journal's hourly counts can be used instead of its rows.
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

    A reading has the count 1, and its value, which may be NaN, as mean, minimum and maximum. A
    bucket counts finite readings; one without any is absent. Stamps ascend. Buckets cover the
    period of their `grid`, which may be wider than requested.
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
    """A row of an export: a reading, or an attempt without one (`sensor` is empty, `value` NaN).

    `x` and `y` are m in the map frame, NaN for a tag without a position. `status` and `source` are
    as in lupin_msgs/Observation; `source` is empty if unknown.
    """

    stamp_ns: int
    tag_id: str
    x: float
    y: float
    sensor: str
    value: float
    status: int
    source: str


MAX_WRITES: Final = 2_000
# A tag's recent writes at a moment: its last scans and inspections, at most this many of each.
RECENT_COUNT: Final = 9
# Scans in one answer: they take some seconds of one core.
MAX_SCANS: Final = 200_000


@dataclass(frozen=True, slots=True)
class WritesRequest:
    """Request for at most `max_count` writes numbered above `after`; 0: from the beginning.

    From the beginning, writes received more than `reach_s` ago are left out, and all but the latest
    `reach_count`; 0: no limit.
    """

    after: int = 0
    reach_s: float = 0.0
    reach_count: int = 0
    max_count: int = MAX_WRITES


@dataclass(frozen=True, slots=True)
class RunSpan:
    """A period of the time axis, `start_ns <= stamp < end_ns`, and the run that it belongs to."""

    run: int
    start_ns: int
    end_ns: int
    is_simulated: bool = False


def recent_of(writes: Iterable[Observation], at_ns: int) -> tuple[Observation, ...]:
    """Select the writes that are recent at a moment, from those of one run in any order."""
    by_tag: dict[tuple[str, int], list[Observation]] = {}
    for write in writes:
        if write.stamp_ns <= at_ns and (write.readings or write.flower):
            by_tag.setdefault((write.tag_id, write.kind), []).append(write)
    found: list[Observation] = []
    for mine in by_tag.values():
        mine.sort(key=_in_time)
        stamps = sorted({write.stamp_ns for write in mine})[-RECENT_COUNT:]
        found += [write for write in mine if write.stamp_ns >= stamps[0]]
    return tuple(sorted(found, key=_in_time))


def _in_time(write: Observation) -> tuple[int, int]:
    return write.stamp_ns, write.number


@dataclass(frozen=True, slots=True)
class PastWrites:
    """Some attempts, in the order of their numbers; request more after `last`, until `is_all`.

    They have no pose, and their flowers no blooms and no footprint. `journal` identifies the file:
    numbers of different files are not comparable.
    """

    journal: str
    spans: tuple[RunSpan, ...]
    writes: tuple[Observation, ...]
    last: int
    is_all: bool

    @property
    def first(self) -> int:
        """The number of the first; without any, the next number."""
        return self.writes[0].number if self.writes else self.last + 1

    @property
    def of_newest_run(self) -> list[Observation]:
        """Those of the run of the clock that goes on."""
        return [write for write in self.writes if write.run == self.spans[-1].run]
