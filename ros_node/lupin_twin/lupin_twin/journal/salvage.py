# ruff: noqa: S608  # SQL is put together of constants
"""Quarantines a damaged journal under a dated name, and copies what can be read into a new one.

SQLite itself reads the file, on both sides of each damaged page. With such a page, the copy loses
its rows, and those of the pages that are reachable only through it.
"""

from __future__ import annotations

import os
import shutil
import sqlite3
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import closing, suppress
from itertools import count
from pathlib import Path
from types import NoneType
from typing import Any, Final
from urllib.parse import quote

from lupin_twin.core.past import HOUR_NS
from lupin_twin.journal.appending import LAST_SEQ, PURGED_SEQ
from lupin_twin.journal.checking import delete_wrong
from lupin_twin.journal.counts import DELETED, count_rows
from lupin_twin.journal.rows import is_number
from lupin_twin.journal.schema import (
    FILE_ERRORS,
    HOURS_OF_LISTS,
    LOCAL_SITE,
    PAGE_SIZE,
    TABLES,
    WRITTEN,
    Foreign,
    SiteLog,
    empty_file,
    get_meta,
    insert_into,
    is_damage_error,
    open_reader,
    open_writer,
    set_meta,
    transaction,
)

# Key of the quarantined file's name, until it has been salvaged.
SALVAGE: Final = "salvage"
# Rows that are read at once; around damage, fewer.
_LOT: Final = 1_000
_LAST: Final = 2**61
_LEAST_ROW_BYTES: Final = 20
_TYPES: Final[Mapping[str, tuple[type, ...]]] = {
    "TEXT": (str,),
    "BIGINT": (int,),
    "INTEGER": (int,),
    "DOUBLE PRECISION": (int, float),
}
_ALL: Final = "SELECT * FROM {0} WHERE site = 'local'"
# This index has all columns of its table, and so is a second copy of it.
_SERIES_OF: Final = (
    "SELECT site, series, run, tag, kind, sensors FROM series INDEXED BY series_of"
    " WHERE site = 'local'"
)
# Small tables, and the column by which each is ordered.
_SMALL: Final = {"run": "run", "series": "series", "place": "seq", "note": "id"}
_NO_RUN: Final = "run NOT IN (SELECT run FROM run)"
_MEANINGLESS: Final = {
    "run": "joins NOT IN (SELECT run FROM run)",
    "series": f"{_NO_RUN} OR NOT json_valid(sensors)",
    "place": _NO_RUN,
}
# Counts of deleted rows are copied; rows that exist are counted again.
_COUNTED: Final = {
    "hour": ("series", f"hour <= :at / {HOUR_NS}"),
    "tally": ("run", f"hour <= :at / {HOUR_NS}"),
    "event": ("run", "stamp_ns <= :at"),
}
_HAS_SENSOR: Final = "SELECT 1 FROM pragma_table_info('hour') WHERE name = 'sensor'"
_NOT_DELETED: Final = (
    (
        "DELETE FROM hour WHERE series IN (SELECT series FROM series WHERE run = :run)"
        f" AND hour > :at / {HOUR_NS}"
    ),
    f"DELETE FROM tally WHERE run = :run AND hour > :at / {HOUR_NS}",
    "DELETE FROM event WHERE run = :run AND stamp_ns > :at",
)

Record = tuple[Any, ...]


def numbered(path: Path, end: str) -> Iterator[Path]:
    """Yield names of files beside `path`, to find one that is not taken."""
    for number in count():
        yield path.with_name(f"{path.name}{end}" + (f"-{number}" if number else ""))


def quarantine(path: Path) -> Path:
    """Rename a file and its WAL; returns the new path. No data is deleted or overwritten.

    In its place comes a new file which names it, so that a salvage that fails is done again. If
    this is killed, the next call completes it (`begun_quarantine`).
    """
    new, name = _new_of(path), begun_quarantine(path)
    if not name:
        delete(new)
        # Wall time, for the person who looks for the file.
        when = time.strftime("%Y%m%dT%H%M%SZ", time.gmtime())
        free = (file for file in numbered(path, f".damaged-{when}") if not file.exists())
        name = next(free).name
        with closing(open_writer(new)) as connection:
            set_meta(connection, SALVAGE, name)
    quarantined = path.with_name(name)
    # The WAL first: SQLite would read it as that of the new file.
    for end in ("-wal", ""):
        old, its = path.with_name(path.name + end), quarantined.with_name(name + end)
        if old.exists() and not its.exists():
            old.rename(its)
    # SQLite rebuilds the WAL's index from the WAL; one left behind would be of another file. So
    # would be an empty WAL, which a reader makes if it finds none.
    delete(path, "-wal", "-shm")
    new.rename(path)
    return quarantined


