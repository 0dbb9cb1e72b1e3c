"""The open file, in the thread that writes it: transactions, runs, checkpoints, upkeep, damage."""

from __future__ import annotations

import sqlite3
import struct
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from lupin_twin.journal.appending import Appender
from lupin_twin.journal.prefilling import Stretch, simulated
from lupin_twin.journal.reading import ending, heard_until
from lupin_twin.journal.restoring import Restored, restore
from lupin_twin.journal.retention import (
    Limits,
    note_limits,
    purge_rollups_step,
    purge_step,
    shrink_step,
)
from lupin_twin.journal.rollups import Folding, get_meta
from lupin_twin.journal.rows import Row
from lupin_twin.journal.runs import Carries, Clock, Run, carried_at_start, goes_on
from lupin_twin.journal.salvage import Salvage, set_aside
from lupin_twin.journal.schema import (
    FILE_ERRORS,
    find_damage,
    open_writer,
    says_damaged,
    transaction,
)
from lupin_twin.journal.syncing import Syncing
from lupin_twin.journal.tallying import TALLIED, tally_step

# A file up to this size is read through for damage as it is opened: a quarter of a second.
_CHECKED_BYTES: Final = 64_000_000
# The log is put into the file when it is this long: the longer, the fewer pages are written twice.
_LOG_BYTES: Final = 8_000_000
# So much of a damaged file is read before the twin goes on with what is there.
_SALVAGE_S: Final = 1.5
# Readers count what is not tallied yet; the rarer it is done, the fewer pages are written.
_TALLY_EVERY_S: Final = 60.0
_TALLY_ROWS: Final = 1_000
_FOLD_EVERY_S: Final = 3600.0
# So many waiting rows are a reason to fold, and so many are held in memory at most.
_FOLD_ROWS: Final = 50_000
_PURGE_EVERY_S: Final = 60.0
_PURGE_ROLLUPS_EVERY_S: Final = 86_400.0
_LOOK_EVERY_S: Final = 1.0

# What a row can be refused for by its own fault.
_ROW_ERRORS: Final = (
    ValueError,
    OverflowError,
    TypeError,
    struct.error,
    sqlite3.DataError,
    sqlite3.IntegrityError,
    sqlite3.InterfaceError,
)


