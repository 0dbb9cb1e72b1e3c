"""The journal as the twin sees it: hand over, and be told what was known before.

One thread opens, writes, checkpoints and looks after the file; another syncs it. Whatever happens
to the disk happens to them: nothing here raises, waits or grows without bound on the caller's
thread.
"""

from __future__ import annotations

import math
import threading
import time
from pathlib import Path
from typing import Final, NamedTuple

from lupin_twin.journal.condition import Condition, JournalState
from lupin_twin.journal.file import JournalFile
from lupin_twin.journal.lock import InUse, Lock
from lupin_twin.journal.pending import MAX_WEIGHT, Entry, Pending
from lupin_twin.journal.prefilling import Stretch
from lupin_twin.journal.restoring import Restored
from lupin_twin.journal.retention import Limits
from lupin_twin.journal.rows import Row
from lupin_twin.journal.runs import Clock, Run
from lupin_twin.journal.schema import DamagedFile, Foreign, says_damaged

# Rows wait so long for others to share a commit with, from when the first of them was handed over;
# half of the 100 ms in which they are safe from a killed process. Late ones do not wait.
_GATHER_S: Final = 0.04
_MAX_BATCH: Final = 500
# Ten times what is promised: a checkpoint on a slow disk is no reason yet to alarm anybody.
_SLOW_S: Final = 1.0
_RETRY_S: Final = (0.5, 1.0, 2.0, 5.0, 10.0)
# With nothing to write: how often the file is looked after.
_IDLE_S: Final = 1.0
# What readers say has a file set aside no oftener: were it their fault, copies would fill the disk.
_HEAL_EVERY_S: Final = 86_400.0


_HEALED_IN: Final = (JournalState.RECORDING, JournalState.FAILING)


class _Era(NamedTuple):
    """A clock that the twin has followed; `scans` are restored per series at the start.

    `before_ns` is where the one before it had come to, where the twin saw it go back.
    """

    clock: Clock
    scans: int
    before_ns: int | None


