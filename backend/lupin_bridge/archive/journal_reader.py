# ruff: noqa: S608  # SQL is put together of constants
"""The journal's end of forwarding: reads the rows after a number, as rows of the archive.

The file is only read, in a process that is not its twin's. Rows are synced to the disk before they
are handed on. Otherwise, after a power cut, the twin could reuse numbers that the archive has.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Final

from lupin_bridge.archive.database import ArchiveError
from lupin_twin.core.past import HOUR_NS, Event
from lupin_twin.journal.appending import PURGED_SEQ, Appender
from lupin_twin.journal.paths import forwarded_seq, note_forwarded
from lupin_twin.journal.retention import RECORD
from lupin_twin.journal.schema import (
    DAY_LENGTH,
    LOCAL_SITE,
    MAP,
    ORIGIN,
    SiteLog,
    get_meta,
    one_view,
    open_named,
)

Row = tuple[Any, ...]

# Rows of each table in one transaction; looks are larger.
_SCANS: Final = 5_000
_INSPECTIONS: Final = 500
_APPENDED: Final = {"scan": _SCANS, "look": _INSPECTIONS, "place": _SCANS}
_WITHIN: Final = f"site = '{LOCAL_SITE}' AND seq > :after AND seq <= :upto"

# Each with the archive's site and numbers: `seqs` and `runs` are the offsets of these.
_ROWS: Final = {
    "series": (
        "SELECT :site, series + :seqs, run + :runs, tag, kind, sensors FROM series"
        f" WHERE site = '{LOCAL_SITE}' AND series > :after AND series <= :upto"
    ),
    "scan": (
        "SELECT :site, seq + :seqs, series + :seqs, stamp_ns, own_stamp_ns, arrival_ns, status,"
        f" source, mission, detail, is_copy, readings FROM scan WHERE {_WITHIN}"
    ),
    "look": (
        "SELECT :site, seq + :seqs, run + :runs, tag, stamp_ns, own_stamp_ns, arrival_ns, source,"
        " mission, species, confidence, anomaly, flower_count, bug_count, is_copy, blooms, box"
        f" FROM look WHERE {_WITHIN}"
    ),
    "place": (
        "SELECT :site, seq + :seqs, run + :runs, tag, stamp_ns, arrival_ns, x, y, z, qx, qy, qz,"
        f" qw, is_copy FROM place WHERE {_WITHIN}"
    ),
    # The counts that include those rows, as they are now.
    "hour": (
        "SELECT :site, hour.series + :seqs, hour.hour, n, total, low, high FROM"
        f" (SELECT DISTINCT series, stamp_ns / {HOUR_NS} AS hour FROM scan WHERE {_WITHIN}"
        "  AND is_copy = 0) AS touched"
        f" CROSS JOIN hour ON hour.site = '{LOCAL_SITE}' AND hour.series = touched.series"
        " AND hour.hour = touched.hour"
    ),
    "tally": (
        "SELECT :site, tally.run + :runs, event, tally.hour, n, total, low, high, first_ns, last_ns"
        f" FROM (SELECT DISTINCT run, stamp_ns / {HOUR_NS} AS hour FROM scan"
        f"  CROSS JOIN series USING (site, series) WHERE {_WITHIN} AND is_copy = 0"
        f"  UNION SELECT DISTINCT run, stamp_ns / {HOUR_NS} FROM look WHERE {_WITHIN}"
        "  AND is_copy = 0) AS touched"
        f" CROSS JOIN tally ON tally.site = '{LOCAL_SITE}' AND tally.run = touched.run"
        " AND tally.hour = touched.hour"
    ),
}
_ARRIVAL: Final = " UNION ALL ".join(
    f"SELECT arrival_ns FROM {table} WHERE site = :site AND seq = :seq" for table in _APPENDED
)
# Small tables: all rows are read each time, and those that have changed are sent.
_SMALL: Final = {
    "run": (
        "SELECT :site, run + :runs, is_simulated, begun_stamp_ns, begun_arrival_ns,"
        f" begun_seq + :seqs, joins + :runs, ended_stamp_ns FROM run WHERE site = '{LOCAL_SITE}'"
    ),
    "note": (
        "SELECT :site, id, made_at_ns, made_by, kind, subject, text, until_ns FROM note"
        f" WHERE site = '{LOCAL_SITE}'"
    ),
}
_EVENTS: Final = (
    "SELECT :site, run + :runs, event, stamp_ns, CASE seq WHEN 0 THEN 0 ELSE seq + :seqs END, tag,"
    f" value FROM event WHERE site = '{LOCAL_SITE}' AND run = :run AND stamp_ns >= :since"
)
_TOUCHED_SINCE: Final = (
    f"SELECT run, min(stamp_ns) FROM (SELECT run, stamp_ns FROM scan"
    f" CROSS JOIN series USING (site, series) WHERE {_WITHIN} UNION ALL"
    f" SELECT run, stamp_ns FROM look WHERE {_WITHIN}) GROUP BY run"
)
# The last event that began before a stamp may go on past it.
_EVENT_OVER: Final = (
    f"SELECT max(stamp_ns) FROM event WHERE site = '{LOCAL_SITE}' AND run = :run"
    " AND event = :event AND stamp_ns < :since"
)
# All counts of a series (`hour`) or a run (`tally`): the numbers of these, and the rows of one.
_COUNTED: Final = {
    "hour": (
        f"SELECT series FROM series WHERE site = '{LOCAL_SITE}'",
        (
            "SELECT :site, series + :seqs, hour, n, total, low, high FROM hour"
            f" WHERE site = '{LOCAL_SITE}' AND series = :number"
        ),
    ),
    "tally": (
        f"SELECT run FROM run WHERE site = '{LOCAL_SITE}'",
        (
            "SELECT :site, run + :runs, event, hour, n, total, low, high, first_ns, last_ns"
            f" FROM tally WHERE site = '{LOCAL_SITE}' AND run = :number"
        ),
    ),
}


@dataclass(frozen=True, slots=True)
class Epoch:
    """The offsets of a journal's numbers in the archive, and the last number forwarded."""

    site: str
    number: int
    seq_offset: int
    run_offset: int
    forwarded_seq: int


