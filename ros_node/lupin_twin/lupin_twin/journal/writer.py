"""The journal as the twin uses it: it hands rows over, and gets what was known before.

One thread opens, writes, checkpoints and maintains the file; another syncs it. A slow or failing
disk affects only them: for the caller, nothing here raises, waits or grows without bound.
"""

from __future__ import annotations

import math
import shutil
import threading
import time
from collections import deque
from concurrent.futures import Future
from dataclasses import replace
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any, Final, NamedTuple

from lupin_twin.core.diagnostics import Condition, JournalState
from lupin_twin.core.notes import Note
from lupin_twin.core.parameters import World
from lupin_twin.core.state import Write
from lupin_twin.field.explored import OccupancyMap, text_of
from lupin_twin.journal.checking import is_damaged
from lupin_twin.journal.file import JournalFile
from lupin_twin.journal.fold import Restored
from lupin_twin.journal.paths import InUse, Lock, finish_replacing
from lupin_twin.journal.rebuild import old_version, upgrade
from lupin_twin.journal.retention import Limits
from lupin_twin.journal.rows import weight
from lupin_twin.journal.runs import Clock, Run, Turn
from lupin_twin.journal.salvage import salvage
from lupin_twin.journal.schema import DamagedFile, Foreign, is_damage_error
from lupin_twin.journal.writes import NoteQueue

# Readings, flowers and rows that may wait: about 60 MB, twenty minutes of the largest greenhouse.
MAX_WEIGHT: Final = 200_000


class Entry(NamedTuple):
    """A row, the number of its era (1: the first), and when it came: steady clock and ROS time."""

    era: int
    row: Write
    handed_over_s: float
    at_ns: int


class Pending:
    """A queue between two threads. When it is full, the oldest are lost and counted.

    The latest are what a restarted twin needs.
    """

    def __init__(self) -> None:
        self.arrived = threading.Event()
        self._lock = threading.Lock()
        self._entries: deque[Entry] = deque()
        self._weight = 0
        self._lost = 0
        self._lost_ns: tuple[int, int] | None = None
        # How many of the oldest are being written.
        self._held = 0

    def put(self, entry: Entry) -> None:
        """Add an entry; takes microseconds, whatever the disk does."""
        with self._lock:
            self._entries.append(entry)
            self._weight += weight(entry.row)
            self._shed()
        if not self.arrived.is_set():
            self.arrived.set()

    def hold(self, count: int) -> list[Entry]:
        """Return at most `count` of the oldest; they stay in the queue, safely, until `done`."""
        self.arrived.clear()
        with self._lock:
            held = list(islice(self._entries, count))
            self._held = len(held)
            if len(self._entries) > count:
                self.arrived.set()
        return held

    def done(self, count: int) -> None:
        """Remove the first `count` of the held entries, which are written now."""
        with self._lock:
            self._held = 0
            for _ in range(count):
                self._weight -= weight(self._entries.popleft().row)

    def _shed(self) -> None:
        while self._weight > MAX_WEIGHT and len(self._entries) > self._held + 1:
            lost = self._entries[self._held]
            del self._entries[self._held]
            self._weight -= weight(lost.row)
            self._lost += 1
            first_ns, last_ns = self._lost_ns or (lost.at_ns, lost.at_ns)
            self._lost_ns = min(first_ns, lost.at_ns), max(last_ns, lost.at_ns)

    def counts(self) -> tuple[int, int, float | None]:
        """(waiting, lost, when the oldest waiting entry was handed over: steady clock, s)."""
        with self._lock:
            oldest = self._entries[0].handed_over_s if self._entries else None
            return len(self._entries), self._lost, oldest

    @property
    def complete_ns(self) -> int | None:
        """When the first waiting or lost entry was received, ROS time; None if there is none."""
        with self._lock:
            found = [entry.at_ns for entry in islice(self._entries, 1)]
            found += (self._lost_ns or ())[:1]
            return min(found, default=None)

    def take_lost(self) -> int | None:
        """When the last entry lost since the previous call was received; None if none was lost."""
        with self._lock:
            lost_ns, self._lost_ns = self._lost_ns, None
        return None if lost_ns is None else lost_ns[1]


