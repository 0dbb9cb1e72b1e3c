# ruff: noqa: S608  # SQL is put together of constants
"""The journal's end of forwarding: reads the rows after a number, as rows of the archive.

The file is only read, in a process that is not its twin's. Rows are synced to the disk before they
are handed on. Otherwise, after a power cut, the twin could reuse numbers that the archive has.
"""

from __future__ import annotations

import json
import os
from collections import defaultdict
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from lupin_twin.core.past import Event
from lupin_twin.journal import sql
from lupin_twin.journal.appending import PURGED_SEQ, Appender
from lupin_twin.journal.follow import rows_behind
from lupin_twin.journal.paths import files_of, forwarded_seq, note_forwarded
from lupin_twin.journal.retention import RECORD
from lupin_twin.journal.rows import noted_number
from lupin_twin.journal.schema import (
    DAY_LENGTH,
    MAP,
    ORIGIN,
    Row,
    SiteLog,
    columns,
    one_view,
    open_named,
)

# About how many rows one transaction has.
_ROWS: Final = 5_000
# Small tables: all rows are read each time, and those that have changed are sent.
_SMALL: Final = ("run", "meta")
# Columns with numbers of the journal, in whatever table.
_SEQS: Final = ("seq", "series", "begun_seq")
_RUNS: Final = ("run", "joins")
# For each run, since when new rows may have changed its events. The last silence that began before
# them may now end later.
_EVENTS_SINCE: Final = (
    "SELECT run, coalesce((SELECT max(stamp_ns) FROM event WHERE site = :site"
    f" AND event.run = new.run AND event = '{Event.SILENCES}' AND stamp_ns < since_ns), since_ns)"
    " FROM (SELECT run, min(stamp_ns) AS since_ns FROM"
    "  (SELECT run, stamp_ns FROM scan CROSS JOIN series USING (site, series)"
    "   WHERE site = :site AND seq > :after AND seq <= :upto UNION ALL SELECT run, stamp_ns"
    "   FROM look WHERE site = :site AND seq > :after AND seq <= :upto) GROUP BY run) AS new"
)
_EVERY_EVENT: Final = "SELECT run, 0 FROM run WHERE site = :site"
_EVENTS: Final = "SELECT * FROM event WHERE site = :site AND run = :run AND stamp_ns >= :since"


@dataclass(frozen=True, slots=True)
class Epoch:
    """The offsets of a journal's numbers in the archive, and the last number forwarded."""

    site: str
    number: int
    seq_offset: int
    run_offset: int
    forwarded_seq: int

    def moved(self, table: str, rows: Iterable[Row]) -> list[list[Any]]:
        """Rows of the journal as the archive has them: of its site, and with its numbers."""
        offsets = {**dict.fromkeys(_SEQS, self.seq_offset), **dict.fromkeys(_RUNS, self.run_offset)}
        # The offsets of the first epoch are 0.
        numbers = [
            (place, offset)
            for place, name in enumerate(columns(table))
            if (offset := offsets.get(name))
        ]
        found = [[self.site, *map(without_nul, row[1:])] for row in rows]
        for row in found:
            for place, offset in numbers:
                # None and 0 refer to no row.
                row[place] = row[place] and row[place] + offset
        return found


def without_nul(value: Any) -> Any:
    """The value without NUL, which PostgreSQL's text cannot hold: the batch would never go in."""
    return value.replace("\0", "\ufffd") if isinstance(value, str) else value


@dataclass(frozen=True, slots=True)
class Batch:
    """Rows by table for one transaction, up to the number `upto` of the journal.

    `replaced`: for these runs, its events replace the archive's from a stamp on.
    """

    upto: int
    is_full: bool
    rows: dict[str, list[list[Any]]]
    replaced: list[tuple[int, int]]

    def __bool__(self) -> bool:
        return bool(self.rows or self.replaced)


