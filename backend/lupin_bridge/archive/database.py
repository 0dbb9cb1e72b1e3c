# ruff: noqa: S608  # SQL is put together of constants, and of names of tables
"""The archive's database: connections, tables, versions, contents, checks and retention.

psycopg is imported where it is needed: it is the extra `fleet`.

Retention deletes scans and inspections by their age. What was counted of them stays.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from importlib.resources import files
from typing import TYPE_CHECKING, Any, Final

from lupin_bridge.console import CommandError
from lupin_bridge.settings import SettingError, variable
from lupin_twin.journal.schema import HOURS_OF_LISTS, POSTGRESQL_HOUR, POSTGRESQL_TABLES

if TYPE_CHECKING:
    import psycopg

VERSION: Final = 2
# Listeners are notified of a site with new rows: a hint, which may be lost.
CHANNEL: Final = "lupin_log"
_OLDEST_SERVER: Final = 150_000
# A lost network is noticed within half a minute, here and, by `_SESSION`, at the server. A host
# that does not answer must not keep us from the next one, which may be a former standby.
_LINK: Final = {
    "connect_timeout": "4",
    "keepalives_idle": "10",
    "keepalives_interval": "5",
    "keepalives_count": "3",
    "tcp_user_timeout": "30000",
}
_SESSION: Final = (
    "SET tcp_keepalives_idle = 10; SET tcp_keepalives_interval = 5; SET tcp_keepalives_count = 3"
)
# The stamp up to which something was deleted or lost never decreases.
META_AGAIN: Final = (
    "ON CONFLICT (site, key) DO UPDATE SET value = CASE WHEN meta.key ~ '_ns:' THEN"
    " CAST(greatest(CAST(meta.value AS BIGINT), CAST(excluded.value AS BIGINT)) AS TEXT)"
    " ELSE excluded.value END"
)
# What libpq adds to the reason: advice to programmers, and where it failed.
_NOISE: Final = tuple(
    map(
        re.compile,
        (
            r"^(connection is bad|connection failed|consuming input failed): ",
            r"\?? *Is the server running .*$| This probably means .*$| DETAIL: .*$",
        ),
    )
)
# A query that takes longer is cancelled: nobody waits for its answer any more.
_MAX_MS: Final = 10_000
_SITE: Final = re.compile(r"[a-z][a-z0-9_-]{0,62}")


class ArchiveError(CommandError):
    """An operation on the archive failed."""


class UsageError(ArchiveError, SettingError):
    """A request that can never work: no retry helps."""


def check_site(called: str, site: str) -> None:
    """Refuse an invalid name of a site, which is also the name of its user in the database.

    Raises:
        UsageError: it is invalid.

    """
    if not _SITE.fullmatch(site):
        raise UsageError(
            f"{called} is {site[:64]!r}, expected a-z, 0-9, _ and - after a letter, 63 at most"
        )


def check_url(url: str) -> dict[str, Any]:
    """The parts of an archive's address.

    Raises:
        UsageError: it is no address of a PostgreSQL, or psycopg is not installed.

    """
    try:
        from psycopg import ProgrammingError, conninfo  # noqa: PLC0415
    except ImportError as error:
        raise UsageError("the archive needs psycopg: pip install 'lupin-twin[fleet]'") from error
    try:
        found = conninfo.conninfo_to_dict(url)
    except ProgrammingError:
        found = {}
    # The address is not repeated: it may hold a password. If that contains an @, a part of it
    # counts as the host, which messages name; the host of an abstract socket begins with @.
    if not found or "@" in str(found.get("host", ""))[1:]:
        raise UsageError(
            "--archive-url is not a PostgreSQL address, expected one such as"
            " postgresql://gh1@db.example/lupin"
        )
    return found


def place_of(url: str) -> str:
    """Host and database of an address, for messages, without the password."""
    said = check_url(url)
    return f"{said.get('host', 'the local PostgreSQL')}/{said.get('dbname', '')}"


def connect(url: str, name: str, session: str = "read-write") -> psycopg.Connection[Any]:
    """A connection in autocommit mode; transactions are explicit blocks.

    Of several hosts it is to the one that takes writes; `session` is libpq's
    `target_session_attrs`.

    Raises:
        UsageError: see `check_url`.
        ArchiveError: no connection can be made.

    """
    said = check_url(url)
    import psycopg  # noqa: PLC0415

    with explaining():
        connection = psycopg.connect(
            **{**_LINK, "target_session_attrs": session, "application_name": name, **said},
            autocommit=True,
        )
        connection.execute(_SESSION)
    return connection


def archive_url() -> str:
    """The archive's address, from the environment: others can read a command line."""
    return os.environ[variable("archive_url")]


