from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterator
from itertools import count
from typing import Any

import psycopg
import pytest

from lupin_twin.journal.schema import POSTGRESQL_TABLES
from tests.support.postgres import postgres

# As the same log in SQLite, and where its rows are in PostgreSQL: a connection, and the site.
Copied = Callable[[sqlite3.Connection], tuple[Any, str]]

_TABLES = ("meta", "run", "series", "scan", "look", "place", "hour", "tally", "event")


@pytest.fixture(scope="session")
def copied() -> Iterator[Copied]:
    """Copies a log to a real PostgreSQL, as one site among others."""
    numbers = count()
    with postgres() as url, psycopg.connect(url, autocommit=True) as archive:
        archive.execute(POSTGRESQL_TABLES)

        def copy(log: sqlite3.Connection) -> tuple[Any, str]:
            site = f"site {next(numbers)}"
            with archive.transaction(), archive.cursor() as cursor:
                for table in _TABLES:
                    rows = log.execute(f"SELECT * FROM {table}").fetchall()
                    if rows:
                        cursor.executemany(
                            f"INSERT INTO {table} VALUES ({', '.join(['%s'] * len(rows[0]))})",
                            [(site, *row[1:]) for row in rows],
                        )
            return archive, site

        yield copy