class Journal:
    """Records from construction to `close`. Every method is for the thread that hands over."""

    def __init__(
        self, path: Path, holder: str, limits: Limits, max_weight: int = MAX_WEIGHT
    ) -> None:
        self._path = path
        self._holder = holder
        self._limits = limits
        self._pending = Pending(max_weight)
        self._eras: list[_Era] = []
        self._stop = threading.Event()
        self._was_tried = threading.Event()
        self._restored: Restored | None = None
        self._told = Condition(JournalState.STARTING, "opening the journal", str(path))
        # The writer thread's own.
        self._runs: list[Run] = []
        self._lock: Lock | None = None
        self._written = self._repeated = self._refused = 0
        self._is_sound: bool | None = None
        self._failures = 0
        self._met_damage = ""
        self._heals_from_s = -math.inf
        self._set_aside = ""
        self._simulated: Stretch | None = None
        self._thread = threading.Thread(target=self._run, name="journal", daemon=True)
        self._thread.start()

    # --- for the twin -------------------------------------------------------------------------

    def begin(self, clock: Clock, scans_per_series: int = 1, before_ns: int | None = None) -> None:
        """Follow a clock from now on: the first one, or one that has gone back from `before_ns`.

        Nothing is written before the first. With that, the journal restores.
        """
        self._eras.append(_Era(clock, scans_per_series, before_ns))
        self._pending.arrived.set()

    def write(self, row: Row) -> None:
        """Hand a row over; it is safe from a killed process within 100 ms."""
        self._pending.put(Entry(len(self._eras), row, time.monotonic()))

    def take_restored(self, wait_s: float = 0.0) -> Restored | None:
        """What was known before, once; None if that is not there (yet).

        Waits at most `wait_s`, and no longer than until the file turns out not to be usable.
        """
        if wait_s:
            self._was_tried.wait(wait_s)
        restored, self._restored = self._restored, None
        return restored

    @property
    def condition(self) -> Condition:
        """How it is doing; for any thread."""
        waiting, lost, oldest_s = self._pending.counts()
        behind_s = 0.0 if oldest_s is None else time.monotonic() - oldest_s
        told = self._told
        state, detail = told.state, told.detail
        if state is JournalState.RECORDING and behind_s > _SLOW_S:
            state = JournalState.SLOW
            detail = f"the disk is slow: the journal is {behind_s:.0f} s behind"
        if lost and state is not JournalState.RECORDING:
            detail += f"; {lost} observations were lost to it"
        return Condition(
            state=state,
            detail=detail,
            path=told.path,
            written=told.written,
            repeated=told.repeated,
            waiting=waiting,
            behind_s=behind_s,
            lost=lost,
            refused=told.refused,
            file_bytes=told.file_bytes,
            set_aside=told.set_aside,
            simulated_ns=told.simulated_ns,
        )

    def heal(self, damage: str) -> None:
        """Have the file set aside, as somebody has met damage in it; for any thread.

        What can be read of it is read, as at a start. That is done once a day at most.
        """
        if self._told.state in _HEALED_IN and time.monotonic() >= self._heals_from_s:
            self._met_damage = damage
            self._pending.arrived.set()

    def close(self, wait_s: float = 1.5) -> None:
        """Write what is waiting and let go of the file; a disk that hangs is not waited for."""
        self._stop.set()
        self._pending.arrived.set()
        self._thread.join(wait_s)

    # --- the writer thread --------------------------------------------------------------------

    def _run(self) -> None:
        while True:
            try:
                self._record()
                break
            except Exception as error:  # noqa: BLE001  # the twin goes on, whatever it is
                self._tell_failure(error)
                self._was_tried.set()
                if says_damaged(error):
                    self._is_sound = False
            if self._stop.is_set():
                break
            self._stop.wait(_RETRY_S[min(self._failures, len(_RETRY_S) - 1)])
            self._failures += 1
        if self._lock is not None:
            self._lock.release()

    def _record(self) -> None:
        """Open the file and write until it fails or the twin ends."""
        self._path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        if self._lock is None:
            self._lock = Lock(self._path, self._holder)
        file = JournalFile(self._path, self._limits, is_sound=self._is_sound)
        try:
            self._is_sound = True
            self._set_aside = file.set_aside or self._set_aside
            self._simulated = file.simulated
            file.keep_runs(self._runs)
            is_last = False
            while not is_last:
                is_last = self._stop.is_set()
                self._see_damage()
                self._catch_up(file)
                self._write(file, is_last=is_last)
                has_more = file.look_after() if not is_last else False
                self._tell(JournalState.RECORDING, self._summary(), file.size())
                if not is_last and not self._pending.arrived.wait(0.0 if has_more else _IDLE_S):
                    continue
                # Others may be about to come.
                if not is_last:
                    self._stop.wait(self._gather_s())
        finally:
            file.close()

    def _gather_s(self) -> float:
        *_, oldest_s = self._pending.counts()
        return _GATHER_S if oldest_s is None else oldest_s + _GATHER_S - time.monotonic()

    def _see_damage(self) -> None:
        damage, self._met_damage = self._met_damage, ""
        # Two may have met it, one of them a little later.
        if damage and time.monotonic() >= self._heals_from_s:
            self._heals_from_s = time.monotonic() + _HEAL_EVERY_S
            raise DamagedFile(f"it is damaged ({damage}), and is being set aside")

    def _catch_up(self, file: JournalFile) -> None:
        """Give each clock that the twin has followed its run; the first one restores."""
        while len(self._runs) < len(self._eras):
            era = self._eras[len(self._runs)]
            if self._runs:
                self._runs.append(file.next_run(self._runs[-1], era.clock, era.before_ns))
            else:
                run = file.first_run(era.clock)
                restored = file.restore(run, era.scans)
                self._set_aside = file.set_aside or self._set_aside
                self._runs.append(run)
                self._restored = restored
                self._was_tried.set()

    def _write(self, file: JournalFile, *, is_last: bool) -> None:
        if not self._runs:
            self._pending.arrived.clear()
        while self._runs:
            entries = self._pending.take(_MAX_BATCH)
            if not entries:
                return
            # An era that has no run yet comes after all that have one.
            known = [entry for entry in entries if entry.era <= len(self._runs)]
            later = entries[len(known) :]
            try:
                written, refused = file.append(
                    [(self._runs[max(0, entry.era - 1)], entry.row) for entry in known]
                )
            except BaseException:
                self._pending.put_back(entries)
                raise
            self._pending.put_back(later)
            self._failures = 0
            self._written += written
            self._refused += refused
            self._repeated += len(known) - written - refused
            if later or not is_last:
                return

    # --- telling ------------------------------------------------------------------------------

    def _summary(self) -> str:
        if self._set_aside:
            return f"recording; a damaged journal was set aside as {self._set_aside}"
        return "recording"

    def _tell(self, state: JournalState, detail: str, file_bytes: int | None = None) -> None:
        self._told = Condition(
            state=state,
            detail=detail,
            path=str(self._path),
            written=self._written,
            repeated=self._repeated,
            refused=self._refused,
            file_bytes=self._told.file_bytes if file_bytes is None else file_bytes,
            set_aside=self._set_aside,
            simulated_ns=self._simulated,
        )

    def _tell_failure(self, error: Exception) -> None:
        match error:
            case InUse():
                self._tell(JournalState.IN_USE, str(error))
            case Foreign():
                self._tell(JournalState.FOREIGN, str(error))
            case _:
                self._tell(
                    JournalState.FAILING, f"the journal {self._path} cannot be written: {error}"
                )