def open_archive(url: str) -> Any:
    """A connection that cannot write, to the primary or to a standby.

    Raises:
        ArchiveError: there is no archive that can be read; `UsageError`: no later try helps.

    """
    import psycopg  # noqa: PLC0415  # the extra `fleet`

    connection = connect(url, "lupin-twin fleet", session="any")
    try:
        connection.read_only = True
        # A transaction sees one state of the archive.
        connection.isolation_level = psycopg.IsolationLevel.REPEATABLE_READ
        with explaining():
            connection.execute(f"SET statement_timeout = {_MAX_MS}")
            check_version(connection)
    except ArchiveError:
        connection.close()
        raise
    return connection


@contextmanager
def explaining() -> Iterator[None]:
    """Turn a database's error into an `ArchiveError`, which says in one line what it means."""
    import psycopg  # noqa: PLC0415

    try:
        yield
    except psycopg.Error as error:
        raise ArchiveError(_explained(error)) from error


def _explained(error: psycopg.Error) -> str:
    import psycopg  # noqa: PLC0415

    text = error.diag.message_primary or " ".join(str(error).split())
    for noise in _NOISE:
        text = noise.sub("", text)
    match error:
        case psycopg.errors.UndefinedTable():
            text = "the database has no archive: lupin-twin archive init creates it"
        case psycopg.errors.InsufficientPrivilege():
            text = (
                f"the archive does not permit it: {text}; a forwarder needs a user in the role"
                " lupin_forwarder with the name of the site, a page one in lupin_page, and its"
                " administrator the owner"
            )
        case psycopg.errors.DiskFull():
            text = f"the archive is full: {text}"
        case psycopg.errors.QueryCanceled():
            text = f"the archive takes too long: {text}"
        case psycopg.DataError():
            text = f"a value cannot be read or written: {text}"
        case psycopg.errors.UniqueViolation():
            text = f"another forwarder writes the same site: {text}"
        case _:
            text = f"the archive cannot be reached or written: {text}"
    return text


def check_version(connection: psycopg.Connection[Any]) -> None:
    """Refuse an archive of another version.

    Raises:
        ArchiveError: it is of another version.
        psycopg.Error: it is no archive, see `explaining`.

    """
    version = _version(connection)
    if version != VERSION:
        raise ArchiveError(
            f"the archive is of version {version}, expected {VERSION}:"
            + (" lupin-twin archive migrate" if version < VERSION else " update lupin-twin here")
        )


def _version(connection: psycopg.Connection[Any]) -> int:
    found = connection.execute("SELECT version FROM archive").fetchone()
    return 0 if found is None else int(found[0])


def init(connection: psycopg.Connection[Any]) -> None:
    """Make tables and roles, all or nothing.

    Raises:
        ArchiveError: there is an archive already, or the database is not suitable.
        psycopg.Error: whatever the database says.

    """
    if connection.info.server_version < _OLDEST_SERVER:
        raise ArchiveError(
            f"the server is PostgreSQL {connection.info.server_version // 10_000}, expected 15"
            " or newer"
        )
    encoding = connection.info.parameter_status("server_encoding")
    if encoding != "UTF8":
        raise ArchiveError(f"the database's encoding is {encoding}, expected UTF8")
    there = connection.execute("SELECT to_regclass('archive'), to_regclass('scan')").fetchone()
    if there != (None, None):
        raise ArchiveError("the database already has an archive: see lupin-twin archive info")
    with connection.transaction():
        connection.execute(POSTGRESQL_TABLES)
        connection.execute(_text("tables.sql"))
        connection.execute("INSERT INTO archive VALUES (%s)", (VERSION,))
        connection.execute(_text("roles.sql"))


