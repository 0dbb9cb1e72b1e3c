"""The source of `lupin-twin web`: a twin in another process, which many sources may share.

It reads the twin's log in a file on this machine: the twin's own file, or a copy. The twin's own
file is recognized by its journal's id, not by its path alone. If it cannot be read, `get_writes`
fetches the rows into a copy, a file of this user for each journal. When a twin begins a new
journal, it gets a new copy. A damaged copy is deleted and made anew.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import math
import os
import shutil
import time
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Final, TypeVar

from lupin_msgs.srv import GetWrites

from lupin_bridge.feed.query import Now
from lupin_bridge.feed.ros_source import Post, RosSource, now_ns_of
from lupin_bridge.feed.source import TwinUnavailableError, TwinUpdate
from lupin_bridge.feed.tasks import Guard, Periodic, end
from lupin_bridge.feed.web_node import WebNode
from lupin_twin.core.diagnostics import UNKNOWN_JOURNAL, Condition, JournalState
from lupin_twin.core.parameters import World
from lupin_twin.core.past import NotRemembered, PastRefused
from lupin_twin.journal.follow import Followed, Lot, NotALotError, followed, write
from lupin_twin.journal.paths import journal_path
from lupin_twin.journal.schema import FILE_ERRORS, Empty, Foreign, is_damage_error
from lupin_twin.ros import convert_services
from lupin_twin.runtime.workers import Workers

log = logging.getLogger(__name__)

ResultT = TypeVar("ResultT")

# Interval of polling for new rows, and so how far the past shown here lags at most.
POLL_S: Final = 0.3
# Interval after an error, and while there is nothing to follow.
RETRY_S: Final = 1.0
# Longest wait for a log: a live twin reports within a second where its journal is.
FOUND_S: Final = 3.0
# A copy that was not written for this long is deleted at the start, unless it is the newest.
RETAINED_S: Final = 90 * 86_400.0
# Estimated time to write a lot into the file, s.
_WRITE_S: Final = 0.05
_FILE_ERRORS: Final = (Foreign, OSError, *FILE_ERRORS)
_ERRORS: Final = (NotALotError, NotRemembered, PastRefused, TwinUnavailableError, *_FILE_ERRORS)


class FollowedLog:
    """Finds the log of a twin in another process, or keeps a copy of it up to date.

    `query(after)` returns the rows after a row number, within its own time-out. `named` is the path
    of the twin's own file on this machine, read even before the twin is received; None: the path
    that the twin reports. `world` is what the twin observes, by the log. Belongs to the event loop.
    """

    def __init__(
        self,
        query: Callable[[int], Awaitable[Lot]],
        workers: Workers,
        named: Path | None = None,
    ) -> None:
        self._query = query
        self._named = named
        self._workers = workers
        self._folder: Path | None = None
        self.world = World("unknown")
        # Why the copy cannot be written; empty: it can be, as far as known.
        self.fault = ""
        self._reported = UNKNOWN_JOURNAL
        self._has_report = False
        self._own: Path | None = None
        self._followed: Followed | None = None
        self._is_known = asyncio.Event()
        self._task: asyncio.Task[None] | None = None

    @property
    def condition(self) -> Condition | None:
        """The condition of the log that is read here; None: there is none yet."""
        if self._own is not None:
            return replace(self._reported, path=str(self._own))
        if self._followed is None:
            return None
        return _readable(self._reported, self._followed, self._path(self._followed.journal))

    def on_update(self, journal: Condition) -> None:
        """Take the twin's report on its journal; the last one stays valid until a new one comes."""
        if journal.state is not JournalState.UNKNOWN and journal.journal_id:
            self._reported, self._has_report = journal, True

    async def explain(self, error: NotRemembered) -> NotRemembered:
        """The error; if it is about a copy, one that says so, as this process makes that anew."""
        if self._own is not None or self._followed is None:
            return error
        path = self._path(self._followed.journal)
        if str(path) not in str(error):
            return error
        if error.damage:
            await self._on_worker(lambda: _delete(path))
        why = f"{path}, the copy of the twin's journal, cannot be read; it is copied again"
        return NotRemembered(f"{why} as soon as the twin answers")

    async def wait(self) -> None:
        """Wait until a log is known, for at most `FOUND_S`."""
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(self._is_known.wait(), FOUND_S)

    async def start(self, folder: Path | None) -> None:
        """Start with the newest copy in a folder; None: there is no folder for copies."""
        self._folder = folder
        if folder is not None:
            with contextlib.suppress(*_ERRORS):
                self._followed = await self._on_worker(lambda: _newest(folder))
                self.world = self._followed.world if self._followed else self.world
        self._task = asyncio.create_task(self._keep(), name="log")

    async def stop(self) -> None:
        """Stop; the next start continues the copy."""
        await end(self._task)

    def _path(self, journal: str) -> Path:
        assert self._folder is not None
        return self._folder / f"{journal}.sqlite"

    async def _keep(self) -> None:
        guard = Guard("the twin's journal is not followed", *_ERRORS)
        is_failing = False
        while True:
            if self.condition is not None:
                self._is_known.set()
            pause_s = await guard.run(self._look())
            # After a single error, a damaged or foreign copy is deleted and made anew.
            was_failing, is_failing = is_failing, isinstance(pause_s, _FILE_ERRORS)
            self.fault = (
                f"This bridge cannot copy the twin's journal to {self._folder}: {pause_s}"
                if was_failing and is_failing
                else ""
            )
            await asyncio.sleep(RETRY_S if isinstance(pause_s, Exception) else pause_s)

    async def _look(self) -> float:
        """Find the log, or copy its new rows; returns the time to wait before the next call, s."""
        own = self._named or Path(self._reported.path)
        found = await self._on_worker(lambda: _found(own))
        if found is not None and self._named is not None and not self._has_report:
            self._reported = replace(
                _readable(self._reported, found, own), journal_id=found.journal
            )
        twin = self._reported
        if not twin.journal_id:
            return POLL_S
        self._own = None
        if found is not None and found.journal == twin.journal_id:
            self._own, self.world = own, found.world
        if self._own is not None or self._folder is None:
            return RETRY_S
        here = self._path(twin.journal_id)
        try:
            # Read each time: another `web` may write it too, and anybody may delete it.
            after = await self._on_worker(lambda: _last(here))
            lot = await self._query(after)
            if lot.journal != twin.journal_id:
                return RETRY_S  # the twin has begun a new journal, and soon reports that
            self._followed = await self._on_worker(
                lambda: write(here, lot, twin.complete_ns, after)
            )
            self.world = self._followed.world
        except _FILE_ERRORS as error:
            if isinstance(error, Foreign) or is_damage_error(error) or here.is_dir():
                self._followed = None
                await self._on_worker(lambda: _delete(here))
                log.warning("%s cannot be used (%s): the log is copied again", here, error)
            raise
        return POLL_S if lot.is_all else 0.0

    async def _on_worker(self, work: Callable[[], ResultT]) -> ResultT:
        return await asyncio.wrap_future(self._workers.submit(lambda _: work(), _WRITE_S))


