# ruff: noqa: S608  # SQL is put together of constants
"""What was heard, write by write, in the order of hearing: see `lupin_twin.past_writes`."""

from __future__ import annotations

import sqlite3
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from lupin_twin.journal.packing import Damaged, columns, unpack_numbers, unseal
from lupin_twin.journal.reading import SCAN, one_view, sensor_names
from lupin_twin.journal.spans import spans
from lupin_twin.past_writes import PastWrite, PastWrites, RunSpan, WritesRequest

# What an answer of so many writes takes, about, s.
WRITES_S: Final = 0.05

_ARRIVAL: Final = (
    "SELECT scan.id, stamp_ns + run.lead_ns + 1000 * lag_us FROM scan"
    " JOIN series ON series.id = series JOIN run ON run.id = run"
    " WHERE scan.id >= ? ORDER BY scan.id LIMIT 1"
)
_SCANS: Final = (
    "SELECT run, tag_id, kind, status, names, "
    + ", ".join(f"scan.{column}" for column in SCAN.split(", "))
    + " FROM scan JOIN series ON series.id = scan.series JOIN tag ON tag.id = tag"
    " JOIN sensors ON sensors.id = sensors WHERE scan.id > ? ORDER BY scan.id LIMIT ?"
)
_LOOKS: Final = (
    "SELECT look.id, run, tag_id, stamp_ns, kind, status, text, anomaly, bug_count"
    " FROM look JOIN series ON series.id = look.series JOIN tag ON tag.id = tag"
    " JOIN name ON name.id = species WHERE look.id > ? ORDER BY look.id LIMIT ?"
)


def writes(connection: sqlite3.Connection, request: WritesRequest) -> PastWrites:
    """The next writes; what is damaged costs itself."""
    with one_view(connection):
        newest = max(_newest(connection, "scan"), _newest(connection, "look"))
        after = request.after or _beginning(connection, request, newest)
        count = request.max_count
        scans = connection.execute(_SCANS, (after, count)).fetchall()
        looks = connection.execute(_LOOKS, (after, count)).fetchall()
        numbers = sorted([*(row[5] for row in scans), *(row[0] for row in looks)])
        is_all = len(numbers) <= count and len(scans) < count and len(looks) < count
        last = max(newest, after) if is_all else numbers[min(count, len(numbers)) - 1]
        found = [*_read_scans(scans, last), *_read_looks(looks, last)]
        found.sort(key=lambda write: write.number)
        axis = tuple(RunSpan(s.run.id, s.start_ns, s.end_ns) for s in spans(connection))
        return PastWrites(_identity(connection), axis, tuple(found), last, is_all)


def _newest(connection: sqlite3.Connection, table: str) -> int:
    (newest,) = connection.execute(f"SELECT max(id) FROM {table}").fetchone()
    return int(newest or 0)


def _beginning(connection: sqlite3.Connection, request: WritesRequest, newest: int) -> int:
    """The number before the first write that is asked for: arrivals ascend with numbers."""
    low, high = 0, newest
    if request.reach_count:
        low = max(0, newest - request.reach_count)
    if not request.reach_s:
        return low
    since_ns = time.time_ns() - int(request.reach_s * 1e9)
    while low < high:
        middle = (low + high) // 2
        row = connection.execute(_ARRIVAL, (middle + 1,)).fetchone()
        if row is None or row[1] >= since_ns:
            high = middle
        else:
            low = row[0]
    return low


def _read_scans(rows: list[tuple[Any, ...]], last: int) -> Iterator[PastWrite]:
    names: dict[str, tuple[str, ...]] = {}
    for run, tag_id, kind, status, text, *row in rows:
        if row[0] > last:
            return
        if text not in names:
            names[text] = sensor_names(text)
        try:
            values = unpack_numbers(unseal(columns(*row[1:-1]), row[-1]), len(names[text]))
        except Damaged:
            continue
        sensors = names[text] if values else ()
        yield PastWrite(row[0], run, tag_id, row[2], kind, status, sensors, tuple(values))


def _read_looks(rows: list[tuple[Any, ...]], last: int) -> Iterator[PastWrite]:
    for number, run, tag_id, stamp_ns, kind, status, species, anomaly, bugs in rows:
        if number > last:
            return
        seen = (species, bool(anomaly), bugs)
        yield PastWrite(number, run, tag_id, stamp_ns, kind, status, (), (), True, *seen)


def _identity(connection: sqlite3.Connection) -> str:
    """One file's name among files: one that was set aside has another in its place."""
    path = connection.execute("PRAGMA database_list").fetchone()[2]
    status = Path(path).stat()
    return f"{status.st_dev:x}-{status.st_ino:x}"
