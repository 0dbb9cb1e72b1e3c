# ruff: noqa: S608  # SQL is put together of constants
"""Is a journal what was written? Its structure, what rows refer to, hours against their scans.

SQLite keeps no checksums: a digit that has flipped in a reading shows in its hour alone, which was
counted as the scan was written.
"""

from __future__ import annotations

import json
import math
import sqlite3
from collections.abc import Callable, Generator, Iterator
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import Any, Final

from lupin_twin.journal.hours import is_counted
from lupin_twin.journal.reading import numbers_of
from lupin_twin.journal.retention import purged_ns
from lupin_twin.journal.schema import (
    FILE_ERRORS,
    DamagedFile,
    Empty,
    Foreign,
    open_reader,
    says_damaged,
)
from lupin_twin.past import HOUR_NS

# A lot is one short look at the file: a check that takes minutes must not keep the log growing.
_ROWS: Final = 5_000
_MAX_STRUCTURE: Final = 100
# So many hours, spread over all of them, are held against their scans: some seconds' worth.
_COMPARED: Final = 20_000
# A sum is kept to fifteen digits, each time that a batch is added.
_TOLERANCE: Final = 1e-11

# What is wrong with rows from :after to :until, as (seq, tag).
_WRONG: Final = {
    "scan": (
        "SELECT seq, tag FROM scan AS r LEFT JOIN series AS s"
        " ON s.site = r.site AND s.series = r.series"
        " WHERE r.seq > :after AND r.seq <= :until AND r.site = :site AND (tag IS NULL"
        " OR CASE WHEN json_valid(sensors) AND json_valid(readings)"
        " THEN json_array_length(sensors) != json_array_length(readings) ELSE 1 END"
        " OR typeof(stamp_ns) != 'integer' OR typeof(status) != 'integer')"
    ),
    "look": (
        "SELECT seq, tag FROM look AS r LEFT JOIN run ON run.site = r.site AND run.run = r.run"
        " WHERE r.seq > :after AND r.seq <= :until AND r.site = :site"
        " AND (run.run IS NULL OR NOT json_valid(blooms) OR NOT json_valid(box)"
        " OR typeof(stamp_ns) != 'integer' OR typeof(bug_count) != 'integer')"
    ),
    "place": (
        "SELECT seq, tag FROM place AS r LEFT JOIN run ON run.site = r.site AND run.run = r.run"
        " WHERE r.seq > :after AND r.seq <= :until AND r.site = :site"
        " AND (run.run IS NULL OR typeof(stamp_ns) != 'integer' OR typeof(x + y + qw) != 'real')"
    ),
}

Progress = Callable[[str, float], None]


def find_damage(path: Path) -> str | None:
    """The first thing that is wrong with the file's structure, None if nothing is.

    Reads all of it, tables against their indexes: about half a second for 64 MB.
    """
    try:
        with closing(open_reader(path)) as connection:
            (found,) = connection.execute("PRAGMA integrity_check(1)").fetchone()
    except FILE_ERRORS as error:
        return str(error) if says_damaged(error) else None
    except (Foreign, Empty):
        return None
    return None if found == "ok" else str(found)


def find_all_damage(connection: sqlite3.Connection, tell: Progress) -> Generator[str, None, None]:
    """Everything that is wrong with a journal, a sentence each, as it is found.

    `tell(what, share)` is called as the work goes on, with the share of it that is done. What lies
    on pages that cannot be read is reported once, with the table that it ends the reading of.

    Raises:
        sqlite3.OperationalError: somebody interrupts it; that is no damage.

    """
    tell("structure", 0.0)
    parts: dict[str, Callable[[], Iterator[str]]] = {
        "structure": partial(_structure, connection),
        **{table: partial(_rows, connection, table, tell) for table in _WRONG},
        "hour": partial(_hours, connection, tell),
    }
    for what, read in parts.items():
        try:
            yield from read()
        except FILE_ERRORS as error:
            if getattr(error, "sqlite_errorcode", None) == sqlite3.SQLITE_INTERRUPT:
                raise
            yield f"{what}: cannot be read on: {error}"