def _readable(reported: Condition, found: Followed, path: Path) -> Condition:
    """The condition of a file that can be read, even if its twin is gone, or cannot write it."""
    return replace(
        reported,
        state=JournalState.RECORDING,
        path=str(path),
        written=found.last,
        complete_ns=found.complete_ns,
        kept_ns=found.kept_ns,
        simulated_ns=found.simulated_ns,
    )


def _newest(folder: Path) -> Followed | None:
    """The copy that was written last; old ones among the others are deleted."""
    files = sorted(folder.glob("*.sqlite"), key=lambda it: it.stat().st_mtime)
    for path in files[:-1]:
        if path.stat().st_mtime < time.time() - RETAINED_S:
            log.info("%s is deleted: its twin has written nothing for 90 days", path)
            _delete(path)
    return followed(files[-1]) if files else None


def _delete(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path)
    for suffix in ("", "-wal", "-shm"):
        path.with_name(path.name + suffix).unlink(missing_ok=True)


def _last(path: Path) -> int:
    try:
        return followed(path).last if path.exists() else 0
    except Empty:  # the process that created it was killed
        return 0


def _found(path: Path) -> Followed | None:
    """A file's journal id and extent; None: it does not exist, or cannot be read."""
    with contextlib.suppress(*_FILE_ERRORS):
        return followed(path)
    return None


# --- the source -----------------------------------------------------------------------------------

# ROS time past this, in 2001, is wall-clock time, which goes on while the twin is silent.
_A_DATE_NS: Final = 10**18

# Interval of the check whether the twin is lost.
_LOOK_S: Final = 1.0
# A node made while the network has no address never receives the twin. So the node is made anew
# again when the silence has doubled, or has grown by this, whichever is first.
_REJOIN_AGAIN_S: Final = 300.0


