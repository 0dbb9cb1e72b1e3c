"""The parent's end of the process that watches the archive: started, read, started again.

Holds the newest overview and says what is new of it. Belongs to the event loop.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Final

import orjson

from lupin_bridge.fleet.overview import Archive, Site
from lupin_bridge.fleet.watcher import read_site
from lupin_bridge.settings import Settings

log = logging.getLogger(__name__)

# It writes a line at each look, every two seconds at least; a link that is dead takes half a minute
# to be found out by the system.
STUCK_S: Final = 6.0
# Before its first line it has to be started, and to connect.
_START_S: Final = 15.0
_RETRY_S: Final = 2.0
_LOOK_S: Final = 0.5
# A line of a thousand sites has 200 kB.
_MAX_LINE: Final = 64_000_000
_MAX_SITES: Final = 20_000
# What the process reads and judges by.
_NEEDED: Final = ("archive_url", "sensors", "reading_validity_s", "day_hours", "time_zone")


class Watching:
    """The sites and the archive as they were seen last, from `start` to `stop`.

    `on_news` is called where anything is not as it was.
    """

    def __init__(self, settings: Settings, on_news: Callable[[], None]) -> None:
        self.sites: Mapping[str, Site] = {}
        self.archive = Archive(is_reachable=False, message="the archive has not been read yet")
        self.looks = 0
        self.starts = 0
        self._on_news = on_news
        # What an archive's clock is ahead of this process's steady one.
        self._ahead_ns = time.time_ns() - time.monotonic_ns()
        self._answered_s = time.monotonic()
        self._settings = orjson.dumps({name: getattr(settings, name) for name in _NEEDED})
        self._process: asyncio.subprocess.Process | None = None
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
        for task in self._tasks:
            task.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await task
        await self._end()

    async def _keep(self) -> None:
        while True:
            try:
                await self._live()
            except Exception:  # nobody waits for this task, and all of the overview depends on it
                log.exception("the archive is not watched")
            await self._end()
            await asyncio.sleep(_RETRY_S)

    async def _live(self) -> None:
        self._process = await asyncio.create_subprocess_exec(
            *(sys.executable, "-P", "-m", "lupin_bridge.fleet.watcher"),
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            limit=_MAX_LINE,
            process_group=0,
        )
        self.starts += 1
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        # Not on its command line, which others can read.
        self._process.stdin.write(self._settings + b"\n")
        while line := await self._process.stdout.readline():
            self._take(line)
        log.error("the process that watches the archive has ended; it is started again")
        self._down("the archive is not watched just now")

    async def _end(self) -> None:
        if self._process is not None and self._process.returncode is None:
            self._process.kill()
        if self._process is not None:
            await self._process.wait()

    async def _mind(self) -> None:
        while True:
            await asyncio.sleep(_LOOK_S)
            patience_s = STUCK_S if self.looks else _START_S
            if time.monotonic() - self._answered_s >= patience_s:
                self._down(f"the archive has not answered for {STUCK_S:g} s")

    def _take(self, line: bytes) -> None:
        found = orjson.loads(line)
        self._answered_s = time.monotonic()
        self.looks += 1
        if "down" in found:
            self._down(found["down"])
            return
        self._ahead_ns = found["now_ns"] - time.monotonic_ns()
        news = {site["site"]: read_site(site) for site in found["sites"]}
        if not self.archive.is_reachable:
            log.info("the archive is read")
        if not (news or found["gone"] or not self.archive.is_reachable):
            return
        known = {} if found["is_whole"] else self.sites
        sites = {name: site for name, site in known.items() if name not in found["gone"]} | news
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
