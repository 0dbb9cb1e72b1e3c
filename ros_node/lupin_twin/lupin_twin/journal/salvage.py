# ruff: noqa: S608  # SQL is put together of constants
"""A damaged file: quarantined under a name that says when, and read page by page.

A row is found where it stands, on whatever page, without the trees that lead to it
(https://www.sqlite.org/fileformat2.html, 1.6 and 2): so it does not matter which pages are lost.
The pages of its write-ahead log are read in the place of those that they were to replace.
"""

from __future__ import annotations

import sqlite3
import struct
from collections.abc import Generator, Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from types import NoneType
from typing import IO, Any, Final

from lupin_twin.core.past import HOUR_NS
from lupin_twin.journal.appending import LAST_SEQ, PURGED_SEQ
from lupin_twin.journal.hours import WrittenInspection, WrittenScan, count
from lupin_twin.journal.rows import flower_of, numbers_of, sensor_names
from lupin_twin.journal.schema import (
    LOCAL_SITE,
    PAGE_SIZE,
    DamagedFile,
    SiteLog,
    set_meta,
    transaction,
)

_LEAF: Final = 0x0A
_INNER: Final = 0x02
_FIRST_PAGE_HEADER: Final = 100
_INT_BYTES: Final = (0, 1, 2, 3, 4, 6, 8)
_REAL: Final = struct.Struct(">d")
# What of a row stands on its page, at most and at least, where the rest goes on on others.
_LARGEST_HERE: Final = (PAGE_SIZE - 12) * 64 // 255 - 23
_LEAST_HERE: Final = (PAGE_SIZE - 12) * 32 // 255 - 23
# No row of ours is longer, and a damaged page may say anything.
_MAX_PAYLOAD: Final = 10_000_000
_LOG_HEADER: Final = 32
_FRAME_HEADER: Final = 24

_LEAST_ROW_BYTES: Final = 20
# By what a row of each table is known: text, integer, number, and those that may be missing.
_KINDS: Final = {
    "meta": "ttt",
    "run": "tiiiiiII",
    "series": "tiitit",
    "scan": "tiiiIiitttit",
    "look": "tiitiIitttFiiiitt",
    "place": "tiitiifffffffi",
    "hour": "tiitttt",
    "tally": "titiiiiiii",
    "event": "titiiti",
    "note": "ttittttI",
    # The index of the series: all that their table says.
    "series_of": "tititi",
}
_TYPES: Final[dict[str, tuple[type, ...]]] = {
    "t": (str,),
    "i": (int,),
    "I": (int, NoneType),
    "f": (int, float),
    "F": (int, float, NoneType),
}
_WRITTEN: Final = ("scan", "look")
_NO_RUN: Final = "run NOT IN (SELECT run FROM run)"
_MEANINGLESS: Final = {
    "run": "joins NOT IN (SELECT run FROM run)",
    "series": f"{_NO_RUN} OR NOT json_valid(sensors)",
    "place": _NO_RUN,
}
# What was counted outlives the rows; of rows that are there it is counted again.
_COUNTED: Final = ("hour", "tally", "event")
# Later than any stamp that we write.
_NEVER: Final = 2**62
# A run begins at a moment of the wall's clock; nothing is counted that far.
_LATE: Final = 10**12

Record = tuple[Any, ...]


def quarantine(path: Path, when: str) -> Path:
    """Rename a file and its log; returns the new name. Nothing is ever deleted or overwritten."""
    number = 0
    while True:
        aside = path.with_name(f"{path.name}.damaged-{when}" + (f"-{number}" if number else ""))
        if not aside.exists():
            break
        number += 1
    log = path.with_name(path.name + "-wal")
    if log.exists():
        log.rename(aside.with_name(aside.name + "-wal"))
    # The index of the log is made anew from the log; one that is left behind is of another file.
    path.with_name(path.name + "-shm").unlink(missing_ok=True)
    path.rename(aside)
    return aside


class _Broken(ValueError):
    """Bytes that are no row."""


