# ruff: noqa: S608  # SQL is put together of constants
"""Replaces a damaged journal by a new one with what can be read of it.

SQLite itself reads the file, on both sides of each damaged page. With such a page, the new file
loses its rows, and those of the pages that are reachable only through it. Counts of lost rows stay,
as those of deleted rows do; lost counts are made again of the rows.
"""

from __future__ import annotations

import errno
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

from lupin_twin.journal.appending import LAST_SEQ, PURGED_SEQ
from lupin_twin.journal.checking import delete_wrong, size_of
from lupin_twin.journal.counts import count_rows, extent
from lupin_twin.journal.paths import delete, finish_replacing, ready
from lupin_twin.journal.retention import note_lost
from lupin_twin.journal.rows import is_number
from lupin_twin.journal.runs import runs
from lupin_twin.journal.schema import (
    FILE_ERRORS,
    HOURS_OF_LISTS,
    LOCAL_SITE,
    PAGE_SIZE,
    TABLES,
    WRITTEN,
    SiteLog,
    empty_file,
    insert_into,
    is_damage_error,
    open_writer,
    set_meta,
    sync,
    transaction,
    upsert_into,
)

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
# Tables that are copied at once, and the column by which each is ordered.
_ORDERS: Final = {"run": "run", "series": "series", "place": "seq", "note": "id"}
_COUNTS: Final = {"hour": "series", "tally": "run", "event": "run"}
_NO_RUN: Final = "run NOT IN (SELECT run FROM run)"
_MEANINGLESS: Final = {
    "run": "joins NOT IN (SELECT run FROM run)",
    "series": f"{_NO_RUN} OR NOT json_valid(sensors)",
    "hour": "series NOT IN (SELECT series FROM series)",
    **dict.fromkeys(("place", "tally", "event"), _NO_RUN),
}
_HAS_SENSOR: Final = "SELECT 1 FROM pragma_table_info('hour') WHERE name = 'sensor'"

Record = tuple[Any, ...]


def replace_journal(path: Path, new: Path, end: str) -> Path:
    """Put a new file in a journal's place; the old one and its WAL get another name with this end.

    Returns that name. No data is deleted or overwritten. If this is killed, the old file is still
    in its place, or `finish_replacing` puts the new one there.
    """
    if size_of(new.with_name(new.name + "-wal")):  # closing it reports no error
        raise OSError(errno.ENOSPC, f"the WAL of {new} could not be moved into the file")
    sync(new)
    new.chmod(path.stat().st_mode & 0o777)
    for number in count():
        old = path.with_name(path.name + end + (f"-{number}" if number else ""))
        if not old.exists() or old.samefile(path):  # killed after this step
            break
    for part in ("", "-wal"):
        one, other = path.with_name(path.name + part), old.with_name(old.name + part)
        if size_of(one) and not other.exists():
            _give_name(one, other)
    sync(path.parent)
    new.rename(ready(path))
    path.unlink()
    finish_replacing(path)
    return old


def _give_name(path: Path, other: Path) -> None:
    try:
        os.link(path, other)
    except OSError:  # a file system without links
        part = path.with_name(path.name + ".copy")
        try:
            shutil.copyfile(path, part)
            sync(part)
        except OSError:  # the disk is full: a partial copy would keep it so
            part.unlink(missing_ok=True)
            raise
        part.rename(other)


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


def salvage(path: Path) -> Path:
    """Quarantine a damaged journal, with a new one in its place; rows keep their numbers.

    Returns the damaged file's new name, which tells the time. It is unknown what could not be read,
    so each run counts as incomplete up to now.

    Raises:
        sqlite3.Error, OSError: the damaged file is still in its place: the disk is full, say.

    """
    new, mended = (path.with_name(path.name + end) for end in (".salvage", ".mended"))
    for left in (new, mended):  # by a salvage that was killed
        delete(left)
    try:
        with closing(open_writer(new)) as target:
            with closing(_opened(path)) as old:
                is_known = _has_tables(old)
                if is_known:
                    _copy(old, target, path.stat().st_size)
            if not is_known:
                _mend(path, mended)
                with closing(_opened(mended)) as old:
                    _copy(old, target, path.stat().st_size)
            log = SiteLog(target)
            for run in runs(log.execute):
                # A simulation's time may have stood still since its last row.
                now_ns = 0 if run.begun.is_simulated else time.time_ns()
                last_ns = max(now_ns, run.begun.stamp_ns, *(extent(log, run.root) or ()))
                note_lost(target, run.root, last_ns)
        # Wall time, for the person who looks for the file.
        when = time.strftime("%Y%m%dT%H%M%SZ", time.gmtime())
        return replace_journal(path, new, f".damaged-{when}")
    finally:
        delete(new)
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