def begun_quarantine(path: Path) -> str:
    """The new name of a file whose quarantine was killed; empty: none was."""
    try:
        with closing(open_reader(_new_of(path))) as connection:
            name = get_meta(connection, SALVAGE) or ""
    except (*FILE_ERRORS, Foreign, OSError):
        return ""
    # If both exist, another journal has been begun since then.
    return "" if path.exists() and path.with_name(name).exists() else name


def _new_of(path: Path) -> Path:
    return path.with_name(path.name + ".new")


def delete(path: Path, *ends: str) -> None:
    """Delete a file and those of SQLite beside it, or only those with these endings."""
    for end in ends or ("", "-journal", "-wal", "-shm"):
        path.with_name(path.name + end).unlink(missing_ok=True)


def readable(
    connection: sqlite3.Connection, select: str, number: str, after: int = -1
) -> Iterator[list[Record]]:
    """Yield lots of rows in the order of their number, the first column; an empty lot is damage.

    `select` is a query up to the condition on the number: "SELECT id, .. FROM table WHERE".
    """
    text = f"{select} {number} >= ? ORDER BY {number} LIMIT ?"

    def lot(at: int, size: int) -> list[Record] | None:
        try:
            rows = connection.execute(text, (at, size)).fetchall()
        except FILE_ERRORS as error:
            if _is_unreadable(error):
                return None
            raise
        # A number may be damaged: rows count only if it is within the lot's range. The last row of
        # a full lot is left to the next one.
        numbers = [row[0] for row in rows[-1:] if isinstance(row[0], int)]
        if len(rows) == size > 1:
            del rows[-1]
        fitting = [
            row
            for row in rows
            if isinstance(row[0], int) and at <= row[0] <= max(numbers, default=0)
        ]
        # No such row before the end means that the order is damaged.
        return None if not fitting and (rows or at <= end) else fitting

    at, size, end = after + 1, _LOT, -1
    with suppress(*FILE_ERRORS):
        for last in connection.execute(f"{select} {number} >= 0 ORDER BY {number} DESC LIMIT 1"):
            end = last[0] if isinstance(last[0], int) else -1
    while at < _LAST and (rows := lot(at, size)) != []:
        if rows:
            yield rows
            at = max(row[0] for row in rows) + 1
        elif size > 1:
            size //= 2
        else:
            yield []
            at, size = _behind_damage(lot, at), _LOT


def _behind_damage(lot: Callable[[int, int], object], bad: int) -> int:
    """The number after damage from which rows can be read again."""
    step = 1
    while bad + step < _LAST and lot(bad + step, 1) is None:
        bad += step
        step += step // 8 + 1
    good = bad + step
    while good - bad > 1:
        middle = (good + bad) // 2
        bad, good = (middle, good) if lot(middle, 1) is None else (bad, middle)
    return good


def salvage(quarantined: Path, connection: sqlite3.Connection) -> None:
    """Copy what can be read of a quarantined journal into a new one; rows keep their numbers.

    After a salvage that was killed, everything is copied again. If the quarantined file is gone,
    nothing is copied.

    Raises:
        sqlite3.Error, OSError: the new one cannot be written, or the old one cannot be opened.

    """
    if not quarantined.exists():
        return
    mended = quarantined.with_name(quarantined.name + ".mended")
    try:
        with closing(_opened(quarantined)) as old:
            is_known = _has_tables(old)
            if is_known:
                _copy(old, connection, quarantined.stat().st_size)
        if not is_known:
            _mend(quarantined, mended)
            with closing(_opened(mended)) as old:
                _copy(old, connection, quarantined.stat().st_size)
    finally:
        delete(quarantined, "-shm")
        delete(mended)


def _is_unreadable(error: Exception) -> bool:
    """Whether these rows cannot be read, now or later: of damage, or by a disk's bad sector."""
    code = getattr(error, "sqlite_errorcode", None)
    return is_damage_error(error) or code == sqlite3.SQLITE_IOERR_READ


def _opened(path: Path) -> sqlite3.Connection:
    name = f"file:{quote(os.fsencode(path))}?mode=ro"
    return sqlite3.connect(name, uri=True, isolation_level=None)


def _has_tables(old: sqlite3.Connection) -> bool:
    try:
        for table in TABLES:
            old.execute(f"SELECT site FROM {table} WHERE 0").fetchall()
    except FILE_ERRORS:
        return False
    return True


