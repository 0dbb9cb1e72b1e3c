"""Forwards a journal to the archive, again and again until it is stopped.

A problem is reported once, in one line, and retried later; it does not affect the twin.

`Sink` is the archive's end: it appends a site's rows, one batch per transaction, each row once.

Notes also go the other way: those made in the fleet are handed to the twin, which writes them into
its journal. A note has one id everywhere, so it is written once in each.
"""

from __future__ import annotations

import asyncio
import json
import logging
import os
import socket
import sys
import time
from collections.abc import Awaitable, Callable
from contextlib import closing
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, Final

from lupin_bridge.archive.database import (
    CHANNEL,
    META_AGAIN,
    ArchiveError,
    UsageError,
    check_site,
    check_url,
    check_version,
    connect,
    explaining,
    place_of,
)
from lupin_bridge.archive.journal_reader import Batch, Epoch, Source, without_nul
from lupin_bridge.console import CommandError
from lupin_bridge.feed.tasks import Guard, end
from lupin_bridge.settings import Settings, option, variable
from lupin_twin.core.notes import KINDS, MAX_NOTES, SHELF_S, Note, NotesRequest, NotesUnwritable
from lupin_twin.core.past import DAY_NS, NotRemembered
from lupin_twin.core.state import NANOSECONDS_PER_SECOND
from lupin_twin.journal.retention import RECORD
from lupin_twin.journal.rows import last_row
from lupin_twin.journal.schema import (
    FILE_ERRORS,
    WRITTEN,
    Foreign,
    SiteLog,
    columns,
    insert_into,
    upsert_into,
)
from lupin_twin.journal.writes import notes, number_of

# How to write the tables whose rows change.
_CHANGING: Final = {
    **{table: upsert_into(table) for table in ("run", "hour", "tally")},
    "meta": f"{insert_into('meta')} {META_AGAIN}",
}
_EPOCH: Final = (
    "SELECT journal_id, epoch, seq_offset, run_offset, forwarded_seq FROM epoch"
    " WHERE site = :site ORDER BY epoch DESC LIMIT 1"
)
_RUNS: Final = "SELECT coalesce(max(run), 0) FROM run WHERE site = :site"
_NEW_EPOCH: Final = (
    "INSERT INTO epoch VALUES (:site, :number, :journal, now(), :seq_offset, :run_offset, 0)"
)
_FORWARDED: Final = (
    "UPDATE epoch SET forwarded_seq = :forwarded_seq WHERE site = :site AND epoch = :number"
)
_NO_EVENTS: Final = "DELETE FROM event WHERE site = :site AND run = :run AND stamp_ns >= :since"
_LOCK: Final = "SELECT pg_try_advisory_lock(hashtextextended(:name, 0))"
_OTHER: Final = (
    "SELECT machine, process, date_trunc('second', since) FROM forwarder WHERE site = :site"
)
# Notes of the fleet in one go, characters of one, and notes of a journal past which it takes none:
# more than people write.
_MAX_RETURNED: Final = 50
_MAX_TEXT: Final = 4_000
_MAX_KNOWN: Final = 100_000
_HERE: Final = (
    "INSERT INTO forwarder VALUES (:site, :machine, :process, now(), now())"
    " ON CONFLICT (site) DO UPDATE SET"
    " machine = excluded.machine, process = excluded.process, since = excluded.since"
)


