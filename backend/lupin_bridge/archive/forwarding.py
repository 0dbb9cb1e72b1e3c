"""Forwarding a journal to the archive: again and again until it is asked to end.

Whatever is wrong is said once, in one line, and tried again later; the twin has no part in it.
"""

from __future__ import annotations

import asyncio
import logging
import os
import sys
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Final

from lupin_bridge.archive.database import (
    ArchiveError,
    UsageError,
    check_site,
    check_url,
    explained,
    place_of,
)
from lupin_bridge.archive.sink import Sink
from lupin_bridge.archive.source import Source
from lupin_bridge.feed.shared_work import end
from lupin_bridge.settings import SettingError, Settings, option, variable
from lupin_twin.journal.schema import FILE_ERRORS, Foreign

log = logging.getLogger(__name__)

FIRST_WAIT_S: Final = 0.5
MAX_WAIT_S: Final = 5.0
# How often is looked for what is new, and how often the archive is told that this lives.
_POLL_S: Final = 0.25
_HEARTBEAT_S: Final = 2.0


class Forwarder:
    """Forwards the journal that `path` finds, to a site of the archive.

    Raises:
        UsageError: the site or the address cannot be.

    """

    def __init__(
        self, url: str, site: str, path: Callable[[], Path], say: Callable[[str], None]
    ) -> None:
        check_site(site)
        check_url(url)
        self._url = url
        self._site = site
        self._path = path
        self._say = say
        self._told = ""
        self._wait_s = FIRST_WAIT_S

    def run(self, *, once: bool = False) -> bool:
        """Forward for ever, or `once` what is there; returns whether that was done."""
        while True:
            wrong = self._try(once=once)
            if once:
                return not wrong
            if wrong:
                time.sleep(self._wait_s)
                self._wait_s = min(2 * self._wait_s, MAX_WAIT_S)

    def _try(self, *, once: bool) -> bool:
        """Forward until something is wrong, which is said, or the journal is another one."""
        import psycopg  # noqa: PLC0415  # see `database`

        try:
            path = self._path()
            try:
                with closing(Source(path)) as source:
                    self._forward(source, once=once)
            except (Foreign, OSError, *FILE_ERRORS) as error:
                raise ArchiveError(f"the journal {path} cannot be forwarded: {error}") from error
            except psycopg.Error as error:
                raise explained(error) from error
        except UsageError:
            raise
        except ArchiveError as error:
            if str(error) != self._told:
                self._told = str(error)
                again = "" if once else "; it will be retried"
                self._say(f"site {self._site} is not forwarded: {error}{again}")
            return True
        return False

    def _forward(self, source: Source, *, once: bool) -> None:
        # Without an archive too: from now on the twin keeps what is not there.
        source.claim()
        with closing(Sink(self._url, self._site)) as sink:
            epoch = sink.begin(source, self._say)
            is_full, is_said, received_s = True, False, time.monotonic()
            while not source.is_replaced():
                if source.has_changed() or is_full:
                    batch = source.batch(epoch)
                    if batch:
                        epoch = sink.put(batch, epoch)
                    source.was_sent(batch, epoch)
                    is_full = batch.is_full
                if not is_said:  # one that is reached may still take nothing, time after time
                    self._told, self._wait_s, is_said = "", FIRST_WAIT_S, True
                    self._say(f"site {self._site} is forwarded to {place_of(self._url)}")
                if once and not is_full:
                    return
                if time.monotonic() - received_s >= _HEARTBEAT_S:
                    received_s = time.monotonic()
                    sink.heard()
                if not is_full:
                    time.sleep(_POLL_S)


# --- the process that `serve` starts, so that it never holds up the twin --------------------------

_LOOK_S: Final = 0.2
_RESTART_S: Final = 5.0


def check(settings: Settings, role: str) -> None:
    """Refuse what can never be forwarded.

    Raises:
        SettingError: it is asked for.

    """
    given = [name for name in ("site", "archive_url") if getattr(settings, name)]
    if not given:
        return
    called = settings.called(given[0])
    if role == "web":
        raise SettingError(f"{called} is for the twin, not for lupin-twin web")
    if len(given) == 1:
        (other,) = {"site", "archive_url"} - {*given}
        raise SettingError(f"{called} is given without {option(other)}, an archive needs both")
    try:
        check_site(settings.site)
        check_url(settings.archive_url)
    except UsageError as error:
        raise SettingError(str(error)) from None


class Forwarding:
    """The process, from construction to `stop`; started again whenever it has ended.

    Without a site there is none. `journal` is the path of the twin's journal, empty while it is
    not known.
    """

    def __init__(self, settings: Settings, journal: Callable[[], str]) -> None:
        self._journal = journal
        # Not on its command line, which others can read.
        self._env = {
            **os.environ,
            variable("site"): settings.site,
            variable("archive_url"): settings.archive_url,
        }
        self._process: asyncio.subprocess.Process | None = None
        self._task = asyncio.create_task(self._keep(), name="forwarding")

    async def stop(self) -> None:
        """End it, at any moment: it goes on from there another time."""
        await end(self._task)
        if self._process is not None and self._process.returncode is None:
            self._process.kill()
            await self._process.wait()

    async def _keep(self) -> None:
        if not self._env[variable("site")]:
            return
        while not (journal := self._journal()):
            await asyncio.sleep(_LOOK_S)
        words = ("forward", "--end-with-input", "--journal", journal)
        while True:
            try:
                self._process = await asyncio.create_subprocess_exec(
                    *(sys.executable, "-P", "-m", "lupin_bridge.cli.command", *words),
                    env=self._env,
                    stdin=asyncio.subprocess.PIPE,
                )
                ended = f"has ended with code {await self._process.wait()}"
            except OSError as error:
                ended = f"cannot be started: {error}"
            log.error("the forwarder %s; it is started again", ended)
            await asyncio.sleep(_RESTART_S)
