"""One sensor of one tag over a period, its readings or buckets of them; or all readings, in order.

An export reads a stretch of time in one short transaction, so that a reader that takes an hour over
ten million rows keeps the log from being put into the file for no longer than that.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any, Final

from lupin_twin.core.past import HOUR_NS, NotRemembered, PastRow, SeriesPast, SeriesRequest
from lupin_twin.journal.buckets import Buckets, Entry, answer, whole_hours
from lupin_twin.journal.events import FROM_SCAN, events
from lupin_twin.journal.hours import deleted_ns, is_counted
from lupin_twin.journal.rows import KIND_READING, named_numbers, sensor_names
from lupin_twin.journal.runs import Run, Span, runs, spans_within
from lupin_twin.journal.schema import SiteLog, one_view

# What an answer costs, about, s; the second for events of the whole site, each tag.
SERIES_S: Final = 0.01
SERIES_S_PER_TAG: Final = 1e-5
# What the newest readings of a sensor cost, each tag.
NEWEST_S_PER_TAG: Final = 3e-4

_WITHIN: Final = (
    "FROM scan WHERE site = :site AND series = :series AND stamp_ns >= :start AND stamp_ns < :end"
    " AND is_copy = 0"
)
_HOURS_WITHIN: Final = (
    "FROM hour WHERE site = :site AND series = :series AND hour >= :first AND hour < :last"
)
# Of a JSON list on both engines.
_ENTRY: Final = "CAST({0} ->> CAST(:place AS INTEGER) AS {1})"
_N: Final = _ENTRY.format("n", "BIGINT")
_BUCKETS: Final = (
    "SELECT (hour - :origin) / :width AS bucket,"  # constants
    f" sum({_N}), sum({_ENTRY.format('total', 'DOUBLE PRECISION')}),"
    f" min({_ENTRY.format('low', 'DOUBLE PRECISION')}),"
    f" max({_ENTRY.format('high', 'DOUBLE PRECISION')}) {_HOURS_WITHIN} GROUP BY bucket"
)


class _Part:
    """A sensor's readings in a series within a span; `place` is where it stands in `sensors`."""

    def __init__(self, log: SiteLog, span: Span, series: int, place: int, sensors: str) -> None:
        self.span = span
        self._log = log
        self._series = {"series": series, "place": place}
        self._place = place
        self._sensors = sensors
        self._deleted_ns = deleted_ns(log, span.run.id)

    def ask(self, sql: str, span: Span | None = None, /, **more: int) -> list[tuple[Any, ...]]:
        """Rows of the series within a part of the span, or all of it."""
        span = span or self.span
        hours = {"first": span.start_ns // HOUR_NS, "last": -(-span.end_ns // HOUR_NS)}
        within = {"start": span.start_ns, "end": span.end_ns} | hours | self._series
        return list(self._log.execute(sql, within | more).fetchall())

    def is_deleted(self) -> bool:
        if self.span.start_ns > self._deleted_ns:
            return False
        last = min(self.span.end_ns - 1, self._deleted_ns) // HOUR_NS + 1
        return bool(self.ask(f"SELECT 1 {_HOURS_WITHIN} LIMIT 1", last=last))

    def hourly(self) -> int:
        return int(self.ask(f"SELECT coalesce(sum({_N}), 0) {_HOURS_WITHIN}")[0][0])

    def entries(self, limit: int) -> list[Entry]:
        rows = self.ask(f"SELECT stamp_ns, seq, readings {_WITHIN} LIMIT :limit", limit=limit)
        return self._read(rows)

    def oldest(self) -> list[int]:
        """The first stamp, or the beginning of the first hour where rows were deleted."""
        found = [at_ns for (at_ns,) in self.ask(f"SELECT min(stamp_ns) {_WITHIN}")]
        if self.span.start_ns <= self._deleted_ns:
            for (hour,) in self.ask(f"SELECT min(hour) {_HOURS_WITHIN}"):
                found.append(hour if hour is None else max(hour * HOUR_NS, self.span.start_ns))
        return [at_ns for at_ns in found if at_ns is not None]

    def fill(self, buckets: Buckets) -> None:
        rest = [self.span]
        if buckets.are_hours():
            hours, rest = whole_hours(self.span, self._deleted_ns)
            for index, n, *numbers in self.ask(
                _BUCKETS,
                first=hours[0],
                last=hours[1],
                origin=buckets.grid.start_ns // HOUR_NS,
                width=buckets.grid.bucket_ns // HOUR_NS,
            ):
                if n:
                    buckets.add(index, int(n), *numbers)
        for span in rest:
            for stamp_ns, _, value in self._read(
                self.ask(f"SELECT stamp_ns, seq, readings {_WITHIN}", span)
            ):
                if is_counted(value):
                    buckets.add_value(stamp_ns, value)

    def _read(self, rows: Sequence[tuple[int, int, str]]) -> list[Entry]:
        every = named_numbers([self._sensors] * len(rows), [text for *_, text in rows])
        return [
            (stamp_ns, seq, values[self._place])
            for (stamp_ns, seq, _), (_, values) in zip(rows, every, strict=True)
        ]


def series(connection: Any, request: SeriesRequest, now_ns: int) -> SeriesPast:
    """What a sensor gave, or the events that are requested, see GetHistory.srv.

    Where rows were deleted, the answer is in buckets of whole hours.
    """
    log = SiteLog(connection)
    if request.event is not None:
        return events(log, request, now_ns)
    # A reading of this very moment counts as one of the past.
    end_ns = max(request.end_ns or now_ns + 1, request.start_ns)
    start_ns = request.start_ns
    if not start_ns:
        oldest = (at_ns for part in _parts(log, request, 0, end_ns) for at_ns in part.oldest())
        start_ns = min(oldest, default=end_ns)
    return answer(partial(_parts, log, request), start_ns, end_ns, request.max_points)


# Of each series from the stamp on of the last that counts: a search of its own, by the limit.
_NEWEST: Final = (
    "SELECT s.tag, r.stamp_ns, r.seq, r.readings FROM (SELECT s.*, coalesce((SELECT stamp_ns"
    " FROM scan WHERE site = s.site AND series = s.series AND stamp_ns >= :start"
    " AND stamp_ns < :end AND is_copy = 0 ORDER BY stamp_ns DESC LIMIT 1 OFFSET :more), :start)"
    " AS first_ns FROM series AS s WHERE s.site = :site AND s.run = :run AND s.kind = 0"
    " AND s.sensors = :sensors LIMIT 1000000) AS s CROSS JOIN scan AS r WHERE r.site = s.site"
    " AND r.series = s.series AND r.stamp_ns >= s.first_ns AND r.stamp_ns < :end AND r.is_copy = 0"
)
_SETS: Final = "SELECT DISTINCT sensors FROM series WHERE site = :site AND run = :run AND kind = 0"


def newest(
    connection: Any, sensor_type: str, start_ns: int, end_ns: int, each: int
) -> dict[str, list[tuple[int, float]]]:
    """Of every tag the last `each` readings of a sensor in a period: (ns of ROS time, value).

    In their order, and without those that are not finite.
    """
    log = SiteLog(connection)
    found: dict[str, list[Entry]] = {}
    for span in spans_within(runs(log.execute), start_ns, end_ns):
        within = {"run": span.run.id, "start": span.start_ns, "end": span.end_ns}
        for (text,) in log.execute(_SETS, within).fetchall():
            names = sensor_names(text)
            if sensor_type not in names:
                continue
            query = within | {"sensors": text, "more": each - 1}
            rows = log.execute(_NEWEST, query).fetchall()
            place = names.index(sensor_type)
            every = named_numbers([text] * len(rows), [row[-1] for row in rows])
            for (tag, stamp_ns, seq, _), (_, values) in zip(rows, every, strict=True):
                if is_counted(values[place]):
                    found.setdefault(tag, []).append((stamp_ns, seq, values[place]))
    return {
        tag: [(stamp_ns, value) for stamp_ns, _, value in sorted(entries)[-each:]]
        for tag, entries in found.items()
    }


def _parts(log: SiteLog, request: SeriesRequest, start_ns: int, end_ns: int) -> list[_Part]:
    found = []
    for span in spans_within(runs(log.execute), start_ns, end_ns):
        of_run = {"run": span.run.id, "tag": request.tag_id, "kind": KIND_READING}
        for number, text in log.execute(
            "SELECT series, sensors FROM series WHERE site = :site AND run = :run AND tag = :tag"
            " AND kind = :kind ORDER BY series",
            of_run,
        ).fetchall():
            names = sensor_names(text)
            if request.sensor_type in names:
                place = names.index(request.sensor_type)
                found.append(_Part(log, span, number, place, text))
    return found


LOT: Final = 1_000
# Readings that are read in one go, about, and what that costs, s.
_STRETCH: Final = 40_000
STRETCH_S: Final = 0.1
_FIRST_STRETCH_NS: Final = 60 * 1_000_000_000
_NOWHERE: Final = (math.nan, math.nan)
_NO_READING: Final = (("", math.nan),)

_SCANS: Final = f"SELECT stamp_ns, seq, tag, sensors, status, source, readings {FROM_SCAN}"
_NEXT: Final = f"SELECT min(stamp_ns) {FROM_SCAN}"  # constants


def rows(
    connection: Any,
    start_ns: int,
    end_ns: int,
    tag_id: str | None = None,
    sensor_type: str | None = None,
) -> Iterator[list[PastRow]]:
    """Lots of at most `LOT` rows, see `Export`."""
    export = Export(start_ns, end_ns, tag_id, sensor_type)
    while True:
        with one_view(connection):
            found = export.step(connection)
        if found is None:
            return
        yield from lots(found)


def lots(found: list[PastRow]) -> Iterator[list[PastRow]]:
    """Rows, `LOT` at a time."""
    for first in range(0, len(found), LOT):
        yield found[first : first + LOT]


class Export:
    """The rows of a period; None: of all tags; of all sensors, and of attempts without a reading.

    Each step may be over another connection. An export that deleting has overtaken is not whole,
    and does not look so.
    """

    def __init__(
        self, start_ns: int, end_ns: int, tag_id: str | None, sensor_type: str | None
    ) -> None:
        self._period = (start_ns, end_ns)
        self._tag_id = tag_id
        self._sensor_type = sensor_type
        self._spans: deque[Span] | None = None
        self._at_ns = 0
        self._length_ns = _FIRST_STRETCH_NS
        self._run: Run | None = None
        self._places: dict[str, tuple[float, float]] = {}
        # The last stamp of each run that was deleted when the first row was given.
        self._deleted_ns: dict[int, int] = {}
        self._has_begun = False

    def step(self, connection: Any) -> list[PastRow] | None:
        """The rows of the next stretch of time, maybe none; None: that was all.

        Raises:
            NotRemembered: behind rows that were given, some are deleted since.

        """
        log = SiteLog(connection)
        if self._spans is None:
            self._spans = deque(spans_within(runs(log.execute), *self._period))
        if not self._has_begun:
            self._deleted_ns = {s.run.id: deleted_ns(log, s.run.id) for s in self._spans}
        while self._spans and self._spans[0].end_ns <= self._at_ns:
            self._spans.popleft()
        return self._stretch(log, self._spans[0]) if self._spans else None

    def _stretch(self, log: SiteLog, span: Span) -> list[PastRow]:
        if self._run != span.run:
            self._run, self._places = span.run, _places(log, span.run)
        start_ns = max(self._at_ns, span.start_ns)
        horizon_ns = deleted_ns(log, span.run.id)
        if horizon_ns >= start_ns and horizon_ns > self._deleted_ns[span.run.id]:
            why = "scans that come next were deleted while others were taken: begin again"
            raise NotRemembered(why, is_lasting=False)
        while True:
            until_ns = min(start_ns + self._length_ns, span.end_ns)
            # Of one stamp there are as many scans as there are.
            limit = "" if self._length_ns == 1 else f" LIMIT {_STRETCH}"
            scans = self._ask(log, _SCANS + limit, start_ns, until_ns)
            read = sum(1 + scan[-1].count(",") for scan in scans)
            if self._length_ns == 1 or read < _STRETCH:
                break
            self._length_ns = max(1, self._length_ns // 8)
        self._at_ns = until_ns
        if not scans:
            ((next_ns,),) = self._ask(log, _NEXT, until_ns, span.end_ns)
            self._at_ns = span.end_ns if next_ns is None else next_ns
        more = _STRETCH / 4 / max(read, _STRETCH // 32)
        self._length_ns = max(1, int(self._length_ns * more))
        self._has_begun |= bool(scans)
        return self._read(sorted(scans))

    def _ask(self, log: SiteLog, sql: str, start_ns: int, end_ns: int) -> list[tuple[Any, ...]]:
        assert self._run is not None
        of_tag = "" if self._tag_id is None else " AND tag = :tag"
        query = {"run": self._run.id, "tag": self._tag_id, "start": start_ns, "end": end_ns}
        return list(log.execute(sql.replace("{tag}", of_tag), query).fetchall())

    def _read(self, scans: list[tuple[Any, ...]]) -> list[PastRow]:
        found: list[PastRow] = []
        every = named_numbers((scan[3] for scan in scans), [scan[-1] for scan in scans])
        for (stamp_ns, _, tag, _, status, source, _), (names, values) in zip(
            scans, every, strict=True
        ):
            x, y = self._places.get(tag, _NOWHERE)
            readings = zip(names, values, strict=True) if values else _NO_READING
            found += [
                PastRow(stamp_ns, tag, x, y, sensor, value, status, source)
                for sensor, value in readings
                if self._sensor_type in (None, sensor)
            ]
        return found


def _places(log: SiteLog, run: Run) -> dict[str, tuple[float, float]]:
    """Where tags are: what was known first holds, what was carried into the run before all."""
    found = log.execute(
        "SELECT tag, x, y FROM place WHERE site = :site AND run = :run ORDER BY seq DESC",
        {"run": run.id},
    )
    return {tag: (x, y) for tag, x, y in found.fetchall()}
