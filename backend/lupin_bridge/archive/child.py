"""The forwarder that `serve` starts: a process of its own, so that it never holds up the twin."""

from __future__ import annotations

import asyncio
import logging
import os
import sys
from collections.abc import Callable
from typing import Final

from lupin_bridge.archive.database import UsageError, check_site, check_url
from lupin_bridge.feed.shared_work import end
from lupin_bridge.settings import SettingError, Settings, option, variable

log = logging.getLogger(__name__)

_POLL_S: Final = 0.2
_WAIT_S: Final = 5.0


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
            await asyncio.sleep(_POLL_S)
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
            await asyncio.sleep(_WAIT_S)