def _mend(quarantined: Path, mended: Path) -> None:
    """Copy a file with a new one's header and schema, which lie at the same place in each."""
    for end in ("", "-wal"):
        if quarantined.with_name(quarantined.name + end).exists():
            shutil.copyfile(
                quarantined.with_name(quarantined.name + end), mended.with_name(mended.name + end)
            )
    content, roots = empty_file()
    with mended.open("rb+") as file:
        for number in range(len(content) // PAGE_SIZE):
            if number + 1 not in roots:
                file.seek(number * PAGE_SIZE)
                file.write(content[number * PAGE_SIZE : (number + 1) * PAGE_SIZE])
        # With a page count of 0, SQLite uses the file's size.
        file.seek(28)
        file.write(bytes(4))


def _copy(old: sqlite3.Connection, new: sqlite3.Connection, size: int) -> None:
    with transaction(new):
        for table in TABLES:
            new.execute(f"DELETE FROM {table}")
        purged = _copy_facts(old, new, size)
        for table, by in _SMALL.items():
            _put(new, table, _both_ends(old, _ALL.format(table), by))
        _put(new, "series", _both_ends(old, _SERIES_OF, "run"))
        if purged:
            _copy_counts(old, new, max(purged.values()))
        for table, is_meaningless in _MEANINGLESS.items():
            new.execute(f"DELETE FROM {table} WHERE {is_meaningless}")
        for (run,) in new.execute("SELECT run FROM run").fetchall():
            within = {"run": run, "at": purged.get(run, -1)}
            for of_run in _NOT_DELETED:
                new.execute(of_run, within)
    for table in WRITTEN:
        select, behind = f"SELECT seq, * FROM {table} WHERE site = 'local' AND", -1
        for lot in filter(None, readable(old, select, "seq")):
            last = max(row[0] for row in lot)
            with transaction(new):
                _put(new, table, (row[1:] for row in lot))
                delete_wrong(new, table, behind, last)
                count_rows(SiteLog(new), behind, last, purged)
            behind = last
            # Move each lot into the file, so that the WAL does not grow.
            new.execute("PRAGMA wal_checkpoint(PASSIVE)").fetchall()


def _copy_counts(old: sqlite3.Connection, new: sqlite3.Connection, at_ns: int) -> None:
    """Copy the counts up to a stamp."""
    for table, (by, which) in _COUNTED.items():
        select = _ALL.format(table)
        if table == "hour" and not old.execute(_HAS_SENSOR).fetchone():  # of version 4
            of_lists = HOURS_OF_LISTS.format(lists=table, each="json_each(n) AS each")
            select = f"{of_lists} AND site = 'local'"
        _put(new, table, _both_ends(old, f"{select} AND {which}", by, {"at": at_ns}))


def _both_ends(
    old: sqlite3.Connection, select: str, by: str, values: Mapping[str, Any] | None = None
) -> Iterator[Record]:
    """Yield rows from the first one up to damage, then from the last one back to damage."""
    for order in ("ASC", "DESC"):
        try:
            yield from old.execute(f"{select} ORDER BY {by} {order}", values or {})
        except FILE_ERRORS as error:
            if not _is_unreadable(error):
                raise
        else:
            return


def _copy_facts(old: sqlite3.Connection, new: sqlite3.Connection, size: int) -> dict[int, int]:
    """Copy facts about the journal as a whole; returns the last deleted stamp of each run."""
    purged, largest = {}, size // _LEAST_ROW_BYTES
    for _, key, value in _both_ends(old, _ALL.format("meta"), "key"):
        run = str(key).removeprefix(DELETED)
        is_sound = is_number(str(value))
        if key in (LAST_SEQ, PURGED_SEQ) and is_sound:
            largest = max(largest, int(value))
        if run != key and is_number(run) and is_sound:
            # The whole hour is counted already.
            purged[int(run)] = (int(value) // HOUR_NS + 1) * HOUR_NS - 1
        is_sound |= key != PURGED_SEQ and "_ns" not in str(key)
        if is_sound and key not in ("journal_id", SALVAGE, LAST_SEQ):
            set_meta(new, key, value)
    # New numbers are past those of all rows that may have been lost at the end.
    set_meta(new, LAST_SEQ, largest + 1_000_000)
    return purged


def _put(new: sqlite3.Connection, table: str, rows: Iterable[Record]) -> None:
    """Put rows into a table of the new file, if each column is of its type."""
    types = [
        _TYPES[kind] if is_needed else (*_TYPES[kind], NoneType)
        for _, _, kind, is_needed, *_ in new.execute(f"PRAGMA table_info({table})").fetchall()
    ]
    fitting = [row for row in rows if row[0] == LOCAL_SITE and all(map(isinstance, row, types))]
    new.executemany(f"{insert_into(table)} ON CONFLICT DO NOTHING", fitting)
