# ruff: noqa: S608  # SQL is put together of constants
"""Upgrades a journal of an earlier version, and vacuums a journal.

An upgrade builds a new file beside the journal, in batches, and renames it. If the process is
killed meanwhile, the old file is intact, and the next upgrade goes on after the last batch. The old
file stays beside the new one; one of version 4, as `NAME.v4`.
"""

from __future__ import annotations

import errno
import shutil
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing, suppress
from itertools import islice
from pathlib import Path
from typing import Final

from lupin_twin.core.past import HOUR_NS
from lupin_twin.journal.appending import LAST_SEQ, Appender, copy_known
from lupin_twin.journal.checking import Progress, find_all_damage, size_of
from lupin_twin.journal.counts import ADD_HOUR, DELETED
from lupin_twin.journal.fold import copies
from lupin_twin.journal.paths import delete, writing_alone
from lupin_twin.journal.runs import Run, put_run, runs
from lupin_twin.journal.salvage import replace_journal
from lupin_twin.journal.schema import (
    APPLICATION_ID,
    FILE_ERRORS,
    HOURS_OF_LISTS,
    LOCAL_SITE,
    TABLES,
    UPGRADED,
    DamagedFile,
    Foreign,
    NotPossible,
    columns,
    get_meta,
    insert_into,
    json_text,
    open_writer,
    set_meta,
    transaction,
)
from lupin_twin.journal.version3 import VERSION, OldRun, Version3

# What one transaction copies, and a killed upgrade loses: a second, even on a small board.
ROWS = 5_000
# Facts about an upgraded file: the file that it was made from; the last number of that file that is
# copied, and how many damaged rows there were before.
_MADE_FROM: Final = "upgraded_from"
_COPIED: Final = "upgraded"
# Between two calls while a long SQL statement runs.
_INSTRUCTIONS: Final = 100_000
_NUMBERS: Final = ("simulated_from_ns", "simulated_until_ns")


def old_version(path: Path) -> int | None:
    """The version of a journal that has to be upgraded; None of any other file, and without one.

    Only its first bytes are read (https://www.sqlite.org/fileformat2.html, 1.3).
    """
    try:
        with path.open("rb") as file:
            header = file.read(100)
    except FileNotFoundError:
        return None
    version, application_id = (int.from_bytes(header[at : at + 4], "big") for at in (60, 68))
    return version if application_id == APPLICATION_ID and version in UPGRADED else None


def upgrade(path: Path, report: Callable[[float], None]) -> str:
    """Upgrade a journal that has an `old_version`; the caller holds its lock.

    `report(share)` is called as the work goes on. Returns, in words, which rows were left out
    because they are damaged; usually empty.

    Raises:
        sqlite3.Error, DamagedFile, OSError: the journal is unchanged: somebody reads it, say, or
            the disk is full.

    """
    version, new = old_version(path), path.with_name(path.name + ".upgrade")
    # Refused at once: an upgrade that fills the disk would begin again and again.
    needed, free = path.stat().st_size * 5 // 4 - size_of(new), shutil.disk_usage(path.parent).free
    if free < needed:
        room = f"its upgrade needs {needed / 1e6:,.1f} MB of disk, {free / 1e6:,.1f} MB are free"
        raise OSError(errno.ENOSPC, room)
    try:
        with closing(sqlite3.connect(path, isolation_level=None, timeout=5.0)) as connection:
            # First move the WAL into the file: otherwise it would be taken for the new file's WAL.
            if _is_read(connection):
                somebody = f"another process reads {path}, which must be upgraded"
                raise sqlite3.OperationalError(somebody)  # noqa: TRY301
            connection.execute("PRAGMA query_only = 1")
            with closing(_begun(path, new)) as target:
                if version == VERSION:
                    steps = _Upgrade(Version3(connection), target).steps()
                else:
                    steps = _copy_version4(path, new, target)
                for share in steps:
                    target.execute("PRAGMA wal_checkpoint(PASSIVE)").fetchall()
                    report(min(1.0, share))
                damaged = _copied(target)[1]
        kept = replace_journal(path, new, f".v{version}")
    except BaseException as error:
        delete(new)
        if isinstance(error, sqlite3.OperationalError) and str(error).startswith("no such"):
            raise DamagedFile(f"the tables of {path} are not those of a journal") from error
        raise
    return f"{damaged:,} rows of {kept} are damaged and left out" if damaged else ""


