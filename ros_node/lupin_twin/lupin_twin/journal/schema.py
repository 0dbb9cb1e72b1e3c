"""The journal's tables, for SQLite and PostgreSQL alike; opening a file; queries on one site.

Plain SQL that any tool reads. `site` leads every key; a twin's own file has only one, `local`.
Times are ns: stamps are ROS time, arrivals are wall time.

`seq` is one sequence over scan, look and place, in the order of arrival. The number of a series is
the seq of its first write. Inspections have a series too, of kind 1 without sensors; the id of a
note begins with its number. A failed attempt is a scan whose status is not 0; a failed inspection
is such a scan in the inspections' series. `own_stamp_ns` is the stamp that was sent, if it cannot
be true (from the future; 0: none). It is NULL if it equals `stamp_ns`, and -1 in a copy that no
stamp identifies. A copy (`is_copy`) is what was known when a run or a step began; `begun_seq` is
the first copy. A step is a row of `run` that `joins` another: the same run, whose clock was
corrected a little. Rows refer to the run, never to the step. `ended_stamp_ns` is NULL in the
current run, and in a step.

Counts are written with their rows, without copies, and outlive them. `hour` has the count, sum,
minimum and maximum of a sensor's finite readings; `sensor` is its place in `sensors`, from 0.
`tally` has the same of the site's scans, failures and inspections, with the first and the last
stamp. `event` has what is rare: pests seen and cleared, with the number of bugs, and silences
(more than ten minutes without an attempt), in ns.
"""

from __future__ import annotations

import json
import os
import re
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote

from lupin_twin.journal import sql

APPLICATION_ID: Final = 0x4C55504A  # "LUPJ"
VERSION: Final = 5
# Earlier versions that are upgraded (see `rebuild`); no release wrote others.
UPGRADED: Final = (3, 4)
LOCAL_SITE: Final = "local"
# All tables but `site` and `meta`; those of observations.
TABLES: Final = ("run", "series", "scan", "look", "place", "hour", "tally", "event", "note")
WRITTEN: Final = ("scan", "look")

# A commit has a few scans, and writes whole pages: small ones. With 512 bytes, each row over 102
# bytes would need a further page, such as a scan of five readings with all digits.
PAGE_SIZE: Final = 1024

