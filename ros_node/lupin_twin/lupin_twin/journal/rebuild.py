"""Upgrades a journal of an earlier version, and vacuums a journal.

An upgrade builds a new file beside the journal, syncs it, and renames it: if the process is killed
meanwhile, the old file is intact. The old file stays beside the new one; one of version 4, as
`NAME.v4`.
"""

from __future__ import annotations

import os
import shutil
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing
from itertools import islice
from pathlib import Path
from typing import Final

from lupin_twin.core.past import HOUR_NS
from lupin_twin.journal.appending import Appender, copy_known
from lupin_twin.journal.checking import Progress, find_all_damage, size_of
from lupin_twin.journal.counts import ADD_HOUR, DELETED
from lupin_twin.journal.fold import copies
from lupin_twin.journal.paths import writing_alone
from lupin_twin.journal.retention import RETENTION_BYTES, RETENTION_NS
from lupin_twin.journal.runs import Run, put_run
from lupin_twin.journal.salvage import numbered
from lupin_twin.journal.schema import (
    APPLICATION_ID,
    HOURS_OF_LISTS,
    LOCAL_SITE,
    TABLES,
    UPGRADED,
    DamagedFile,
    NotPossible,
    insert_into,
    json_text,
    open_writer,
    set_meta,
    sync,
    transaction,
)
from lupin_twin.journal.version3 import VERSION, OldRun, Version3

_ROWS: Final = 5_000
# Between two calls while a long SQL statement runs.
_INSTRUCTIONS: Final = 100_000
_NUMBERS: Final = (RETENTION_NS, RETENTION_BYTES, "simulated_from_ns", "simulated_until_ns")


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
    try:
        with closing(sqlite3.connect(path, isolation_level=None, timeout=5.0)) as connection:
            # First move the WAL into the file: otherwise it would be taken for the new file's WAL.
            if _is_read(connection):
                somebody = f"another process reads {path}, which must be upgraded"
                raise sqlite3.OperationalError(somebody)  # noqa: TRY301
            connection.execute("PRAGMA query_only = 1")
            _remove(new)
            with closing(open_writer(new)) as target:
                # A failed upgrade begins again, so nothing has to be durable before it is done.
                target.execute("PRAGMA journal_mode = MEMORY")
                target.execute("PRAGMA synchronous = OFF")
                if version == VERSION:
                    damaged = _Upgrade(Version3(connection), target, report).run()
                else:
                    damaged = _copy_version4(path, new, target, report)
        sync(new)
        kept = _keep(path, version)
    except BaseException as error:
        _remove(new)
        if isinstance(error, sqlite3.OperationalError) and str(error).startswith("no such"):
            raise DamagedFile(f"the tables of {path} are not those of a journal") from error
        raise
    # Empty by now, but they belong to the old file. A process that still reads it has them open.
    for end in ("-wal", "-shm"):
        path.with_name(path.name + end).unlink(missing_ok=True)
    new.chmod(path.stat().st_mode & 0o777)
    new.replace(path)
    sync(path.parent)
    return f"{damaged:,} rows of {kept} are damaged and left out" if damaged else ""


def _is_read(connection: sqlite3.Connection) -> bool:
    """Move the whole WAL into the file; returns whether a reader prevented that."""
    connection.execute("PRAGMA busy_timeout = 1000")
    ((is_busy, *_),) = connection.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchall()
    return bool(is_busy)


def _remove(new: Path) -> None:
    for end in ("", "-wal", "-shm", "-journal"):
        new.with_name(new.name + end).unlink(missing_ok=True)


def _keep(path: Path, version: int | None) -> Path:
    """Give the old file a second name, and return that; no other file is overwritten."""
    for kept in numbered(path, f".v{version}"):
        if not kept.exists():
            break
        if kept.samefile(path):  # an earlier upgrade was killed after this step
            return kept
    try:
        os.link(path, kept)
    except OSError:  # a file system without links
        part = path.with_name(path.name + ".upgrade-copy")
        try:
            shutil.copyfile(path, part)
            sync(part)
        except OSError:  # the disk is full: a partial copy would keep it so
            part.unlink(missing_ok=True)
            raise
        part.rename(kept)
    sync(path.parent)
    return kept


def _copy_version4(
    old: Path, new: Path, target: sqlite3.Connection, report: Callable[[float], None]
) -> int:
    """Copy a journal of version 4, whose hours are lists; a damaged row ends the upgrade."""

    def go_on() -> None:
        report(min(1.0, size_of(new) / size_of(old)))

    target.set_progress_handler(go_on, _INSTRUCTIONS)
    target.execute("ATTACH ? AS old", (str(old),))
    with transaction(target):
        for table in ("site", "meta", *TABLES):
            if table != "hour":
                target.execute(f"INSERT OR REPLACE INTO {table} SELECT * FROM old.{table}")  # noqa: S608
        target.execute(HOURS_OF_LISTS.format(lists="old.hour", each="json_each(n) AS each"))
    return 0


class _Upgrade:
    """Copies an open journal of version 3 into an open new one."""

    def __init__(
        self, old: Version3, target: sqlite3.Connection, report: Callable[[float], None]
    ) -> None:
        self._old = old
        self._target = target
        self._report = report
        self._appender = Appender(target)
        self._begun: dict[int, Run] = {}

    def run(self) -> int:
        last_id = self._old.last_id()
        rows = iter(self._old.rows())
        while lot := list(islice(rows, _ROWS)):
            with transaction(self._target):
                for number, run, row in lot:
                    self._begin_until(run)
                    if self._appender.counted_ns and number > self._old.meta("rolled_id"):
                        # From here on, the old file has no counts yet.
                        self._appender.flush()
                        self._appender.counted_ns.clear()
                    self._appender.append(run, (row,))
                self._appender.flush()
            self._report(min(1.0, lot[-1][0] / last_id))
        with transaction(self._target):
            self._begin_until(max(self._old.runs, default=0))
            for key in _NUMBERS:
                if value := self._old.meta(key):
                    set_meta(self._target, key, value)
        return self._old.damaged

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
        if (purged_ns := self._old.meta(f"purged_ns:{run.id}", -1)) >= 0:
            self._carry_counts(run.id, purged_ns)
        before = None if old.follows is None else self._begun.get(old.follows)
        if before is not None:
            rows = copies(self._target, before, places_only=old.places_only)
            copy_known(self._appender, before, run, rows)

    def _carry_counts(self, run: int, purged_ns: int) -> None:
        """Copy the counts of hours with deleted rows; their other rows are not counted again."""
        hour = purged_ns // HOUR_NS
        self._appender.counted_ns[run] = (hour + 1) * HOUR_NS - 1
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
