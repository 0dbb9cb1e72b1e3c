"""Follows the twin's log and derives the alarms: from the past at the start, then from new writes.

The journal is read in lots, and evaluated on workers; while nothing changes, nothing is done. If
there is no journal, or it fails, the twin's states are used instead, and the board says so.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Final, TypeVar

from lupin_bridge.alarms.board import (
    AlarmBoard,
    AlarmSource,
    Board,
    Change,
    board_of,
    change_between,
)
from lupin_bridge.feed.source import TwinSource, TwinUnavailableError, TwinUpdate
from lupin_bridge.feed.tasks import Guard, end
from lupin_bridge.judge.alarm_fold import FORGET_EVERY_NS, AlarmLog
from lupin_bridge.judge.episodes import Alarm, silence
from lupin_bridge.judge.judging import Judge
from lupin_bridge.judge.scans import NO_TAG, recent_writes, writes_of
from lupin_twin.core.diagnostics import JournalState
from lupin_twin.core.past import (
    DAY_NS,
    FOREVER_NS,
    NotRemembered,
    PastRefused,
    PastWrites,
    RunSpan,
)
from lupin_twin.core.state import Observation, Snapshot


def writes_between(before: Snapshot | None, now: Snapshot, number: int) -> list[Observation]:
    """What happened between two states (see `writes_of`), numbered from `number` on."""
    known = {} if before is None else {tag.tag_id: tag for tag in before.tags}
    found = [
        write
        for tag in now.tags
        if (old := known.get(tag.tag_id, NO_TAG)) is not tag
        for write in writes_of(old, tag)
    ]
    return [replace(write, number=number + at) for at, write in enumerate(found)]


# --- the feed -------------------------------------------------------------------------------------

log = logging.getLogger(__name__)

# Writes per lot: some tens of milliseconds of a worker.
LOT: Final = 500
LOT_S: Final = 0.05
# After this long, an observation is in the journal. A slow disk is read when it has written more.
JOURNAL_S: Final = 0.15
# Pause after each reading: a robot that scans all the time is followed once a second.
REST_S: Final = 0.85
RETRY_S: Final = 5.0
# A journal that has not answered for this long says nothing about now, even if the twin is live.
UNANSWERED_S: Final = 30.0
_NOT_RECORDED: Final = frozenset({JournalState.FAILING, JournalState.IN_USE, JournalState.FOREIGN})
# Numbers of writes that are made from states: beyond those of any journal.
_FIRST_RECEIVED: Final = 2**62
_ALL_TIME: Final = (RunSpan(0, 0, FOREVER_NS),)
_SILENCES: Final = 100
_UNREADABLE: Final = (NotRemembered, PastRefused, TwinUnavailableError)

ResultT = TypeVar("ResultT")


class AlarmFeed:
    """Keeps `board` up to date with the twin's observations. Belongs to the event loop.

    `now_ns` returns ROS time; None: not known. `days` is how far back the past is read. `judge`
    gets what no state shows: daily quantities, and writes that came late or soon after another.
    """

    def __init__(
        self,
        source: TwinSource,
        judge: Judge,
        board: AlarmBoard,
        now_ns: Callable[[], int | None],
        days: float,
    ) -> None:
        self._source = source
        self.judge = judge
        self._board = board
        self._now_ns = now_ns
        self._days = days
        self._log = AlarmLog(judge.criteria, days)
        self._wake = asyncio.Event()
        self._written = 0
        self._due_ns = FOREVER_NS
        self._is_caught_up = False
        self.missed = 0
        self._alarm_source: AlarmSource = "journal"
        self._seen: Snapshot | None = None
        self._received: list[Observation] = []
        self._received_number = _FIRST_RECEIVED
        self._silences: list[Alarm] = []
        # The last known time of the twin.
        self._last_ns: int | None = None
        # What the newest board is made of: alarms of the log, silences, and since when cleared
        # alarms are kept.
        self._board_of: tuple[tuple[Alarm, ...], tuple[Alarm, ...], int] = ((), (), 0)
        self._again: asyncio.TimerHandle | None = None
        self._task: asyncio.Task[None] | None = None

    def start(self) -> None:
        """Start following."""
        self._task = asyncio.create_task(self._run(), name="alarms")

    async def stop(self) -> None:
        """Stop."""
        if self._again is not None:
            self._again.cancel()
        await end(self._task)

    # --- what happens ----------------------------------------------------------------------------

    def on_state(self, update: TwinUpdate) -> None:
        """Take a new state of the twin; does nothing if that and the journal are unchanged."""
        before, now = self._seen, update.snapshot
        self._last_ns = self._last_ns if now.now_ns is None else now.now_ns
        self._withdraw_silences()
        is_new = before is None or before.tags != now.tags
        is_kept = update.journal.state not in _NOT_RECORDED
        if is_kept == (self._alarm_source == "heard"):
            self._begin("journal" if is_kept else "heard")
            before, is_new = None, True
        if is_new:
            if not is_kept:
                if before is not None and now.stamp_ns < before.stamp_ns:
                    self._begin("heard")
                    before = None
                writes = writes_between(before, now, self._received_number)
                self._received_number += len(writes)
                self._received += writes
            self._seen = now
        # A late observation, or a late write, is in the journal, but does not change the state. It
        # is read when the source has it: a copy of the journal may be late too.
        written = self._source.journal().written
        is_written = is_kept and written != self._written
        self._written = written
        if is_new or is_written or now.stamp_ns >= self._due_ns:
            self._wake.set()

    def on_silence(self, *, is_silent: bool, last_ns: int | None) -> None:
        """Note that the twin has fallen silent, or is live again; `last_ns` is its newest stamp.

        None: it has lost its clock, and has been silent since its last known time.
        """
        last_ns = self._last_ns if last_ns is None else last_ns
        open_now = self._silences[-1] if self._silences else None
        was_silent = open_now is not None and open_now.is_active
        if is_silent == was_silent or last_ns is None:
            return
        if open_now is None or not was_silent:
            self._silences = [*self._silences, silence(last_ns)][-_SILENCES:]
        else:
            over_ns = max(last_ns, open_now.raised_at_ns)
            self._silences[-1] = replace(open_now, cleared_at_ns=over_ns)
        self._wake.set()

    def _withdraw_silences(self) -> None:
        """Withdraw the silences that are in the future, because the clock has gone back."""
        now_ns = self._now_ns()
        been = [it for it in self._silences if now_ns is None or it.raised_at_ns <= now_ns]
        if been != self._silences:
            self._silences = been
            self._wake.set()

    # --- following -------------------------------------------------------------------------------

    def _begin(self, says: AlarmSource) -> None:
        """Forget all that was read, to read it again."""
        self._alarm_source = says
        self._log = AlarmLog(self.judge.criteria, self._days)
        self._received, self._seen = [], None
        self._is_caught_up = False

    async def _run(self) -> None:
        loop = asyncio.get_running_loop()
        answered_s = loop.time()
        reading, publishing = (Guard("the alarms stay unchanged", *_UNREADABLE) for _ in range(2))
        while True:
            await self._wake.wait()
            await asyncio.sleep(JOURNAL_S)
            self._wake.clear()
            read = self._take_received() if self._alarm_source == "heard" else self._follow()
            if (error := await reading.run(read)) is None:
                answered_s = loop.time()
            else:
                if not isinstance(error, _UNREADABLE):
                    self._begin(self._alarm_source)
                self._again = loop.call_later(RETRY_S, self._wake.set)
                await publishing.run(self._publish_silence(loop.time() - answered_s))
            await asyncio.sleep(REST_S)

    async def _take_received(self) -> None:
        lot, self._received = self._received, []
        for first in range(0, max(1, len(lot)), LOT):
            part, last = tuple(lot[first : first + LOT]), self._received_number - 1
            await self._take(PastWrites("", _ALL_TIME, part, last, is_all=True))
        await self._publish()

    async def _follow(self) -> None:
        alarm_log = self._log
        is_all = False
        while not is_all:
            past = await self._source.writes(alarm_log.request(LOT))
            if alarm_log is not self._log:
                return  # begun anew meanwhile, and woken
            was_caught_up = alarm_log.is_caught_up
            is_all = await self._take(past)
            if alarm_log is not self._log:
                return
            if was_caught_up and alarm_log.is_caught_up:
                self.judge.note_writes(past.of_newest_run)
            self._is_caught_up &= was_caught_up
        await self._publish()

    async def _take(self, past: PastWrites) -> bool:
        """Take writes; returns whether nothing more is to be read."""
        alarm_log, tags = self._log, () if self._seen is None else self._seen.tags
        missed = alarm_log.missed
        is_all = await self._on_worker(lambda _: alarm_log.take(past, tags))
        if alarm_log.missed and not self.missed:
            log.warning(
                "an observation arrived too late for its alarms; lupin_alarms_missed counts these"
            )
        self.missed += alarm_log.missed - missed
        return is_all

    async def _publish(self) -> None:
        alarm_log, fold, now_ns, seen = self._log, self._log.fold, self._now_ns(), self._seen
        if seen is not None and seen.clock == "doubted":
            now_ns = seen.stamp_ns  # alarms of the log stand; what is unknown is how old they are
        if fold is None or now_ns is None:
            await self._publish_silence(0.0)
            return
        moment_ns, since_ns = now_ns, max(0, now_ns - int(self._days * DAY_NS))
        found = await self._on_worker(lambda _: fold.found(moment_ns, since_ns))
        self._due_ns = found.due_ns
        self.judge.note_days(found.days)
        is_past, self._is_caught_up = not self._is_caught_up, True
        begins_ns = moment_ns if alarm_log.since_ns is None else alarm_log.since_ns
        await self._put(found.alarms, since_ns, self._alarm_source, begins_ns, is_past=is_past)

    async def _publish_silence(self, unanswered_s: float) -> None:
        """Publish silences with the last known alarms: nothing else reports that a twin is gone.

        If the twin is live but its journal does not answer, the source is `starting`: these alarms
        may not be all there are.
        """
        now, (alarms, _, since_ns) = self._board.now, self._board_of
        is_removed = any(alarm.is_active for alarm in self._silences)
        is_old = unanswered_s >= UNANSWERED_S and not is_removed
        source: AlarmSource = "starting" if is_old else now.source
        await self._put(alarms, since_ns, source, now.since_ns)

    async def _put(
        self,
        alarms: tuple[Alarm, ...],
        since_ns: int,
        source: AlarmSource,
        begins_ns: int | None,
        *,
        is_past: bool = False,
    ) -> None:
        """Publish alarms of the log with the silences, without those cleared before `since_ns`."""
        before, beside = self._board.now, tuple(self._silences)
        # Alarms are dropped for their age once an hour.
        since_ns -= since_ns % FORGET_EVERY_NS

        def newest(_: object) -> tuple[Board, Change]:
            now = board_of((*alarms, *beside), since_ns)
            return now, replace(change_between(before, now, since_ns), is_past=is_past)

        board, change = before, Change((), is_past=is_past)
        if alarms is not self._board_of[0] or (beside, since_ns) != self._board_of[1:]:
            board, change = await self._on_worker(newest)
            self._board_of = alarms, beside, since_ns
        self._board.put(board, change, source, begins_ns)

    async def _on_worker(self, work: Callable[[object], ResultT]) -> ResultT:
        """Run the work on a worker, where it does not block the event loop."""
        return await asyncio.wrap_future(self._source.workers.submit(work, LOT_S))


# Pause between two attempts to read the log, s.
LEARN_AGAIN_S: Final = 2.0
# Rough time to look up what is recent, and the light of three days.
RECENT_S: Final = 0.5


async def learn_recent(source: TwinSource, judge: Judge, first: Snapshot) -> None:
    """Give the judge what was recent at the first state, or all would seem unknown after a start.

    Retries while the log cannot be read; until then, the judge knows only what is received.
    """
    recent = partial(recent_writes, first.stamp_ns)
    while True:
        try:
            judge.learn(await source.ask(recent, RECENT_S))
        except (NotRemembered, TwinUnavailableError):
            judge.knows_recent = True
            await asyncio.sleep(LEARN_AGAIN_S)
            continue
        except PastRefused as error:
            log.info("alarms start without the recent past: %s", error)
        except Exception:  # nobody awaits this, and nothing else needs it
            log.exception("alarms start without the recent past")
        judge.knows_recent = True
        return
