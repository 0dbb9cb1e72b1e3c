# ruff: noqa: S608  # SQL is put together of constants
"""Checks a journal for damage, and summarises its content. Only reads, also while a twin records.

SQLite checks its own structure, and that its indexes agree with their tables. This module also
checks that rows are valid. SQLite keeps no checksums, so a flipped digit is not found.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Generator, Iterator
from contextlib import closing
from pathlib import Path
from typing import Final

from lupin_twin.journal.counts import extent
from lupin_twin.journal.rows import is_number, sensor_names
from lupin_twin.journal.runs import Run, runs
from lupin_twin.journal.schema import (
    FILE_ERRORS,
    LOCAL_SITE,
    Empty,
    Foreign,
    SiteLog,
    is_damage_error,
    open_reader,
)

# A lot is one short read of the file: a check that takes minutes must not keep the WAL growing.
_ROWS: Final = 5_000
_MAX_STRUCTURE: Final = 100
# A file up to this size is checked when it is opened: a quarter of a second.
_CHECKED_BYTES: Final = 64_000_000
_NO_STAMP: Final = "typeof(stamp_ns) != 'integer' OR stamp_ns NOT BETWEEN 0 AND 4611686018427387904"
_BEHIND: Final = "r.seq > :after AND r.seq <= :until AND r.site = :site"
# Queries for invalid rows numbered above :after and up to :until, as (seq, tag).
_WRONG: Final = {
    "scan": (
        "SELECT seq, tag FROM scan AS r LEFT JOIN series AS s"
        " ON s.site = r.site AND s.series = r.series"
        f" WHERE {_BEHIND} AND (tag IS NULL"
        " OR CASE WHEN json_valid(sensors) AND json_valid(readings)"
        " THEN json_array_length(sensors) != json_array_length(readings)"
        " OR EXISTS (SELECT 1 FROM json_each(readings) WHERE type IN ('text', 'array', 'object'))"
        f" ELSE 1 END OR typeof(status) != 'integer' OR {_NO_STAMP})"
    ),
    "look": (
        "SELECT seq, tag FROM look AS r LEFT JOIN run ON run.site = r.site AND run.run = r.run"
        f" WHERE {_BEHIND} AND (run.run IS NULL"
        " OR CASE WHEN json_valid(blooms) AND json_valid(box)"
        " THEN EXISTS (SELECT 1 FROM json_each(blooms) WHERE json_array_length(value) != 7)"
        " OR EXISTS (SELECT 1 FROM json_each(box) WHERE json_array_length(value) != 3)"
        f" ELSE 1 END OR typeof(bug_count) != 'integer' OR {_NO_STAMP})"
    ),
    "place": (
        "SELECT seq, tag FROM place AS r LEFT JOIN run ON run.site = r.site AND run.run = r.run"
        f" WHERE {_BEHIND} AND (run.run IS NULL OR typeof(x + y + qw) != 'real'"
        f" OR {_NO_STAMP})"
    ),
}

Progress = Callable[[str, float], None]


def is_damaged(path: Path) -> bool:
    """Whether the structure of a file has a defect; one that is too large counts as sound."""
    if not 0 < size_of(path) <= _CHECKED_BYTES:
        return False
    try:
        with closing(open_reader(path)) as connection:
            return bool(connection.execute("PRAGMA integrity_check(1)").fetchone() != ("ok",))
    except FILE_ERRORS as error:
        return is_damage_error(error)
    except (Foreign, Empty):
        return False


def find_all_damage(connection: sqlite3.Connection, report: Progress) -> Generator[str, None, None]:
    """Yield every defect of a journal, a sentence each.

    `report(what, share)` is called as the work goes on, with the share that is done. A page that
    cannot be read ends the check of its table, and is reported once.

    Raises:
        sqlite3.OperationalError: the check was interrupted; that is no damage.

    """
    report("structure", 0.0)
    parts = [("structure", _structure(connection))]
    parts += [(table, _rows(connection, table, report)) for table in _WRONG]
    for what, found in parts:
        try:
            yield from found
        except FILE_ERRORS as error:
            if getattr(error, "sqlite_errorcode", None) == sqlite3.SQLITE_INTERRUPT:
                raise
            yield f"{what}: cannot be read further: {error}"


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
    facts = "SELECT key, value FROM meta WHERE key GLOB '*_seq' OR key GLOB '*_ns*'"
    for key, value in connection.execute(facts).fetchall():
        if not is_number(str(value)):
            yield f"{key} is {value!r}, which is not a number"


def _rows(connection: sqlite3.Connection, table: str, report: Progress) -> Iterator[str]:
    report(table, 0.0)
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
            report(table, (after - first + 1) / (last - first + 1))
    report(table, 1.0)


def delete_wrong(connection: sqlite3.Connection, table: str, after: int, until: int) -> None:
    """Delete the invalid rows of a twin's own journal numbered above `after` and up to `until`."""
    connection.execute(
        f"DELETE FROM {table} WHERE site = :site AND seq IN (SELECT seq FROM ({_WRONG[table]}))",
        {"site": LOCAL_SITE, "after": after, "until": until},
    )


# --- what is in it --------------------------------------------------------------------------------

_COUNTED: Final = ("scan", "look", "place")

# A run, and the stamps of its first and last attempts, deleted ones included; None: it has none.
RunExtent = tuple[Run, int | None, int | None]


def row_counts(connection: sqlite3.Connection) -> dict[str, int]:
    """Number of rows of each table, copies included, and number of tags and of failed scans."""
    rows = {
        table: int(connection.execute(f"SELECT count(*) FROM {table}").fetchone()[0])
        for table in _COUNTED
    }
    (rows["tag"],) = connection.execute(
        "SELECT count(*) FROM (SELECT tag FROM series UNION SELECT tag FROM place)"
    ).fetchone()
    # A partial index holds just these rows.
    (rows["failure"],) = connection.execute(
        "SELECT count(*) FROM scan WHERE status != 0 AND is_copy = 0"
    ).fetchone()
    return rows


def sensors_of(connection: sqlite3.Connection) -> list[str]:
    """The names of all sensors."""
    names: set[str] = set()
    for (text,) in connection.execute("SELECT DISTINCT sensors FROM series"):
        names.update(sensor_names(text))
    return sorted(names)


def extents(connection: sqlite3.Connection) -> list[RunExtent]:
    """The runs of the clock in order, with their first and last attempts."""
    log = SiteLog(connection)
    every = [run for run in runs(log.execute) if run.joins is None]
    return [(run, *(extent(log, run.id) or (None, None))) for run in every]


def size_of(path: Path) -> int:
    """Size of a file in bytes; 0 if it does not exist."""
    try:
        return path.stat().st_size
    except FileNotFoundError:
        return 0
