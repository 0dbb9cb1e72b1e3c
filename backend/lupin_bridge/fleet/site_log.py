"""One site's log in the archive, in the place of a connection to a twin's own journal.

Every query of the log names its site `:site` and is understood by both engines. So whoever reads a
journal reads a site of the archive, and gets the same answer.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from concurrent.futures import CancelledError
from contextlib import closing
from dataclasses import dataclass
from typing import Any, Final

from lupin_bridge.archive.database import CHANNEL, ArchiveError, check_version, connect, explained
from lupin_bridge.settings import variable
from lupin_twin.core.notes import Note
from lupin_twin.journal.notes import last_number, put_note
from lupin_twin.journal.schema import SiteLog
from lupin_twin.runtime.workers import ShouldStop

_NOTHING: Final[Mapping[str, Any]] = {}
# A question that takes longer is given up: nobody waits for its answer any more.
_MAX_MS: Final = 10_000

# The number up to which the site's journal has come, by which its own notes are known.
_FORWARDED: Final = "SELECT forwarded_seq FROM epoch WHERE site = :site ORDER BY epoch DESC LIMIT 1"


@dataclass(frozen=True, slots=True)
class SiteConnection:
    """Reads one site by a connection of psycopg, whatever site a query names."""

    connection: Any
    site: str

    def execute(self, sql: str, values: Mapping[str, Any] = _NOTHING) -> Any:
        """A cursor; its rows come as tuples."""
        return SiteLog(self.connection, self.site).execute(sql, values)

    def meta(self, key: str) -> str | None:
        """See `SiteLog`."""
        return SiteLog(self.connection, self.site).meta(key)

    def transaction(self) -> Any:
        """See psycopg."""
        return self.connection.transaction()

    @property
    def info(self) -> Any:
        """See psycopg: whether a transaction is open."""
        return self.connection.info


def archive_url() -> str:
    """Where the archive is: not on the command line of a process, which others can read."""
    return os.environ[variable("archive_url")]


def open_archive(url: str, name: str) -> Any:
    """A connection that cannot write, to the primary or to a standby.

    Raises:
        ArchiveError: there is no archive that can be read; `UsageError`: no later try helps.

    """
    import psycopg  # noqa: PLC0415  # the extra `fleet`

    connection = connect(url, name, session="any")
    try:
        connection.read_only = True
        # All that is read in one transaction is of one moment.
        connection.isolation_level = psycopg.IsolationLevel.REPEATABLE_READ
        connection.execute(f"SET statement_timeout = {_MAX_MS}")
        check_version(connection)
    except psycopg.Error as error:
        connection.close()
        raise explained(error) from error
    except ArchiveError:
        connection.close()
        raise
    return connection


def write_note(site: str, note: Note, should_stop: ShouldStop) -> Note:
    """Write what somebody said into a site's log, at the primary; returns it with its id.

    Raises:
        ArchiveError: there is no archive that can be written; `psycopg.Error`: it refuses.
        CancelledError: nobody waits for it any more, and it is not written.

    """
    with (
        closing(connect(archive_url(), "lupin-twin fleet")) as connection,
        connection.transaction(),
    ):
        log = SiteLog(connection, site)
        (forwarded,) = log.execute(_FORWARDED).fetchone() or (0,)
        # Behind all that were forwarded, and before those that the twin has yet to write.
        written = put_note(log, max(forwarded, last_number(log)) + 1, note)
        connection.execute("SELECT pg_notify(%s, %s)", (CHANNEL, site))
        if should_stop():
            raise CancelledError
        return written