class Source:
    """An open journal, in one thread; `path` has to be a journal, `log` runs queries on it.

    Raises:
        Empty, Foreign, DamagedFile, sqlite3.Error, OSError: as `open_named`.

    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._connection = open_named(path)
        # Only now, because opening makes a WAL where there is none.
        self._files = files_of(path)
        self.log = SiteLog(self._connection)
        self._version = -1
        self._sent: frozenset[tuple[str, Row]] = frozenset()
        # Whether the archive may lack events of rows that it has.
        self._is_behind = True

    def close(self) -> None:
        """Close the journal."""
        self._connection.close()

    def is_replaced(self) -> bool:
        """Whether its path, or its WAL's, is now that of another file, or of none."""
        return files_of(self._path) != self._files

    def has_changed(self) -> bool:
        """Whether anybody has written since the last call."""
        (version,) = self._connection.execute("PRAGMA data_version").fetchone()
        before, self._version = self._version, version
        return bool(before != version)

    def last_seq(self) -> int:
        """The last number that the journal has assigned."""
        return Appender(self._connection).last_seq

    def note_ids(self) -> set[str]:
        """The ids of all its notes."""
        return {note_id for (note_id,) in self.log.execute(sql.NOTE_IDS)}

    def batch(self, epoch: Epoch) -> Batch:
        """The next batch, as of one moment, and synced to the disk."""
        after = epoch.forwarded_seq
        with one_view(self._connection):
            found, upto, is_all = rows_behind(self.log, after, _ROWS, every=True)
            found += [("meta", row) for row in self._facts(epoch)]
            since: list[tuple[int, int]] = []
            if is_all:  # rows go first, because late ones change events
                sql = _EVERY_EVENT if self._is_behind else _EVENTS_SINCE
                since = self.log.execute(sql, {"after": after, "upto": upto}).fetchall()
            for run, since_ns in since:
                of_run = self.log.execute(_EVENTS, {"run": run, "since": since_ns})
                found += [("event", row) for row in of_run]
        self._sync()
        self._is_behind = not is_all
        small = frozenset(each for each in found if each[0] in _SMALL)
        by_table: dict[str, list[Row]] = defaultdict(list)
        for table, row in found:
            if table not in _SMALL or (table, row) not in self._sent:
                by_table[table].append(row)
        self._sent = small
        rows = {table: epoch.moved(table, of_table) for table, of_table in by_table.items()}
        return Batch(upto, not is_all, rows, [(run + epoch.run_offset, at) for run, at in since])

    def claim(self) -> None:
        """Have the twin keep what is not in the archive yet.

        Raises:
            OSError: nothing can be written beside the journal.

        """
        if not forwarded_seq(self._path, self.log.journal_id):
            self.note(0)

    def note(self, seq: int) -> None:
        """Note beside the journal that its rows up to a number are in the archive."""
        if forwarded_seq(self._path, self.log.journal_id) != seq:
            note_forwarded(self._path, self.log.journal_id, seq)

    def _facts(self, epoch: Epoch) -> Iterator[Row]:
        """The rows of the file's `meta` that are true of the archive too.

        Rows that were deleted here stay there, except those that were never forwarded.
        """
        purged = noted_number(self.log, PURGED_SEQ)
        of_runs = ("lost_ns", "purged_ns") if purged > epoch.forwarded_seq else ("lost_ns",)
        for site, key, value in self.log.execute("SELECT * FROM meta WHERE site = :site"):
            name, _, number = key.partition(":")
            if name in of_runs:
                yield site, f"{name}:{int(number) + epoch.run_offset}", value
            elif key.startswith(RECORD):
                record = json.loads(value)
                record["seq"] = record.get("seq", 0) + epoch.seq_offset
                yield site, f"{key}:{epoch.number}", json.dumps(record)
            elif key in {ORIGIN, DAY_LENGTH, MAP} or key.startswith("simulated_"):
                yield site, key, value

    def _sync(self) -> None:
        # Only the write-ahead log: closing a descriptor of the file would drop SQLite's locks.
        with suppress(FileNotFoundError):
            log = os.open(self._path.with_name(self._path.name + "-wal"), os.O_RDONLY)
            try:
                os.fdatasync(log)
            finally:
                os.close(log)
