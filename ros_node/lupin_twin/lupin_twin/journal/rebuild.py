# ruff: noqa: S608  # SQL is put together of constants
"""A new file in a journal's place: one of version 3 upgraded, or one without gaps.

It is built beside the journal, synced, and takes its name: whoever is killed meanwhile has the old
one whole. The old one of an upgrade stays beside it as `NAME.v3`.
"""

from __future__ import annotations

import os
import shutil
import sqlite3
from collections.abc import Callable, Iterable
from contextlib import closing
from itertools import islice
from pathlib import Path
from typing import Final

from lupin_twin.core.past import HOUR_NS
from lupin_twin.journal.appending import Appender, copy_known
from lupin_twin.journal.beside import writing_alone
from lupin_twin.journal.checking import Progress, find_all_damage
from lupin_twin.journal.fold import copies
from lupin_twin.journal.hours import DELETED
from lupin_twin.journal.retention import RETENTION_BYTES, RETENTION_NS
from lupin_twin.journal.runs import Run, put_run
from lupin_twin.journal.salvage import numbered
from lupin_twin.journal.schema import (
    APPLICATION_ID,
    LOCAL_SITE,
    DamagedFile,
    NotPossible,
    json_text,
    open_writer,
    set_meta,
    sync,
    transaction,
)
from lupin_twin.journal.version3 import VERSION, Bucket, OldRun, Version3

_ROWS: Final = 5_000
_NUMBERS: Final = (RETENTION_NS, RETENTION_BYTES, "simulated_from_ns", "simulated_until_ns")


def is_version3(path: Path) -> bool:
    """Whether a file is a journal of that version; one that cannot be read is none.

    Only its first bytes are read (https://www.sqlite.org/fileformat2.html, 1.3).
    """
    try:
        with path.open("rb") as file:
            header = file.read(100)
    except FileNotFoundError:
        return False
    numbers = (int.from_bytes(header[at : at + 4], "big") for at in (60, 68))
    return tuple(numbers) == (VERSION, APPLICATION_ID)


def upgrade(path: Path, report: Callable[[float], None]) -> str:
    """Upgrade a journal of version 3, which the caller holds the lock of.

    `report(share)` is called as the work goes on. Returns in words what was left out, for it was
    not what had been written: nothing, mostly.

    Raises:
        sqlite3.Error, DamagedFile, OSError: it is as it was: somebody reads it, say, or the disk
            is full.

    """
    new = path.with_name(path.name + ".upgrade")
    try:
        with closing(sqlite3.connect(path, isolation_level=None, timeout=5.0)) as connection:
            # All of it in the one file: the log beside it would be taken for one of the new file.
            if _is_read(connection):
                somebody = f"somebody reads {path}, which is to be upgraded"
                raise sqlite3.OperationalError(somebody)  # noqa: TRY301
            connection.execute("PRAGMA query_only = 1")
            _remove(new)
            with closing(open_writer(new)) as target:
                # Of what is begun again if it fails, nothing has to be safe before it is done.
                target.execute("PRAGMA journal_mode = MEMORY")
                target.execute("PRAGMA synchronous = OFF")
                damaged = _Upgrade(Version3(connection), target, report).run()
        sync(new)
        kept = _keep(path)
    except BaseException as error:
        _remove(new)
        if isinstance(error, sqlite3.OperationalError) and str(error).startswith("no such"):
            raise DamagedFile(f"the tables of {path} are not those of a journal") from error
        raise
    # Empty by now, but of the old file: who still reads that has them open, and keeps them.
    for end in ("-wal", "-shm"):
        path.with_name(path.name + end).unlink(missing_ok=True)
    new.chmod(path.stat().st_mode & 0o777)
    new.replace(path)
    sync(path.parent)
    return f"{damaged:,} rows of {kept} are damaged and left out" if damaged else ""


def _is_read(connection: sqlite3.Connection) -> bool:
    """Put all of the log into the file, unless somebody still reads what was before."""
    connection.execute("PRAGMA busy_timeout = 1000")
    ((is_busy, *_),) = connection.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchall()
    return bool(is_busy)


def _remove(new: Path) -> None:
    for end in ("", "-wal", "-shm", "-journal"):
        new.with_name(new.name + end).unlink(missing_ok=True)