_FROM_VERSION1: Final = ";".join(
    (
        "ALTER TABLE hour RENAME TO lists",
        "ALTER INDEX hour_pkey RENAME TO lists_pkey",
        POSTGRESQL_HOUR.strip().rstrip(";"),
        "INSERT INTO hour "
        + HOURS_OF_LISTS.format(
            lists="lists", each="generate_series(0, json_array_length(n) - 1) AS each(key)"
        ),
        "DROP TABLE lists",
        f"UPDATE archive SET version = {VERSION}",
    )
)


def migrate(connection: psycopg.Connection[Any]) -> None:
    """Bring tables and roles up to date, all or nothing.

    Raises:
        ArchiveError: the archive is newer than this.
        psycopg.Error: whatever the database says.

    """
    with connection.transaction():
        if _version(connection) == 1:
            connection.execute(_FROM_VERSION1)
        check_version(connection)
        connection.execute(_text("roles.sql"))


def _text(name: str) -> Any:
    return files(__package__).joinpath(name).read_text(encoding="utf-8")


# --- contents, checks and retention ---------------------------------------------------------------

_SITES: Final = (
    "SELECT site.site, machine, process, heard_at > now() - INTERVAL '10 s',"
    " heard_at::timestamptz(0)::text, (SELECT max(epoch) FROM epoch WHERE epoch.site = site.site)"
    " FROM site LEFT JOIN forwarder ON forwarder.site = site.site ORDER BY site.site"
)
_COUNT: Final = "SELECT count(*), max(arrival_ns) FROM {} WHERE site = %s"
# Inconsistent rows, of which there should be none.
_STRAY: Final = {
    "scans without a series": (
        "scan WHERE NOT EXISTS (SELECT FROM series WHERE series.site = scan.site"
        " AND series.series = scan.series)"
    ),
    "scans with more or fewer readings than their series has sensors": (
        "scan JOIN series USING (site, series) WHERE json_array_length(readings::json)"
        " <> json_array_length(sensors::json)"
    ),
    "hours without a series": (
        "hour WHERE NOT EXISTS (SELECT FROM series WHERE series.site = hour.site"
        " AND series.series = hour.series)"
    ),
    **{
        f"rows of {table} without a run": (
            f"{table} AS here WHERE NOT EXISTS (SELECT FROM run WHERE run.site = here.site"
            " AND run.run = here.run)"
        )
        for table in ("series", "look", "place", "tally", "event")
    },
    "rows of scan past what was forwarded": (
        "scan WHERE seq > (SELECT max(seq_offset + forwarded_seq) FROM epoch"
        " WHERE epoch.site = scan.site)"
    ),
}


