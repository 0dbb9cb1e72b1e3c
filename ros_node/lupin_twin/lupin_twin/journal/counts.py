"""Counts for long views of the past, and the answers that are made of them.

They are upserted in the transaction that writes the counted rows. By the hour: readings of each
sensor (`hour`), the site's scans, failures and inspections (`tally`). One by one, because they are
rare (`event`): pests seen and cleared, and silences, which are times without an attempt. Counts
stay when rows are deleted, and are never recomputed: a late row is added.

The answer over a period has single entries if they are few, otherwise buckets. Buckets of an hour
or more are made from the counts of whole hours. If rows were deleted or are too many, all buckets
are that long. Shorter ones are made from the rows.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from lupin_twin.core.past import HOUR_NS, SILENCE_NS, Event, Grid, RunSpan, SeriesPast, grid
from lupin_twin.core.state import KIND_TAG_READING, STATUS_OK
from lupin_twin.journal import sql
from lupin_twin.journal.rows import noted_number, numbers_of
from lupin_twin.journal.schema import DamagedFile, SiteLog, insert_into

# Followed by the number of a run: the last stamp of its deleted rows.
DELETED: Final = "purged_ns:"
# Followed by the number of a run: up to when the site's counts include rows forgotten since.
FORGOTTEN: Final = "counted_ns:"
# Events that are counted by the hour.
TALLIED: Final = (Event.SCANS, Event.FAILURES, Event.INSPECTIONS)
# A sum of larger readings could overflow, which PostgreSQL refuses.
_LARGEST: Final = 1e290


def is_counted(value: float) -> bool:
    """Whether a reading counts in the long views: NaN, infinite and huge ones do not."""
    return -_LARGEST < value < _LARGEST


def count_rows(log: SiteLog, after: int, until: int, counted_ns: Mapping[int, int]) -> None:
    """Count the rows numbered above `after` and up to `until`; each once, whatever its stamp.

    `counted_ns`: for some runs, the time up to which all rows are counted already.

    Raises:
        DamagedFile: a scan has no series, or its readings are invalid.

    """
    within = {"after": after, "until": until}
    scans = log.execute(_SCANS, within).fetchall()
    inspections = [
        row
        for row in log.execute(_INSPECTIONS, within).fetchall()
        if row[1] > counted_ns.get(row[0], -1)
    ]
    hours: dict[tuple[int, int, int], list[float]] = defaultdict(list)
    # Of attempts: value and stamp.
    tallies: dict[tuple[int, str, int], list[tuple[int, int]]] = defaultdict(list)
    stamps: dict[int, list[int]] = defaultdict(list)
    readings = numbers_of([row[-1] for row in scans])
    for (run, series, kind, stamp_ns, status, _), values in zip(scans, readings, strict=True):
        if kind is None:
            raise DamagedFile("a scan has no series")
        if stamp_ns <= counted_ns.get(run, -1):
            continue
        stamps[run].append(stamp_ns)
        hour = stamp_ns // HOUR_NS
        if status != STATUS_OK:
            tallies[run, Event.FAILURES, hour].append((status, stamp_ns))
        elif kind == KIND_TAG_READING:
            tallies[run, Event.SCANS, hour].append((len(values), stamp_ns))
        for sensor, value in enumerate(values):
            hours[series, hour, sensor].append(value)
    for run, stamp_ns, _, _, _, bug_count in inspections:
        stamps[run].append(stamp_ns)
        tallies[run, Event.INSPECTIONS, stamp_ns // HOUR_NS].append((bug_count, stamp_ns))
    for run, of_run in stamps.items():
        _note_silences(log, run, sorted(of_run))
    log.execute_many(ADD_HOUR, list(_of_hours(log, hours)))
    log.execute_many(_ADD_TALLY, list(_of_tallies(log, tallies)))
    for inspection in inspections:
        _note_pests(log, *inspection)


def extent(log: SiteLog, run: int) -> tuple[int, int] | None:
    """The first and the last attempt of a run; None if there was none."""
    found = [
        row
        for event in TALLIED
        for end in (sql.FIRST_TALLY, sql.LAST_TALLY)
        for row in log.execute(end, {"run": run, "event": event}).fetchall()
    ]
    return (min(found)[0], max(last for _, last in found)) if found else None


def deleted_ns(log: SiteLog, run: int) -> int:
    """The last stamp of a run's deleted rows; -1 if none was deleted."""
    return noted_number(log, f"{DELETED}{run}", -1)


