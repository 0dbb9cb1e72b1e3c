"""One sensor of one tag over a period: its readings, or buckets of them.

Buckets of an hour and more are made of the rollups and of what is not folded into them yet; so are
all where scans were given up already. Shorter ones, and readings, are read off the scans.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from typing import Final

from lupin_twin.journal.events import events
from lupin_twin.journal.hours import merged_hours
from lupin_twin.journal.packing import Bucket, Damaged, columns, unpack_numbers, unseal
from lupin_twin.journal.reading import SCAN, one_view, sensor_names
from lupin_twin.journal.retention import purged_ns
from lupin_twin.journal.rollups import Folded
from lupin_twin.journal.spans import Span, spans_within
from lupin_twin.past import HOUR_NS, Grid, SeriesPast, SeriesRequest, grid

# Scans that are read for one answer: a quarter of a second. Of more, the hours are told.
MAX_SCANS: Final = 50_000
# What an answer costs, about, s; the second for events of the whole house, each tag.
SERIES_S: Final = 0.01
SERIES_S_PER_TAG: Final = 1e-5


@dataclass(frozen=True, slots=True)
class _Part:
    """A series within a span: where the sensor stands in its set, and how large that is."""

    span: Span
    series: int
    places: tuple[int, ...]
    sensors: int
    purged_ns: int

    def is_purged(self) -> bool:
        """Whether scans of the span may have been given up."""
        return self.span.start_ns <= self.purged_ns


def series(connection: sqlite3.Connection, request: SeriesRequest, now_ns: int) -> SeriesPast:
    """What a sensor gave, or the events that are asked for, see GetHistory.srv.

    Where scans were given up, the answer is in buckets of whole hours. Bytes that are damaged cost
    their own reading, or hour.
    """
    with one_view(connection):
        if request.event is not None:
            return events(connection, request, now_ns)
        # A reading of this very moment counts as one of the past.
        end_ns = max(request.end_ns or now_ns + 1, request.start_ns)
        parts = list(_parts(connection, request, request.start_ns, end_ns))
        start_ns = request.start_ns or min(
            (oldest for part in parts if (oldest := _oldest(connection, part)) is not None),
            default=end_ns,
        )
        told = grid(start_ns, end_ns, request.max_points)
        # Of hours it need not be known how many scans there are, but for whether they are few.
        limit = request.max_points if told.bucket_ns >= HOUR_NS else MAX_SCANS
        scans = sum(_count(connection, part, limit) for part in parts)
        is_given_up = any(part.is_purged() and _is_rolled(connection, part) for part in parts)
        if not is_given_up and scans <= request.max_points:
            return _readings(connection, parts, start_ns, end_ns)
        if is_given_up or scans > MAX_SCANS:
            told = grid(start_ns, end_ns, request.max_points, HOUR_NS)
        # The period is that of the buckets from here on.
        parts = list(_parts(connection, request, told.start_ns, told.end_ns))
        if told.bucket_ns % HOUR_NS or told.start_ns % HOUR_NS:
            buckets = _bucketed(connection, parts, told)
        else:
            buckets = _rolled(connection, parts, told)
        return _answer(told, buckets)


def newest(
    connection: sqlite3.Connection, request: SeriesRequest, most: int
) -> list[tuple[int, float]] | None:
    """The last `most` finite readings of a sensor in a period: (ns of ROS time, value), in order.

    No more of the period is read than that. None: scans of it were given up.
    """
    with one_view(connection):
        parts = list(_parts(connection, request, request.start_ns, request.end_ns))
        if any(part.is_purged() and _is_rolled(connection, part) for part in parts):
            return None
        found = sorted(
            last
            for part in parts
            # A scan that names the sensor twice is not cut in two.
            for last in islice(_backwards(connection, part), most + len(part.places) - 1)
        )
        return [(stamp_ns, value) for stamp_ns, _, _, value in found[-most:]]


def _backwards(
    connection: sqlite3.Connection, part: _Part
) -> Iterator[tuple[int, int, int, float]]:
    """(stamp, number, place in its set, value) of a span's finite readings, the newest first."""
    rows = connection.execute(
        f"SELECT {SCAN} FROM scan WHERE series = ? AND stamp_ns >= ? AND stamp_ns < ?"  # noqa: S608
        " ORDER BY stamp_ns DESC, id DESC",
        (part.series, part.span.start_ns, part.span.end_ns),
    )
    places = len(part.places)
    for index, (stamp_ns, number, value) in enumerate(_values(rows, part)):
        if value - value == 0.0:  # finite
            yield stamp_ns, number, index % places, value