class JournalFile:
    """Open from construction to `close`.

    A damaged file is set aside first and read as far as it goes; `set_aside` is its new name then.
    `is_sound`: None has it checked as it is opened, if it is not too large.

    Raises:
        Foreign, sqlite3.Error, OSError: as `open_writer`.

    """

    def __init__(self, path: Path, limits: Limits, *, is_sound: bool | None) -> None:
        self.simulated: Stretch | None = None
        self._path = path
        self._limits = limits
        self.set_aside = ""
        self._salvaging: Iterator[None] | None = None
        if is_sound is False or (is_sound is None and self._is_damaged()):
            self._set_aside()
        self._open()

    def close(self) -> None:
        """Close it; what was committed is put into the file, and its log goes."""
        self._syncing.close()
        self._connection.close()

    # --- opening ------------------------------------------------------------------------------

    def _is_damaged(self) -> bool:
        if not self._path.exists() or not 0 < self._path.stat().st_size <= _CHECKED_BYTES:
            return False
        return find_damage(self._path) is not None

    def _set_aside(self) -> None:
        # Wall time, as whoever looks for the file reads it.
        self.set_aside = str(set_aside(self._path, time.strftime("%Y%m%dT%H%M%SZ", time.gmtime())))

    def _open(self) -> None:
        try:
            self._connection = open_writer(self._path)
        except FILE_ERRORS as error:
            if not says_damaged(error):
                raise
            self._set_aside()
            self._connection = open_writer(self._path)
        try:
            self._salvage()
            self._appender = Appender(self._connection)
            self.simulated = simulated(self._connection)
            self._folding: Folding | None = None
            self._tallied_s = self._folded_s = self._purged_s = self._looked_s = 0.0
            self._purging = False
            self._shrinking = False
            self._rollups_purged_s, self._rollup_series = time.monotonic(), 0
            self._syncing = Syncing(self._path)
        except BaseException:  # whatever it was: nobody has this object, and could close it
            self._connection.close()
            raise
        self._inode = self._path.stat().st_ino

    def _salvage(self) -> None:
        """Go on with what was set aside, now or before the last end."""
        if self.set_aside:
            self._connection.execute(
                "INSERT OR REPLACE INTO meta VALUES ('salvage', ?)", (Path(self.set_aside).name,)
            )
        found = self._connection.execute("SELECT value FROM meta WHERE key = 'salvage'").fetchone()
        if not found:
            return
        self._salvaging = Salvage(self._path.with_name(found[0]), self._connection).steps()
        enough_s = time.monotonic() + _SALVAGE_S
        while self._salvage_step() and time.monotonic() < enough_s:
            pass

    def _salvage_step(self) -> bool:
        if self._salvaging is not None and next(self._salvaging, self) is self:
            self._salvaging = None
            self._connection.execute("DELETE FROM meta WHERE key = 'salvage'")
        return self._salvaging is not None

    # --- runs ---------------------------------------------------------------------------------

    def first_run(self, now: Clock) -> Run:
        """The run that a twin which starts now is in: the last one, or a new one."""
        last = ending(self._connection, is_simulated=now.is_simulated)
        if last is not None and goes_on(last, now):
            with self._transaction():
                self._go_on_with(last.run.id)
            return last.run
        follows = None if last is None else last.run.id
        return self._new_run(now, follows, carried_at_start(now))

    def next_run(self, before: Run, now: Clock, ended_ns: int | None = None) -> Run:
        """A new run of a clock that has gone back, from `ended_ns`, while the twin lived."""
        if ended_ns is not None:
            with self._transaction():
                self._connection.execute(
                    "UPDATE run SET ended_stamp_ns = ? WHERE id = ?", (ended_ns, before.id)
                )
        return self._new_run(now, before.id, Carries.ALL)

    def _new_run(self, now: Clock, follows: int | None, carries: Carries) -> Run:
        (last,) = self._connection.execute("SELECT coalesce(max(id), 0) FROM run").fetchone()
        run = Run(last + 1, now, follows, carries if follows is not None else Carries.NOTHING)
        self.keep_runs([run])
        return run

    def keep_runs(self, runs: Sequence[Run]) -> None:
        """Have the runs in the file, as they are in another one that is gone; the last goes on."""
        if not runs:
            return
        with self._transaction():
            self._connection.executemany(
                "INSERT OR IGNORE INTO run VALUES (?, ?, ?, ?, ?, ?, ?, NULL)",
                [
                    (
                        run.id,
                        int(run.begun.is_simulated),
                        run.begun.stamp_ns,
                        run.begun.arrival_ns,
                        run.lead_ns,
                        run.follows,
                        int(run.carries),
                    )
                    for run in runs
                ],
            )
            self._go_on_with(runs[-1].id)

    def _go_on_with(self, run: int) -> None:
        """One run goes on; another, whose end nobody saw, ended with the last heard in it."""
        self._connection.execute("UPDATE run SET ended_stamp_ns = NULL WHERE id = ?", (run,))
        unended = self._connection.execute(
            "SELECT id, begun_stamp_ns FROM run WHERE ended_stamp_ns IS NULL AND id != ?", (run,)
        ).fetchall()
        for other, begun_ns in unended:
            self._connection.execute(
                "UPDATE run SET ended_stamp_ns = ? WHERE id = ?",
                (max(begun_ns, heard_until(self._connection, other)), other),
            )

    def restore(self, run: Run, scans_per_series: int) -> Restored:
        """What is known in a run. A file of which that cannot be read is set aside once."""
        try:
            restored = restore(self._connection, run, scans_per_series)
            if not restored.damaged or self.set_aside:
                return restored
        except FILE_ERRORS as error:
            if self.set_aside or not says_damaged(error):
                raise
        self.close()
        self._set_aside()
        self._open()
        self.keep_runs([run])
        return restore(self._connection, run, scans_per_series)

    # --- writing ------------------------------------------------------------------------------

    def append(self, rows: Sequence[tuple[Run, Row]]) -> tuple[int, int]:
        """Write rows in one transaction; returns how many were new, and how many cannot be written.

        Raises:
            sqlite3.Error, OSError: nothing was written.

        """
        written = refused = 0
        if not rows:
            return written, refused
        with self._transaction():
            for run, row in rows:
                try:
                    written += self._appender.append(run, (row,))
                except _ROW_ERRORS:
                    refused += 1
        return written, refused

    def size(self) -> int:
        """Bytes on the disk, the log included."""
        return self._path.stat().st_size + self._log_bytes()

    # --- upkeep -------------------------------------------------------------------------------

    def look_after(self) -> bool:
        """One small step of what has to be done; returns whether there is more to do at once.

        Raises:
            sqlite3.Error, OSError: the file is no longer what it was.

        """
        now_s = time.monotonic()
        if now_s - self._looked_s >= _LOOK_EVERY_S:
            self._looked_s = now_s
            if not self._path.exists() or self._path.stat().st_ino != self._inode:
                raise FileNotFoundError(f"{self._path} was removed or replaced")
        if self._log_bytes() > _LOG_BYTES:
            self._connection.execute("PRAGMA wal_checkpoint(PASSIVE)").fetchall()
        if self._salvaging is not None:
            return self._salvage_step()
        return self._tally(now_s) or self._fold(now_s) or self._purge(now_s)

    def _tally(self, now_s: float) -> bool:
        waiting = self._appender.last_id - get_meta(self._connection, TALLIED)
        is_time = now_s - self._tallied_s >= _TALLY_EVERY_S
        if not waiting or not (is_time or waiting >= _TALLY_ROWS):
            return False
        self._tallied_s = now_s
        with self._transaction():
            return tally_step(self._connection)

    def _fold(self, now_s: float) -> bool:
        if self._folding is None:
            rolled_id = get_meta(self._connection, "rolled_id")
            waiting = self._appender.last_id - rolled_id
            is_time = now_s - self._folded_s >= _FOLD_EVERY_S or not self._folded_s
            if not waiting or not (is_time or waiting >= _FOLD_ROWS):
                return False
            last_id = min(self._appender.last_id, rolled_id + _FOLD_ROWS)
            self._folding = Folding(self._connection, last_id)
        with self._transaction():
            has_more = self._folding.step()
        if has_more:
            return True
        self._folding, self._folded_s = None, now_s
        return bool(self._appender.last_id - get_meta(self._connection, "rolled_id") >= _FOLD_ROWS)

    def _purge(self, now_s: float) -> bool:
        if not self._purging and not self._shrinking:
            if now_s - self._purged_s < _PURGE_EVERY_S:
                return False
            self._purged_s, self._purging = now_s, True
            with self._transaction():
                note_limits(self._connection, self._limits)
        if self._purging:
            with self._transaction():
                self._purging = purge_step(self._connection, self._limits, time.time_ns())
            self._shrinking = True
        elif self._shrinking:
            self._shrinking = shrink_step(self._connection)
        if self._rollup_series or now_s - self._rollups_purged_s >= _PURGE_ROLLUPS_EVERY_S:
            self._rollups_purged_s = now_s
            with self._transaction():
                self._rollup_series = purge_rollups_step(
                    self._connection, time.time_ns(), self._rollup_series
                )
        return self._purging or self._shrinking

    def _log_bytes(self) -> int:
        try:
            return self._path.with_name(self._path.name + "-wal").stat().st_size
        except FileNotFoundError:
            return 0

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        with transaction(self._connection):
            yield
        self._syncing.has_written()
