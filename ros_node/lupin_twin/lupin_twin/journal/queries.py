"""One sensor of one tag over a period: its readings, or buckets of them.

Buckets of an hour and more are made of hours; so are all where rows were deleted. Shorter ones, and
readings, are read off the rows. What a bucket says has 12 digits, so that it is the same in
whatever way, and on whatever engine, it was added up.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from lupin_twin.journal.events import events
from lupin_twin.journal.hours import Buckets, deleted_ns, is_counted, whole_hours
from lupin_twin.journal.reading import numbers_of, sensor_names
from lupin_twin.journal.rows import KIND_READING
from lupin_twin.journal.runs import Span, runs, spans_within
from lupin_twin.journal.schema import LOCAL_SITE, DamagedFile
from lupin_twin.journal.site_log import SiteLog
from lupin_twin.past import HOUR_NS, SeriesPast, SeriesRequest, grid

# Scans that are read for one answer: a quarter of a second. Of more, the hours are reported.
MAX_SCANS: Final = 50_000
# What an answer costs, about, s; the second for events of the whole site, each tag.
SERIES_S: Final = 0.01
SERIES_S_PER_TAG: Final = 1e-5

_WITHIN: Final = (
    "FROM scan WHERE site = :site AND series = :series AND stamp_ns >= :start AND stamp_ns < :end"
    " AND is_copy = 0"
)
_HOURS_WITHIN: Final = (
    "FROM hour WHERE site = :site AND series = :series AND hour >= :first AND hour < :last"
)
# Of a JSON list on both engines.
_ENTRY: Final = "CAST({0} ->> CAST(:place AS INTEGER) AS {1})"
_BUCKETS: Final = (
    "SELECT (hour - :origin) / :width AS bucket,"  # constants
    f" sum({_ENTRY.format('n', 'BIGINT')}), sum({_ENTRY.format('total', 'DOUBLE PRECISION')}),"
    f" min({_ENTRY.format('low', 'DOUBLE PRECISION')}),"
    f" max({_ENTRY.format('high', 'DOUBLE PRECISION')}) {_HOURS_WITHIN} GROUP BY bucket"
)


@dataclass(frozen=True, slots=True)
class _Part:
    """A series within a span: where the sensor stands in its list, and how long that is."""

    span: Span
    series: int
    place: int
    sensors: int
    deleted_ns: int

    def asked(self, **more: int) -> Mapping[str, int]:
        """What queries name."""
        within = {"start": self.span.start_ns, "end": self.span.end_ns}
        return {"series": self.series, "place": self.place} | within | more

    def is_deleted(self) -> bool:
        """Whether rows of the span may have been deleted."""
        return self.span.start_ns <= self.deleted_ns


def series(
    connection: Any, request: SeriesRequest, now_ns: int, site: str = LOCAL_SITE
) -> SeriesPast:
    """What a sensor gave, or the events that are asked for, see GetHistory.srv.

    Where rows were deleted, the answer is in buckets of whole hours.
    """
    log = SiteLog(connection, site)
    with log.one_view():
        if request.event is not None:
            return events(log, request, now_ns)
        # A reading of this very moment counts as one of the past.
        end_ns = max(request.end_ns or now_ns + 1, request.start_ns)
        parts = _parts(log, request, request.start_ns, end_ns)
        oldest = [at_ns for part in parts if (at_ns := _oldest(log, part)) is not None]
        start_ns = request.start_ns or min(oldest, default=end_ns)
        told = grid(start_ns, end_ns, request.max_points)
        # Of hours it need not be known how many scans there are, but for whether they are few.
        limit = request.max_points if told.bucket_ns >= HOUR_NS else MAX_SCANS
        scans = sum(_count(log, part, limit) for part in parts)
        are_deleted = any(part.is_deleted() and _has_hours(log, part) for part in parts)
        if not are_deleted and scans <= request.max_points:
            return _readings(log, parts, start_ns, end_ns)
        if are_deleted or scans > MAX_SCANS:
            told = grid(start_ns, end_ns, request.max_points, HOUR_NS)
        # The period is that of the buckets from here on.
        parts = _parts(log, request, told.start_ns, told.end_ns)
        buckets = Buckets(told)
        for part in parts:
            _add(log, buckets, part)
        return buckets.past()


def newest(
    connection: Any, request: SeriesRequest, most: int, site: str = LOCAL_SITE
) -> list[tuple[int, float]] | None:
    """The last `most` finite readings of a sensor in a period: (ns of ROS time, value), in order.

    No more of the period is read than that. None: rows of it were deleted.
    """
    log = SiteLog(connection, site)
    with log.one_view():
        parts = _parts(log, request, request.start_ns, request.end_ns)
        if any(part.is_deleted() and _has_hours(log, part) for part in parts):
            return None
        found = sorted(reading for part in parts for reading in _last(log, part, most))
        return [(stamp_ns, value) for stamp_ns, _, value in found[-most:]]


def _parts(log: SiteLog, request: SeriesRequest, start_ns: int, end_ns: int) -> list[_Part]:
    found = []
    for span in spans_within(runs(log.execute, log.site), start_ns, end_ns):
        of_run = {"run": span.run.id, "tag": request.tag_id, "kind": KIND_READING}
        horizon_ns: int | None = None
        for number, text in log.execute(
            "SELECT series, sensors FROM series WHERE site = :site AND run = :run AND tag = :tag"
            " AND kind = :kind ORDER BY series",
            of_run,
        ).fetchall():
            names = sensor_names(text)
            if request.sensor_type in names:
                if horizon_ns is None:
                    horizon_ns = deleted_ns(log, span.run.id)
                place = names.index(request.sensor_type)
                found.append(_Part(span, number, place, len(names), horizon_ns))
    return found


def _oldest(log: SiteLog, part: _Part) -> int | None:
    (stamp_ns,) = log.execute(f"SELECT min(stamp_ns) {_WITHIN}", part.asked()).fetchone()
    known = [] if stamp_ns is None else [int(stamp_ns)]
    if part.is_deleted():
        within = part.asked(
            first=part.span.start_ns // HOUR_NS, last=-(-part.span.end_ns // HOUR_NS)
        )
        (hour,) = log.execute(f"SELECT min(hour) {_HOURS_WITHIN}", within).fetchone()
        if hour is not None:
            known.append(max(hour * HOUR_NS, part.span.start_ns))
    return min(known, default=None)


def _count(log: SiteLog, part: _Part, limit: int) -> int:
    (count,) = log.execute(
        f"SELECT count(*) FROM (SELECT 1 AS one {_WITHIN} LIMIT :limit) AS found",  # noqa: S608
        part.asked(limit=limit + 1),
    ).fetchone()
    return int(count)


def _has_hours(log: SiteLog, part: _Part) -> bool:
    """Whether an hour has what was deleted within the span."""
    last_ns = min(part.span.end_ns - 1, part.deleted_ns)
    within = part.asked(first=part.span.start_ns // HOUR_NS, last=last_ns // HOUR_NS + 1)
    return log.execute(f"SELECT 1 {_HOURS_WITHIN} LIMIT 1", within).fetchone() is not None


# --- rows -----------------------------------------------------------------------------------------


def _values(log: SiteLog, part: _Part, span: Span) -> Iterator[tuple[int, int, float]]:
    """(stamp, seq, value) of the readings in a part of the span."""
    found = log.execute(
        f"SELECT stamp_ns, seq, readings {_WITHIN}",
        part.asked(start=span.start_ns, end=span.end_ns),
    )
    return _read(part, found.fetchall())


def _read(part: _Part, rows: Sequence[tuple[int, int, str]]) -> Iterator[tuple[int, int, float]]:
    every = numbers_of([text for *_, text in rows])
    for (stamp_ns, seq, _), values in zip(rows, every, strict=True):
        if len(values) != part.sensors:
            raise DamagedFile(f"scan {seq} has {len(values)} readings of {part.sensors} sensors")
        yield stamp_ns, seq, values[part.place]


def _last(log: SiteLog, part: _Part, most: int) -> list[tuple[int, int, float]]:
    found: list[tuple[int, int, float]] = []
    at: Mapping[str, int] = {"at": part.span.end_ns, "seq": 0}
    while len(found) < most:
        rows = log.execute(
            f"SELECT stamp_ns, seq, readings {_WITHIN} AND (stamp_ns, seq) < (:at, :seq)"
            " ORDER BY stamp_ns DESC, seq DESC LIMIT :limit",
            part.asked(limit=most, **at),
        ).fetchall()
        found += [reading for reading in _read(part, rows) if is_counted(reading[2])]
        if len(rows) < most:
            break
        at = {"at": rows[-1][0], "seq": rows[-1][1]}
    return found[:most]


def _readings(log: SiteLog, parts: Sequence[_Part], start_ns: int, end_ns: int) -> SeriesPast:
    # Of one stamp, in the order of receiving.
    found = sorted(reading for part in parts for reading in _values(log, part, part.span))
    values = tuple(value for *_, value in found)
    stamps = tuple(stamp_ns for stamp_ns, *_ in found)
    return SeriesPast(start_ns, end_ns, None, stamps, (1,) * len(found), values, values, values)


def _add(log: SiteLog, buckets: Buckets, part: _Part) -> None:
    """Add what a span has: hours where it has them whole, rows where another span begins."""
    rest = [part.span]
    if buckets.are_hours():
        hours, rest = whole_hours(part.span, part.deleted_ns)
        asked = part.asked(
            first=hours[0],
            last=hours[1],
            origin=buckets.told.start_ns // HOUR_NS,
            width=buckets.told.bucket_ns // HOUR_NS,
        )
        for index, n, *numbers in log.execute(_BUCKETS, asked).fetchall():
            if n:
                buckets.add(index, int(n), *numbers)
    for span in rest:
        for stamp_ns, _, value in _values(log, part, span):
            if is_counted(value):
                buckets.add_value(stamp_ns, value)
