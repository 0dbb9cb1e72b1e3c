"""Is a journal what was written? Its structure, the check of every row, rollups against rows."""

from __future__ import annotations

import math
import sqlite3
from collections.abc import Callable, Generator, Iterator, Sequence
from typing import Any, Final

from lupin_twin.journal.packing import (
    Bucket,
    Damaged,
    columns,
    unpack_buckets,
    unpack_numbers,
    unpack_shape,
    unseal,
)
from lupin_twin.journal.reading import LOOK, SCAN, Series, all_series, one_view, pins, runs
from lupin_twin.journal.retention import purged_ns
from lupin_twin.journal.rollups import Folded, get_meta
from lupin_twin.journal.schema import FILE_ERRORS
from lupin_twin.past import HOUR_NS

# A lot is one short look at the file: a check that takes minutes must not keep the log growing.
_ROWS: Final = 5_000
_MAX_STRUCTURE: Final = 100
_EVERY_TABLE: Final = ("scan", "look", "rollup")
# Rollups have no check of their own: so many, spread over all of them, are held against their
# scans, some seconds' worth.
_COMPARED: Final = 20_000
# A mean is merged in another order than it is counted in.
_MEAN_TOLERANCE: Final = 1e-9

Progress = Callable[[str, float], None]


def find_all_damage(connection: sqlite3.Connection, tell: Progress) -> Generator[str, None, None]:
    """Everything that is wrong with a journal, a sentence each, as it is found.

    `tell(what, share)` is called as the work goes on, with the share of it that is done. What lies
    on pages that cannot be read is told once, with the table that it ends the reading of.

    Raises:
        sqlite3.OperationalError: somebody interrupts it; that is no damage.

    """
    tell("structure", 0.0)
    try:
        for (found,) in connection.execute(f"PRAGMA integrity_check({_MAX_STRUCTURE})"):
            if found != "ok":
                yield f"structure: {found}"
        every = {series.id: series for series in all_series(connection)}
        yield from _lost_series(connection, every)
        for run in runs(connection).values():
            noted = connection.execute("SELECT lead_ns, carries FROM run WHERE id = ?", (run.id,))
            if noted.fetchone() != (run.lead_ns, int(run.carries)):
                yield f"run {run.id} is not what was written"
            for _, number, pin in pins(connection, run):
                if pin is None:
                    yield f"pin {number} is not what was written"
    except FILE_ERRORS as error:
        _raise_interrupt(error)
        yield f"what rows have in common cannot be read: {error}"
        return
    for table in _EVERY_TABLE:
        try:
            yield from _rows(connection, table, every, tell)
        except sqlite3.Error as error:
            _raise_interrupt(error)
            yield f"{table}: cannot be read on: {error}"


def _raise_interrupt(error: Exception) -> None:
    if getattr(error, "sqlite_errorcode", None) == sqlite3.SQLITE_INTERRUPT:
        raise error


def _lost_series(connection: sqlite3.Connection, every: dict[int, Series]) -> Iterator[str]:
    for (number,) in connection.execute("SELECT id FROM series ORDER BY id"):
        if number not in every:
            yield f"series {number}: its run, tag, source or sensors are missing"


def _rows(
    connection: sqlite3.Connection, table: str, every: dict[int, Series], tell: Progress
) -> Iterator[str]:
    tell(table, 0.0)
    if table == "rollup":
        yield from _rollups(connection, every, tell)
        return
    what = SCAN if table == "scan" else LOOK
    read: Callable[[bytes, Series], object] = _read_scan if table == "scan" else _read_look
    first, last = connection.execute(f"SELECT min(id), max(id) FROM {table}").fetchone()  # noqa: S608
    after = (first or 0) - 1
    while lot := connection.execute(
        f"SELECT {what} FROM {table} WHERE id > ? ORDER BY id LIMIT {_ROWS}",  # noqa: S608
        (after,),
    ).fetchall():
        for row in lot:
            series = every.get(row[1])
            # A series that began after the check did is of rows that no one has damaged yet.
            if series is not None and not _is_whole(row, series, read):
                yield f"{table} {row[0]} of tag {series.tag_id!r} is not what was written"
        after = lot[-1][0]
        tell(table, (after - first + 1) / max(1, last - first + 1))


def _rollups(
    connection: sqlite3.Connection, every: dict[int, Series], tell: Progress
) -> Iterator[str]:
    (count,) = connection.execute("SELECT count(*) FROM rollup").fetchone()
    stride, seen = -(-count // _COMPARED), 0
    for done, series in enumerate(every.values(), 1):
        with one_view(connection):
            rolled = connection.execute(
                "SELECT hour, buckets FROM rollup WHERE series = ? ORDER BY hour", (series.id,)
            ).fetchall()
            whole_from = _whole_from(connection, series) if rolled else 0
            for hour, packed in rolled:
                seen += 1
                try:
                    buckets = unpack_buckets(packed, len(series.sensors))
                except Damaged:
                    wrong = "is not what was written"
                else:
                    is_chosen = hour >= whole_from and seen % stride == 0
                    if not is_chosen or _fits(connection, series, hour, buckets):
                        continue
                    wrong = "does not fit its scans"
                yield f"the rollup of tag {series.tag_id!r} in hour {hour} {wrong}"
        tell("rollup", done / len(every))


def _whole_from(connection: sqlite3.Connection, series: Series) -> float:
    """The first hour of which no scan was given up or lost to damage."""
    hour: float = purged_ns(connection, series.run) // HOUR_NS + 1
    salvaged_id = get_meta(connection, "salvaged_id")
    if salvaged_id:
        (first_ns,) = connection.execute(
            "SELECT min(stamp_ns) FROM scan WHERE series = ? AND id > ?", (series.id, salvaged_id)
        ).fetchone()
        hour = max(hour, math.inf if first_ns is None else first_ns // HOUR_NS + 1)
    return hour


def _fits(
    connection: sqlite3.Connection, series: Series, hour: int, rolled: Sequence[Bucket]
) -> bool:
    counted = [Bucket() for _ in series.sensors]
    for row in connection.execute(
        f"SELECT {SCAN} FROM scan WHERE series = ? AND stamp_ns >= ? AND stamp_ns < ? AND id <= ?",  # noqa: S608
        (series.id, hour * HOUR_NS, (hour + 1) * HOUR_NS, Folded(connection).up_to(series.id)),
    ):
        try:
            values = unpack_numbers(unseal(columns(*row[1:-1]), row[-1]), len(series.sensors))
        except Damaged:
            return True  # which is told already
        for bucket, value in zip(counted, values, strict=True):
            if math.isfinite(value):
                bucket.add(value)
    return all(
        (a.n, a.low, a.high) == (b.n, b.low, b.high)
        and math.isclose(a.mean, b.mean, rel_tol=_MEAN_TOLERANCE, abs_tol=_MEAN_TOLERANCE)
        for a, b in zip(counted, rolled, strict=True)
    )


def _is_whole(
    row: tuple[Any, ...], series: Series, read: Callable[[bytes, Series], object]
) -> bool:
    try:
        read(unseal(columns(*row[1:-1]), row[-1]), series)
    except Damaged:
        return False
    return True


def _read_scan(body: bytes, series: Series) -> object:
    return unpack_numbers(body, len(series.sensors))


def _read_look(body: bytes, _: Series) -> object:
    return unpack_shape(body)
