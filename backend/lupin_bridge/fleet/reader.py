"""The process that reads the sites' logs, in the archive in place of a journal.

One process answers for all open sites. A query has the name of its site in place of a journal's
path. Every SQL query of the log has its site as `:site`, and works with both engines: a `SiteLog`
stands in for a connection to a twin's own journal.
"""

from __future__ import annotations

import logging
from concurrent.futures import CancelledError
from contextlib import closing, suppress
from dataclasses import dataclass
from typing import Any, Final

from lupin_bridge.archive.database import (
    CHANNEL,
    ArchiveError,
    archive_url,
    connect,
    explaining,
    open_archive,
)
from lupin_bridge.feed.query import LogReader, Now, PastQuery
from lupin_bridge.feed.query import main as serve
from lupin_twin.core.notes import Note
from lupin_twin.core.parameters import World
from lupin_twin.core.past import FOREVER_NS, NotRemembered
from lupin_twin.core.state import Snapshot
from lupin_twin.field.explored import OccupancyMap, map_of
from lupin_twin.journal.appending import simulated
from lupin_twin.journal.fold import state_at
from lupin_twin.journal.retention import Stretches, kept
from lupin_twin.journal.rows import last_row
from lupin_twin.journal.runs import runs, span_at, world_of
from lupin_twin.journal.schema import MAP, DamagedFile, SiteLog
from lupin_twin.journal.writes import put_note
from lupin_twin.runtime.workers import ShouldStop

# A map is identified by a hash of its text, which is the same in all replicas.
_NEWER_MAP: Final = (
    "SELECT value, hashtextextended(value, 0) FROM meta WHERE site = :site AND key = :key"
    " AND hashtextextended(value, 0) <> :known"
)
# The last forwarded number of the site's journal, after which notes from here are numbered.
_FORWARDED: Final = "SELECT forwarded_seq FROM epoch WHERE site = :site ORDER BY epoch DESC LIMIT 1"
_WRITE_MS: Final = 5_000
logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Reported:
    """All tags as of the site's time now; what is kept of the past, and what of it is simulated.

    `is_wall_clock`: that time is wall-clock time, which goes on even while nothing comes. `world`
    is what the twin observes.
    """

    snapshot: Snapshot
    is_wall_clock: bool
    world: World
    kept_ns: Stretches
    simulated_ns: tuple[int, int] | None
    # Hash of the newest map; and the map itself, if it is another one than that of the query.
    map_hash: int
    occupancy_map: OccupancyMap | None


def _write_note(site: str, note: Note, should_stop: ShouldStop) -> Note:
    """Write a note into a site's log, at the primary; returns it with its id.

    Raises:
        ArchiveError: there is no archive that can be written, or it refuses.
        CancelledError: nobody waits for it any more, and it is not written.

    """
    with (
        explaining(),
        closing(connect(archive_url(), "lupin-twin fleet")) as connection,
        connection.transaction(),
    ):
        # Ends before its caller gives up: others also read over these few connections.
        connection.execute(f"SET LOCAL statement_timeout = {_WRITE_MS}")
        log = SiteLog(connection, site)
        (forwarded,) = log.execute(_FORWARDED).fetchone() or (0,)
        # Not after the last note: that may be of an earlier journal, which had far more rows.
        written = put_note(log, forwarded + 1, note)
        connection.execute("SELECT pg_notify(%s, %s)", (CHANNEL, site))
        if should_stop():
            raise CancelledError
        return written


def latest(known_map: int, frame_id: str, reader: LogReader) -> Reported:
    """A `PastQuery`: what a site's twin would report now, as far as its log has arrived.

    `known_map` is the hash of the map that is known already.
    """
    log = reader.connection
    every = runs(log.execute)
    span = span_at(every, FOREVER_NS)
    is_wall_clock = span is None or not span.is_simulated
    (now_ns,) = log.execute(
        "SELECT CAST(extract(epoch FROM now()) * 1000000000 AS BIGINT)"
    ).fetchone()
    _, stamp_ns, arrival_ns = last_row(log)
    if not is_wall_clock:
        now_ns = stamp_ns + max(0, now_ns - (arrival_ns or now_ns))
    # Includes stamps of a robot's clock that is a little ahead of this one: they were received.
    known = state_at(log, FOREVER_NS, frame_id)
    return Reported(
        Snapshot(max(now_ns, stamp_ns), frame_id, known.tags),
        is_wall_clock,
        world_of(log),
        kept(log),
        simulated(log),
        *_newer_map(log, known_map),
    )


def _newer_map(log: SiteLog, known: int) -> tuple[int, OccupancyMap | None]:
    row = log.execute(_NEWER_MAP, {"key": MAP, "known": known}).fetchone()
    text, found = row or ("", known)
    try:
        return found, map_of(text, found) if text else None
    except ValueError as error:
        logger.warning("the floor plan of %s cannot be read: %s", log.site, error)
        return found, None


class FromArchive:
    """An `Answerer` from the archive, each query in a transaction, over pooled connections."""

    def __init__(self) -> None:
        self._idle: list[Any] = []

    def __call__(self, query: PastQuery[Any] | Note, now: Now, should_stop: ShouldStop) -> Any:
        """Answer a query of a site, or write a note into its log."""
        site = now.condition.path
        try:
            if isinstance(query, Note):
                return _write_note(site, query, should_stop)
            connection = self._connection()
            try:
                with explaining(), connection.transaction():
                    return query(LogReader(SiteLog(connection, site), now, should_stop))
            except ArchiveError:
                connection.close()
                raise
            finally:
                if not connection.closed:
                    self._idle.append(connection)
        except ArchiveError as error:
            raise NotRemembered(str(error)) from error
        except DamagedFile as error:
            raise NotRemembered(f"rows of the site cannot be read: {error}") from error

    def _connection(self) -> Any:
        with suppress(IndexError):  # there is none
            while True:
                connection: Any = self._idle.pop()
                # A connection whose server has gone fails only when it is used.
                try:
                    with explaining():
                        connection.execute("SELECT 1")
                except ArchiveError:
                    connection.close()
                else:
                    return connection
        return open_archive(archive_url())


def main() -> None:
    """Answer the parent until it ends."""
    serve(FromArchive)