# {key}: a clause that only SQLite has. {months}: PostgreSQL partitions large tables by month of the
# stamp, which then is part of the key.
_HOUR: Final = """
CREATE TABLE hour (
    site TEXT NOT NULL, series BIGINT NOT NULL, hour BIGINT NOT NULL, sensor INTEGER NOT NULL,
    n BIGINT NOT NULL, total DOUBLE PRECISION NOT NULL, low DOUBLE PRECISION NOT NULL,
    high DOUBLE PRECISION NOT NULL, PRIMARY KEY (site, series, hour, sensor)
){key};
"""
_TABLES: Final = (
    """
CREATE TABLE meta (
    site TEXT NOT NULL, key TEXT NOT NULL, value TEXT NOT NULL, PRIMARY KEY (site, key)
){key};
CREATE TABLE site (site TEXT NOT NULL PRIMARY KEY, name TEXT NOT NULL){key};
CREATE TABLE run (
    site TEXT NOT NULL, run BIGINT NOT NULL, is_simulated INTEGER NOT NULL,
    begun_stamp_ns BIGINT NOT NULL, begun_arrival_ns BIGINT NOT NULL, begun_seq BIGINT NOT NULL,
    joins BIGINT, ended_stamp_ns BIGINT, PRIMARY KEY (site, run)
){key};
CREATE TABLE series (
    site TEXT NOT NULL, series BIGINT NOT NULL, run BIGINT NOT NULL, tag TEXT NOT NULL,
    kind INTEGER NOT NULL, sensors TEXT NOT NULL, PRIMARY KEY (site, series)
){key};
CREATE UNIQUE INDEX series_of ON series (site, run, tag, kind, sensors);
CREATE TABLE scan (
    site TEXT NOT NULL, seq BIGINT NOT NULL, series BIGINT NOT NULL, stamp_ns BIGINT NOT NULL,
    own_stamp_ns BIGINT, arrival_ns BIGINT NOT NULL, status INTEGER NOT NULL,
    source TEXT NOT NULL, mission TEXT NOT NULL, detail TEXT NOT NULL, is_copy INTEGER NOT NULL,
    readings TEXT NOT NULL, PRIMARY KEY (site, seq{stamp})
){months};
CREATE INDEX scan_at ON scan (site, series, stamp_ns, seq);
CREATE INDEX scan_sent ON scan (site, series, own_stamp_ns) WHERE own_stamp_ns IS NOT NULL;
CREATE INDEX scan_failed ON scan (site, series, stamp_ns) WHERE status != 0;
CREATE INDEX scan_bare ON scan (site, series, stamp_ns, seq) WHERE status = 0 AND readings = '[]';
CREATE TABLE look (
    site TEXT NOT NULL, seq BIGINT NOT NULL, run BIGINT NOT NULL, tag TEXT NOT NULL,
    stamp_ns BIGINT NOT NULL, own_stamp_ns BIGINT, arrival_ns BIGINT NOT NULL,
    source TEXT NOT NULL, mission TEXT NOT NULL, species TEXT NOT NULL,
    confidence DOUBLE PRECISION, anomaly INTEGER NOT NULL, flower_count INTEGER NOT NULL,
    bug_count INTEGER NOT NULL, is_copy INTEGER NOT NULL, blooms TEXT NOT NULL, box TEXT NOT NULL,
    PRIMARY KEY (site, seq{stamp})
){months};
CREATE INDEX look_at ON look (site, run, tag, stamp_ns, seq);
CREATE INDEX look_when ON look (site, run, stamp_ns);
CREATE INDEX look_sent ON look (site, run, tag, own_stamp_ns) WHERE own_stamp_ns IS NOT NULL;
CREATE TABLE place (
    site TEXT NOT NULL, seq BIGINT NOT NULL, run BIGINT NOT NULL, tag TEXT NOT NULL,
    stamp_ns BIGINT NOT NULL, arrival_ns BIGINT NOT NULL,
    x DOUBLE PRECISION NOT NULL, y DOUBLE PRECISION NOT NULL, z DOUBLE PRECISION NOT NULL,
    qx DOUBLE PRECISION NOT NULL, qy DOUBLE PRECISION NOT NULL, qz DOUBLE PRECISION NOT NULL,
    qw DOUBLE PRECISION NOT NULL, is_copy INTEGER NOT NULL, PRIMARY KEY (site, seq)
){key};
CREATE INDEX place_of ON place (site, run, tag);
CREATE TABLE tally (
    site TEXT NOT NULL, run BIGINT NOT NULL, event TEXT NOT NULL, hour BIGINT NOT NULL,
    n BIGINT NOT NULL, total BIGINT NOT NULL, low BIGINT NOT NULL, high BIGINT NOT NULL,
    first_ns BIGINT NOT NULL, last_ns BIGINT NOT NULL, PRIMARY KEY (site, run, event, hour)
){key};
CREATE TABLE event (
    site TEXT NOT NULL, run BIGINT NOT NULL, event TEXT NOT NULL, stamp_ns BIGINT NOT NULL,
    seq BIGINT NOT NULL, tag TEXT NOT NULL, value BIGINT NOT NULL,
    PRIMARY KEY (site, run, event, stamp_ns, seq)
){key};
CREATE INDEX event_of ON event (site, run, tag, stamp_ns, seq);
CREATE TABLE note (
    site TEXT NOT NULL, id TEXT NOT NULL, made_at_ns BIGINT NOT NULL, made_by TEXT NOT NULL,
    kind TEXT NOT NULL, subject TEXT NOT NULL, text TEXT NOT NULL, until_ns BIGINT,
    PRIMARY KEY (site, id)
){key};
"""
    + _HOUR
)
_KEYED: Final = " WITHOUT ROWID"
SQLITE_TABLES: Final = _TABLES.format(key=_KEYED, months=_KEYED, stamp="")
# The archive creates the partitions.
POSTGRESQL_TABLES: Final = _TABLES.format(
    key="", months=" PARTITION BY RANGE (stamp_ns)", stamp=", stamp_ns"
)
POSTGRESQL_HOUR: Final = _HOUR.format(key="")
# Up to version 4, an hour had a JSON list in each column, with an element for each sensor. {lists}
# is that table, {each} has the `key` of each element.
HOURS_OF_LISTS: Final = (
    "SELECT site, series, hour, each.key, CAST(n ->> each.key AS BIGINT),"
    " CAST(total ->> each.key AS DOUBLE PRECISION), CAST(low ->> each.key AS DOUBLE PRECISION),"
    " CAST(high ->> each.key AS DOUBLE PRECISION) FROM {lists}, {each}"
    " WHERE CAST(n ->> each.key AS BIGINT) > 0"
)