def _keep(path: Path) -> Path:
    """Give the old file a second name, and return it; nothing that has one is overwritten."""
    for kept in numbered(path, f".v{VERSION}"):
        if not kept.exists():
            break
        if kept.samefile(path):  # killed between this and the end
            return kept
    try:
        os.link(path, kept)
    except OSError:  # a file system without links
        part = path.with_name(path.name + ".upgrade-copy")
        try:
            shutil.copyfile(path, part)
            sync(part)
        except OSError:  # the disk is full: what is there of it would keep it so
            part.unlink(missing_ok=True)
            raise
        part.rename(kept)
    sync(path.parent)
    return kept


class _Upgrade:
    """From the one open file to the other."""

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
                        # From here on the old file has not counted yet.
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
        """Begin the runs up to one: those before it, in which nothing was received, too."""
        if last not in self._begun:
            for number in sorted(self._old.runs.keys() - self._begun.keys()):
                if number <= last:
                    self._begin(self._old.runs[number])

    def _begin(self, old: OldRun) -> None:
        self._appender.flush()
        run = Run(old.id, old.begun, self._appender.last_seq + 1, None, old.ended_ns)
        self._begun[old.id] = run
        put_run(self._target, run)
        # The last stamp of what was deleted by age or size.
        if (purged_ns := self._old.meta(f"purged_ns:{run.id}", -1)) >= 0:
            self._carry_counts(run.id, purged_ns)
        before = None if old.follows is None else self._begun.get(old.follows)
        if before is not None:
            rows = copies(self._target, before, places_only=old.places_only)
            copy_known(self._appender, before, run, rows)

    def _carry_counts(self, run: int, purged_ns: int) -> None:
        """What was counted in hours some of whose rows are deleted; the others are not counted."""
        hour = purged_ns // HOUR_NS
        self._appender.counted_ns[run] = (hour + 1) * HOUR_NS - 1
        set_meta(self._target, f"{DELETED}{run}", purged_ns)
        self._add("hour", 7, self._hours(run, hour))
        for table, columns in (("tally", 10), ("event", 7)):
            rows = getattr(self._old, table)(run, hour)
            self._add(table, columns, [(LOCAL_SITE, run, *row) for row in rows])

    def _add(self, table: str, columns: int, rows: Iterable[tuple[object, ...]]) -> None:
        marks = ", ".join("?" * columns)
        self._target.executemany(f"INSERT INTO {table} VALUES ({marks})", rows)

    def _hours(self, run: int, until: int) -> list[tuple[object, ...]]:
        """Rows of `hour`: several series of the old file are one here, that of any source."""
        numbers: dict[tuple[str, int, tuple[str, ...]], int] = {}
        found: dict[tuple[int, int], list[Bucket]] = {}
        for tag_id, kind, sensors, hour, buckets in self._old.hours(run, until):
            key = (tag_id, kind, sensors)
            if key not in numbers:
                self._appender.last_seq += 1
                numbers[key] = self._appender.last_seq
                row = (LOCAL_SITE, numbers[key], run, tag_id, kind, json_text(sensors))
                self._add("series", 6, [row])
            at = (numbers[key], hour)
            found[at] = list(map(_joined, found[at], buckets)) if at in found else buckets
        return [
            (LOCAL_SITE, *at, *map(json_text, zip(*map(_finite, buckets), strict=True)))
            for at, buckets in sorted(found.items())
            if any(n for n, *_ in buckets)
        ]


def _joined(one: Bucket, other: Bucket) -> Bucket:
    """What both have counted."""
    low, high = min(one[2], other[2]), max(one[3], other[3])
    return one[0] + other[0], one[1] + other[1], low, high


def _finite(bucket: Bucket) -> tuple[float | None, ...]:
    """As it stands in `hour`: without a reading there is no least and no largest."""
    return bucket if bucket[0] else (0, 0.0, None, None)


_INSTRUCTIONS: Final = 100_000


def vacuum(path: Path, holder: str, report: Progress) -> tuple[int, int]:
    """Make the file small; returns its bytes before and after.

    All of it is read for damage first: without gaps, what is still to be saved of a damaged one
    would be lost. `report(what, share)` is called meanwhile.

    Raises:
        InUse: a twin has it.
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
            raise NotPossible(f"somebody reads {path}: try again when nobody does")
        return before, path.stat().st_size


def handle_interrupts(connection: sqlite3.Connection) -> None:
    """Have Ctrl-C end what takes SQLite minutes: Python sees it only in Python."""
    connection.set_progress_handler(lambda: 0, _INSTRUCTIONS)
