# ruff: noqa: S608  # SQL is put together of constants and numbers
"""What the whole house did in a span, out of its tallies: counts, and where nothing was tried.

Whole hours where they do, else five minutes. Of a slot that two spans share the scans themselves
are read, while they are kept. What is not tallied yet is added.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from typing import Final, NamedTuple

from lupin_twin.journal.retention import purged_ns
from lupin_twin.journal.rollups import get_meta
from lupin_twin.journal.spans import Span
from lupin_twin.journal.tallying import FROM_LOOK, FROM_SCAN, IN_SCAN, KINDS, TALLIED
from lupin_twin.past import HOUR_NS, SLOT_NS, Grid, NotRemembered

# The first and the last try of a stretch in which no gap matters.
Extent = tuple[int, int]


class Count(NamedTuple):
    """How many, and the sum, the least and the largest of their values."""

    n: int
    total: int
    low: int
    high: int

    def and_(self, other: Count) -> Count:
        """Both together."""
        return Count(
            self.n + other.n,
            self.total + other.total,
            min(self.low, other.low),
            max(self.high, other.high),
        )


def merge(found: dict[int, Count], index: int, count: Count) -> None:
    """Add to a bucket."""
    found[index] = found[index].and_(count) if index in found else count


class _Units(NamedTuple):
    """Rows of a tally, `first <= slot < last`, each `unit_ns` long."""

    unit_ns: int
    first: int
    last: int

    @property
    def table(self) -> str:
        return "tally_hour" if self.unit_ns == HOUR_NS else "tally"


class _Try(NamedTuple):
    stamp_ns: int
    kind: str | None
    value: int


_KIND: Final = "".join(f" WHEN {which} THEN '{kind}'" for kind, (which, _) in IN_SCAN.items())
_VALUE: Final = "".join(f" WHEN {which} THEN {value}" for which, value in IN_SCAN.values())
_SCAN: Final = f"SELECT stamp_ns, CASE{_KIND} END, CASE{_VALUE} ELSE 0 END FROM"
_LOOK: Final = "SELECT stamp_ns, 'look', bug_count FROM"
_LATE: Final = (
    f"{_SCAN} {FROM_SCAN} WHERE scan.id > :after AND run = :run"
    f" UNION ALL {_LOOK} {FROM_LOOK} WHERE look.id > :after AND run = :run"
)
# By the index of each series: of a few minutes.
_EARLY: Final = (
    f"{_SCAN} series CROSS JOIN sensors ON sensors.id = sensors"
    " CROSS JOIN scan ON scan.series = series.id WHERE run = :run AND scan.id <= :after"
    " AND stamp_ns >= :start AND stamp_ns < :end"
    f" UNION ALL {_LOOK} series CROSS JOIN look ON look.series = series.id WHERE run = :run"
    " AND look.id <= :after AND stamp_ns >= :start AND stamp_ns < :end"
)
_TRIES: Final = " + ".join(f"coalesce({kind}_n, 0)" for kind in KINDS)


class Tallies:
    """The tallies as of one view of the file.

    Raises:
        NotRemembered: a damaged file is being read, and tallies and scans do not fit yet.

    """

    def __init__(self, connection: sqlite3.Connection) -> None:
        if connection.execute("SELECT 1 FROM meta WHERE key = 'salvage'").fetchone():
            raise NotRemembered(
                "what can be read of a damaged journal is being read; ask again", is_lasting=False
            )
        self._connection = connection
        self._tallied = get_meta(connection, TALLIED)
        self._late: dict[int, list[_Try]] = {}

    def counts(self, kind: str, span: Span, told: Grid) -> dict[int, Count]:
        """By bucket of a grid that is of whole slots."""
        found: dict[int, Count] = {}
        is_hourly = told.bucket_ns % HOUR_NS == 0 and told.start_ns % HOUR_NS == 0
        units, singles = self._parts(span, is_hourly=is_hourly)
        for part in units:
            # A slot that begins before the period is one of a span that begins in it.
            for index, *numbers in self._connection.execute(
                f"SELECT (max(slot * {part.unit_ns}, {told.start_ns}) - {told.start_ns})"
                f" / {told.bucket_ns} AS bucket, sum({kind}_n), sum({kind}_total), min({kind}_low),"
                f" max({kind}_high) FROM {part.table}"
                f" WHERE run = ? AND slot >= ? AND slot < ? AND {kind}_n > 0 GROUP BY bucket",
                (span.run.id, part.first, part.last),
            ):
                merge(found, index, Count(*numbers))
        for one in singles:
            if one.kind == kind:
                index = (one.stamp_ns - told.start_ns) // told.bucket_ns
                merge(found, index, Count(1, one.value, one.value, one.value))
        return found

    def tries(self, span: Span) -> int:
        """How often something was tried."""
        units, singles = self._parts(span, is_hourly=True)
        return len(singles) + sum(
            int(
                self._connection.execute(
                    f"SELECT coalesce(sum({_TRIES}), 0) FROM {part.table}"
                    " WHERE run = ? AND slot >= ? AND slot < ?",
                    (span.run.id, part.first, part.last),
                ).fetchone()[0]
            )
            for part in units
        )

    def extents(self, span: Span, longest_ns: int) -> Iterator[Extent]:
        """All tries; those with no gap longer than that between them may be one."""
        units, singles = self._parts(span, is_hourly=True)
        for one in singles:
            yield one.stamp_ns, one.stamp_ns
        for part in units:
            for slot, first_ns, last_ns, gap_ns in self._rows(span, part):
                if gap_ns <= longest_ns:
                    yield first_ns, last_ns
                    continue
                of_hour = HOUR_NS // SLOT_NS
                slots = _Units(SLOT_NS, slot * of_hour, (slot + 1) * of_hour)
                for _, first, last, _ in self._rows(span, slots):
                    yield first, last

    def spread(self, span: Span) -> Iterator[int]:
        """A stamp for each try, where the scans themselves are given up: evenly within a slot."""
        units, singles = self._parts(span, is_hourly=False)
        yield from (one.stamp_ns for one in singles)
        for part in units:
            for n, first_ns, last_ns in self._connection.execute(
                f"SELECT {_TRIES}, first_ns, last_ns FROM {part.table}"
                " WHERE run = ? AND slot >= ? AND slot < ?",
                (span.run.id, part.first, part.last),
            ):
                for number in range(n):
                    yield first_ns + (last_ns - first_ns) * number // max(1, n - 1)

    def ends(self, span: Span) -> Extent | None:
        """The first and the last try; None if there is none."""
        first_hour, last_hour = span.start_ns // HOUR_NS, (span.end_ns - 1) // HOUR_NS
        found = [one.stamp_ns for one in self._singles(span)]
        for order in ("ASC", "DESC"):
            hours = self._connection.execute(
                f"SELECT slot FROM tally_hour WHERE run = ? AND slot BETWEEN ? AND ?"
                f" ORDER BY slot {order}",
                (span.run.id, first_hour, last_hour),
            )
            for (hour,) in hours:
                start_ns = max(span.start_ns, hour * HOUR_NS)
                end_ns = min(span.end_ns, (hour + 1) * HOUR_NS)
                within = list(self.extents(Span(span.run, start_ns, end_ns), 0))
                if within:
                    found += [min(within)[0], max(last_ns for _, last_ns in within)]
                    break
        return (min(found), max(found)) if found else None

    # --- parts of a span ----------------------------------------------------------------------

    def _parts(self, span: Span, *, is_hourly: bool) -> tuple[list[_Units], list[_Try]]:
        """The rows of tallies that are the span's, and the single tries beside them."""
        units: list[_Units] = []
        singles = list(self._singles(span))
        start_ns, end_ns = span.start_ns, span.end_ns
        stretches = [(start_ns, end_ns)]
        first, last = -(-start_ns // HOUR_NS), end_ns // HOUR_NS
        if is_hourly and first < last:
            units.append(_Units(HOUR_NS, first, last))
            stretches = [(start_ns, first * HOUR_NS), (last * HOUR_NS, end_ns)]
        for begin_ns, until_ns in stretches:
            first, last = -(-begin_ns // SLOT_NS), until_ns // SLOT_NS
            if first < last:
                units.append(_Units(SLOT_NS, first, last))
            cut = {at_ns // SLOT_NS for at_ns in (begin_ns, until_ns) if at_ns % SLOT_NS}
            for slot in cut if begin_ns < until_ns else ():
                part = _Units(SLOT_NS, slot, slot + 1)
                if self._is_within(span, part):
                    units.append(part)
                else:
                    singles += self._early(span, part)
        return units, singles

    def _is_within(self, span: Span, part: _Units) -> bool:
        """Whether a slot that the span cuts has nothing beside it, or nobody can tell any more."""
        for _, first_ns, last_ns, _ in self._rows(span, part):
            if span.start_ns <= first_ns and last_ns < span.end_ns:
                return True
            is_beside = last_ns < span.start_ns or span.end_ns <= first_ns
            return not is_beside and part.first * SLOT_NS <= purged_ns(self._connection, span.run)
        return False

    def _early(self, span: Span, part: _Units) -> list[_Try]:
        if not self._rows(span, part):
            return []
        within = {
            "run": span.run.id,
            "after": self._tallied,
            "start": max(span.start_ns, part.first * SLOT_NS),
            "end": min(span.end_ns, part.last * SLOT_NS),
        }
        return [_Try(*row) for row in self._connection.execute(_EARLY, within)]

    def _singles(self, span: Span) -> Iterator[_Try]:
        """What is not tallied yet."""
        run = span.run.id
        if run not in self._late:
            late = self._connection.execute(_LATE, {"run": run, "after": self._tallied})
            self._late[run] = [_Try(*row) for row in late]
        return (one for one in self._late[run] if span.start_ns <= one.stamp_ns < span.end_ns)

    def _rows(self, span: Span, part: _Units) -> list[tuple[int, int, int, int]]:
        return self._connection.execute(
            f"SELECT slot, first_ns, last_ns, gap_ns FROM {part.table}"
            " WHERE run = ? AND slot >= ? AND slot < ? ORDER BY slot",
            (span.run.id, part.first, part.last),
        ).fetchall()