def _mend(damaged: Path, mended: Path) -> None:
    """Copy a file with a new one's header and schema, which lie at the same place in each."""
    for end in ("", "-wal"):
        if (part := damaged.with_name(damaged.name + end)).exists():
            shutil.copyfile(part, mended.with_name(mended.name + end))
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
        _copy_facts(old, new, size)
        for table, by in _ORDERS.items():
            _put(new, table, _both_ends(old, _ALL.format(table), by))
        _put(new, "series", _both_ends(old, _SERIES_OF, "run"))
        _delete_meaningless(new)
    for table in WRITTEN:
        select, behind = f"SELECT seq, * FROM {table} WHERE site = 'local' AND", -1
        for lot in filter(None, readable(old, select, "seq")):
            last = max(row[0] for row in lot)
            with transaction(new):
                _put(new, table, (row[1:] for row in lot))
                delete_wrong(new, table, behind, last)
                count_rows(SiteLog(new), behind, last, {})
            behind = last
            # Move each lot into the file, so that the WAL does not grow.
            new.execute("PRAGMA wal_checkpoint(PASSIVE)").fetchall()
    # What was counted there includes rows that are gone; what cannot be read is counted again.
    with transaction(new):
        for table, by in _COUNTS.items():
            select = _ALL.format(table)
            if table == "hour" and not old.execute(_HAS_SENSOR).fetchone():  # of version 4
                of_lists = HOURS_OF_LISTS.format(lists=table, each="json_each(n) AS each")
                select = f"{of_lists} AND site = 'local'"
            _put(new, table, _both_ends(old, select, by), upsert_into(table))
        _delete_meaningless(new)


def _delete_meaningless(new: sqlite3.Connection) -> None:
    for table, is_meaningless in _MEANINGLESS.items():
        new.execute(f"DELETE FROM {table} WHERE {is_meaningless}")


def _both_ends(old: sqlite3.Connection, select: str, by: str) -> Iterator[Record]:
    """Yield rows from the first one up to damage, then from the last one back to damage."""
    for order in ("ASC", "DESC"):
        try:
            yield from old.execute(f"{select} ORDER BY {by} {order}")
        except FILE_ERRORS as error:
            if not _is_unreadable(error):
                raise
        else:
            return


def _copy_facts(old: sqlite3.Connection, new: sqlite3.Connection, size: int) -> None:
    """Copy facts about the journal as a whole."""
    largest = size // _LEAST_ROW_BYTES
    for _, key, value in _both_ends(old, _ALL.format("meta"), "key"):
        is_sound = is_number(str(value))
        if key in (LAST_SEQ, PURGED_SEQ) and is_sound:
            largest = max(largest, int(value))
        is_sound |= key != PURGED_SEQ and "_ns" not in str(key)
        if is_sound and key not in ("journal_id", LAST_SEQ):
            set_meta(new, key, value)
    # New numbers are past those of all rows that may have been lost at the end.
    set_meta(new, LAST_SEQ, largest + 1_000_000)


def _put(
    new: sqlite3.Connection, table: str, rows: Iterable[Record], insert: str | None = None
) -> None:
    """Put rows into a table of the new file, if each column is of its type."""
    types = [
        _TYPES[kind] if is_needed else (*_TYPES[kind], NoneType)
        for _, _, kind, is_needed, *_ in new.execute(f"PRAGMA table_info({table})").fetchall()
    ]
    fitting = (row for row in rows if row[0] == LOCAL_SITE and all(map(isinstance, row, types)))
    new.executemany(insert or f"{insert_into(table)} ON CONFLICT DO NOTHING", fitting)
