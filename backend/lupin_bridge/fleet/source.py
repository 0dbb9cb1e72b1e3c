"""`SiteTwin`, the source of one site's page: its twin as its log in the archive shows it.

`Watching` has the newest overview of the archive, from the process that watches it. Both belong to
the event loop.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any, Final

from lupin_bridge.feed.past_process import PastProcess
from lupin_bridge.feed.query import Now
from lupin_bridge.feed.relay import Relay, TwinNames
from lupin_bridge.feed.source import TwinSource, TwinUnavailableError, TwinUpdate
from lupin_bridge.feed.tasks import Guard, Periodic, end
from lupin_bridge.fleet.overview import Archive, Site
from lupin_bridge.fleet.reader import Reported, latest
from lupin_bridge.fleet.watcher import MAX_AHEAD_NS, News
from lupin_bridge.settings import Settings
from lupin_twin.core.diagnostics import UNKNOWN_JOURNAL, Condition, JournalState
from lupin_twin.core.notes import Note, NotesUnwritable
from lupin_twin.core.parameters import TwinParameters, World
from lupin_twin.core.past import NotRemembered
from lupin_twin.core.state import same_tags
from lupin_twin.field.engine import FieldRules
from lupin_twin.field.explored import OccupancyMap
from lupin_twin.runtime.workers import Workers

log = logging.getLogger(__name__)

# The watching process answers every two seconds at least; the system takes half a minute to notice
# a dead link.
STUCK_S: Final = 6.0
# Longer before its first answer: it has to start and connect.
START_S: Final = 15.0
RETRY_S: Final = 1.0


class Watching:
    """The sites and the archive as they were seen last, from `start` to `stop`.

    Each is another object when it has changed.
    """

    def __init__(self, settings: Settings) -> None:
        self.sites: Mapping[str, Site] = {}
        self.archive = Archive(is_reachable=False, message="the archive has not been read yet")
        self.looks = 0
        # How far the archive's clock is ahead of this process's monotonic one.
        self._ahead_ns = time.time_ns() - time.monotonic_ns()
        self.process = PastProcess("lupin_bridge.fleet.watcher")
        self._settings = settings
        self._task: asyncio.Task[None] | None = None

    @property
    def now_ns(self) -> int:
        """The time by the archive's clock."""
        return time.monotonic_ns() + self._ahead_ns

    def start(self) -> None:
        """Start watching."""
        self._task = asyncio.create_task(self._keep(), name="watching")

    async def stop(self) -> None:
        """Stop."""
        await end(self._task)
        await self.process.stop()

    async def _keep(self) -> None:
        guard = Guard("the archive is not watched")
        while True:
            await guard.run(self._see())
            if not self.archive.is_reachable:
                await asyncio.sleep(RETRY_S)

    async def _see(self) -> None:
        try:
            self._take(await self._look())
        except Exception as error:
            self._down(_why(error))
            if not isinstance(error, _KNOWN):
                raise

    async def _look(self) -> News:
        """Wait for news; if they take too long, report that meanwhile."""
        about = Now(0, "", UNKNOWN_JOURNAL)
        settings: Any = self._settings  # see `FromWatcher`
        look: asyncio.Task[News] = asyncio.create_task(self.process.ask(settings, about, 0.0))
        try:
            patience_s = STUCK_S if self.looks else START_S
            while not (await asyncio.wait((look,), timeout=patience_s))[0]:
                # Not the look itself, because another one must not run beside it.
                self.process.cancel()
                # A reason that was reported before stays: that of a cancelled query says more.
                if self.archive.is_reachable or not self.archive.since_ns:
                    self._down(f"the archive has not answered for {STUCK_S:g} s")
            return await look
        finally:
            look.cancel()

    def _take(self, news: News) -> None:
        self.looks += 1
        self._ahead_ns = news.now_ns - time.monotonic_ns()
        if not self.archive.is_reachable:
            log.info("the archive is read")
        elif not news.changed and len(news.names) == len(self.sites):
            return
        known = {**self.sites, **{site.site: site for site in news.changed}}
        self.sites = {name: known[name] for name in sorted(news.names)}
        self.archive = Archive(is_reachable=True)

    def _down(self, message: str) -> None:
        if not self.archive.is_reachable and self.archive.message == message:
            return
        since_ns = self.archive.since_ns or self.now_ns
        self.archive = replace(self.archive, is_reachable=False, message=message, since_ns=since_ns)
        log.warning("%s", message)


