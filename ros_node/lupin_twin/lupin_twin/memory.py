"""What the twin knows and its journal, kept together: each write handed over, each start restored.

No ROS; time and environment are arguments. Everything here runs on the thread that the store
belongs to, and takes microseconds, but for the start: that waits for what was known before.
"""

from __future__ import annotations

import re
from collections import Counter, deque
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from lupin_twin import ingest
from lupin_twin.bounds import MAX_TEXT_LENGTH
from lupin_twin.drops import Drop
from lupin_twin.history import KIND_FLOWER, KIND_TAG_READING, History
from lupin_twin.ingest import Pin
from lupin_twin.journal.condition import OFF, Condition
from lupin_twin.journal.restoring import Restored
from lupin_twin.journal.retention import Limits
from lupin_twin.journal.rows import LookRow, PinRow, Row, ScanRow
from lupin_twin.journal.runs import Clock, is_new_run
from lupin_twin.journal.writer import Journal
from lupin_twin.recall import Recall
from lupin_twin.state import Look, Scan, TwinStore

NO_JOURNAL: Final = "off"

# So long a start waits for what was known before; what comes later is taken in as it comes.
_START_WAIT_S: Final = 10.0

# Two simulations on one /clock make it go back dozens of times a second, and each run stays in the
# file: so many may begin within such a time, by the wall's clock.
MAX_NEW_RUNS: Final = 10
NEW_RUNS_NS: Final = 100 * 1_000_000_000


def journal_path(
    given: str, environ: Mapping[str, str], domain: int, namespace: str
) -> Path | None:
    """Where the journal is, None where none is kept.

    By default it is a file of the user's, named by domain and namespace.

    Raises:
        RuntimeError: there is no home to keep it in.

    """
    if given == NO_JOURNAL:
        return None
    if given:
        return Path(given).expanduser().absolute()
    names = [f"domain-{domain}", *re.findall("[^/]+", namespace)]
    return state_folder(environ) / f"{'.'.join(names)}.sqlite"


def demo_journal_path(environ: Mapping[str, str], seed: int) -> Path:
    """Where a demo keeps its journal: apart from a real twin's, and each seed for itself.

    Raises:
        RuntimeError: there is no home to keep it in.

    """
    return state_folder(environ) / f"demo-seed-{seed}.sqlite"


def state_folder(environ: Mapping[str, str]) -> Path:
    """The user's folder for what outlives a process (XDG Base Directory Specification).

    Raises:
        RuntimeError: there is no home to keep it in.

    """
    given = Path(environ.get("XDG_STATE_HOME", ""))
    # A relative path there is invalid and to be ignored.
    home = given if given.is_absolute() else Path("~/.local/state").expanduser()
    return home / "lupin-twin"