_SCANS: Final = (
    "SELECT run, scan.series, kind, stamp_ns, status, readings FROM scan LEFT JOIN series"
    " ON series.site = scan.site AND series.series = scan.series"
    " WHERE scan.site = :site AND seq > :after AND seq <= :until AND is_copy = 0"
)
_INSPECTIONS: Final = (
    "SELECT run, stamp_ns, tag, seq, anomaly, bug_count FROM look"
    " WHERE site = :site AND seq > :after AND seq <= :until AND is_copy = 0"
)

# --- by the hour ----------------------------------------------------------------------------------

_ADD: Final = (
    " ON CONFLICT DO UPDATE SET n = n + excluded.n, total = total + excluded.total,"
    " low = min(low, excluded.low), high = max(high, excluded.high)"
)
ADD_HOUR: Final = insert_into("hour") + _ADD
_ADD_TALLY: Final = (
    f"{insert_into('tally')}{_ADD},"
    " first_ns = min(first_ns, excluded.first_ns), last_ns = max(last_ns, excluded.last_ns)"
)


# In the order of the tables, so that each of their pages is visited once.


def _of_hours(
    log: SiteLog, hours: Mapping[tuple[int, int, int], Iterable[float]]
) -> Iterator[tuple[object, ...]]:
    for key, values in sorted(hours.items()):
        if of := [value for value in values if is_counted(value)]:
            yield log.site, *key, len(of), sum(of), min(of), max(of)


def _of_tallies(
    log: SiteLog, tallies: Mapping[tuple[int, str, int], Iterable[tuple[int, int]]]
) -> Iterator[tuple[object, ...]]:
    for key, attempts in sorted(tallies.items()):
        of, stamps = zip(*attempts, strict=True)
        counts = len(of), sum(of), min(of), max(of)
        yield log.site, *key, *counts, min(stamps), max(stamps)


# --- one by one -----------------------------------------------------------------------------------

_EVENT: Final = (
    "INSERT INTO event (site, run, event, stamp_ns, seq, tag, value)"
    " VALUES (:site, :run, :event, :at, :seq, :tag, :value) ON CONFLICT DO NOTHING"
)
_NOT_EVENT: Final = (
    "DELETE FROM event WHERE site = :site AND run = :run AND event = :event AND stamp_ns = :at"
    " AND seq = :seq"
)


def silence_over(log: SiteLog, run: int, at_ns: int) -> tuple[int, int] | None:
    """The attempts around a moment, if a silence lies between them; the later may be at it."""
    query = {"run": run, "event": Event.SILENCES, "at": at_ns}
    found = log.execute(sql.SILENCE_BEFORE, query).fetchone()
    return (found[0], found[1]) if found and found[1] >= at_ns else None


def _note_silences(log: SiteLog, run: int, stamps: list[int]) -> None:
    first_ns, last_ns = extent(log, run) or (stamps[0], stamps[0])
    for at_ns in stamps:
        if at_ns > last_ns:
            _note_silence(log, run, last_ns, at_ns)
            last_ns = at_ns
        elif at_ns < first_ns:
            _note_silence(log, run, at_ns, first_ns)
            first_ns = at_ns
        elif at_ns in (first_ns, last_ns):  # many tags at one moment
            continue
        elif (over := silence_over(log, run, at_ns)) is not None and over[1] > at_ns:
            gone = {"run": run, "event": Event.SILENCES, "at": over[0], "seq": 0}
            log.execute(_NOT_EVENT, gone)
            _note_silence(log, run, over[0], at_ns)
            _note_silence(log, run, at_ns, over[1])


def _note_silence(log: SiteLog, run: int, start_ns: int, end_ns: int) -> None:
    value = end_ns - start_ns
    if value > SILENCE_NS:
        key = {"run": run, "event": Event.SILENCES, "at": start_ns, "seq": 0, "tag": ""}
        log.execute(_EVENT, key | {"value": value})


_INSPECTION: Final = (
    "SELECT stamp_ns, seq, anomaly, bug_count FROM look WHERE site = :site AND run = :run"
    " AND tag = :tag AND is_copy = 0 AND (stamp_ns, seq) {0} (:at, :seq)"
    " ORDER BY stamp_ns {1}, seq {1} LIMIT 1"
)
_BEFORE: Final = _INSPECTION.format("<", "DESC")
_AFTER: Final = _INSPECTION.format(">", "ASC")
_LAST_CHANGE: Final = (
    "SELECT event FROM event WHERE site = :site AND run = :run AND tag = :tag"
    " AND (stamp_ns, seq) < (:at, :seq) ORDER BY stamp_ns DESC, seq DESC LIMIT 1"
)


