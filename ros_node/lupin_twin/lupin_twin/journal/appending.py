"""Rows into tables: numbers for names and series, and nothing that is there already."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Callable, Iterable
from typing import Final, TypeVar

from lupin_twin.journal.changes import put_change
from lupin_twin.journal.packing import columns, pack_numbers, pack_shape, seal
from lupin_twin.journal.rows import KIND_FLOWER, STATUS_OK, LookRow, PinRow, Row, ScanRow
from lupin_twin.journal.runs import Run

# Numbers kept at hand; past that they are looked up in the file again.
_MAX_AT_HAND: Final = 200_000

_Key = TypeVar("_Key")
_SERIES = tuple[int, int, int, int, int, int]  # run, tag, kind, source, status, sensors


class Appender:
    """Writes rows through a connection, inside its caller's transaction.

    What it remembers of the file is wrong after a transaction that was rolled back: make another
    one then.
    """

    def __init__(self, connection: sqlite3.Connection) -> None:
        self._execute = connection.execute
        (self.last_id,) = self._execute(
            "SELECT max(coalesce((SELECT max(id) FROM scan), 0),"
            " coalesce((SELECT max(id) FROM look), 0), coalesce((SELECT max(id) FROM pin), 0),"
            " coalesce((SELECT value FROM meta WHERE key = 'purged_id'), 0))"
        ).fetchone()
        self._tags: dict[str, int] = {}
        self._names: dict[str, int] = {}
        self._sensors: dict[tuple[str, ...], int] = {}
        self._series: dict[_SERIES, int] = {}
        self._newest: dict[int, int] = {}

    def append(self, run: Run, rows: Iterable[Row]) -> int:
        """Write what is not there yet; returns how many rows that were."""
        return sum(self._append(run, row) for row in rows)

    def _append(self, run: Run, row: Row) -> bool:
        lag_us = (row.arrival_ns - row.stamp_ns - run.lead_ns) // 1000
        tag = self._number(self._tags, "tag", "tag_id", row.tag_id)
        if isinstance(row, PinRow):
            pose = row.pose
            packed = pack_numbers((pose.x, pose.y, pose.z, pose.qx, pose.qy, pose.qz, pose.qw))
            check = columns(run.id, tag, row.stamp_ns, lag_us)
            written = self._execute(
                "INSERT OR IGNORE INTO pin VALUES (?, ?, ?, ?, ?, ?)",
                (self.last_id + 1, run.id, tag, row.stamp_ns, lag_us, seal(check, packed)),
            )
            self.last_id += written.rowcount
            return written.rowcount == 1
        kind, status, names = (
            (KIND_FLOWER, STATUS_OK, ())
            if isinstance(row, LookRow)
            else (row.kind, row.status, tuple(reading.name for reading in row.readings))
        )
        source = self._number(self._names, "name", "text", row.source)
        series = self._series_number(
            (run.id, tag, kind, source, status, self._sensors_number(names))
        )
        table = "look" if isinstance(row, LookRow) else "scan"
        if not self._is_new(table, series, row):
            return False
        mission = self._number(self._names, "name", "text", row.mission)
        self.last_id += 1
        if isinstance(row, ScanRow):
            self._put_scan(row, series, lag_us, mission)
        else:
            self._put_look(row, series, lag_us, mission)
            put_change(self._execute, self.last_id, (run.id, tag), row)
        return True

    def _put_scan(self, scan: ScanRow, series: int, lag_us: int, mission: int) -> None:
        detail = _unicode(scan.detail) or None
        check = columns(series, scan.stamp_ns, scan.own_stamp_ns, lag_us, mission, detail)
        packed = pack_numbers([reading.value for reading in scan.readings])
        self._execute(
            "INSERT INTO scan VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
            (
                self.last_id,
                series,
                scan.stamp_ns,
                scan.own_stamp_ns,
                lag_us,
                mission,
                detail,
                seal(check, packed),
            ),
        )

    def _put_look(self, look: LookRow, series: int, lag_us: int, mission: int) -> None:
        flower = look.flower
        species = self._number(self._names, "name", "text", flower.species)
        at = (series, look.stamp_ns, look.own_stamp_ns, lag_us)
        told = (mission, species, int(flower.anomaly), flower.flower_count, flower.bug_count)
        check = columns(*at, *told)
        self._execute(
            "INSERT INTO look VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
            (self.last_id, *at, *told, seal(check, pack_shape(flower))),
        )

    def _is_new(self, table: str, series: int, row: ScanRow | LookRow) -> bool:
        """Whether a series has nothing of this stamp; mostly it is past all of them."""
        stamp_ns = row.stamp_ns
        if row.own_stamp_ns:
            found = self._execute(
                f"SELECT 1 FROM {table} WHERE series = ? AND own_stamp_ns = ?",  # noqa: S608
                (series, row.own_stamp_ns),
            )
            if found.fetchone() is not None:
                return False
        if series not in self._newest:
            if len(self._newest) >= _MAX_AT_HAND:
                self._newest.clear()
            (newest,) = self._execute(
                f"SELECT max(stamp_ns) FROM {table} WHERE series = ?",  # noqa: S608  # a constant
                (series,),
            ).fetchone()
            self._newest[series] = -1 if newest is None else newest
        if stamp_ns > self._newest[series]:
            self._newest[series] = stamp_ns
            return True
        found = self._execute(
            f"SELECT 1 FROM {table} WHERE series = ? AND stamp_ns = ?",  # noqa: S608
            (series, stamp_ns),
        )
        return found.fetchone() is None

    # --- numbers for names --------------------------------------------------------------------

    def _number(self, known: dict[str, int], table: str, column: str, text: str) -> int:
        text = _unicode(text)
        return self._remembered(
            known,
            text,
            lambda: self._looked_up(
                f"SELECT id FROM {table} WHERE {column} = ?",  # noqa: S608  # constants
                f"INSERT INTO {table} ({column}) VALUES (?)",  # noqa: S608
                (text,),
            ),
        )

    def _sensors_number(self, names: tuple[str, ...]) -> int:
        return self._remembered(
            self._sensors,
            names,
            lambda: self._looked_up(
                "SELECT id FROM sensors WHERE names = ?",
                "INSERT INTO sensors (names) VALUES (?)",
                (json.dumps(names),),
            ),
        )

    def _series_number(self, series: _SERIES) -> int:
        return self._remembered(
            self._series,
            series,
            lambda: self._looked_up(
                "SELECT id FROM series WHERE run = ? AND tag = ? AND kind = ? AND source = ?"
                " AND status = ? AND sensors = ?",
                "INSERT INTO series (run, tag, kind, source, status, sensors)"
                " VALUES (?, ?, ?, ?, ?, ?)",
                series,
            ),
        )

    def _looked_up(self, select: str, insert: str, values: tuple[object, ...]) -> int:
        found = self._execute(select, values).fetchone()
        return int(found[0]) if found else int(self._execute(insert, values).lastrowid or 0)

    @staticmethod
    def _remembered(known: dict[_Key, int], key: _Key, look_up: Callable[[], int]) -> int:
        number = known.get(key)
        if number is None:
            if len(known) >= _MAX_AT_HAND:
                known.clear()
            number = known[key] = look_up()
        return number


def _unicode(text: str) -> str:
    """The text as SQLite takes it: what is no Unicode must not cost the row."""
    return text.encode("utf-8", "replace").decode("utf-8")
