"""One site's rows, over a connection to SQLite or, by psycopg, to PostgreSQL: one SQL for both."""

from __future__ import annotations

import re
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from typing import Any, Final

from lupin_twin.journal.schema import LOCAL_SITE, one_view

_NOTHING: Final[Mapping[str, Any]] = {}
_NAME: Final = re.compile(r":([a-z_]+)")


@dataclass(frozen=True, slots=True)
class SiteLog:
    """Where queries go to; each may name `:site`, and other values as `:name`."""

    connection: Any
    site: str = LOCAL_SITE

    def execute(self, sql: str, values: Mapping[str, Any] = _NOTHING) -> Any:
        """A cursor; its rows come as tuples."""
        return self.connection.execute(self._of_engine(sql), {**values, "site": self.site})

    def execute_many(self, sql: str, rows: Sequence[tuple[Any, ...]]) -> None:
        """The same statement for many rows of values, each for a `?`."""
        if rows:
            self.connection.cursor().executemany(self._of_engine(sql), rows)

    @contextmanager
    def one_view(self) -> Iterator[None]:
        """All that is read within is of one moment; keep it short, for the log grows meanwhile."""
        if isinstance(self.connection, sqlite3.Connection):
            with one_view(self.connection):
                yield
            return
        with self.connection.transaction():
            self.connection.execute("SET TRANSACTION ISOLATION LEVEL REPEATABLE READ")
            yield

    def _of_engine(self, sql: str) -> str:
        return sql if isinstance(self.connection, sqlite3.Connection) else _for_psycopg(sql)


@cache
def _for_psycopg(sql: str) -> str:
    return _NAME.sub(r"%(\1)s", sql).replace("?", "%s")