def _parts(
    connection: sqlite3.Connection, request: SeriesRequest, start_ns: int, end_ns: int
) -> Iterator[_Part]:
    found = connection.execute("SELECT id FROM tag WHERE tag_id = ?", (request.tag_id,)).fetchone()
    if found is None:
        return
    for span in spans_within(connection, start_ns, end_ns):
        horizon_ns = purged_ns(connection, span.run)
        for number, text in connection.execute(
            "SELECT series.id, names FROM series JOIN sensors ON sensors.id = sensors"
            " WHERE run = ? AND tag = ?",
            (span.run.id, found[0]),
        ):
            names = sensor_names(text)
            places = tuple(n for n, name in enumerate(names) if name == request.sensor_type)
            if places:
                yield _Part(span, number, places, len(names), horizon_ns)


def _oldest(connection: sqlite3.Connection, part: _Part) -> int | None:
    within = (part.series, part.span.start_ns, part.span.end_ns)
    (stamp_ns,) = connection.execute(
        "SELECT min(stamp_ns) FROM scan WHERE series = ? AND stamp_ns >= ? AND stamp_ns < ?", within
    ).fetchone()
    if not part.is_purged():
        return None if stamp_ns is None else int(stamp_ns)
    (hour,) = connection.execute(
        "SELECT min(hour) FROM rollup WHERE series = ? AND hour BETWEEN ? AND ?",
        (part.series, part.span.start_ns // HOUR_NS, (part.span.end_ns - 1) // HOUR_NS),
    ).fetchone()
    known = [stamp_ns] if stamp_ns is not None else []
    if hour is not None:
        known.append(max(hour * HOUR_NS, part.span.start_ns))
    return min(known, default=None)


def _count(connection: sqlite3.Connection, part: _Part, limit: int) -> int:
    (count,) = connection.execute(
        "SELECT count(*) FROM (SELECT 1 FROM scan"
        " WHERE series = ? AND stamp_ns >= ? AND stamp_ns < ? LIMIT ?)",
        (part.series, part.span.start_ns, part.span.end_ns, limit + 1),
    ).fetchone()
    return int(count) * len(part.places)


def _is_rolled(connection: sqlite3.Connection, part: _Part) -> bool:
    """Whether a rollup tells of what was given up within the span."""
    last_ns = min(part.span.end_ns - 1, part.purged_ns)
    found = connection.execute(
        "SELECT 1 FROM rollup WHERE series = ? AND hour BETWEEN ? AND ? LIMIT 1",
        (part.series, part.span.start_ns // HOUR_NS, last_ns // HOUR_NS),
    )
    return found.fetchone() is not None


def _scans(
    connection: sqlite3.Connection, part: _Part, start_ns: int, end_ns: int
) -> Iterator[tuple[int, int, float]]:
    """(stamp, number, value) of the readings in a part of the span."""
    if start_ns >= end_ns:
        return
    rows = connection.execute(
        f"SELECT {SCAN} FROM scan WHERE series = ? AND stamp_ns >= ? AND stamp_ns < ?",  # noqa: S608
        (part.series, start_ns, end_ns),
    )
    yield from _values(rows, part)


def _values(rows: sqlite3.Cursor, part: _Part) -> Iterator[tuple[int, int, float]]:
    for row in rows:
        try:
            values = unpack_numbers(unseal(columns(*row[1:-1]), row[-1]), part.sensors)
        except Damaged:
            continue
        for place in part.places:
            yield row[2], row[0], values[place]


def _readings(
    connection: sqlite3.Connection, parts: list[_Part], start_ns: int, end_ns: int
) -> SeriesPast:
    # Of one stamp, in the order of hearing.
    found = sorted(
        (stamp_ns, number, index, value)
        for part in parts
        for index, (stamp_ns, number, value) in enumerate(
            _scans(connection, part, part.span.start_ns, part.span.end_ns)
        )
    )
    values = tuple(value for *_, value in found)
    stamps = tuple(stamp_ns for stamp_ns, *_ in found)
    return SeriesPast(start_ns, end_ns, None, stamps, (1,) * len(found), values, values, values)


def _bucketed(connection: sqlite3.Connection, parts: list[_Part], told: Grid) -> dict[int, Bucket]:
    buckets: dict[int, Bucket] = {}
    for part in parts:
        for stamp_ns, _, value in _scans(connection, part, part.span.start_ns, part.span.end_ns):
            if value - value == 0.0:  # finite
                index = (stamp_ns - told.start_ns) // told.bucket_ns
                bucket = buckets.get(index)
                if bucket is None:
                    bucket = buckets[index] = Bucket()
                bucket.add(value)
    return buckets


def _rolled(connection: sqlite3.Connection, parts: list[_Part], told: Grid) -> dict[int, Bucket]:
    folded = Folded(connection)
    buckets: dict[int, Bucket] = {}

    def at(stamp_ns: int) -> Bucket:
        return buckets.setdefault((stamp_ns - told.start_ns) // told.bucket_ns, Bucket())

    for part in parts:
        start_ns, end_ns = part.span.start_ns, part.span.end_ns
        first, last = _hours(part) if folded.is_usable else (0, 0)
        if first >= last:
            first = last = -(-end_ns // HOUR_NS)
        for index, rolled in merged_hours(
            connection,
            part.series,
            (first, last),
            sensors=part.sensors,
            places=part.places,
            width=told.bucket_ns // HOUR_NS,
            origin=told.start_ns // HOUR_NS,
        ):
            buckets.setdefault(index, Bucket()).merge(rolled)
        whole = (max(first * HOUR_NS, start_ns), min(last * HOUR_NS, end_ns))
        late = connection.execute(
            f"SELECT {SCAN} FROM scan WHERE id > ? AND +series = ?"  # noqa: S608
            " AND +stamp_ns >= ? AND +stamp_ns < ?",
            (folded.up_to(part.series), part.series, *whole),
        )
        for readings in (
            _values(late, part) if first < last else iter(()),
            _scans(connection, part, start_ns, min(whole[0], end_ns)),
            _scans(connection, part, max(whole[1], start_ns), end_ns),
        ):
            for stamp_ns, _, value in readings:
                if value - value == 0.0:  # finite
                    at(stamp_ns).add(value)
    return buckets


def _hours(part: _Part) -> tuple[int, int]:
    """The hours whose rollups are told, first to before last: those that the span has whole.

    Of others scans are read, while they are there.
    """
    start_ns, end_ns = part.span.start_ns, part.span.end_ns
    first, last = -(-start_ns // HOUR_NS), end_ns // HOUR_NS
    if start_ns <= part.purged_ns:
        first = start_ns // HOUR_NS
    if max(start_ns, last * HOUR_NS) <= part.purged_ns:
        last = -(-end_ns // HOUR_NS)
    return first, last


def _answer(told: Grid, buckets: dict[int, Bucket]) -> SeriesPast:
    entries = sorted(buckets.items())
    return SeriesPast(
        told.start_ns,
        told.end_ns,
        told.bucket_ns,
        tuple(told.start_ns + index * told.bucket_ns for index, _ in entries),
        tuple(bucket.n for _, bucket in entries),
        tuple(bucket.mean for _, bucket in entries),
        tuple(bucket.low for _, bucket in entries),
        tuple(bucket.high for _, bucket in entries),
    )