# Rows wait this long, from when the first was handed over, for others to share a commit with. They
# have to be safe from a killed process within 100 ms. Late rows do not wait.
_GATHER_S: Final = 0.08
_MAX_BATCH: Final = 500
_SLOW_S: Final = 1.0  # ten times that promise: a checkpoint on a slow disk must not raise an alarm
_RETRY_S: Final = (0.5, 1.0, 2.0, 5.0, 10.0)
_IDLE_S: Final = 1.0  # how often the file is maintained while there is nothing to write
# Least time between two quarantines caused by readers: if they are wrong, copies fill the disk.
_HEAL_EVERY_S: Final = 86_400.0
_WELL: Final = (JournalState.RECORDING, JournalState.OFF)
_HEALED_IN: Final = (*_WELL, JournalState.FAILING)


class _Era(NamedTuple):
    """A clock that the twin follows, and why; `before_ns` is the last time of the one before."""

    clock: Clock
    turn: Turn
    before_ns: int | None


class Journal:
    """Records from construction to `close`. Unless noted, methods are for the twin's thread.

    `is_temporary`: the file is alone in its folder, which is deleted at the end.
    """

    def __init__(
        self,
        path: Path,
        holder: str,
        limits: Limits,
        *,
        world: World = World(),
        is_temporary: bool = False,
    ) -> None:
        self._path = path
        self._holder = holder
        self._world = world
        self._limits = limits
        self._is_temporary = is_temporary
        self._pending = Pending()
        self._notes = NoteQueue()
        self._map: OccupancyMap | None = None
        self._eras: list[_Era] = []
        self._stop = threading.Event()
        self._was_attempted = threading.Event()
        self._restored: Restored | None = None
        self._reported = Condition(JournalState.STARTING, "opening the journal", str(path))
        # Owned by the writer thread.
        self._runs: list[Run] = []
        self._lock: Lock | None = None
        # The last one that could be opened.
        self._file: JournalFile | None = None
        self._failures = 0
        self._is_sound: bool | None = None
        self._heals_from_s = -math.inf
        self._met_damage = self._quarantined = self._left_out = ""
        # Wall time of the journal's last arrival, if the clock contradicts it.
        self._doubted_ns: int | None = None
        self._thread = threading.Thread(target=self._run, name="journal", daemon=True)
        self._thread.start()

    # --- for the twin -------------------------------------------------------------------------

    def begin(
        self,
        clock: Clock,
        turn: Turn = Turn.START,
        before_ns: int | None = None,
    ) -> None:
        """Follow a clock from now on; `turn` tells why.

        Nothing is written before the first call, which restores what was known. If its clock is
        doubted, the journal waits for another call, with a clock that agrees or is believed.
        """
        self._was_attempted.clear()
        self._eras.append(_Era(clock, turn, before_ns))
        self._pending.arrived.set()

    def write(self, row: Write, at_ns: int | None = None) -> None:
        """Hand over a row that was received at `at_ns`, ROS time; None: at its stamp.

        It is safe from a killed process within 100 ms.
        """
        at_ns = row.stamp_ns if at_ns is None else at_ns
        self._pending.put(Entry(len(self._eras), row, time.monotonic(), at_ns))

    def write_note(self, note: Note) -> Future[Note]:
        """Hand over a note; the future soon has it with its id, or raises `NotesUnwritable`."""
        written = self._notes.put(note)
        self._pending.arrived.set()
        if self._stop.is_set() or self._reported.state not in (*_WELL, JournalState.STARTING):
            self._notes.refuse(self._reported.detail)
        return written

    def write_map(self, floor: OccupancyMap) -> None:
        """Hand over the latest map; it replaces one that was not written yet."""
        self._map = floor

    def take_restored(self, wait_s: float = 0.0) -> Restored | None:
        """Return what was known before, once; None if it is not available (yet).

        Waits at most `wait_s`, and only until the file turns out to be unusable.
        """
        if wait_s:
            self._was_attempted.wait(wait_s)
        restored, self._restored = self._restored, None
        return restored

    @property
    def condition(self) -> Condition:
        """The journal's condition; for any thread. If nothing waits, it is complete up to now."""
        waiting, lost, oldest_s = self._pending.counts()
        behind_s = 0.0 if oldest_s is None else time.monotonic() - oldest_s
        last = self._reported
        state, detail = last.state, last.detail
        # Rows that wait for the first clock do not wait for the disk.
        if self._eras and state in _WELL and behind_s > _SLOW_S:
            state = JournalState.SLOW
            detail = f"the disk is slow: the journal is {behind_s:.0f} s behind"
        if lost and state not in _WELL:
            detail += f"; {lost} observations were lost"
        return replace(
            last,
            state=state,
            detail=detail,
            waiting=waiting,
            behind_s=behind_s,
            lost=lost,
            complete_ns=self._pending.complete_ns,
        )

    def heal(self, damage: str) -> None:
        """Quarantine the file, because a reader has found damage in it; for any thread.

        What can be read of it is salvaged, as at a start. This is done at most once a day.
        """
        if self._reported.state in _HEALED_IN and time.monotonic() >= self._heals_from_s:
            self._met_damage = damage
            self._pending.arrived.set()

    def close(self, wait_s: float = 1.5) -> None:
        """Write the waiting rows and close the file; a disk that hangs is not waited for."""
        self._stop.set()
        self._pending.arrived.set()
        self._thread.join(wait_s)
        if self._is_temporary:
            shutil.rmtree(self._path.parent, ignore_errors=True)

    # --- the writer thread --------------------------------------------------------------------

    def _run(self) -> None:
        while True:
            try:
                self._record()
                break
            except Exception as error:  # noqa: BLE001  # the twin goes on, whatever it is
                self._report_failure(error)
                self._notes.refuse(self._reported.detail)
                wait_s = _RETRY_S[min(self._failures, len(_RETRY_S) - 1)]
                if is_damage_error(error):
                    self._is_sound = False
                    if not self._failures:
                        wait_s = 0.0  # a starting twin waits for what can be salvaged
                if wait_s:
                    self._was_attempted.set()
            if self._stop.is_set():
                break
            self._stop.wait(wait_s)
            self._failures += 1
        if self._lock is not None:
            self._lock.close()

    def _record(self) -> None:
        """Open the file and write until it fails or the twin ends."""
        self._path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        if self._lock is None:
            self._lock = Lock(self._path, self._holder)
        self._mend()
        file = JournalFile(self._path, self._limits)
        try:
            file.note_world(self._world)
            if self._file is not None:
                for run in self._runs:
                    file.retain_run(run, self._file.end)
            self._file = file
            is_last = False
            while not is_last:
                is_last = self._stop.is_set()
                self._see_damage()
                self._catch_up(file)
                self._write(file, all_that_waits=is_last)
                self._notes.write(file.put_note)
                if self._map is not None:
                    file.put_map(self._map, partial(text_of, self._map))
                has_more = not is_last and file.check_size(may_purge=bool(self._runs))
                self._report_well(file)
                if not is_last and not self._pending.arrived.wait(0.0 if has_more else _IDLE_S):
                    continue
                # Other rows may arrive soon, and share the commit.
                if not is_last:
                    self._stop.wait(self._gather_s())
        finally:
            file.close()

    def _mend(self) -> None:
        """Upgrade a file of an earlier version, and salvage a damaged one, whatever its version."""
        finish_replacing(self._path)
        if self._is_sound is None:
            if old_version(self._path) is not None:
                self._left_out = upgrade(self._path, self._report_progress)
            self._is_sound = not is_damaged(self._path)
        if not self._is_sound and self._path.exists():
            self._quarantined = str(salvage(self._path))
        self._is_sound = True

    def _gather_s(self) -> float:
        *_, oldest_s = self._pending.counts()
        return _GATHER_S if oldest_s is None else oldest_s + _GATHER_S - time.monotonic()

    def _see_damage(self) -> None:
        damage, self._met_damage = self._met_damage, ""
        # Two readers may report the same damage, one of them a little later.
        if damage and time.monotonic() >= self._heals_from_s:
            self._heals_from_s = time.monotonic() + _HEAL_EVERY_S
            raise DamagedFile(f"it is damaged ({damage}), and is being quarantined")

    def _catch_up(self, file: JournalFile) -> None:
        """Give each era its run; the first one restores what was known."""
        while len(self._runs) < len(self._eras):
            era = self._eras[len(self._runs)]
            if self._runs:
                # A run begins with what is known, so rows received before it are written first.
                self._write(file, all_that_waits=True)
                self._runs.append(self._next_run(file, self._runs[-1], era))
                continue
            believed = era.turn is Turn.BELIEVED
            restored = file.start(era.clock, is_believed=believed)
            self._doubted_ns = restored.doubted_ns
            if restored.doubted_ns is not None:
                del self._eras[0]
            else:
                self._runs.append(restored.run)
            self._restored = restored
            self._was_attempted.set()

    @staticmethod
    def _next_run(file: JournalFile, before: Run, era: _Era) -> Run:
        if era.turn is Turn.AHEAD:
            return file.rejoin(era.clock, before)
        joins = before.root if era.turn is Turn.STEP else None
        return file.begin(era.clock, before, joins=joins, ended_ns=era.before_ns)

    def _write(self, file: JournalFile, *, all_that_waits: bool) -> None:
        if not self._runs:
            self._pending.arrived.clear()
        while self._runs:
            entries = self._pending.hold(_MAX_BATCH)
            if not entries:
                return
            # Entries of an era without a run yet come after all others.
            known = [entry for entry in entries if entry.era <= len(self._runs)]
            written = file.append(
                [(self._runs[max(0, entry.era - 1)], entry.row) for entry in known]
            )
            self._pending.done(len(known))
            self._failures = 0
            self._reported = replace(self._reported, written=self._reported.written + written)
            lost_ns = self._pending.take_lost()
            if lost_ns is not None:
                file.note_lost(self._runs[-1], lost_ns)
            if len(known) < len(entries) or not all_that_waits:
                return

    # --- reporting ----------------------------------------------------------------------------

    def _summary(self, unmet_limit: str) -> str:
        if self._is_temporary:
            return "observations are kept in a temporary file, which is deleted at the end"
        if self._quarantined:
            return f"recording; a damaged journal was quarantined as {self._quarantined}"
        if unmet_limit:
            return f"recording; {unmet_limit}"
        return f"recording; {self._left_out}" if self._left_out else "recording"

    def _report_progress(self, share: float) -> None:
        detail = f"the journal {self._path} is being upgraded: {share:.0%} is done"
        self._report(JournalState.UPGRADING, detail)

    def _report_well(self, file: JournalFile) -> None:
        state = JournalState.OFF if self._is_temporary else JournalState.RECORDING
        detail = self._summary(file.unmet_limit)
        if file.lost_log:
            state, detail = JournalState.FAILING, file.lost_log
        if self._doubted_ns is not None:
            state = JournalState.DOUBTING
            until = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(self._doubted_ns // 10**9))
            detail = (
                f"the clock contradicts the journal {self._path}, which was written until {until}:"
                " nothing is written until they agree or ten minutes have passed"
            )
        self._report(
            state,
            detail,
            file_bytes=file.size(),
            quarantined=self._quarantined,
            simulated_ns=file.simulated,
            kept_ns=file.kept(),
            journal_id=file.journal_id,
            inode=file.inode,
        )

    def _report_failure(self, error: Exception) -> None:
        state, detail = JournalState.FAILING, f"the journal {self._path} cannot be written: {error}"
        if isinstance(error, InUse):
            state, detail = JournalState.IN_USE, str(error)
        elif isinstance(error, Foreign):
            state, detail = JournalState.FOREIGN, str(error)
        self._report(state, detail, inode=0)

    def _report(self, state: JournalState, detail: str, **known: Any) -> None:
        self._reported = replace(self._reported, state=state, detail=detail, **known)