def _note_pests(  # noqa: PLR0917
    log: SiteLog, run: int, stamp_ns: int, tag: str, seq: int, anomaly: int, bug_count: int
) -> None:
    """Note whether an inspection is a change; a late one may alter that of the next one."""
    within = {"run": run, "tag": tag, "at": stamp_ns, "seq": seq}
    before = log.execute(_BEFORE, within).fetchone()
    if before is not None:
        had = bool(before[2])
    else:
        # A tag without inspections has no pest. If they were deleted, the last change tells it.
        change = log.execute(_LAST_CHANGE, within).fetchone()
        had = change is not None and change[0] == Event.PESTS_SEEN
    has = bool(anomaly)
    _note_pest(log, within, bug_count, (had, has))
    after = log.execute(_AFTER, within).fetchone()
    if after is not None:
        within |= {"at": after[0], "seq": after[1]}
        _note_pest(log, within, after[3], (has, bool(after[2])))


def _note_pest(log: SiteLog, at: dict[str, Any], bugs: int, pests: tuple[bool, bool]) -> None:
    had, has = pests
    event = Event.PESTS_SEEN if has else Event.PESTS_CLEARED
    if had != has:
        log.execute(_EVENT, at | {"event": event, "value": bugs})
    else:
        log.execute(_NOT_EVENT, at | {"event": event})


# --- answers over a period ------------------------------------------------------------------------

# Rows read for one answer: a quarter of a second. If there are more, the hourly counts are used.
MAX_ROWS: Final = 50_000

# (stamp, seq, value).
Entry = tuple[int, int, float]