_MAGIC: Final = b"SQLite format 3\0"
# Error codes which mean that the file itself is damaged.
_DAMAGE: Final = frozenset({sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB})
_BAD_TEXT: Final = ("Could not decode to UTF-8", "malformed JSON")


class Foreign(Exception):
    """The file is another program's, or of another version; it is left as it is."""


class Empty(FileNotFoundError):
    """The file is empty: a journal that is just being created."""


class NotPossible(Exception):
    """A file does not allow the operation now; the message says why. The file is unchanged."""


class DamagedFile(Exception):
    """The journal's header, tables or rows are not what was written."""


# Errors that opening or reading a damaged file may raise. Python may fail to decode what SQLite
# quotes from a damaged table.
FILE_ERRORS: Final = (sqlite3.Error, DamagedFile, UnicodeDecodeError)


def is_damage_error(error: BaseException) -> bool:
    """Whether an error means that the file is damaged."""
    if isinstance(error, (DamagedFile, UnicodeDecodeError)):
        return True
    # A damaged text: SQLite does not check texts, but Python and the JSON functions do.
    if isinstance(error, sqlite3.Error) and str(error).startswith(_BAD_TEXT):
        return True
    code = getattr(error, "sqlite_errorcode", None)
    return code is not None and code & 0xFF in _DAMAGE


def open_writer(path: Path) -> sqlite3.Connection:
    """Open the one connection that writes, in the calling thread; creates a missing file.

    A commit goes to the write-ahead log (WAL), and is not synced: the owner of the connection has
    to do that. Nothing is checkpointed unless requested.

    Raises:
        Foreign: the file is another program's, or of another version.
        sqlite3.Error, OSError: it cannot be opened, or is damaged (`is_damage_error`).

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
        # The WAL is truncated after a checkpoint, so that its size tells how much of it is new.
        connection.execute("PRAGMA journal_size_limit = 0")
        connection.execute("PRAGMA cache_size = -16000")
    except BaseException:
        connection.close()
        raise
    return connection


# All in one transaction: SQLite writes a page even for setting auto_vacuum alone.
_NEW: Final = (
    f"PRAGMA page_size = {PAGE_SIZE}; BEGIN; PRAGMA auto_vacuum = INCREMENTAL; {SQLITE_TABLES}"  # noqa: S608
    f" INSERT INTO site VALUES ('{LOCAL_SITE}', '');"
    f" INSERT INTO meta VALUES ('{LOCAL_SITE}', 'journal_id', lower(hex(randomblob(16))));"
    f" PRAGMA application_id = {APPLICATION_ID}; PRAGMA user_version = {VERSION}; COMMIT;"
)


def _create(connection: sqlite3.Connection, path: Path) -> None:
    connection.execute("PRAGMA synchronous = FULL")
    connection.executescript(_NEW)
    connection.execute("PRAGMA journal_mode = WAL")
    sync(path.parent)


def empty_file() -> tuple[bytes, frozenset[int]]:
    """The bytes of a new journal, and the numbers of the root pages of its tables and indexes."""
    with closing(sqlite3.connect(":memory:", isolation_level=None)) as new:
        new.executescript(_NEW)
        roots = new.execute("SELECT rootpage FROM sqlite_schema")
        return new.serialize(), frozenset(number for (number,) in roots)


@contextmanager
def transaction(connection: sqlite3.Connection) -> Iterator[None]:
    """Write everything within, or nothing."""
    connection.execute("BEGIN IMMEDIATE")
    try:
        yield
        connection.execute("COMMIT")
    except BaseException:
        if connection.in_transaction:
            connection.execute("ROLLBACK")
        raise


@contextmanager
def one_view(connection: sqlite3.Connection) -> Iterator[None]:
    """Read everything within as of one moment; keep it short, because the WAL grows meanwhile."""
    connection.execute("BEGIN")
    try:
        yield
    finally:
        connection.rollback()  # does nothing if an interrupted statement has ended it


def sync(path: Path) -> None:
    """Sync a file, or the names in a folder, to the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def open_reader(path: Path, *, is_still: bool = False) -> sqlite3.Connection:
    """Open a connection that cannot write; it may be used in one thread at a time.

    `is_still`: nobody writes the file, and it has no WAL, so its folder may be read-only too.

    Raises:
        Empty: nothing is in it yet.
        Foreign, DamagedFile, sqlite3.Error, OSError: as `open_writer`.

    """
    # Opening a FIFO would wait forever.
    if path.exists() and not path.is_file():
        raise Foreign(f"{path} is not a journal: it is not a regular file")
    connection = sqlite3.connect(
        f"file:{quote(os.fsencode(path))}?mode=ro{'&immutable=1' if is_still else ''}",
        uri=True,
        isolation_level=None,
        timeout=5.0,
        check_same_thread=False,
    )
    try:
        connection.execute("PRAGMA mmap_size = 0")
        connection.execute("PRAGMA query_only = 1")
        connection.execute("PRAGMA cache_size = -8000")
        _check_identity(connection, path)
    except BaseException:
        connection.close()
        raise
    return connection


