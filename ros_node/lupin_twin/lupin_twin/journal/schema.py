"""The file: its tables, how it is opened, and what a file that is none of ours is called.

One row a scan, append-only. `id` is the number of the write, one sequence over all kinds, so that
the order in which things were heard can be replayed. A `series` is what scans have in common: run,
tag, kind, status, source and the set of sensors. It keeps rows short, and the newest of each series
by a moment is one step in `scan_at`. A stamp that was sent and could not be true (from the future,
or none: 0) stands in `own_stamp_ns`. The view `scans` spells rows out, arrivals included. The one
run that goes on has no `ended_stamp_ns`. A `change` is a look that saw a pest where the look before
it had not, or the other way round; a `tally` counts tries in five minutes, `tally_hour` in an hour.
A site would be a column of `run`, for everything hangs on that.
"""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from functools import cache
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote

APPLICATION_ID: Final = 0x4C55504A  # "LUPJ"
VERSION: Final = 3

# A commit writes whole pages, and a commit is a few scans: with 1 kB pages the disk gets 0.8 kB a
# reading at 10,000 tags, with 4 kB pages 2.0 kB; the file is a twentieth larger.
PAGE_SIZE: Final = 1024

_TALLY: Final = """
    run INTEGER NOT NULL, slot INTEGER NOT NULL,
    first_ns INTEGER NOT NULL, last_ns INTEGER NOT NULL, gap_ns INTEGER NOT NULL,
    scan_n INTEGER, scan_total INTEGER, scan_low INTEGER, scan_high INTEGER,
    failure_n INTEGER, failure_total INTEGER, failure_low INTEGER, failure_high INTEGER,
    look_n INTEGER, look_total INTEGER, look_low INTEGER, look_high INTEGER,
    PRIMARY KEY (run, slot)
"""
_TABLES: Final = f"""
CREATE TABLE meta (key TEXT PRIMARY KEY, value ANY NOT NULL) STRICT, WITHOUT ROWID;
CREATE TABLE run (
    id INTEGER PRIMARY KEY, is_simulated INTEGER NOT NULL,
    begun_stamp_ns INTEGER NOT NULL, begun_arrival_ns INTEGER NOT NULL, lead_ns INTEGER NOT NULL,
    follows INTEGER, carries INTEGER NOT NULL, ended_stamp_ns INTEGER
) STRICT;
CREATE TABLE tag (id INTEGER PRIMARY KEY, tag_id TEXT NOT NULL UNIQUE) STRICT;
CREATE TABLE name (id INTEGER PRIMARY KEY, text TEXT NOT NULL UNIQUE) STRICT;
CREATE TABLE sensors (id INTEGER PRIMARY KEY, names TEXT NOT NULL UNIQUE) STRICT;
CREATE TABLE series (
    id INTEGER PRIMARY KEY, run INTEGER NOT NULL, tag INTEGER NOT NULL, kind INTEGER NOT NULL,
    status INTEGER NOT NULL, source INTEGER NOT NULL, sensors INTEGER NOT NULL,
    UNIQUE (run, tag, kind, source, status, sensors)
) STRICT;
CREATE TABLE scan (
    id INTEGER PRIMARY KEY, series INTEGER NOT NULL, stamp_ns INTEGER NOT NULL,
    own_stamp_ns INTEGER, lag_us INTEGER NOT NULL, mission INTEGER NOT NULL, detail TEXT,
    readings BLOB NOT NULL
) STRICT;
CREATE INDEX scan_at ON scan (series, stamp_ns);
CREATE INDEX scan_sent ON scan (series, own_stamp_ns) WHERE own_stamp_ns IS NOT NULL;
CREATE TABLE look (
    id INTEGER PRIMARY KEY, series INTEGER NOT NULL, stamp_ns INTEGER NOT NULL,
    own_stamp_ns INTEGER, lag_us INTEGER NOT NULL, mission INTEGER NOT NULL,
    species INTEGER NOT NULL, anomaly INTEGER NOT NULL, flower_count INTEGER NOT NULL,
    bug_count INTEGER NOT NULL, shape BLOB NOT NULL
) STRICT;
CREATE INDEX look_at ON look (series, stamp_ns);
CREATE INDEX look_sent ON look (series, own_stamp_ns) WHERE own_stamp_ns IS NOT NULL;
CREATE TABLE pin (
    id INTEGER PRIMARY KEY, run INTEGER NOT NULL, tag INTEGER NOT NULL, stamp_ns INTEGER NOT NULL,
    lag_us INTEGER NOT NULL, pose BLOB NOT NULL, UNIQUE (run, tag)
) STRICT;
CREATE TABLE rollup (
    series INTEGER NOT NULL, hour INTEGER NOT NULL, buckets BLOB NOT NULL,
    PRIMARY KEY (series, hour)
) STRICT, WITHOUT ROWID;
CREATE TABLE change (
    id INTEGER PRIMARY KEY, run INTEGER NOT NULL, tag INTEGER NOT NULL, stamp_ns INTEGER NOT NULL,
    anomaly INTEGER NOT NULL, bug_count INTEGER NOT NULL
) STRICT;
CREATE INDEX change_of ON change (run, tag, stamp_ns, anomaly, bug_count);
CREATE INDEX change_at ON change (run, stamp_ns, anomaly, bug_count);
CREATE TABLE tally ({_TALLY}) STRICT, WITHOUT ROWID;
CREATE TABLE tally_hour ({_TALLY}) STRICT, WITHOUT ROWID;
CREATE VIEW scans AS
    SELECT scan.id, series.run, tag.tag_id, stamp_ns,
        stamp_ns + run.lead_ns + 1000 * lag_us AS arrival_ns, kind, status, detail,
        source.text AS source, mission.text AS mission, sensors.names AS sensors, readings
    FROM scan JOIN series ON series.id = scan.series JOIN tag ON tag.id = series.tag
        JOIN run ON run.id = series.run JOIN sensors ON sensors.id = series.sensors
        JOIN name AS source ON source.id = series.source
        JOIN name AS mission ON mission.id = scan.mission;
"""  # noqa: S608  # of constants