def _is_read(connection: sqlite3.Connection) -> bool:
    """Move the whole WAL into the file; returns whether a reader prevented that."""
    connection.execute("PRAGMA busy_timeout = 1000")
    ((is_busy, *_),) = connection.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchall()
    return bool(is_busy)


def _begun(path: Path, new: Path) -> sqlite3.Connection:
    """Open what a killed upgrade of the same file has built, or else a new file."""
    status = path.stat()
    made_from = f"{status.st_size} {status.st_mtime_ns}"
    with suppress(*FILE_ERRORS, Foreign):
        target = open_writer(new)
        if get_meta(target, _MADE_FROM) == made_from:
            return target
        target.close()
    delete(new)
    target = open_writer(new)
    set_meta(target, _MADE_FROM, made_from)
    return target


def _copied(target: sqlite3.Connection) -> tuple[int, int]:
    after, _, damaged = (get_meta(target, _COPIED) or "0 0").partition(" ")
    return int(after), int(damaged)


def _copy_version4(old: Path, new: Path, target: sqlite3.Connection) -> Iterator[float]:
    """Copy a journal of version 4, whose hours are lists; a damaged row ends the upgrade.

    Yields the share that is done after each batch. A table goes on after its last row.
    """
    target.execute("ATTACH ? AS old", (str(old),))
    for table in ("site", "meta"):
        target.execute(f"INSERT OR REPLACE INTO {table} SELECT * FROM old.{table}")
    for table in TABLES:
        names = [name for name in columns(table, of_key=True) if name != "sensor"]
        key, marks = ", ".join(names), ", ".join("?" * len(names))
        lot = f"(SELECT * FROM old.{table} WHERE ({key}) > ({marks}) ORDER BY {key} LIMIT {ROWS})"
        select = f"SELECT * FROM {lot}"
        if table == "hour":
            select = HOURS_OF_LISTS.format(lists=lot, each="json_each(n) AS each")
        last = f"SELECT {key} FROM {{}} ORDER BY {' DESC, '.join(names)} DESC LIMIT 1"
        after = target.execute(last.format(table)).fetchone() or [""] * len(names)
        while until := target.execute(last.format(lot), after).fetchone():
            with transaction(target):
                target.execute(f"INSERT INTO {table} {select}", after)
            after = until
            yield size_of(new) / size_of(old)