# --- the source of one site's page ----------------------------------------------------------------

HEARTBEAT_S: Final = 1.0


class SiteTwin(TwinSource):
    """`TwinSource` over a site's log; all sites share `past` and `workers`."""

    answerer = "the archive"

    def __init__(
        self,
        site: str,
        watching: Watching,
        past: PastProcess,
        workers: Workers,
        timeout_s: float,
    ) -> None:
        self.site = site
        self.past = past
        self.timeout_s = timeout_s
        self.workers = workers
        self.relay = Relay(_no_ros, None)
        self._watching = watching
        # A twin's parameters are not in its log: if they are not the defaults, fields differ.
        self._parameters = TwinParameters()
        self.rules = FieldRules.of(self._parameters)
        self.buffer_len = self._parameters.buffer_len
        # A twin's default names; nothing is received under them here.
        self.names = TwinNames("/twin/state", "/twin/get_field")
        self._map: OccupancyMap | None = None
        self._map_hash = 0
        self._reported: Reported | None = None
        self._read_ns = 0
        self._seq = -1
        # Why new rows could not be read.
        self._problem = ""
        # As last notified: whether it was live, up to where it was read, what was wrong.
        self._said: tuple[bool, int, tuple[str, ...]] | None = None
        self._has_read = asyncio.Event()
        self._guard = Guard(f"site {site} is unchanged", *_KNOWN)
        self._reader = Periodic(self._read, HEARTBEAT_S, f"read {site}", 0.0)
        # It goes on while rows are read, however long that takes.
        self._heartbeat = Periodic(self._notify, HEARTBEAT_S, f"site {site}")
        self._on_state: Callable[[TwinUpdate], None]

    async def start(
        self,
        on_state: Callable[[TwinUpdate], None],
        on_death: Callable[[], None],  # noqa: ARG002  # there is no thread that could die
    ) -> None:
        """Start following the site; waits for its first state, within the time-out."""
        self._on_state = on_state
        self._heartbeat.start()
        self._reader.start()
        if self._watching.archive.is_reachable:
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._has_read.wait(), self.timeout_s)

    async def stop(self) -> None:
        """Stop; the process that reads goes on for other sites."""
        await self._reader.stop()
        await self._heartbeat.stop()

    @property
    def world(self) -> World:
        """See `TwinSource`: by the site's log."""
        return World("unknown") if self._reported is None else self._reported.world

    @property
    def problems(self) -> tuple[str, ...]:
        """See `TwinSource`."""
        archive = self._watching.archive
        problem = self._problem if archive.is_reachable else _sentence(archive.message)
        return (problem,) if problem else ()

    @property
    def _site(self) -> Site:
        return self._watching.sites.get(self.site, Site(self.site))

    @property
    def _is_live(self) -> bool:
        return self._watching.archive.is_reachable and self._site.is_live

    async def _read(self) -> None:
        error = await self._guard.run(self._read_newer())
        self._problem = "" if error is None else _sentence(_why(error))

    async def _read_newer(self) -> None:
        last_seq = self._site.last_seq
        if last_seq == self._seq or not self._watching.archive.is_reachable:
            return
        query = partial(latest, self._map_hash, self._parameters.frame_id)
        found: Reported = await self._in_time(self._reading(query))
        if found.map_hash != self._map_hash:
            self._map, self._map_hash = found.occupancy_map, found.map_hash
        self._reported = found
        self._read_ns = time.monotonic_ns()
        self._seq = last_seq
        await self._notify()
        self._has_read.set()

    async def _notify(self) -> None:
        site, is_live = self._site, self._is_live
        reported = self._reported
        problems = self.problems
        said = is_live, self._seq, problems
        if reported is None or not (is_live or said != self._said):
            return
        self._said = said
        is_ahead = (
            reported.is_wall_clock and _newest_ns(reported) - self._watching.now_ns > MAX_AHEAD_NS
        )
        stamp_ns = self._now_ns(reported)
        # By the same clock as `now`, if that is the wall's: a later moment would be refused.
        now_ns = stamp_ns if reported.is_wall_clock else self._watching.now_ns
        ago_s = max(0.0, (now_ns - site.heartbeat_ns) / 1e9) if site.heartbeat_ns else 0.0
        if not is_live:
            # As of the forwarder's last heartbeat: readers add `silent_s`.
            stamp_ns = site.heartbeat_ns if reported.is_wall_clock else _newest_ns(reported)
        before = None if self.update is None else self.update.snapshot
        self.update = TwinUpdate(
            replace(
                reported.snapshot,
                stamp_ns=stamp_ns,
                tags=same_tags(before, reported.snapshot.tags),
                clock="doubted" if is_ahead else "running",
            ),
            # Made of what was read: the same in all replicas.
            f"{self.site}-{self._seq}-{self._map_hash}",
            occupancy_map=self._map,
            journal=self.journal(),
            rules=self.rules,
            origin=reported.world.origin,
            input_problems=problems,
            silent_s=0.0 if is_live else ago_s,
        )
        self._on_state(self.update)

    def _now_ns(self, reported: Reported) -> int:
        """The site's ROS time now; that of a simulation goes on only while it is live."""
        passed_ns = time.monotonic_ns() - self._read_ns
        goes_on = reported.is_wall_clock or self._is_live
        return reported.snapshot.stamp_ns + (passed_ns if goes_on else 0)

    # --- see `TwinSource` ---------------------------------------------------------------------

    def journal(self) -> Condition:
        """The condition of the site's log, whose path is the site's name."""
        site, reported = self._site, self._reported
        complete_ns = None
        if reported is not None:
            complete_ns = (
                site.heartbeat_ns if reported.is_wall_clock else reported.snapshot.stamp_ns
            )
        return Condition(
            JournalState.RECORDING,
            path=self.site,
            written=site.last_seq,
            simulated_ns=None if reported is None else reported.simulated_ns,
            complete_ns=complete_ns,
            kept_ns=() if reported is None else reported.kept_ns,
            journal_id=self.site,
        )

    writes_notes = True

    async def write_note(self, note: Note) -> Note:
        """See `TwinSource`: into the site's log in the archive, where every replica reads it."""
        try:
            written: Note = await self._in_time(self._reading(note))
        except NotRemembered as error:
            raise NotesUnwritable(f"the note of {note.by} was not written: {error}") from error
        return written

    async def now(self) -> Now:
        """See `TwinSource`."""
        reported = self._reported
        if reported is None:
            raise TwinUnavailableError(f"the site has not been read yet. {self._problem}".strip())
        now_ns = self._now_ns(reported)
        return Now(now_ns, self._parameters.frame_id, self.journal())

    async def _reading(self, query: Any) -> Any:
        about = Now(0, self._parameters.frame_id, self.journal())
        return await self.past.ask(query, about, 0.0)


def _newest_ns(reported: Reported) -> int:
    """When the newest observation was: of a simulation, the last moment all replicas know of."""
    return max((tag.last_observed_ns or 0 for tag in reported.snapshot.tags), default=0)


# Errors whose message says what is wrong.
_KNOWN: Final = (NotRemembered, TwinUnavailableError)


def _why(error: Exception) -> str:
    return f"{'' if isinstance(error, _KNOWN) else 'the archive cannot be read: '}{error}"


def _sentence(message: str) -> str:
    return f"{message[:1].upper()}{message[1:].rstrip('.')}."


def _no_ros() -> Any:
    raise TwinUnavailableError("the archive has no ROS topics")