def _structure(connection: sqlite3.Connection) -> Iterator[str]:
    for (found,) in connection.execute(f"PRAGMA integrity_check({_MAX_STRUCTURE})"):
        if found != "ok":
            yield f"structure: {found}"
    for series, tag in connection.execute(
        "SELECT series, tag FROM series LEFT JOIN run USING (site, run)"
        " WHERE begun_seq IS NULL OR NOT json_valid(sensors)"
    ).fetchall():
        yield f"series {series} of tag {tag!r} has no run or no list of sensors"
    for number, joins in connection.execute(
        "SELECT a.run, a.joins FROM run AS a LEFT JOIN run AS b ON b.site = a.site"
        " AND b.run = a.joins WHERE a.joins IS NOT NULL AND b.run IS NULL"
    ).fetchall():
        yield f"run {number} joins run {joins}, which is missing"


def _rows(connection: sqlite3.Connection, table: str, tell: Progress) -> Iterator[str]:
    tell(table, 0.0)
    sites = connection.execute(f"SELECT site, min(seq), max(seq) FROM {table} GROUP BY site")
    for site, first, last in sites.fetchall():
        after = first - 1
        while after < last:
            within = {"site": site, "after": after, "until": after + _ROWS}
            for seq, tag in connection.execute(_WRONG[table], within).fetchall():
                yield f"{table} {seq} of tag {tag!r} is not what was written"
            # Numbers may jump by millions.
            (following,) = connection.execute(
                f"SELECT min(seq) FROM {table} WHERE site = :site AND seq > :until", within
            ).fetchone()
            after = last if following is None else following - 1
            tell(table, (after - first + 1) / (last - first + 1))
    tell(table, 1.0)


def _hours(connection: sqlite3.Connection, tell: Progress) -> Iterator[str]:
    tell("hour", 0.0)
    (count,) = connection.execute("SELECT count(*) FROM hour").fetchone()
    stride, seen = -(-count // _COMPARED), 0
    every = connection.execute("SELECT site, series, run, tag FROM series").fetchall()
    for done, (site, series, run, tag) in enumerate(every, 1):
        for row in connection.execute(_HOURS_OF, (site, series)).fetchall():
            seen += 1
            # Of earlier hours some scans may have been deleted by age.
            is_whole = row[0] > purged_ns(connection, run, site) // HOUR_NS
            if seen % stride == 0 and is_whole and not _fits(connection, site, series, row):
                yield f"hour {row[0]} of tag {tag!r} does not fit its scans"
        tell("hour", done / len(every))


_HOURS_OF: Final = (
    "SELECT hour, n, total, low, high FROM hour WHERE site = ? AND series = ? ORDER BY hour"
)


def _fits(connection: sqlite3.Connection, site: str, series: int, row: tuple[Any, ...]) -> bool:
    hour, *noted = row
    texts = connection.execute(
        "SELECT readings FROM scan WHERE site = ? AND series = ? AND stamp_ns >= ? AND stamp_ns < ?"
        " AND is_copy = 0",
        (site, series, hour * HOUR_NS, (hour + 1) * HOUR_NS),
    ).fetchall()
    try:
        n, total, low, high = map(json.loads, noted)
        by_sensor = zip(*numbers_of([text for (text,) in texts]), strict=True)
        for sensor, values in enumerate(by_sensor):
            counted = [value for value in values if is_counted(value)]
            if (n[sensor], low[sensor], high[sensor]) != (
                len(counted),
                min(counted, default=None),
                max(counted, default=None),
            ) or not math.isclose(
                total[sensor], sum(counted), rel_tol=_TOLERANCE, abs_tol=_TOLERANCE
            ):
                return False
        return bool(texts) or not any(n)
    except (DamagedFile, ValueError, TypeError, IndexError, RecursionError):
        return False