class _Upgrade:
    """Copies an open journal of version 3 into a new one, or goes on with that."""

    def __init__(self, old: Version3, target: sqlite3.Connection) -> None:
        self._old = old
        self._target = target
        self._appender = Appender(target)
        # Until the old file has no counts yet, those of hours with deleted rows are copied.
        self._appender.counted_ns = {
            run: (purged_ns // HOUR_NS + 1) * HOUR_NS - 1
            for run in old.runs
            if (purged_ns := old.meta(f"{DELETED}{run}", -1)) >= 0
        }
        self._begun = {run.id: run for run in runs(target.execute)}

    def steps(self) -> Iterator[float]:
        """Copy all; yields the share that is done after each batch."""
        after, damaged = _copied(self._target)
        if after:
            self._old.damaged = damaged
        last_id, rows = self._old.last_id(), self._old.rows(after)
        while lot := list(islice(rows, ROWS)):
            with transaction(self._target):
                for number, run, row in lot:
                    if row is None:
                        self._old.damaged += 1
                        continue
                    self._begin_until(run)
                    if self._appender.counted_ns and number > self._old.meta("rolled_id"):
                        self._appender.flush()
                        self._appender.counted_ns.clear()
                    self._appender.append(run, (row,))
                after = lot[-1][0]
                self._note(after)
            yield after / last_id
        with transaction(self._target):
            self._begin_until(max(self._old.runs, default=0))
            for key in _NUMBERS:
                if value := self._old.meta(key):
                    set_meta(self._target, key, value)
            self._note(after)

    def _note(self, after: int) -> None:
        self._appender.flush()
        # Series without rows have numbers too.
        set_meta(self._target, LAST_SEQ, self._appender.last_seq)
        set_meta(self._target, _COPIED, f"{after} {self._old.damaged}")

    def _begin_until(self, last: int) -> None:
        """Begin the runs up to one, including earlier ones in which nothing was received."""
        if last not in self._begun:
            for number in sorted(self._old.runs.keys() - self._begun.keys()):
                if number <= last:
                    self._begin(self._old.runs[number])

    def _begin(self, old: OldRun) -> None:
        self._appender.flush()
        run = Run(old.id, old.begun, self._appender.last_seq + 1, None, old.ended_ns)
        self._begun[old.id] = run
        put_run(self._target, run)
        # The last stamp of the rows that were deleted by age or size.
        if (purged_ns := self._old.meta(f"{DELETED}{run.id}", -1)) >= 0:
            self._carry_counts(run.id, purged_ns)
        before = None if old.follows is None else self._begun.get(old.follows)
        if before is not None:
            rows = copies(self._target, before, places_only=old.places_only)
            copy_known(self._appender, before, run, rows)

    def _carry_counts(self, run: int, purged_ns: int) -> None:
        """Copy the counts of hours with deleted rows; their other rows are not counted again."""
        hour = purged_ns // HOUR_NS
        set_meta(self._target, f"{DELETED}{run}", purged_ns)
        self._target.executemany(ADD_HOUR, self._hours(run, hour))
        for table in ("tally", "event"):
            rows = ((LOCAL_SITE, run, *row) for row in getattr(self._old, table)(run, hour))
            self._target.executemany(insert_into(table), rows)

    def _hours(self, run: int, until: int) -> Iterator[tuple[object, ...]]:
        """Rows of `hour`; series of the old file that differ only by source become one."""
        numbers: dict[tuple[str, int, tuple[str, ...]], int] = {}
        for tag_id, kind, sensors, hour, buckets in self._old.hours(run, until):
            key = (tag_id, kind, sensors)
            if key not in numbers:
                self._appender.last_seq += 1
                numbers[key] = self._appender.last_seq
                row = (LOCAL_SITE, numbers[key], run, tag_id, kind, json_text(sensors))
                self._target.execute(insert_into("series"), row)
            for sensor, bucket in enumerate(buckets):
                if bucket[0]:
                    yield LOCAL_SITE, numbers[key], hour, sensor, *bucket


def vacuum(path: Path, holder: str, report: Progress) -> tuple[int, int]:
    """Vacuum a journal; returns its size in bytes before and after.

    The whole file is checked for damage first: vacuuming a damaged file would lose what can still
    be salvaged. `report(what, share)` is called meanwhile.

    Raises:
        InUse: a twin writes it.
        NotPossible: it is damaged, or somebody reads it.
        Empty, Foreign, DamagedFile, sqlite3.Error, OSError: as `open_named`.

    """
    with writing_alone(path, holder) as connection:
        handle_interrupts(connection)
        before = path.stat().st_size
        with closing(find_all_damage(connection, report)) as found:
            first = next(found, None)
        if first is not None:
            raise NotPossible(
                f"{path} is damaged and left as it is ({first});"
                " lupin-twin journal check lists all damage"
            )
        connection.execute("VACUUM")
        if _is_read(connection):
            raise NotPossible(f"another process reads {path}: try again when none does")
        return before, path.stat().st_size


def handle_interrupts(connection: sqlite3.Connection) -> None:
    """Let Ctrl-C end a long SQLite statement: Python handles signals only while it runs itself."""
    connection.set_progress_handler(lambda: 0, _INSTRUCTIONS)
