"""Answers a query over a period: single entries if they are few, otherwise buckets.

Buckets of an hour or more are made from the counts of whole hours. If rows were deleted or are too
many, all buckets are that long. Shorter ones are made from the rows.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from lupin_twin.core.past import HOUR_NS, Grid, SeriesPast, grid
from lupin_twin.journal.counts import deleted_ns, is_counted
from lupin_twin.journal.runs import Span
from lupin_twin.journal.schema import SiteLog

# Rows read for one answer: a quarter of a second. If there are more, the hourly counts are used.
MAX_ROWS: Final = 50_000

# (stamp, seq, value).
Entry = tuple[int, int, float]


def bounds(span: Span) -> dict[str, Any]:
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

    def __init__(self, log: SiteLog, span: Span, table: Table, of: Mapping[str, Any]) -> None:
        self.span = span
        self._log = log
        self._table = table
        self._of = of
        self._deleted_ns = deleted_ns(log, span.run.id) if table.hours else -1

    def ask(self, sql: str, span: Span | None = None, /, **more: int) -> list[tuple[Any, ...]]:
        """Execute SQL over a part of the span, or all of it; returns the rows."""
        query = {**bounds(span or self.span), **self._of, **more}
        return list(self._log.execute(sql, query).fetchall())

    def is_deleted(self) -> bool:
        """Whether some of it is left only as hourly counts."""
        if self.span.start_ns > self._deleted_ns:
            return False
        last = min(self.span.end_ns - 1, self._deleted_ns) // HOUR_NS + 1
        return bool(self.ask(f"SELECT 1 {self._table.hours} LIMIT 1", last=last))

    def hourly(self) -> int:
        """Number of values, by the hourly counts."""
        if not self._table.hours:
            return 0
        return int(self.ask(f"SELECT coalesce(sum(n), 0) {self._table.hours}")[0][0])

    def oldest(self) -> list[int]:
        """The first stamp, or the beginning of the first hour where rows were deleted."""
        found = [at_ns for (at_ns,) in self.ask(f"SELECT min(stamp_ns) {self._table.rows}")]
        if self.span.start_ns <= self._deleted_ns:
            for (hour,) in self.ask(f"SELECT min(hour) {self._table.hours}"):
                found.append(hour if hour is None else max(hour * HOUR_NS, self.span.start_ns))
        return [at_ns for at_ns in found if at_ns is not None]

    def entries(self, limit: str, span: Span | None = None) -> list[Entry]:
        """Entries within a part of the span, or all of it; `limit` is an SQL clause, or empty."""
        table = self._table
        rows = self.ask(f"SELECT stamp_ns, seq, {table.value} {table.rows}{limit}", span)
        values = table.read([value for *_, value in rows])
        return [(at_ns, seq, value) for (at_ns, seq, _), value in zip(rows, values, strict=True)]

    def fill(self, buckets: Buckets) -> None:
        """Add the values to buckets."""
        steps, rest = buckets.grid, [self.span]
        if self._table.hours and steps.bucket_ns >= HOUR_NS:
            hours, rest = whole_hours(self.span, self._deleted_ns)
            for index, count, *numbers in self.ask(
                "SELECT (hour - :origin) / :width AS bucket, sum(n), sum(total), min(low),"
                f" max(high) {self._table.hours} GROUP BY bucket",
                first=hours[0],
                last=hours[1],
                origin=steps.start_ns // HOUR_NS,
                width=steps.bucket_ns // HOUR_NS,
            ):
                buckets.add(index, int(count), *map(float, numbers))
        for span in rest:
            for stamp_ns, _, value in self.entries("", span):
                if is_counted(value):
                    buckets.add_value(stamp_ns, value)


def answer(
    parts_of: Callable[[int, int], Sequence[Part]], start_ns: int, end_ns: int, max_points: int
) -> SeriesPast:
    """Answer a query over a period; `parts_of` returns the parts of any period."""
    parts = parts_of(start_ns, end_ns)
    are_deleted = any(part.is_deleted() for part in parts)
    if not are_deleted:
        found: list[Entry] = []
        for part in parts:
            found += part.entries(f" LIMIT {max_points + 1 - len(found)}")
            if len(found) > max_points:
                break
        else:
            # Equal stamps are in order of arrival.
            singly = [(stamp_ns, value) for stamp_ns, _, value in sorted(found)]
            return individually(singly, start_ns, end_ns)
    steps = grid(start_ns, end_ns, max_points)
    if steps.bucket_ns < HOUR_NS and (
        are_deleted or sum(part.hourly() for part in parts) > MAX_ROWS
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
        self._found: dict[int, list[float]] = {}

    def add(self, index: int, n: int, total: float, low: float, high: float) -> None:
        """Add several values to a bucket."""
        bucket = self._found.setdefault(index, [0, 0.0, low, high])
        bucket[0] += n
        bucket[1] += total
        bucket[2], bucket[3] = min(bucket[2], low), max(bucket[3], high)

    def add_value(self, stamp_ns: int, value: float) -> None:
        """Add one value."""
        index = (stamp_ns - self.grid.start_ns) // self.grid.bucket_ns
        self.add(index, 1, value, value, value)

    def past(self) -> SeriesPast:
        """The answer, rounded to 12 digits: these are the same in SQLite and PostgreSQL."""
        steps, found = self.grid, sorted(self._found.items())
        return SeriesPast(
            steps.start_ns,
            steps.end_ns,
            steps.bucket_ns,
            tuple(steps.start_ns + index * steps.bucket_ns for index, _ in found),
            tuple(int(n) for _, (n, *_) in found),
            tuple(_rounded(total / n) for _, (n, total, *_) in found),
            tuple(_rounded(low) for _, (*_, low, _) in found),
            tuple(_rounded(high) for _, (*_, high) in found),
        )


def individually(found: Sequence[tuple[int, float]], start_ns: int, end_ns: int) -> SeriesPast:
    """Make an answer of single (stamp, value) pairs, without buckets."""
    values = tuple(value for _, value in found)
    stamps = tuple(stamp_ns for stamp_ns, _ in found)
    return SeriesPast(start_ns, end_ns, None, stamps, (1,) * len(found), values, values, values)


def _rounded(number: float) -> float:
    return float(f"{number:.12g}")


def whole_hours(span: Span, horizon_ns: int) -> tuple[tuple[int, int], list[Span]]:
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
    return (first, last), [Span(span.run, *edge) for edge in edges if edge[0] < edge[1]]
