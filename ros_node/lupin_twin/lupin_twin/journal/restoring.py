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
    scan_of,
)
from lupin_twin.journal.rows import LookRow, Row, ScanRow
from lupin_twin.journal.runs import Carries, Run
from lupin_twin.journal.spans import MAX_RUNS, behind

# Scans that are read at most, for the histories of all tags: the newest of a series always is.
_MAX_SCANS: Final = 20_000


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
    places: list[tuple[int, int, Row]] = []
    # Of each run, the newest first: its rows, and its beginning, which those before are held to.
    heard: list[tuple[list[tuple[int, int, Row]], int]] = []
    damaged = 0
    for depth, (past, begun_ns, carries) in enumerate(behind(connection, run)):
        for tag, number, pin in pins(connection, past):
            if pin is None:
                damaged += 1
            else:
                places.append((tag, number, _held(pin, begun_ns)))
        rows: list[tuple[int, int, Row]] = []
        if carries is Carries.ALL and depth < MAX_RUNS:
            for tag, number, row in _newest(connection, past, scans_per_series):
                if row is None:
                    damaged += 1
                else:
                    rows.append((tag, number, row))
            heard.append((rows, past.begun.stamp_ns))
    # Numbers ascend over runs that follow each other: the first place is that of the first of them.
    found = sorted([*places, *heard[0][0]], key=lambda entry: entry[1])
    if any(rows for rows, _ in heard[1:]):
        found = [*sorted(places, key=lambda entry: entry[1]), *_carried(heard)]
    found.sort(key=lambda entry: entry[0])
    (count,) = connection.execute(
        "SELECT max(coalesce((SELECT max(id) FROM scan), 0),"
        " coalesce((SELECT max(id) FROM look), 0), coalesce((SELECT max(id) FROM pin), 0))"
    ).fetchone()
    return Restored(run, tuple(row for *_, row in found), count, damaged)


def _carried(heard: list[tuple[list[tuple[int, int, Row]], int]]) -> list[tuple[int, int, Row]]:
    """The rows of all runs, so that of those that were held to one moment the right one is last.

    As it was when the clock went back: what was the newest before stays so, whatever comes that is
    no later.
    """
    order: list[tuple[int, int, Row]] = []
    held_ns: int | None = None
    for rows, begun_ns in reversed(heard):
        held_ns = begun_ns if held_ns is None else min(held_ns, begun_ns)
        if rows:
            order = [(tag, number, _held(row, held_ns)) for tag, number, row in order]
            order += sorted(rows, key=lambda entry: entry[1])
            order.sort(key=lambda entry: entry[2].stamp_ns)
            held_ns = None
    return [(tag, number, _held(row, held_ns)) for tag, number, row in order]


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