class Pages:
    """The pages of a file, those in its log included."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("rb")
        self._log: IO[bytes] | None = None
        self._in_log: dict[int, int] = {}
        log = path.with_name(path.name + "-wal")
        if log.exists():
            self._log = log.open("rb")
            self._read_log()
        self.count = max(path.stat().st_size // PAGE_SIZE, *self._in_log, 0)

    def close(self) -> None:
        """Let go of the file."""
        self._file.close()
        if self._log is not None:
            self._log.close()

    def __getitem__(self, number: int) -> bytes:
        at = self._in_log.get(number)
        file, at = (self._file, (number - 1) * PAGE_SIZE) if at is None else (self._log, at)
        assert file is not None
        file.seek(at)
        return file.read(PAGE_SIZE)

    def _read_log(self) -> None:
        """Where each page stands in it last."""
        assert self._log is not None
        salt = self._log.read(_LOG_HEADER)[16:24]
        at = _LOG_HEADER
        while len(header := self._log.read(_FRAME_HEADER)) == _FRAME_HEADER:
            if header[8:16] != salt:  # left behind by an earlier log
                break
            self._in_log[int.from_bytes(header[:4], "big")] = at + _FRAME_HEADER
            at = self._log.seek(at + _FRAME_HEADER + PAGE_SIZE)

    # --- rows ---------------------------------------------------------------------------------

    def rows(self, *tables: str) -> Iterator[tuple[str, list[Record]]]:
        """Rows of some tables, page by page from the last one on: the newest first, mostly."""
        for number in range(self.count, 0, -1):
            page = self[number]
            at = _FIRST_PAGE_HEADER if number == 1 else 0
            if len(page) < PAGE_SIZE or page[at] not in (_LEAF, _INNER):
                continue
            # All that stands on a page is of one table.
            records = self._records(page, at)
            first = next((record for record in records if _table_of(record)), ())
            table = _table_of(first)
            if table in tables:
                yield table, [first, *(record for record in records if _table_of(record) == table)]

    def _records(self, page: bytes, at: int) -> Iterator[Record]:
        is_inner = page[at] == _INNER
        cells = int.from_bytes(page[at + 3 : at + 5], "big")
        first = at + (12 if is_inner else 8)
        for pointer in range(first, min(first + 2 * cells, PAGE_SIZE - 1), 2):
            cell = int.from_bytes(page[pointer : pointer + 2], "big") + (4 if is_inner else 0)
            try:
                yield self._record(page, cell)
            except (_Broken, IndexError, UnicodeDecodeError, struct.error):
                continue

    def _record(self, page: bytes, at: int) -> Record:
        length, at = _varint(page, at)
        payload = self._payload(page, at, length)
        header, at = _varint(payload, 0)
        kinds = []
        while at < header:
            kind, at = _varint(payload, at)
            kinds.append(kind)
        values = []
        for kind in kinds:
            value, at = _value(payload, at, kind)
            values.append(value)
        return tuple(values)

    def _payload(self, page: bytes, at: int, length: int) -> bytes:
        """What stands on the page, and the pages that it goes on on."""
        if length <= _LARGEST_HERE:
            return page[at : at + length]
        if length > _MAX_PAYLOAD:
            raise _Broken
        here = _LEAST_HERE + (length - _LEAST_HERE) % (PAGE_SIZE - 4)
        here = here if here <= _LARGEST_HERE else _LEAST_HERE
        found = bytearray(page[at : at + here])
        following = int.from_bytes(page[at + here : at + here + 4], "big")
        while len(found) < length:
            more = self[following] if 0 < following <= self.count else b""
            if len(more) < PAGE_SIZE:
                raise _Broken
            following = int.from_bytes(more[:4], "big")
            found += more[4 : 4 + length - len(found)]
        return bytes(found)


def _table_of(record: Record) -> str:
    """The table whose row it looks like; empty: of none, an index's entry for example."""
    for table, kinds in _KINDS.items():
        if (
            len(kinds) == len(record)
            and all(isinstance(v, _TYPES[kind]) for v, kind in zip(record, kinds, strict=True))
            and (table != "run" or record[4] > _LATE)
        ):
            return table
    return ""


def _varint(data: bytes, at: int) -> tuple[int, int]:
    """A number of up to nine bytes, and where it ends."""
    value = 0
    for index in range(8):
        byte = data[at + index]
        value = value << 7 | byte & 0x7F
        if byte < 0x80:
            return value, at + index + 1
    return value << 8 | data[at + 8], at + 9


def _value(data: bytes, at: int, kind: int) -> tuple[Any, int]:
    """A value of a record by its serial type, and where it ends."""
    if kind == 0:
        return None, at
    if kind in (8, 9):
        return kind - 8, at
    if kind < len(_INT_BYTES):
        end = at + _INT_BYTES[kind]
        return int.from_bytes(data[at:end], "big", signed=True), end
    if kind == 7:
        return _REAL.unpack(data[at : at + 8])[0], at + 8
    end = at + (kind - 13) // 2
    if kind < 13 or not kind % 2 or end > len(data):
        raise _Broken
    return data[at:end].decode(), end


