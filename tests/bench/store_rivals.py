"""What the journal is measured beside: a plain table of readings in SQLite, and DuckDB.

Both have one row a reading, as it is usually done: which tag and sensor, when, how much. They keep
less than the journal does: no tries, looks, places, sources or arrivals, no check of a row.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, Protocol

import duckdb
import numpy as np

Reading = tuple[int, int, float]  # series, stamp (ns), value


class Rival(Protocol):
    """A store of readings; a series is one sensor of one tag."""

    name: str

    def __init__(self, path: Path) -> None:
        """Make it."""

    def commit(self, readings: Sequence[Reading]) -> None:
        """Write in one transaction."""

    def load(self, readings: Iterable[Reading]) -> None:
        """Write very many."""

    def ask(self, sql: str, *values: int) -> list[tuple[Any, ...]]:
        """Rows."""

    def every(self, sql: str, lot: int) -> Iterator[Sequence[tuple[Any, ...]]]:
        """Rows in lots."""

    def size(self) -> int:
        """Bytes on the disk."""

    def close(self) -> None:
        """Close it."""


class Plain:
    """SQLite, `PRIMARY KEY (series, ts)`: fast to ask for a series."""

    name = "plain table"

    def __init__(self, path: Path) -> None:
        self._path = path
        self._connection = sqlite3.connect(path, isolation_level=None)
        self._connection.executescript(
            "PRAGMA journal_mode = WAL; PRAGMA synchronous = NORMAL; PRAGMA cache_size = -16000;"
            "CREATE TABLE reading (series INTEGER, ts INTEGER, value REAL,"
            " PRIMARY KEY (series, ts)) WITHOUT ROWID"
        )

    def commit(self, readings: Sequence[Reading]) -> None:
        self._connection.execute("BEGIN")
        self._connection.executemany("INSERT INTO reading VALUES (?, ?, ?)", readings)
        self._connection.execute("COMMIT")

    def load(self, readings: Iterable[Reading]) -> None:
        self.commit(sorted(readings))

    def ask(self, sql: str, *values: int) -> list[tuple[Any, ...]]:
        return self._connection.execute(sql, values).fetchall()

    def every(self, sql: str, lot: int) -> Iterator[Sequence[tuple[Any, ...]]]:
        rows = self._connection.execute(sql)
        while found := rows.fetchmany(lot):
            yield found

    def size(self) -> int:
        self._connection.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchall()
        return self._path.stat().st_size

    def close(self) -> None:
        self._connection.close()


class Duck:
    """DuckDB, one thread: the comparison is by core."""

    name = "DuckDB"

    def __init__(self, path: Path) -> None:
        self._path = path
        self._connection = duckdb.connect(str(path), config={"threads": 1})
        self._connection.execute("CREATE TABLE reading (series INTEGER, ts BIGINT, value DOUBLE)")

    def commit(self, readings: Sequence[Reading]) -> None:
        self._insert(readings)

    def load(self, readings: Iterable[Reading]) -> None:
        self._insert(list(readings))

    def _insert(self, readings: Sequence[Reading]) -> None:
        series, stamps, values = zip(*readings, strict=True)
        arrays = {
            "series": np.array(series, np.int32),
            "ts": np.array(stamps, np.int64),
            "value": np.array(values, np.float64),
        }
        self._connection.register("arrays", arrays)
        self._connection.execute("INSERT INTO reading SELECT series, ts, value FROM arrays")
        self._connection.unregister("arrays")

    def ask(self, sql: str, *values: int) -> list[tuple[Any, ...]]:
        found: list[tuple[Any, ...]] = self._connection.execute(sql, values).fetchall()
        return found

    def every(self, sql: str, lot: int) -> Iterator[Sequence[tuple[Any, ...]]]:
        rows = self._connection.execute(sql)
        while found := rows.fetchmany(lot):
            yield found

    def size(self) -> int:
        self._connection.execute("CHECKPOINT")
        return self._path.stat().st_size

    def close(self) -> None:
        self._connection.close()