def overview(connection: Any) -> list[str]:
    """A line for each site."""
    lines = []
    for site, machine, process, is_live, heard_at, epoch in connection.execute(_SITES).fetchall():
        counts = []
        last_ns = 0
        for table in ("scan", "look", "place"):
            count, newest_ns = connection.execute(_COUNT.format(table), (site,)).fetchone()
            counts.append(f"{count:,} {table}s")
            last_ns = max(last_ns, newest_ns or 0)
        (last,) = connection.execute(
            "SELECT to_timestamp(%s)::timestamptz(0)::text", (last_ns // 10**9,)
        ).fetchone()
        live = "forwarded by" if is_live else f"silent since {heard_at}, forwarded last by"
        whose = "never forwarded" if machine is None else f"{live} {machine} (process {process})"
        lines.append(
            f"{site}: {', '.join(counts)}; the last received {last if last_ns else 'never'};"
            f" {whose}; {epoch or 0} journals"
        )
    return lines or ["no site is forwarded yet"]


def check(connection: Any) -> list[str]:
    """A line for each thing that is wrong."""
    wrong = []
    for what, rows in _STRAY.items():
        (count,) = connection.execute(f"SELECT count(*) FROM {rows}").fetchone()
        if count:
            wrong.append(f"{count:,} {what}")
    return wrong


# Monthly partitions that are over: their names in both tables.
_MONTHS: Final = (
    "SELECT relname, replace(relname, 'scan', 'look') FROM pg_class WHERE oid IN"
    " (SELECT inhrelid FROM pg_inherits WHERE inhparent = 'scan'::regclass)"
    " AND relname ~ '^scan_[0-9]{4}_[0-9]{2}$'"
    " AND to_date(right(relname, 7), 'YYYY_MM') + INTERVAL '1 month' <= %s ORDER BY relname"
)
_OTHERS: Final = (
    "SELECT EXISTS (SELECT FROM {0} WHERE site <> %(site)s)"
    " OR EXISTS (SELECT FROM {1} WHERE site <> %(site)s)"
)
_UPTO: Final = (
    "INSERT INTO meta SELECT site, 'purged_ns:' || run, max(stamp_ns)::text FROM"
    " (SELECT site, run, stamp_ns FROM {0} JOIN series USING (site, series)"
    " UNION ALL SELECT site, run, stamp_ns FROM {1}) AS gone GROUP BY site, run "
) + META_AGAIN
# The age of a simulation's rows counts from their arrival, if its clock is not ahead. The constant
# bound spares the months that stay, and lets the index find the rows.
_DELETE: Final = (
    "WITH kept AS (SELECT site, run, %(before)s - CASE is_simulated WHEN 0 THEN 0"
    " ELSE begun_arrival_ns - begun_stamp_ns END AS from_ns FROM run"
    " WHERE joins IS NULL AND (%(site)s::text IS NULL OR site = %(site)s)),"
    " scans AS (DELETE FROM scan USING series, kept WHERE scan.site = kept.site"
    " AND series.site = kept.site AND scan.series = series.series AND series.run = kept.run"
    " AND stamp_ns < from_ns AND stamp_ns < %(before)s RETURNING kept.site, kept.run, stamp_ns),"
    " looks AS (DELETE FROM look USING kept WHERE look.site = kept.site AND look.run = kept.run"
    " AND stamp_ns < from_ns AND stamp_ns < %(before)s RETURNING kept.site, kept.run, stamp_ns),"
    " gone AS (TABLE scans UNION ALL TABLE looks),"
    " noted AS (INSERT INTO meta SELECT site, 'purged_ns:' || run, max(stamp_ns)::text FROM gone"
    f" GROUP BY site, run {META_AGAIN})"
    " SELECT site, count(*) FROM gone GROUP BY site ORDER BY site"
)


def retain(connection: Any, days: float, site: str | None) -> Iterator[str]:
    """Delete what is older than `days`, of one site or of all; yields a line for each deletion.

    A month that is old enough is dropped whole, at once, if it has no rows of other sites.

    Raises:
        ArchiveError: there is no such site.
        psycopg.Error: whatever the database says.

    """
    before = datetime.now(UTC) - timedelta(days=days)
    known = connection.execute("SELECT count(*) FROM site WHERE site = %s", (site,)).fetchone()
    if site is not None and known == (0,):
        raise ArchiveError(f"the archive has no site {site!r}")
    for names in connection.execute(_MONTHS, (before,)).fetchall():
        with connection.transaction():
            others = {"site": site}
            if site and connection.execute(_OTHERS.format(*names), others).fetchone()[0]:
                continue
            connection.execute(_UPTO.format(*names))
            connection.execute("DROP TABLE {}, {}".format(*names))
        yield f"{names[0][-7:].replace('_', '-')}: the whole month"
    gone = {"before": int(before.timestamp() * 10**9), "site": site}
    for name, count in connection.execute(_DELETE, gone).fetchall():
        yield f"{name}: {count:,} scans and inspections"
