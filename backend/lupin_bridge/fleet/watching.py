"""The newest overview of the archive, as the process that watches it says. On the event loop."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Final

from lupin_bridge.feed.past_process import PastProcess
from lupin_bridge.feed.query import Now
from lupin_bridge.feed.shared_work import end
from lupin_bridge.fleet.overview import Archive, Site
from lupin_bridge.fleet.watcher import News
from lupin_bridge.settings import Settings
from lupin_twin.core.journal_condition import UNKNOWN
from lupin_twin.core.past import NotRemembered

log = logging.getLogger(__name__)

# It answers at each look, every two seconds at least; a link that is dead takes half a minute
# to be found out by the system.
STUCK_S: Final = 6.0
# Before its first answer it has to be started, and to connect.
_START_S: Final = 15.0
_RETRY_S: Final = 1.0
_POLL_S: Final = 0.5
_MAX_SITES: Final = 20_000


class Watching:
    """The sites and the archive as they were seen last, from `start` to `stop`.

    `on_news` is called where anything is not as it was.
    """

    def __init__(self, settings: Settings, on_news: Callable[[], None]) -> None:
        self.sites: Mapping[str, Site] = {}
        self.archive = Archive(is_reachable=False, message="the archive has not been read yet")
        self.looks = 0
        self._on_news = on_news
        # What an archive's clock is ahead of this process's steady one.
        self._ahead_ns = time.time_ns() - time.monotonic_ns()
        self._answered_s = time.monotonic()
        self._process = PastProcess("lupin_bridge.fleet.watcher")
        self._settings = settings
        self._tasks: list[asyncio.Task[None]] = []

    @property
    def now_ns(self) -> int:
        """The time by the archive's clock."""
        return time.monotonic_ns() + self._ahead_ns

    def start(self) -> None:
        """Begin to watch."""
        self._answered_s = time.monotonic()
        self._tasks = [
            asyncio.create_task(self._keep(), name="watching"),
            asyncio.create_task(self._mind(), name="minding"),
        ]

    async def stop(self) -> None:
        """End."""
        await end(*self._tasks)
        await self._process.stop()

    @property
    def starts(self) -> int:
        """How often the process was started."""
        return self._process.starts

    async def _keep(self) -> None:
        while True:
            try:
                self._take(await self._process.ask(self._settings, Now(0, "", UNKNOWN), 0.0))  # type: ignore[arg-type]  # see `WatchChild`
                continue
            except NotRemembered as error:
                self._answered_s = time.monotonic()
                self._down(str(error))
            except Exception:  # nobody waits for this task, and all of the overview depends on it
                log.exception("the archive is not watched")
            await asyncio.sleep(_RETRY_S)

    async def _mind(self) -> None:
        while True:
            await asyncio.sleep(_POLL_S)
            patience_s = STUCK_S if self.looks else _START_S
            # Once it is said why, that stays: a query that is ended for its time says more.
            is_said = self.archive.since_ns and not self.archive.is_reachable
            if not is_said and time.monotonic() - self._answered_s >= patience_s:
                self._down(f"the archive has not answered for {STUCK_S:g} s")

    def _take(self, news: News) -> None:
        self._answered_s = time.monotonic()
        self.looks += 1
        self._ahead_ns = news.now_ns - time.monotonic_ns()
        if not self.archive.is_reachable:
            log.info("the archive is read")
        elif not (news.sites or news.gone):
            return
        known = {} if news.is_whole else self.sites
        sites = {name: site for name, site in known.items() if name not in news.gone}
        sites |= {site.site: site for site in news.sites}
        self.sites = dict(sorted(sites.items())[:_MAX_SITES])
        self.archive = Archive(is_reachable=True)
        self._on_news()

    def _down(self, message: str) -> None:
        if not self.archive.is_reachable and self.archive.message == message:
            return
        since_ns = self.archive.since_ns or self.now_ns
        self.archive = replace(self.archive, is_reachable=False, message=message, since_ns=since_ns)
        log.warning("%s", message)
        self._on_news()