_MAGIC: Final = b"SQLite format 3\0"
# Errors that say that the file itself is no longer what was written.
_DAMAGE: Final = frozenset({sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB})
_BAD_TEXT: Final = ("Could not decode to UTF-8", "malformed JSON")


class Foreign(Exception):
    """A file of somebody else, or of a newer version: it is left as it is."""


class Empty(FileNotFoundError):
    """A file with nothing in it: a journal that is just being made."""


class DamagedFile(Exception):
    """A journal whose header or tables are not what was written."""


# What opening or reading a file that is no longer what was written may end in. Python cannot decode
# what SQLite quotes of a damaged table.
FILE_ERRORS: Final = (sqlite3.Error, DamagedFile, UnicodeDecodeError)


def says_damaged(error: BaseException) -> bool:
    """Whether an error means that the file is damaged."""
    if isinstance(error, (DamagedFile, UnicodeDecodeError)):
        return True
    # A text that is none any more: SQLite does not look into texts, Python and its JSON do.
    if isinstance(error, sqlite3.Error) and str(error).startswith(_BAD_TEXT):
        return True
    code = getattr(error, "sqlite_errorcode", None)
    return code is not None and code & 0xFF in _DAMAGE


def open_writer(path: Path) -> sqlite3.Connection:
    """The one connection that writes, in the calling thread; makes the file where there is none.

    A commit goes to the write-ahead log and is not waited for: whoever holds the connection
    syncs that. Nothing is checkpointed unless asked for.

    Raises:
        Foreign: the file is somebody else's.
        sqlite3.Error, OSError: it cannot be opened, or is damaged (`says_damaged`).

    """
    is_new = not path.exists() or path.stat().st_size == 0
    connection = sqlite3.connect(path, isolation_level=None, timeout=5.0)
    try:
        connection.execute("PRAGMA mmap_size = 0")
        if is_new:
            _create(connection, path)
        _check_identity(connection, path)
        connection.execute("PRAGMA journal_mode = WAL")
        connection.execute("PRAGMA synchronous = NORMAL")
        connection.execute("PRAGMA wal_autocheckpoint = 0")
        connection.execute("PRAGMA cache_size = -16000")
    except BaseException:
        connection.close()
        raise
    return connection


