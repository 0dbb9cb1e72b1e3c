"""Hourly rollups: how many readings a tag's sensor gave in an hour, their mean, least and largest.

Rows are folded in the order in which they were written, each once, whatever its stamp: a late one
is merged into the hour it belongs to. How far that has come stands in the file, so that it goes on
where it was after a crash. What is not folded yet (`Folded`) a reader adds from the scans.
"""

from __future__ import annotations

import json
import sqlite3
from typing import Final

from lupin_twin.journal.packing import (
    Bucket,
    Damaged,
    columns,
    pack_buckets,
    unpack_buckets,
    unpack_numbers,
    unseal,
)
from lupin_twin.journal.reading import SCAN
from lupin_twin.past import HOUR_NS

# What one step reads or writes: some ten milliseconds, for observations wait behind it.
_ROWS_READ: Final = 1_000
_ROWS_WRITTEN: Final = 200


class Folded:
    """How far folding has come, as of one view of the file.

    `is_usable` is false while a damaged file is being read: rollups and scans do not fit yet.
    """

    def __init__(self, connection: sqlite3.Connection) -> None:
        self._all_to = get_meta(connection, "rolled_id")
        self._some_to = get_meta(connection, "rolling_to")
        self._some = get_meta(connection, "rolling_series")
        found = connection.execute("SELECT 1 FROM meta WHERE key = 'salvage'").fetchone()
        self.is_usable = found is None

    def up_to(self, series: int) -> int:
        """The number of the write up to which the scans of a series are in the rollups."""
        return self._some_to if series <= self._some else self._all_to


def get_meta(connection: sqlite3.Connection, key: str, default: int = 0) -> int:
    """A number of the file's own, `default` where it was never set."""
    found = connection.execute("SELECT value FROM meta WHERE key = ?", (key,)).fetchone()
    return int(found[0]) if found else default


def set_meta(connection: sqlite3.Connection, **values: int) -> None:
    """Keep numbers in the file."""
    connection.executemany("INSERT OR REPLACE INTO meta VALUES (?, ?)", values.items())


class Folding:
    """One pass over what was written since the last one, in steps within transactions of others.

    First it reads, then it writes series by series: a tag's hours lie together in the file.
    """

    def __init__(self, connection: sqlite3.Connection, last_id: int) -> None:
        self._connection = connection
        self._read_to = get_meta(connection, "rolled_id")
        self._series_done = get_meta(connection, "rolling_series")
        self._until = get_meta(connection, "rolling_to") or last_id
        self._sensors: dict[int, int] = {}
        self._hours: dict[tuple[int, int], list[Bucket]] = {}
        self._to_write: list[tuple[int, int]] | None = None

    def step(self) -> bool:
        """Do a little; returns whether there is more to do."""
        if self._to_write is None:
            self._read()
            return True
        return self._write()

    def _read(self) -> None:
        rows = self._connection.execute(
            f"SELECT {SCAN} FROM scan"  # noqa: S608  # constants
            " WHERE id > ? AND id <= ? ORDER BY id LIMIT ?",
            (self._read_to, self._until, _ROWS_READ),
        ).fetchall()
        for row in rows:
            series, stamp_ns = row[1:3]
            count = self._sensors_of(series)
            if not count or series <= self._series_done:
                continue
            try:
                body = unseal(columns(*row[1:-1]), row[-1])
                values = unpack_numbers(body, count)
            except Damaged:
                continue
            key = (series, stamp_ns // HOUR_NS)
            buckets = self._hours.get(key)
            if buckets is None:
                buckets = self._hours[key] = [Bucket() for _ in range(count)]
            for bucket, value in zip(buckets, values, strict=True):
                if value - value == 0.0:  # finite
                    bucket.add(value)
        if len(rows) < _ROWS_READ:
            self._to_write = sorted(self._hours, reverse=True)
        else:
            self._read_to = rows[-1][0]

    def _write(self) -> bool:
        assert self._to_write is not None
        series = 0
        written = 0
        while self._to_write and (written < _ROWS_WRITTEN or self._to_write[-1][0] == series):
            key = self._to_write.pop()
            series = key[0]
            self._merge(key, self._hours[key])
            written += 1
        if self._to_write:
            set_meta(self._connection, rolling_to=self._until, rolling_series=series)
            return True
        set_meta(self._connection, rolled_id=self._until, rolling_to=0, rolling_series=0)
        return False

    def _merge(self, key: tuple[int, int], buckets: list[Bucket]) -> None:
        found = self._connection.execute(
            "SELECT buckets FROM rollup WHERE series = ? AND hour = ?", key
        ).fetchone()
        if found:
            try:
                for bucket, earlier in zip(
                    buckets, unpack_buckets(found[0], len(buckets)), strict=True
                ):
                    bucket.merge(earlier)
            except Damaged:
                pass
        self._connection.execute(
            "INSERT OR REPLACE INTO rollup VALUES (?, ?, ?)", (*key, pack_buckets(buckets))
        )

    def _sensors_of(self, series: int) -> int:
        count = self._sensors.get(series)
        if count is None:
            found = self._connection.execute(
                "SELECT names FROM series JOIN sensors ON sensors.id = sensors WHERE series.id = ?",
                (series,),
            ).fetchone()
            count = self._sensors[series] = len(json.loads(found[0])) if found else 0
        return count