class WebTwin(RosSource[WebNode]):
    """`TwinSource` over the ROS contracts of a twin in another process.

    A twin that has been silent for `stale_after_s` gets no requests. After `rejoin_after_s`, the
    node is made anew: Fast DDS may never rediscover a twin that it lost for longer than its lease
    of 20 s. `journal` is the path of the twin's file on this machine; None: the path that the twin
    reports.
    """

    def __init__(
        self,
        *,
        ros_args: Sequence[str],
        timeout_s: float,
        stale_after_s: float = math.inf,
        rejoin_after_s: float = math.inf,
        journal: Path | None = None,
    ) -> None:
        super().__init__(ros_args=ros_args, timeout_s=timeout_s)
        self._stale_after_s = stale_after_s
        self.rejoin_after_s = rejoin_after_s
        self._rejoining = Periodic(self._rejoin_if_lost, _LOOK_S, "the look for a lost twin")
        self._join: Callable[[], Awaitable[None]]
        # `made_s` of the last update before the silence.
        self._lost_s = 0.0
        self._rejoin_at_s = 0.0
        self._node: WebNode | None = None
        self._frame_id: str
        self._log = FollowedLog(self._rows_behind, self.workers, journal)

    async def start(
        self, on_state: Callable[[TwinUpdate], None], on_death: Callable[[], None]
    ) -> None:
        """Start the ROS thread with its node; see `TwinSource.start`."""

        def make_node(context: Any, post: Post) -> WebNode:
            node = WebNode(post, context=context)
            # What the old node knew stays valid in the new one.
            if self._node is not None:
                node.take_over(self._node)
            self._node = node
            return node

        def on_update(update: TwinUpdate) -> None:
            journal, fault = update.journal, self._log.fault
            self._log.on_update(journal)
            if fault:  # or alarms would come from a copy that lags, and nobody would know
                journal = replace(journal, state=JournalState.FAILING, detail=fault)
            on_state(replace(update, journal=journal))

        self._join = partial(self._start_thread, make_node, on_update, on_death)
        await self._join()
        self._rejoining.start()
        self._frame_id, folder = await self.thread.call(
            lambda node: (node.parameters.frame_id, _folder(node))
        )
        await self._log.start(folder)

    async def stop(self) -> None:
        """See `RosSource`."""
        await self._rejoining.stop()
        await self._log.stop()
        await super().stop()

    async def _rejoin_if_lost(self) -> None:
        update = self.update
        if update is None:
            return
        if update.made_s != self._lost_s:
            self._lost_s, self._rejoin_at_s = update.made_s, self.rejoin_after_s
        silent_s = time.monotonic() - update.made_s
        if silent_s < self._rejoin_at_s:
            return
        log.warning("%s: joining ROS again", self._silence(round(silent_s)))
        await self.thread.stop()
        await self._join()
        self._rejoin_at_s = silent_s + min(silent_s, _REJOIN_AGAIN_S)
        self.relay.renew()

    def _silence(self, seconds: float) -> str:
        return f"nothing was received on {self.names.state_topic} for {seconds:g} s"

    @property
    def world(self) -> World:
        """See `TwinSource`: by the log, if one is read here."""
        return self._log.world

    def journal(self) -> Condition:
        """The condition of the log that is read here; until there is one, as on `/diagnostics`."""
        return self._log.condition or super().journal()

    async def now(self) -> Now:
        """See `TwinSource`."""
        if self.update is not None:
            await self._log.wait()
        condition, update = self._log.condition, self.update
        if condition is None:
            raise TwinUnavailableError("the journal is not known here yet: is the twin running?")
        if update is None:  # a log from an earlier run, whose twin is not received
            now_ns = condition.complete_ns or 0
            if now_ns > _A_DATE_NS:
                now_ns = max(now_ns, time.time_ns())
            return Now(now_ns, self._frame_id, condition)
        return Now(now_ns_of(update), update.snapshot.frame_id, condition)

    async def _explain(self, error: NotRemembered) -> NotRemembered:
        return await self._log.explain(error)

    async def _rows_behind(self, after: int) -> Lot:
        """The rows of the twin's log after a number, from the twin's service.

        Raises:
            TwinUnavailableError: no twin answers in time.

        """
        # DDS offers the services of a killed twin for another twenty seconds.
        update = self.update
        if update is not None and time.monotonic() - update.made_s >= self._stale_after_s:
            raise TwinUnavailableError(
                f"{self._silence(self._stale_after_s)}: is the twin running?"
            )
        if why := await self.thread.call(lambda node: node.why_no_rows()):
            raise TwinUnavailableError(why)
        request = GetWrites.Request(after=after)
        response = await self._in_time(
            self.thread.ask(
                lambda node: node.rows.call_async(request),
                # Or rclpy would keep it for ever.
                lambda node, future: node.rows.remove_pending_request(future),
            )
        )
        return convert_services.lot_of(response, after)


def _folder(node: WebNode) -> Path | None:
    """The folder for copies of logs; None: there is none."""
    domain = int(node.context.get_domain_id())
    try:
        journal = journal_path("", os.environ, domain, node.get_namespace())
    except RuntimeError:
        return None
    return None if journal is None else journal.with_suffix(".followed")