class Sink:
    """A connection to the archive that writes a site, exclusively from `begin` on; in one thread.

    Raises:
        ArchiveError: no connection can be made.
        psycopg.Error: any other error of the database; also in every method.

    """

    def __init__(self, url: str, site: str) -> None:
        self._site = site
        self._connection: Any = connect(url, f"lupin-twin forward {site}")
        self._log = SiteLog(self._connection, site)
        # Days since 1970 whose months have their partitions.
        self._days: set[int] = set()
        self._read = NotesRequest()
        self._lacking: tuple[Note, ...] = ()

    def close(self) -> None:
        """Close the connection, so that others may write the site."""
        self._connection.close()

    def _lock(self) -> None:
        check_version(self._connection)
        execute = self._log.execute
        # The server releases the lock when the connection ends, for whatever reason.
        (is_ours,) = execute(_LOCK, {"name": f"lupin-twin forward {self._site}"}).fetchone()
        if not is_ours:
            other = execute(_OTHER).fetchone()
            holder = "{} (process {}) since {}".format(*other) if other else "another machine"
            raise ArchiveError(f"site {self._site} is already forwarded by {holder}: only one may")
        execute(_HERE, {"machine": socket.gethostname(), "process": os.getpid()})
        execute("INSERT INTO site VALUES (:site, '') ON CONFLICT DO NOTHING")

    def beat(self) -> None:
        """Note in the archive that this forwarder is alive, and can write."""
        self._log.execute("UPDATE forwarder SET heard_at = now() WHERE site = :site")

    def begin(self, source: Source, report: Callable[[str], None]) -> Epoch:
        """Lock the site; returns the epoch in which the journal goes on.

        A journal that is not the last one forwarded begins a new epoch. So does one that was
        restored from a copy: its numbers now belong to other rows.

        Raises:
            ArchiveError: the archive is of another version, or another forwarder writes the site.

        """
        self._lock()
        epoch = Epoch(self._site, 1, 0, 0, 0)
        if (found := self._log.execute(_EPOCH).fetchone()) is not None:
            journal_id, *numbers = found
            last = Epoch(self._site, *numbers)
            if journal_id == source.log.journal_id and self._goes_on(source, last):
                return last
            report(f"site {self._site} has a different journal than before: all of it is forwarded")
            (runs,) = self._log.execute(_RUNS).fetchone()
            seqs = last.seq_offset + last.forwarded_seq
            epoch = Epoch(self._site, last.number + 1, seqs, runs, 0)
        self._log.execute(_NEW_EPOCH, {**asdict(epoch), "journal": source.log.journal_id})
        return epoch

    def _goes_on(self, source: Source, last: Epoch) -> bool:
        if source.last_seq() < last.forwarded_seq:
            return False
        seq, _, arrival_ns = last_row(self._log, last.seq_offset + last.forwarded_seq)
        # A row of an earlier journal has no such number here.
        seq = max(0, seq - last.seq_offset)
        here, _, here_ns = last_row(source.log, seq)
        # A row that is not in the journal was deleted there.
        return not seq or here != seq or here_ns == arrival_ns

    def put(self, batch: Batch, epoch: Epoch) -> Epoch:
        """Append a batch, all or nothing; returns the epoch as it is now."""
        self._make_months(batch)
        with self._connection.pipeline(), self._connection.transaction():
            # First: later rows may be of a series with the same tag and sensors.
            for _, key, value in batch.rows.get("meta", ()):
                if key.startswith(RECORD):
                    record = json.loads(value)
                    gone = (without_nul(record["tag"]), record["seq"], record["what"] == "pose")
                    self._connection.execute("SELECT forget_tag(%s, %s, %s)", gone)
            for run, since_ns in batch.replaced:
                self._log.execute(_NO_EVENTS, {"run": run, "since": since_ns})
            for table, rows in batch.rows.items():
                sql = _CHANGING.get(table, f"{insert_into(table)} ON CONFLICT DO NOTHING")
                self._log.execute_many(sql, rows)
            epoch = replace(epoch, forwarded_seq=batch.upto)
            self._log.execute(_FORWARDED, asdict(epoch))
            self._log.execute("SELECT pg_notify(:channel, :site)", {"channel": CHANNEL})
        return epoch

    def lacking(self, source: Source) -> tuple[Note, ...]:
        """The notes of the archive that the journal lacks: the next ones to hand over."""
        found = notes(self._log, self._read)
        if found.notes is not None:
            self._read, self._lacking = NotesRequest(found.journal, found.count), found.notes
        if not self._lacking:
            return ()
        known, most = source.note_ids(), source.last_seq() + MAX_NOTES
        self._lacking = tuple(
            note for note in self._lacking if note.id not in known and _is_sound(note, most)
        )
        return self._lacking[: max(0, min(_MAX_RETURNED, _MAX_KNOWN - len(known)))]

    def _make_months(self, batch: Batch) -> None:
        """Create the partitions of the batch's months, and of the month after each."""
        days = {
            row[columns(table).index("stamp_ns")] // DAY_NS
            for table in WRITTEN
            for row in batch.rows.get(table, ())
        }
        for day in days - self._days:
            self._log.execute("SELECT make_months(:moment)", {"moment": day * 86_400})
            self._days.add(day)


def _is_sound(note: Note, most: int) -> bool:
    """Whether a person can have made a note: others may write to the archive too.

    A number above `most` is that of a journal before this one, or nonsense.
    """
    longest_ns = SHELF_S * NANOSECONDS_PER_SECOND
    return (
        note.kind in KINDS
        and number_of(note.id) <= most
        and sum(map(len, (note.id, note.by, note.subject, note.text))) <= _MAX_TEXT
        and (note.until_ns or 0) <= note.made_at_ns + longest_ns
    )


# --- again and again ------------------------------------------------------------------------------

log = logging.getLogger(__name__)

FIRST_WAIT_S: Final = 0.5
MAX_WAIT_S: Final = 5.0
# Interval of looking for new rows, and of the heartbeat in the archive.
_POLL_S: Final = 0.25
_HEARTBEAT_S: Final = 2.0


