"""A journal's open file, as its writer thread uses it: transactions, runs, upkeep, damage."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import groupby
from pathlib import Path
from typing import Final

from lupin_twin.core.notes import Note
from lupin_twin.core.parameters import World
from lupin_twin.core.past import FOREVER_NS
from lupin_twin.core.state import Write
from lupin_twin.journal.appending import Appender, copy_known, simulated
from lupin_twin.journal.checking import size_of
from lupin_twin.journal.fold import Restored, copies, fold
from lupin_twin.journal.paths import Syncing, files_of, forwarded_seq
from lupin_twin.journal.retention import (
    Limits,
    Stretches,
    horizon_ns,
    kept,
    note_lost,
    purge_step,
    shrink_step,
    unmet_limit,
)
from lupin_twin.journal.rows import LATCHED, last_rows
from lupin_twin.journal.runs import CORRECTION_NS, Clock, Run, put_run, runs, simulation_goes_on
from lupin_twin.journal.schema import (
    DAY_LENGTH,
    MAP,
    ORIGIN,
    SiteLog,
    get_meta,
    open_writer,
    set_meta,
    transaction,
)
from lupin_twin.journal.writes import number_of, put_note

# The WAL is checkpointed at this size: the larger it is, the fewer pages are written twice.
LOG_BYTES: Final = 8_000_000
PURGE_EVERY_S: Final = 60.0
_POLL_EVERY_S: Final = 1.0
# Least time between two maps that are written: a robot that explores sends one every second.
_MAP_REST_S: Final = 10.0


class JournalFile:
    """A journal's file, open for writing from construction to `close`.

    Raises:
        Foreign, sqlite3.Error, OSError: as `open_writer`.

    """

    def __init__(self, path: Path, limits: Limits) -> None:
        # The limit that is exceeded although nothing more can be deleted, in words.
        self.unmet_limit = ""
        # Says that the write-ahead log (WAL) was removed, so readers may fail; empty: it was not.
        self.lost_log = ""
        self._path, self._log = path, path.with_name(path.name + "-wal")
        self._limits = limits
        self._map: object = None
        self._map_rests_until_s = 0.0
        self._connection = open_writer(self._path)
        try:
            self._appender = Appender(self._connection)
            self.simulated = simulated(self._connection)
            self.journal_id = get_meta(self._connection, "journal_id") or ""
            # The journal's id, and the last number that was committed.
            self.end = self.journal_id, self._appender.last_seq
            self._purged_s = self._polled_s = 0.0
            self._purges_before_ns: int | None = None
            self._is_shrinking = False
            self._syncing = Syncing(self._path)
        except BaseException:  # whatever it was: the caller gets no object to close
            self._connection.close()
            raise
        self.inode, self._log_inode = files_of(self._path)

    def close(self) -> None:
        """Move what was committed from the WAL into the file, and close it."""
        self._syncing.close()
        try:
            self._connection.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchall()
        finally:
            self._connection.close()

    def note_world(self, world: World) -> None:
        """Write which world is observed from now on."""
        set_meta(self._connection, ORIGIN, world.origin)
        set_meta(self._connection, DAY_LENGTH, world.day_length_s)

    def put_map(self, floor: object, text_of: Callable[[], str]) -> None:
        """Write the latest map, with this call or a later one; an empty text: it is too large."""
        now_s = time.monotonic()
        if floor is self._map or now_s < self._map_rests_until_s:
            return
        self._map, self._map_rests_until_s = floor, now_s + _MAP_REST_S
        text = text_of()
        if (get_meta(self._connection, MAP) or "") != text:
            set_meta(self._connection, MAP, text)

    # --- runs ---------------------------------------------------------------------------------

    def start(self, now: Clock, *, is_believed: bool) -> Restored:
        """Continue the last run, or begin a new one; returns what the starting twin knows.

        A wall clock that is behind the journal's last arrival is doubted, unless `is_believed`;
        then no run is begun.
        """
        every = self._runs()
        run = next((r for r in reversed(every) if r.begun.is_simulated == now.is_simulated), None)
        if run is None:
            return self._restored(self.begin(now, None))
        root = next(r for r in every if r.id == run.root)
        last = self._last(root)
        if now.is_simulated and not simulation_goes_on(root.begun, last, now):
            run = self.begin(now, None)
        elif not now.is_simulated and now.arrival_ns < last.arrival_ns - CORRECTION_NS:
            if not is_believed:
                restored = self._restored(run)
                return replace(restored, doubted_ns=last.arrival_ns)
            run = self.begin(now, run, places_only=True)
        elif not now.is_simulated and now.stamp_ns < last.stamp_ns:
            run = self.begin(now, run, joins=root.id)
        else:
            with self._transaction():
                self._go_on_with(root.id)
        return self._restored(run)

    def _restored(self, run: Run) -> Restored:
        known = fold(self._connection, run.root, FOREVER_NS, run.begun_seq)
        begun = next(r for r in self._runs() if r.id == run.root)
        rows = last_rows(SiteLog(self._connection), begun, LATCHED)
        return Restored(run, known, tuple(rows), self._appender.last_seq)

    def begin(
        self,
        now: Clock,
        before: Run | None,
        *,
        joins: int | None = None,
        ended_ns: int | None = None,
        places_only: bool = False,
    ) -> Run:
        """Begin a run, or a step of the run `joins`; copies into it what was known in `before`.

        `ended_ns` is how far the clock had come in `before`, if the twin saw it go back.
        """
        execute = self._connection.execute
        with self._transaction():
            (number,) = execute("SELECT coalesce(max(run), 0) + 1 FROM run").fetchone()
            run = Run(number, now, self._appender.last_seq + 1, joins)
            put_run(self._connection, run)
            if before is not None:
                rows = copies(self._connection, before, places_only=places_only)
                copy_known(self._appender, before, run, rows)
                if ended_ns is not None and before.root != run.root:
                    execute(
                        "UPDATE run SET ended_stamp_ns = ? WHERE run = ?", (ended_ns, before.root)
                    )
            self._go_on_with(run.root)
        return run

    def rejoin(self, now: Clock, before: Run) -> Run:
        """After the wall clock jumped ahead, continue the run that it had gone back from, if any.

        That is the latest run that ended before now; without one, `before` continues.
        """
        roots = [r for r in self._runs() if r.joins is None and not r.begun.is_simulated]
        begun = next(r for r in roots if r.id == before.root).begun
        for older in reversed([r for r in roots if r.id < before.root]):
            ended_ns = self._last(older).stamp_ns
            if begun.stamp_ns < ended_ns <= now.stamp_ns:
                return self.begin(now, before, joins=older.id)
        return before

    def retain_run(self, run: Run, end: tuple[str, int]) -> None:
        """Go on with a run; `end` is the `end` of the file that was written before this one.

        If this one ends elsewhere, what the run received may be missing: it is new, salvaged, or a
        backup.
        """
        is_new = all(known.id != run.root for known in self._runs())
        if is_new or self.end != end:
            with self._transaction():
                if is_new:
                    put_run(self._connection, Run(run.root, run.begun, self.end[1] + 1))
                since_ns = time.time_ns() - run.begun.arrival_ns
                note_lost(self._connection, run.root, run.begun.stamp_ns + since_ns)

    def _runs(self) -> list[Run]:
        return runs(self._connection.execute)

    def _last(self, run: Run) -> Clock:
        """The clock at the last write of a run."""
        last = run.begun
        # The latest stamp is among the last rows, because only latched ones are out of order.
        for row in reversed(last_rows(SiteLog(self._connection), run, most=100)):
            if row.stamp_ns > last.stamp_ns:
                arrival_ns = max(row.arrival_ns, last.arrival_ns)
                last = Clock(row.stamp_ns, arrival_ns, last.is_simulated)
        return last

    def _go_on_with(self, run: int) -> None:
        """Continue a run; any other run without a known end ended with its last write."""
        execute = self._connection.execute
        execute("UPDATE run SET ended_stamp_ns = NULL WHERE run = ?", (run,))
        for other in self._runs():
            if other.ended_ns is None and other.joins is None and other.id != run:
                execute(
                    "UPDATE run SET ended_stamp_ns = ? WHERE run = ?",
                    (self._last(other).stamp_ns, other.id),
                )

    # --- writing ------------------------------------------------------------------------------

    def append(self, rows: Sequence[tuple[Run, Write]]) -> int:
        """Write rows in one transaction; returns how many were new.

        Raises:
            sqlite3.Error, OSError: nothing was written.

        """
        with self._transaction():
            written = 0
            for root, of_run in groupby(rows, lambda entry: entry[0].root):
                written += self._appender.append(root, [row for _, row in of_run])
            self._appender.flush()
        return written

    def put_note(self, note: Note) -> Note:
        """Write a note, see `writes.put_note`; returns it with its id.

        Raises:
            sqlite3.Error, OSError: it was not written.

        """
        with self._transaction():
            # Nothing gets the number of a note: a reader of what follows it would miss that.
            last = self._appender.last_seq
            self._appender.last_seq = max(last, number_of(note.id)) if note.id else last + 1
            return put_note(SiteLog(self._connection), self._appender.last_seq, note)

    def note_lost(self, run: Run, at_ns: int) -> None:
        """Write that some of what was received up to a moment is not in the file."""
        with self._transaction():
            note_lost(self._connection, run.root, at_ns)

    def kept(self) -> Stretches:
        """The periods of ROS time for which the journal is complete."""
        return kept(self._connection)

    def size(self) -> int:
        """Bytes on the disk, the WAL included."""
        return self._path.stat().st_size + size_of(self._log)

    # --- upkeep -------------------------------------------------------------------------------

    def check_size(self, *, may_purge: bool) -> bool:
        """Do one small step of upkeep; returns whether there is more to do at once.

        `may_purge`: the clock is believed.

        Raises:
            sqlite3.Error, OSError: the file was removed or replaced, or cannot be written.

        """
        now_s = time.monotonic()
        if now_s - self._polled_s >= _POLL_EVERY_S:
            self._polled_s = now_s
            inode, log_inode = files_of(self._path)
            if inode != self.inode:
                raise FileNotFoundError(f"{self._path} was removed or replaced")
            self.lost_log = ""
            if log_inode != self._log_inode:
                self.lost_log = f"{self._log} was removed: restart the twin, nothing is lost so far"
        # A removed WAL is lost when the process ends, so its content goes into the file at once. We
        # cannot begin a new one, because readers still have the old one open.
        if self.lost_log or size_of(self._log) > LOG_BYTES:
            self._connection.execute("PRAGMA wal_checkpoint(PASSIVE)").fetchall()
        return may_purge and self._purge(now_s)

    def _purge(self, now_s: float) -> bool:
        if self._purges_before_ns is None and not self._is_shrinking:
            if now_s - self._purged_s < PURGE_EVERY_S:
                return False
            self._purged_s = now_s
            self._purges_before_ns = horizon_ns(self._connection, self._limits, time.time_ns())
        if self._purges_before_ns is not None:
            with self._transaction():
                before_ns = self._purges_before_ns
                forwarded = forwarded_seq(self._path, get_meta(self._connection, "journal_id"))
                if not purge_step(self._connection, self._limits, before_ns, forwarded):
                    self.unmet_limit = unmet_limit(self._connection, self._limits, before_ns)
                    self._purges_before_ns = None
            self._is_shrinking = True
        else:
            self._is_shrinking = shrink_step(self._connection)
        return self._purges_before_ns is not None or self._is_shrinking

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        try:
            with transaction(self._connection):
                yield
        except BaseException:
            self._appender = Appender(self._connection)
            raise
        self.end = self.journal_id, self._appender.last_seq
        self._syncing.has_written()
