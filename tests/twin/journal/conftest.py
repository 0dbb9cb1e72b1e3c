import sqlite3
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager
from itertools import count
from pathlib import Path
from typing import Any

import psycopg
import pytest

from lupin_twin.journal.schema import POSTGRESQL_TABLES, SiteLog
from tests.support.log_life import Life, lived
from tests.support.postgres import Postgres

# The same log in SQLite, and its rows in PostgreSQL.
Copied = Callable[[sqlite3.Connection], SiteLog]
Engines = Callable[[sqlite3.Connection], tuple[sqlite3.Connection, SiteLog]]
Living = Callable[[Iterable[tuple[str, Any]]], AbstractContextManager[Life]]

_TABLES = ("meta", "run", "series", "scan", "look", "place", "hour", "tally", "event")


@pytest.fixture(scope="session")
def copied(postgresql: Postgres) -> Iterator[Copied]:
    """Copies a log to a real PostgreSQL, as one site among others."""
    numbers = count()
    with psycopg.connect(postgresql.url, autocommit=True) as connection:
        connection.execute("CREATE DATABASE journals")
    with psycopg.connect(postgresql.url_of("journals"), autocommit=True) as archive:
        archive.execute(POSTGRESQL_TABLES)
        for table in ("scan", "look"):
            archive.execute(f"CREATE TABLE {table}_any PARTITION OF {table} DEFAULT")

        def copy(log: sqlite3.Connection) -> SiteLog:
            site = f"site {next(numbers)}"
            with archive.transaction(), archive.cursor() as cursor:
                for table in _TABLES:
                    rows = log.execute(f"SELECT * FROM {table}").fetchall()
                    if rows:
                        cursor.executemany(
                            f"INSERT INTO {table} VALUES ({', '.join(['%s'] * len(rows[0]))})",
                            [(site, *row[1:]) for row in rows],
                        )
            return SiteLog(archive, site)

        yield copy


@pytest.fixture(scope="session")
def engines(copied: Copied) -> Engines:
    """The log in SQLite, and the same log in PostgreSQL."""
    return lambda log: (log, copied(log))


@pytest.fixture(scope="session")
def living(tmp_path_factory: pytest.TempPathFactory) -> Living:
    """A log that has gone through these steps, in its own file."""
    folder, numbers = tmp_path_factory.mktemp("lives"), count()
    return lambda reported: lived(folder / f"{next(numbers)}.sqlite", reported)


def fail_on_a_full_disk(code: str, path: Path, most: int) -> None:
    """Run code in a process none of whose files may exceed `most` bytes, as on a full disk."""
    program = (
        "import resource, sys; from pathlib import Path; path = Path(sys.argv[1]);"
        f"resource.setrlimit(resource.RLIMIT_FSIZE, ({most}, {most})); {code}"
    )
    ended = subprocess.run(
        [sys.executable, "-c", program, str(path)], check=False, capture_output=True, text=True
    )
    assert ended.returncode == 1
    assert ended.stderr.splitlines()[-1].startswith("sqlite3.OperationalError: ")