class Salvage:
    """Copies what can be read of a damaged journal into a new one, the newest first.

    Rows keep their numbers; one that is no row any more, or whose series is lost, is left.
    """

    def __init__(self, aside: Path, connection: sqlite3.Connection) -> None:
        self._aside = aside
        self._connection = connection
        self._log = SiteLog(connection)
        # Run, kind and number of sensors of each series.
        self._series: dict[int, tuple[int, int, int]] = {}
        self._runs: set[int] = set()
        self._purged_seq = 0
        self._purged_ns: dict[int, int] = {}

    def steps(self) -> Generator[None, None, None]:
        """Each step is one transaction; after the first, runs, series and places are there.

        Steps that were done before do no harm.
        """
        try:
            pages = Pages(self._aside)
        except OSError:
            return
        try:
            with transaction(self._connection):
                self._begin(pages)
            yield
            for table, rows in pages.rows(*_WRITTEN):
                with transaction(self._connection):
                    self._write(table, rows)
                yield
        finally:
            pages.close()

    def _begin(self, pages: Pages) -> None:
        found: dict[str, set[Record]] = {table: set() for table in _KINDS}
        for table, rows in pages.rows(*(table for table in _KINDS if table not in _WRITTEN)):
            found[table].update(row for row in rows if row[0] == LOCAL_SITE)
        self._note(found["meta"])
        for site, run, tag, kind, sensors, series in found["series_of"]:
            found["series"].add((site, series, run, tag, kind, sensors))
        for table in ("run", "series", "place", "note"):
            self._put(table, found[table])
        execute = self._connection.execute
        for table, is_meaningless in _MEANINGLESS.items():
            execute(f"DELETE FROM {table} WHERE {is_meaningless}")
        self._runs = {run for (run,) in execute("SELECT run FROM run")}
        for series, run, kind, sensors in execute("SELECT series, run, kind, sensors FROM series"):
            with suppress(DamagedFile):
                self._series[series] = (run, kind, len(sensor_names(sensors)))
        for table in _COUNTED:
            self._put(table, (row for row in found[table] if self._is_given_up(table, row)))

    def _note(self, rows: Iterable[Record]) -> None:
        meta = {key: value for _, key, value in rows}
        for key, value in meta.items():
            run = key.removeprefix("purged_ns:")
            if key != run and run.isdecimal() and value.isdecimal():
                self._purged_ns[int(run)] = int(value)
        if meta.get(PURGED_SEQ, "").isdecimal():
            self._purged_seq = int(meta[PURGED_SEQ])
        for key, value in meta.items():
            if key not in ("journal_id", LAST_SEQ):
                set_meta(self._connection, key, value)
        # The numbers go on past all that may have been lost at the end.
        last = meta.get(LAST_SEQ, "")
        largest = max(
            self._purged_seq,
            int(last) if last.isdecimal() else 0,
            self._aside.stat().st_size // _LEAST_ROW_BYTES,
        )
        for (seq,) in self._connection.execute("SELECT max(seq) FROM place"):
            largest = max(largest, seq or 0)
        set_meta(self._connection, LAST_SEQ, largest + 1_000_000)

    def _is_given_up(self, table: str, row: Record) -> bool:
        """Whether a count is of rows that were deleted before the damage."""
        if table == "hour":
            run, hour = self._series.get(row[1], (-1,))[0], row[2]
        else:
            run, hour = row[1], row[3] if table == "tally" else row[3] // HOUR_NS
        return run in self._runs and hour <= self._purged_ns.get(run, -1) // HOUR_NS

    def _write(self, table: str, rows: list[Record]) -> None:
        scans, inspections = [], []
        for row in rows:
            if row[0] != LOCAL_SITE or row[1] <= self._purged_seq:
                continue
            written = self._scan(row) if table == "scan" else self._look(row)
            if written is None or not self._put(table, [row]):
                continue
            is_copy = row[10] if table == "scan" else row[14]
            if is_copy:
                continue
            if isinstance(written, WrittenScan):
                scans.append(written)
            else:
                inspections.append(written)
        count(self._log, scans, inspections)

    def _scan(self, row: Record) -> WrittenScan | None:
        run, kind, sensors = self._series.get(row[2], (0, 0, -1))
        try:
            (values,) = numbers_of([row[11]])
        except DamagedFile:
            return None
        if len(values) != sensors or not 0 <= row[3] < _NEVER:
            return None
        return WrittenScan(run, row[2], kind, row[3], row[6], values)

    def _look(self, row: Record) -> WrittenInspection | None:
        try:
            flower_of([*row[9:14], *row[15:17]])
        except DamagedFile:
            return None
        if row[2] not in self._runs or not 0 <= row[4] < _NEVER:
            return None
        return WrittenInspection(row[2], row[3], row[1], row[4], bool(row[11]), row[13])

    def _put(self, table: str, rows: Iterable[Record]) -> int:
        marks = ", ".join("?" * len(_KINDS[table]))
        text = f"INSERT OR IGNORE INTO {table} VALUES ({marks})"
        return int(self._connection.executemany(text, rows).rowcount)