def open_named(path: Path, *, is_still: bool = False) -> sqlite3.Connection:
    """As `open_reader`, for a file that a user names: one that is no database is `Foreign`.

    Raises:
        Empty, Foreign, DamagedFile, sqlite3.Error, OSError: as `open_reader`.

    """
    try:
        return open_reader(path, is_still=is_still)
    except (sqlite3.DatabaseError, Empty) as error:
        # Only now, because closing a file that SQLite has open releases its locks. For SQLite, a
        # file of a few bytes is empty.
        code = getattr(error, "sqlite_errorcode", sqlite3.SQLITE_NOTADB)
        if code == sqlite3.SQLITE_NOTADB and _starts_as_something_else(path):
            raise Foreign(
                f"{path} is not a journal: it does not begin as an SQLite file"
            ) from error
        raise


def _starts_as_something_else(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(len(_MAGIC)) not in {b"", _MAGIC}


def _check_identity(connection: sqlite3.Connection, path: Path) -> None:
    # Checked first: a new file gets all of its content at once.
    if connection.execute("PRAGMA page_count").fetchone() == (0,):
        raise Empty(f"{path} is empty: a journal that is just being created, or none")
    (application_id,) = connection.execute("PRAGMA application_id").fetchone()
    (version,) = connection.execute("PRAGMA user_version").fetchone()
    if application_id != APPLICATION_ID:
        ours = connection.execute("SELECT 1 FROM sqlite_schema WHERE name = 'scan_at'").fetchone()
        if ours:
            raise DamagedFile(f"{path} is a journal with a damaged header")
        raise Foreign(f"{path} is a database, but not a journal of lupin-twin")
    if version != VERSION:
        is_upgraded, other = version in UPGRADED, "install the lupin-twin that wrote it"
        what = "a twin that starts with it upgrades it" if is_upgraded else other
        raise Foreign(
            f"{path} is a journal of version {version}, this is version {VERSION}: {what}"
        )
    if {sql for (sql,) in connection.execute(_SCHEMA)} != _own_tables():
        raise DamagedFile(f"the tables of {path} are not those of a journal")


# Tables and indexes, word for word: no other check sees a flipped letter in them.
_SCHEMA: Final = "SELECT CAST(sql AS BLOB) FROM sqlite_schema WHERE sql != ''"


@cache
def _own_tables() -> frozenset[bytes]:
    with closing(sqlite3.connect(":memory:")) as new:
        new.executescript(SQLITE_TABLES)
        return frozenset(sql for (sql,) in new.execute(_SCHEMA))


@cache
def columns(table: str, *, of_key: bool = False) -> tuple[str, ...]:
    """The names of a table's columns, or of its key's, in their order."""
    with closing(sqlite3.connect(":memory:")) as new:
        new.executescript(SQLITE_TABLES)
        which = "pk > 0 ORDER BY pk" if of_key else "true ORDER BY cid"
        found = new.execute(f"SELECT name FROM pragma_table_info(?) WHERE {which}", (table,))  # noqa: S608
        return tuple(name for (name,) in found)


@cache
def insert_into(table: str) -> str:
    """The statement that writes a row, with a `?` for each column."""
    return f"INSERT INTO {table} VALUES ({', '.join('?' * len(columns(table)))})"  # noqa: S608


@cache
def upsert_into(table: str) -> str:
    """The statement that writes a row, and replaces one with the same key."""
    key = columns(table, of_key=True)
    news = (f"{name} = excluded.{name}" for name in columns(table) if name not in key)
    return f"{insert_into(table)} ON CONFLICT ({', '.join(key)}) DO UPDATE SET {', '.join(news)}"


# Keys of facts: the origin of the observations, and the length of a day, see `World`.
ORIGIN: Final = "origin"
DAY_LENGTH: Final = "day_length_s"
# The latest map, see `explored.text_of`.
MAP: Final = "map"

# --- one site's rows ------------------------------------------------------------------------------


Row = tuple[Any, ...]
_NOTHING: Final[Mapping[str, Any]] = {}
_SET_META: Final = (
    "INSERT INTO meta VALUES (:site, :key, :value)"
    " ON CONFLICT (site, key) DO UPDATE SET value = excluded.value"
    " WHERE meta.value != excluded.value"
)
_NAME: Final = re.compile(r":([a-z_]+)")


@dataclass(frozen=True, slots=True)
class SiteLog:
    """Runs queries on one site's journal; each may name `:site`, and other values as `:name`.

    To run several queries as of one moment, hold a transaction.
    """

    connection: Any
    site: str = LOCAL_SITE

    def execute(self, sql: str, values: Mapping[str, Any] = _NOTHING) -> Any:
        """Execute SQL; returns a cursor whose rows are tuples."""
        return self.connection.execute(self._of_engine(sql), {**values, "site": self.site})

    def execute_many(self, sql: str, rows: Sequence[Sequence[Any]]) -> None:
        """Execute a statement for many rows of values, one for each `?`."""
        if rows:
            self.connection.cursor().executemany(self._of_engine(sql), rows)

    def meta(self, key: str) -> str | None:
        """A noted fact about the journal as a whole; None if it is not noted."""
        found = self.execute(sql.META, {"key": key}).fetchone()
        return None if found is None else str(found[0])

    @property
    def journal_id(self) -> str:
        """The journal's unique id; the file in a quarantined one's place has another."""
        return self.meta("journal_id") or ""

    def _of_engine(self, sql: str) -> str:
        return sql if isinstance(self.connection, sqlite3.Connection) else _for_psycopg(sql)


@cache
def _for_psycopg(sql: str) -> str:
    return _NAME.sub(r"%(\1)s", sql).replace("?", "%s")


def json_text(values: Sequence[object]) -> str:
    """A JSON list as the tables have it."""
    return json.dumps(values, separators=(",", ":"))


def get_meta(connection: sqlite3.Connection, key: str) -> str | None:
    """A noted fact about this twin's own journal; None if it is not noted."""
    return SiteLog(connection).meta(key)


def set_meta(connection: sqlite3.Connection, key: str, value: object) -> None:
    """Note a fact about this twin's own journal."""
    SiteLog(connection).execute(_SET_META, {"key": key, "value": str(value)})