@dataclass(slots=True)
class Batch:
    """Rows by table for one transaction, up to the number `upto` of the journal.

    `events` are, by run (the archive's number) and stamp, all from that stamp on: they replace
    those of the archive. `small` are all rows of the small tables, new or not.
    """

    upto: int
    is_full: bool
    rows: dict[str, list[Row]] = field(default_factory=dict)
    events: dict[tuple[int, int], list[Row]] = field(default_factory=dict)
    small: dict[str, frozenset[Row]] = field(default_factory=dict)

    def __bool__(self) -> bool:
        return any(self.rows.values()) or bool(self.events)


def arrival_of(log: SiteLog, seq: int) -> int | None:
    """When the row of a number was received, in a journal or in the archive; None: it is gone."""
    found = log.execute(_ARRIVAL, {"seq": seq}).fetchone()
    return None if found is None else int(found[0])


class Source:
    """An open journal, in one thread; `path` has to be a journal.

    Raises:
        Empty, Foreign, DamagedFile, sqlite3.Error, OSError: as `open_named`.

    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._inode = path.stat().st_ino
        self._connection = open_named(path)
        self._version = -1
        self._sent: dict[str, frozenset[Row]] = {}
        # From which stamp on events of a run are to be sent; None: all of every run.
        self._events_since: dict[int, int] | None = None

    def close(self) -> None:
        """Close the journal."""
        self._connection.close()

    @cached_property
    def journal_id(self) -> str:
        """The journal's id."""
        return get_meta(self._connection, "journal_id") or ""

    def is_replaced(self) -> bool:
        """Whether its path is now that of another file, or of none."""
        try:
            return self._path.stat().st_ino != self._inode
        except FileNotFoundError:
            return True

    def has_changed(self) -> bool:
        """Whether anybody has written since the last call."""
        (version,) = self._connection.execute("PRAGMA data_version").fetchone()
        before, self._version = self._version, version
        return bool(before != version)

    def last_seq(self) -> int:
        """The last number that the journal has assigned."""
        return Appender(self._connection).last_seq

    def arrival_of(self, seq: int) -> int | None:
        """When the row of a number was received; None: it is not there."""
        return arrival_of(SiteLog(self._connection), seq)

    def batch(self, epoch: Epoch) -> Batch:
        """The next batch, as of one moment, and synced to the disk.

        Raises:
            ArchiveError: the journal is being salvaged.

        """
        with one_view(self._connection):
            self._refuse_salvaged()
            upto, is_full = self._upto(epoch.forwarded_seq)
            parameters = {
                "site": epoch.site,
                "seqs": epoch.seq_offset,
                "runs": epoch.run_offset,
                "epoch": epoch.number,
                "after": epoch.forwarded_seq,
                "upto": upto,
            }
            found = Batch(upto, is_full)
            if upto > epoch.forwarded_seq:
                for table, sql in _ROWS.items():
                    found.rows[table] = self._connection.execute(sql, parameters).fetchall()
            small = {table: self._rows(sql, parameters) for table, sql in _SMALL.items()}
            for table, rows in {**small, "meta": self._facts(parameters)}.items():
                found.small[table] = frozenset(rows)
                sent = self._sent.get(table, frozenset())
                found.rows[table] = [row for row in rows if row not in sent]
            self._see_events(found, parameters)
        self._sync()
        return found

    def was_sent(self, batch: Batch, epoch: Epoch) -> None:
        """Note, here and beside the journal, that a batch is in the archive."""
        self._sent = batch.small
        if batch.events:
            self._events_since = {}
        self._note(max(batch.upto, epoch.forwarded_seq))

    def claim(self) -> None:
        """Have the twin keep what is not in the archive yet.

        Raises:
            ArchiveError: it cannot be forwarded now.
            OSError: nothing can be written beside the journal.

        """
        self._refuse_salvaged()
        if not forwarded_seq(self._path, self.journal_id):
            self._note(0)

    def _note(self, seq: int) -> None:
        if forwarded_seq(self._path, self.journal_id) != seq:
            note_forwarded(self._path, self.journal_id, seq)

    def counted(self, epoch: Epoch) -> Iterator[tuple[str, list[Row]]]:
        """Yield all counts in lots, also those of rows deleted before they were forwarded."""
        moved = {"site": epoch.site, "seqs": epoch.seq_offset, "runs": epoch.run_offset}
        for table, (numbers, sql) in _COUNTED.items():
            for (number,) in self._connection.execute(numbers).fetchall():
                yield table, self._rows(sql, {**moved, "number": number})

    def _refuse_salvaged(self) -> None:
        # Then rows come in any order.
        if get_meta(self._connection, "salvage"):
            raise ArchiveError(f"the journal {self._path} is being saved from damage")

    # --- one batch --------------------------------------------------------------------------------

    def _rows(self, sql: str, parameters: Mapping[str, object]) -> list[Row]:
        return self._connection.execute(sql, parameters).fetchall()

    def _upto(self, after: int) -> tuple[int, bool]:
        """The last number of the next batch, and whether there is more after it."""
        last, ends = after, []
        for table, most in _APPENDED.items():
            (count, end) = self._connection.execute(
                f"SELECT count(*), max(seq) FROM (SELECT seq FROM {table} WHERE site = ?"
                " AND seq > ? ORDER BY seq LIMIT ?)",
                (LOCAL_SITE, after, most),
            ).fetchone()
            last = max(last, end or 0)
            if count == most:
                ends.append(end)
        return (min(ends), True) if ends else (last, False)

    def _facts(self, parameters: Mapping[str, Any]) -> list[Row]:
        """The rows of the file's `meta` that are true of the archive too.

        Rows that were deleted here stay there, except those that were never forwarded.
        """
        purged = int(get_meta(self._connection, PURGED_SEQ) or 0)
        of_runs = ("lost_ns:", "purged_ns:") if purged > parameters["after"] else ("lost_ns:",)
        found = []
        for key, value in self._connection.execute(
            "SELECT key, value FROM meta WHERE site = ? ORDER BY key", (LOCAL_SITE,)
        ):
            name, _, run = key.partition(":")
            if f"{name}:" in of_runs:
                found.append((parameters["site"], f"{name}:{int(run) + parameters['runs']}", value))
            elif f"{name}:" == RECORD:
                record = json.loads(value)
                record["seq"] = record.get("seq", 0) + parameters["seqs"]
                moved = f"{key}:{parameters['epoch']}"
                found.append((parameters["site"], moved, json.dumps(record)))
            elif key in {ORIGIN, DAY_LENGTH, MAP} or key.startswith("simulated_"):
                found.append((parameters["site"], key, value))
        return found

    def _see_events(self, found: Batch, parameters: Mapping[str, Any]) -> None:
        """Add the events to a batch that is not full: late rows change them, so rows go first."""
        since = self._events_since
        if since is not None and found.upto > parameters["after"]:
            for run, stamp_ns in self._rows(_TOUCHED_SINCE, parameters):
                since[run] = min(stamp_ns, since.get(run, stamp_ns))
        if found.is_full:
            return
        if since is None:
            runs = self._connection.execute("SELECT run FROM run WHERE site = ?", (LOCAL_SITE,))
            since = dict.fromkeys((run for (run,) in runs), 0)
        for run, stamp_ns in since.items():
            within = {**parameters, "run": run, "since": stamp_ns, "event": Event.SILENCES}
            (over_ns,) = self._rows(_EVENT_OVER, within)[0]
            within["since"] = stamp_ns if over_ns is None else over_ns
            key = (run + parameters["runs"], within["since"])
            found.events[key] = self._rows(_EVENTS, within)

    def _sync(self) -> None:
        # Only the write-ahead log: closing a descriptor of the file would drop SQLite's locks.
        with suppress(FileNotFoundError):
            log = os.open(self._path.with_name(self._path.name + "-wal"), os.O_RDONLY)
            try:
                os.fdatasync(log)
            finally:
                os.close(log)