def bounds(span: RunSpan) -> dict[str, Any]:
    """SQL parameters of a span, and of the hours that it touches."""
    hours = {"first": span.start_ns // HOUR_NS, "last": -(-span.end_ns // HOUR_NS)}
    return {"start": span.start_ns, "end": span.end_ns, **hours}


@dataclass(frozen=True, slots=True)
class Table:
    """Where values are stored, as SQL: their `rows`, and their hourly counts `hours`, if any.

    `read` converts the rows' `value` to numbers.
    """

    rows: str
    value: str
    read: Callable[[list[Any]], list[float]]
    hours: str = ""


class Part:
    """The requested values within one span; `of` are the parameters of the table's SQL."""

    def __init__(self, log: SiteLog, span: RunSpan, table: Table, of: Mapping[str, Any]) -> None:
        self.span = span
        self._log = log
        self._table = table
        self._of = of
        self._deleted_ns = deleted_ns(log, span.run) if table.hours else -1

    def ask(
        self, select: str, span: RunSpan | None = None, /, **more: int
    ) -> list[tuple[Any, ...]]:
        """Execute SQL over a part of the span, or all of it; returns the rows."""
        query = {**bounds(span or self.span), **self._of, **more}
        return list(self._log.execute(select, query).fetchall())

    def is_deleted(self) -> bool:
        """Whether some of it is left only as hourly counts."""
        if self.span.start_ns > self._deleted_ns:
            return False
        last = min(self.span.end_ns - 1, self._deleted_ns) // HOUR_NS + 1
        return bool(self.ask(f"SELECT 1 {self._table.hours} LIMIT 1", last=last))

    def hourly(self, most: int) -> int:
        """Number of values in whole hours, by their counts; counting ends at `most` or above."""
        if not self._table.hours:
            return 0
        (first, last), _ = whole_hours(self.span, self._deleted_ns)
        total = sql.total(self._table.hours)
        return int(self.ask(total, first=first, last=last, most=most)[0][0])

    def oldest(self) -> list[int]:
        """The first stamp, or the beginning of the first hour where rows were deleted."""
        found = [at_ns for (at_ns,) in self.ask(f"SELECT min(stamp_ns) {self._table.rows}")]
        if self.span.start_ns <= self._deleted_ns:
            for (hour,) in self.ask(f"SELECT min(hour) {self._table.hours}"):
                found.append(hour if hour is None else max(hour * HOUR_NS, self.span.start_ns))
        return [at_ns for at_ns in found if at_ns is not None]

    def count(self, most: int) -> int:
        """Number of values; counting ends at `most` or above."""
        # An hour has at least one, and takes less time than its rows.
        if (found := self.hourly(most)) >= most:
            return found
        return int(self.ask(sql.count(self._table.rows), most=most)[0][0])

    def entries(self, span: RunSpan | None = None) -> list[Entry]:
        """Entries within a part of the span, or all of it."""
        table = self._table
        rows = self.ask(f"SELECT stamp_ns, seq, {table.value} {table.rows}", span)
        values = table.read([value for *_, value in rows])
        return [(at_ns, seq, value) for (at_ns, seq, _), value in zip(rows, values, strict=True)]

    def fill(self, buckets: Buckets) -> None:
        """Add the values to buckets."""
        steps, rest = buckets.grid, [self.span]
        if self._table.hours and steps.bucket_ns >= HOUR_NS:
            hours, rest = whole_hours(self.span, self._deleted_ns)
            for row in self.ask(
                sql.buckets(self._table.hours),
                first=hours[0],
                last=hours[1],
                origin=steps.start_ns // HOUR_NS,
                width=steps.bucket_ns // HOUR_NS,
            ):
                buckets.add(*row)
        for span in rest:
            for stamp_ns, _, value in self.entries(span):
                if is_counted(value):
                    buckets.add_value(stamp_ns, value)


def answer(
    parts_of: Callable[[int, int], Sequence[Part]], start_ns: int, end_ns: int, max_points: int
) -> SeriesPast:
    """Answer a query over a period; `parts_of` returns the parts of any period."""
    parts = parts_of(start_ns, end_ns)
    are_deleted = any(part.is_deleted() for part in parts)
    if not are_deleted and sum(part.count(max_points + 1) for part in parts) <= max_points:
        # Equal stamps are in order of arrival.
        found = sorted(entry for part in parts for entry in part.entries())
        singly = [(stamp_ns, value) for stamp_ns, _, value in found]
        return individually(singly, start_ns, end_ns)
    steps = grid(start_ns, end_ns, max_points)
    if steps.bucket_ns < HOUR_NS and (
        are_deleted or sum(part.hourly(MAX_ROWS + 1) for part in parts) > MAX_ROWS
    ):
        steps = grid(start_ns, end_ns, max_points, HOUR_NS)
    buckets = Buckets(steps)
    # The period is that of the buckets from here on.
    for part in parts_of(steps.start_ns, steps.end_ns):
        part.fill(buckets)
    return buckets.past()


class Buckets:
    """Count, sum, minimum and maximum for each bucket of a grid."""

    def __init__(self, steps: Grid) -> None:
        self.grid = steps
        self._found: dict[int, tuple[int, float, float, float]] = {}

    def add(self, index: int, n: int, total: float, low: float, high: float) -> None:
        """Add several values to a bucket."""
        known = self._found.get(index)
        if known is not None:
            n, total = known[0] + n, known[1] + total
            low, high = min(known[2], low), max(known[3], high)
        self._found[index] = n, total, low, high

    def add_value(self, stamp_ns: int, value: float) -> None:
        """Add one value."""
        index = (stamp_ns - self.grid.start_ns) // self.grid.bucket_ns
        self.add(index, 1, value, value, value)

    def past(self) -> SeriesPast:
        """The answer; its means have 12 digits: these are the same in SQLite and PostgreSQL.

        They are within minimum and maximum, which have all digits.
        """
        steps = self.grid
        rows = [
            (
                steps.start_ns + index * steps.bucket_ns,
                n,
                min(max(float(f"{total / n:.12g}"), low), high),
                low,
                high,
            )
            for index, (n, total, low, high) in sorted(self._found.items())
        ]
        return SeriesPast(steps.start_ns, steps.end_ns, steps.bucket_ns, *zip(*rows, strict=True))


def individually(found: Sequence[tuple[int, float]], start_ns: int, end_ns: int) -> SeriesPast:
    """Make an answer of single (stamp, value) pairs, without buckets."""
    values = tuple(value for _, value in found)
    stamps = tuple(stamp_ns for stamp_ns, _ in found)
    return SeriesPast(start_ns, end_ns, None, stamps, (1,) * len(found), values, values, values)


def whole_hours(span: RunSpan, horizon_ns: int) -> tuple[tuple[int, int], list[RunSpan]]:
    """Split a span into its whole hours (first, and last excluded) and the rest.

    Up to the horizon, rows were deleted: there, an hour that is partly in the span counts as whole.
    """
    start_ns, end_ns = span.start_ns, span.end_ns
    first, last = -(-start_ns // HOUR_NS), end_ns // HOUR_NS
    if start_ns <= horizon_ns:
        first = start_ns // HOUR_NS
    if max(start_ns, last * HOUR_NS) <= horizon_ns:
        last = -(-end_ns // HOUR_NS)
    if first >= last:
        return (0, 0), [span]
    edges = (start_ns, first * HOUR_NS), (last * HOUR_NS, end_ns)
    return (first, last), [RunSpan(span.run, *edge) for edge in edges if edge[0] < edge[1]]