class Memory:
    """A store, its history, and the journal of both, if one is kept; `recall` asks that.

    `buffer_len` scans of a series are restored at most.
    """

    def __init__(
        self, store: TwinStore, history: History, journal: Journal | None, buffer_len: int
    ) -> None:
        self._store = store
        self._history = history
        self._journal = journal
        self._buffer_len = buffer_len
        self._clock: Clock | None = None
        self._begun_ns: deque[int] = deque(maxlen=MAX_NEW_RUNS)
        self.recall = Recall(lambda: self.condition, heal=self.heal)

    def follow(self, now: Clock) -> str | None:
        """Keep to a clock: the first moment of it restores, one that goes back begins a new run.

        Returns what of the journal is known again, in words, once it is. A moment of 0 is a
        simulated clock that has not started: nothing is known then of when anything was. One that
        goes back time and again stays in a run, as at its latest, until it may begin another
        (`MAX_NEW_RUNS`).
        """
        if self._journal is None or now.stamp_ns <= 0:
            return None
        before = self._clock
        if before is None:
            self._clock = now
            self._journal.begin(now, self._buffer_len)
            return self._take(self._journal.take_restored(_START_WAIT_S), now)
        is_new = before.is_simulated != now.is_simulated or is_new_run(before, now)
        if not is_new or self._may_begin(now.arrival_ns):
            self._clock = now
            if is_new:
                self._journal.begin(now, before_ns=before.stamp_ns)
        return self._take(self._journal.take_restored(), now)

    def apply(self, write: ingest.Write, arrival_ns: int, mission: str = "") -> Drop | None:
        """Write what is now and what was, and hand it over; returns what the store refused."""
        was_pinned = self._store.is_pinned(write.tag_id)
        dropped = ingest.apply(write, self._store, self._history)
        if dropped is not None or self._journal is None:
            return dropped
        if write.pose is not None and not was_pinned:
            now_ns = 0 if self._clock is None else self._clock.stamp_ns
            # A place belongs to the moment of the scan that brought it, as its readings do.
            stamp_ns = now_ns if isinstance(write, Pin) else write.stamp_ns
            self._journal.write(PinRow(write.tag_id, stamp_ns, arrival_ns, write.pose))
        if not isinstance(write, Pin):
            self._journal.write(_row(write, arrival_ns, mission[:MAX_TEXT_LENGTH]))
        return None

    @property
    def condition(self) -> Condition:
        """How the journal is doing."""
        return OFF if self._journal is None else self._journal.condition

    def heal(self, damage: str) -> None:
        """Have a journal in which somebody has met damage set aside; from any thread."""
        if self._journal is not None:
            self._journal.heal(damage)

    def close(self) -> None:
        """Answer nothing more, and write what is waiting."""
        self.recall.close()
        if self._journal is not None:
            self._journal.close()

    def _may_begin(self, arrival_ns: int) -> bool:
        begun = self._begun_ns
        if len(begun) == MAX_NEW_RUNS and abs(arrival_ns - begun[0]) < NEW_RUNS_NS:
            return False
        begun.append(arrival_ns)
        return True

    def _take(self, restored: Restored | None, now: Clock) -> str | None:
        if restored is None:
            return None
        for row in restored.rows:
            ingest.apply(_write(row), self._store, self._history)
        # The count goes on where it was: it never falls, over a restart either.
        self._store.observation_count = max(self._store.observation_count, restored.count)
        if self._store.hold_to(now.stamp_ns):
            self._history.hold_to(now.stamp_ns)
        return f"journal {self.condition.path}: {_told(restored.rows, now)}"


def open_journal(path: Path | None, holder: str, days: float, max_mb: float) -> Journal | None:
    """A journal at work, None where none is kept; `holder` is what others are told who has it."""
    return None if path is None else Journal(path, holder, Limits(days, int(max_mb * 1e6)))


def _told(rows: Sequence[Row], now: Clock) -> str:
    if not rows:
        return "nothing was known before"
    counts = Counter(type(row) for row in rows)
    oldest_ns = min(row.stamp_ns for row in rows)
    what = ", ".join(
        f"{counts[kind]:,} {name}"
        for kind, name in ((PinRow, "places"), (ScanRow, "scans and tries"), (LookRow, "looks"))
    )
    tags = len({row.tag_id for row in rows})
    return f"{tags:,} tags are known again, of {what}; the oldest is of {_moment(oldest_ns, now)}"


def _moment(stamp_ns: int, now: Clock) -> str:
    try:
        moment = datetime.fromtimestamp(stamp_ns / 1e9, UTC)
    except (OverflowError, ValueError):
        return f"second {stamp_ns // 10**9}"
    return f"second {stamp_ns / 1e9:.3f}" if now.is_simulated else f"{moment:%Y-%m-%dT%H:%M:%SZ}"


def _row(write: Scan | Look, arrival_ns: int, mission: str) -> Row:
    own = None if write.own_stamp_ns == write.stamp_ns else write.own_stamp_ns
    if isinstance(write, Look) and write.flower is not None:
        return LookRow(
            write.tag_id, write.stamp_ns, arrival_ns, write.flower, write.source, mission, own
        )
    return ScanRow(
        tag_id=write.tag_id,
        stamp_ns=write.stamp_ns,
        arrival_ns=arrival_ns,
        readings=write.readings if isinstance(write, Scan) else (),
        kind=KIND_TAG_READING if isinstance(write, Scan) else KIND_FLOWER,
        status=write.status,
        detail=write.status_detail,
        source=write.source,
        mission=mission,
        own_stamp_ns=own,
    )


def _write(row: Row) -> ingest.Write:
    if isinstance(row, PinRow):
        return Pin(row.tag_id, row.pose)
    own = row.stamp_ns if row.own_stamp_ns is None else row.own_stamp_ns
    if isinstance(row, LookRow):
        return Look(row.tag_id, row.stamp_ns, row.flower, source=row.source, own_stamp_ns=own)
    if row.kind == KIND_FLOWER:
        return Look(row.tag_id, row.stamp_ns, None, None, row.status, row.detail, row.source, own)
    return Scan(
        row.tag_id, row.stamp_ns, row.readings, None, row.status, row.detail, row.source, own
    )