def _create(connection: sqlite3.Connection, path: Path) -> None:
    connection.execute("PRAGMA synchronous = FULL")
    connection.execute(f"PRAGMA page_size = {PAGE_SIZE}")
    # All of it comes in one transaction: for the mode of the vacuum alone SQLite writes a page too.
    connection.executescript(
        f"BEGIN; PRAGMA auto_vacuum = INCREMENTAL; {_TABLES} "
        f"PRAGMA application_id = {APPLICATION_ID}; PRAGMA user_version = {VERSION}; COMMIT;"
    )
    connection.execute("PRAGMA journal_mode = WAL")
    sync_folder(path.parent)


@contextmanager
def transaction(connection: sqlite3.Connection) -> Iterator[None]:
    """All or nothing of what is written within."""
    connection.execute("BEGIN IMMEDIATE")
    try:
        yield
        connection.execute("COMMIT")
    except BaseException:
        if connection.in_transaction:
            connection.execute("ROLLBACK")
        raise


def sync_folder(folder: Path) -> None:
    """Make the names in a folder last."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


# What was found of a file and never changes, by what it is: see `journal.fixed`.
Kept = dict[object, Any]


class Reader(sqlite3.Connection):
    """A connection that cannot write, and what was found over it or over others to the file."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self.kept: Kept = {}


def open_reader(path: Path, *, is_still: bool = False, kept: Kept | None = None) -> Reader:
    """A connection that cannot write; it may be used in one thread at a time.

    `is_still`: nobody writes the file, and it has no log: then its folder may be read-only too.
    `kept` is what other connections to the same file keep, which may be used meanwhile.

    Raises:
        Empty: nothing is in it yet.
        Foreign, DamagedFile, sqlite3.Error: as `open_writer`.

    """
    connection = sqlite3.connect(
        f"file:{quote(os.fsencode(path))}?mode=ro{'&immutable=1' if is_still else ''}",
        uri=True,
        isolation_level=None,
        timeout=5.0,
        check_same_thread=False,
        factory=Reader,
    )
    try:
        connection.execute("PRAGMA mmap_size = 0")
        connection.execute("PRAGMA query_only = 1")
        if kept is not None:
            connection.kept = kept
        _check_identity(connection, path)
    except BaseException:
        connection.close()
        raise
    return connection


def open_named(path: Path, *, is_still: bool = False) -> Reader:
    """As `open_reader`, of a file that somebody names: what is no database is not called damaged.

    Raises:
        Empty, Foreign, DamagedFile, sqlite3.Error, OSError: as `open_reader`.

    """
    try:
        return open_reader(path, is_still=is_still)
    except (sqlite3.DatabaseError, Empty) as error:
        # Looked at only now: to close a file that SQLite has open takes its locks away. To SQLite
        # a file of a few bytes is empty.
        code = getattr(error, "sqlite_errorcode", sqlite3.SQLITE_NOTADB)
        if code == sqlite3.SQLITE_NOTADB and _starts_as_something_else(path):
            raise Foreign(
                f"{path} is no journal: it does not begin as SQLite's files do"
            ) from error
        raise


def _starts_as_something_else(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(len(_MAGIC)) not in {b"", _MAGIC}


def _check_identity(connection: sqlite3.Connection, path: Path) -> None:
    # This first: all that a file that is being made is to hold comes at once.
    if connection.execute("PRAGMA page_count").fetchone() == (0,):
        raise Empty(f"{path} is empty: a journal that is just being made, or none")
    (application_id,) = connection.execute("PRAGMA application_id").fetchone()
    (version,) = connection.execute("PRAGMA user_version").fetchone()
    if application_id != APPLICATION_ID:
        ours = connection.execute("SELECT 1 FROM sqlite_schema WHERE name = 'scan_at'").fetchone()
        if ours:
            raise DamagedFile(f"{path} is a journal with a damaged header")
        raise Foreign(f"{path} is a database, but not a journal of lupin-twin")
    if version != VERSION:
        raise Foreign(f"{path} is a journal of version {version}, this is version {VERSION}")
    if connection.execute(_SCHEMA).fetchall() != _own_tables():
        raise DamagedFile(f"the tables of {path} are not those of a journal")


# Tables, indexes and the view, word for word: no other check sees a flipped letter in them.
_SCHEMA: Final = "SELECT CAST(sql AS BLOB) FROM sqlite_schema WHERE sql != '' ORDER BY sql"


@cache
def _own_tables() -> list[tuple[bytes]]:
    with closing(sqlite3.connect(":memory:")) as new:
        new.executescript(_TABLES)
        return new.execute(_SCHEMA).fetchall()


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