class Forwarder:
    """Forwards the journal that `path` finds, to a site of the archive.

    `give` hands a note of the fleet to the twin; it is called until the journal has it. None:
    nobody takes it.

    Raises:
        UsageError: the site or the address is invalid.

    """

    def __init__(
        self,
        url: str,
        site: str,
        path: Callable[[], Path],
        report: Callable[[str], None],
        give: Callable[[Note], None] | None = None,
    ) -> None:
        check_site("--site", site)
        check_url(url)
        self._url = url
        self._site = site
        self._path = path
        self._report = report
        self._give = give
        self._last_problem = ""
        self._wait_s = FIRST_WAIT_S

    def run(self, *, once: bool = False) -> bool:
        """Forward for ever, or `once` what is there; returns whether that succeeded."""
        while True:
            wrong = self._attempt(once=once)
            if once:
                return not wrong
            if wrong:
                time.sleep(self._wait_s)
                self._wait_s = min(2 * self._wait_s, MAX_WAIT_S)

    def _attempt(self, *, once: bool) -> bool:
        """Forward until the journal is replaced; True: there was a problem, which is reported."""
        try:
            path = self._path()
            try:
                with closing(Source(path)) as source, explaining():
                    self._forward(source, once=once)
            except (Foreign, OSError, *FILE_ERRORS) as error:
                raise ArchiveError(f"the journal {path} cannot be forwarded: {error}") from error
        except UsageError:
            raise
        except CommandError as error:
            if str(error) != self._last_problem:
                self._last_problem = str(error)
                again = "" if once else "; it will be retried"
                self._report(f"site {self._site} is not forwarded: {error}{again}")
            return True
        return False

    def _forward(self, source: Source, *, once: bool) -> None:
        # Even if the archive is down: from now on, the twin keeps what is not there yet.
        source.claim()
        with closing(Sink(self._url, self._site)) as sink:
            epoch = sink.begin(source, self._report)
            is_full, is_reported, beaten_s = True, False, 0.0
            while not source.is_replaced():
                if source.has_changed() or is_full:
                    batch = source.batch(epoch)
                    if batch:
                        epoch = sink.put(batch, epoch)
                    source.note(epoch.forwarded_seq)
                    is_full = batch.is_full
                if not is_reported:  # not earlier: a reachable archive may still refuse every batch
                    self._last_problem, self._wait_s, is_reported = "", FIRST_WAIT_S, True
                    self._report(f"site {self._site} is forwarded to {place_of(self._url)}")
                # Not earlier either: a forwarder that cannot write is not live.
                if time.monotonic() - beaten_s >= _HEARTBEAT_S:
                    beaten_s = time.monotonic()
                    sink.beat()
                    if self._give is not None:
                        for note in sink.lacking(source):
                            self._give(note)
                if once and not is_full:
                    return
                if not is_full:
                    time.sleep(_POLL_S)


# --- the process that `serve` starts, so that it never holds up the twin --------------------------

_LOOK_S: Final = 0.2
RESTART_S: Final = 5.0


def check(settings: Settings, role: str) -> None:
    """Refuse settings with which nothing can ever be forwarded.

    Raises:
        SettingError: such settings are given.

    """
    given = [name for name in ("site", "archive_url") if getattr(settings, name)]
    if not given:
        return
    if role == "web":
        raise settings.wrong(given[0], "is for the twin, not for lupin-twin web")
    if len(given) == 1:
        (other,) = {"site", "archive_url"} - {*given}
        raise settings.wrong(given[0], f"is given without {option(other)}, an archive needs both")
    check_site(settings.called("site"), settings.site)
    check_url(settings.archive_url)


class Forwarding:
    """Keeps a process that forwards, from construction to `stop`; restarts it whenever it ends.

    Without a site, there is none. `journal` returns the path of the twin's journal; empty: not
    known yet. `put` writes a note of the fleet into that.
    """

    def __init__(
        self,
        settings: Settings,
        journal: Callable[[], str],
        put: Callable[[Note], Awaitable[object]],
    ) -> None:
        self._journal = journal
        self._put = put
        # Not on its command line, which others can read.
        self._env = {
            **os.environ,
            variable("site"): settings.site,
            variable("archive_url"): settings.archive_url,
        }
        self._task = asyncio.create_task(self._keep(), name="forwarding")

    async def stop(self) -> None:
        """End the process, which is safe at any moment: the next one goes on from there."""
        await end(self._task)

    async def _keep(self) -> None:
        if not self._env[variable("site")]:
            return
        while not (journal := self._journal()):
            await asyncio.sleep(_LOOK_S)
        from lupin_bridge.feed.source import TwinUnavailableError  # noqa: PLC0415  # numpy

        words = ("forward", "--end-with-input", "--journal", journal)
        # If it is not written now, it comes again.
        known = NotesUnwritable, NotRemembered, TwinUnavailableError
        guard = Guard("a note of the fleet was not written", *known)
        while True:
            process = None
            try:
                process = await asyncio.create_subprocess_exec(
                    *(sys.executable, "-P", "-m", "lupin_bridge.cli.command", *words),
                    env=self._env,
                    stdin=asyncio.subprocess.PIPE,
                    stdout=asyncio.subprocess.PIPE,
                )
                assert process.stdout is not None
                async for line in process.stdout:
                    await guard.run(self._write(line))
                ended = f"has ended with code {await process.wait()}"
            except OSError as error:
                ended = f"cannot be started: {error}"
            finally:
                if process is not None and process.returncode is None:
                    process.kill()
                    await process.wait()
            log.error("the forwarder %s; it is restarted", ended)
            await asyncio.sleep(RESTART_S)

    async def _write(self, line: bytes) -> None:
        await self._put(Note(**json.loads(line)))
