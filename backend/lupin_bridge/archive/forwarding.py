"""Forwarding a journal to the archive: again and again until it is asked to end.

Whatever is wrong is said once, in one line, and tried again later; the twin has no part in it.
"""

from __future__ import annotations

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
from lupin_twin.journal.schema import FILE_ERRORS, Foreign

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
                again = "" if once else "; it is tried again and again"
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
