"""What a twin that starts has to know: the newest of everything, as rows to be applied again."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

from lupin_twin.journal.packing import Damaged
from lupin_twin.journal.reading import (
    LOOK,
    SCAN,
    Names,
    Series,
    all_series,
    look_of,
    pins,
    runs,
    scan_of,
)
from lupin_twin.journal.rows import LookRow, Row, ScanRow
from lupin_twin.journal.runs import Carries, Run

# Scans that are read at most, for the histories of all tags: the newest of a series always is.
_MAX_SCANS: Final = 20_000
# Runs behind the present one whose readings can still be the newest of a tag.
_MAX_RUNS: Final = 100


@dataclass(frozen=True, slots=True)
class Restored:
    """Rows in the order of their tags' first hearing, of a tag in that of writing.

    `count` is how many writes the journal has seen, `damaged` how many rows could not be read.
    """

    run: Run
    rows: tuple[Row, ...]
    count: int
    damaged: int


def restore(connection: sqlite3.Connection, run: Run, scans_per_series: int) -> Restored:
    """What is known in a run: of each series the newest scans (at least one), each newest look.

    Of runs before it what it carries: their places, or all, where what was later than the next
    run's beginning counts as made then.
    """
    found: list[tuple[int, int, int, Row]] = []
    damaged = 0
    for depth, (past, begun_ns, carries) in enumerate(_behind(connection, run)):
        for tag, number, pin in pins(connection, past):
            if pin is None:
                damaged += 1
            else:
                found.append((tag, -depth, number, _held(pin, begun_ns)))
        if carries is Carries.ALL and depth < _MAX_RUNS:
            for tag, number, row in _newest(connection, past, scans_per_series):
                if row is None:
                    damaged += 1
                else:
                    found.append((tag, -depth, number, _held(row, begun_ns)))
    found.sort(key=lambda entry: entry[:3])
    (count,) = connection.execute(
        "SELECT max(coalesce((SELECT max(id) FROM scan), 0),"
        " coalesce((SELECT max(id) FROM look), 0), coalesce((SELECT max(id) FROM pin), 0))"
    ).fetchone()
    return Restored(run, tuple(row for *_, row in found), count, damaged)


def _behind(connection: sqlite3.Connection, run: Run) -> Iterator[tuple[Run, int | None, Carries]]:
    """The run and those it follows: each with what it is held to, and what of it still holds."""
    by_id = runs(connection)
    begun_ns: int | None = None
    carries = Carries.ALL
    past: Run | None = run
    while past is not None and carries is not Carries.NOTHING:
        yield past, begun_ns, carries
        begun_ns = min(past.begun.stamp_ns, past.begun.stamp_ns if begun_ns is None else begun_ns)
        carries = min(carries, past.carries)
        # A run follows an earlier one; a damaged file may say otherwise.
        follows = past.follows
        past = by_id.get(follows) if follows is not None and follows < past.id else None


def _held(row: Row, begun_ns: int | None) -> Row:
    if begun_ns is None or row.stamp_ns <= begun_ns:
        return row
    return replace(row, stamp_ns=begun_ns)


def _newest(
    connection: sqlite3.Connection, run: Run, scans_per_series: int
) -> Iterator[tuple[int, int, ScanRow | LookRow | None]]:
    every = {series.id: series for series in all_series(connection, run)}
    depth = max(1, min(scans_per_series, _MAX_SCANS // max(1, len(every))))
    names = Names(connection)
    scans = _newest_rows(connection, "scan", SCAN, run, depth)
    yield from _read(scans, every, lambda row, series: scan_of(row, series, names))
    looks = _newest_rows(connection, "look", LOOK, run, 1)
    yield from _read(looks, every, lambda row, series: look_of(row, series, names))


def _newest_rows(
    connection: sqlite3.Connection, table: str, what: str, run: Run, depth: int
) -> sqlite3.Cursor:
    newest = f"SELECT id FROM {table} WHERE series = s.id ORDER BY stamp_ns DESC, id DESC LIMIT"  # noqa: S608
    one_or_more = f"= ({newest} 1)" if depth == 1 else f"IN ({newest} {depth})"
    return connection.execute(
        f"SELECT {', '.join('r.' + column for column in what.split(', '))} FROM series AS s"  # noqa: S608
        f" JOIN {table} AS r ON r.id {one_or_more} WHERE s.run = ?",
        (run.id,),
    )


def _read(
    rows: Iterable[tuple[Any, ...]],
    every: Mapping[int, Series],
    make: Callable[[tuple[Any, ...], Series], ScanRow | LookRow],
) -> Iterator[tuple[int, int, ScanRow | LookRow | None]]:
    for row in rows:
        series = every.get(row[1])
        if series is None:
            yield 0, row[0], None
            continue
        try:
            yield series.tag, row[0], make(row, series)
        except Damaged:
            yield series.tag, row[0], None
