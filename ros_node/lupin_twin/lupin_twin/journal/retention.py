"""Deletes rows by age and by size, the oldest first and a few at a time; and tags on request.

Rows are deleted by ranges of their numbers, which lie together in the file. Freed pages are used
again, and surplus ones are given back to the disk. Hourly counts stay.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from lupin_twin.core.past import DAY_NS, HOUR_NS
from lupin_twin.journal.appending import LAST_SEQ, PURGED_SEQ, Appender
from lupin_twin.journal.counts import DELETED, FORGOTTEN, deleted_ns, extent
from lupin_twin.journal.paths import writing_alone
from lupin_twin.journal.rows import noted_number, outermost
from lupin_twin.journal.runs import runs, spans
from lupin_twin.journal.schema import (
    LOCAL_SITE,
    WRITTEN,
    NotPossible,
    SiteLog,
    set_meta,
    transaction,
)

# What one step deletes or moves: about ten milliseconds, because observations wait meanwhile.
_ROWS: Final = 300
_PAGES: Final = 128
# Free pages that stay in the file for new rows: a hundredth of the file, but at least 256.
_FREE_PAGES: Final = 256

# Followed by the number of a run: the time up to which some of its rows were lost.
_LOST: Final = "lost_ns:"
# At most this many periods are reported: the last ones.
_MAX_STRETCHES: Final = 16

# Periods of ROS time, `start <= stamp < end`, ns.
Stretches = tuple[tuple[int, int], ...]


@dataclass(frozen=True, slots=True)
class Limits:
    """How long scans and inspections are kept, and how large the file may be."""

    days: float
    max_bytes: int


def used_bytes(connection: sqlite3.Connection) -> int:
    """Bytes of the file that are in use."""
    pages, free, size = pages_of(connection)
    return (pages - free) * size


def note_lost(connection: sqlite3.Connection, run: int, at_ns: int) -> None:
    """Write that some of what a run received up to a moment was never written."""
    before_ns = noted_number(SiteLog(connection), f"{_LOST}{run}", -1)
    set_meta(connection, f"{_LOST}{run}", max(at_ns, before_ns))


def kept(connection: sqlite3.Connection) -> Stretches:
    """The periods of ROS time for which everything that their run received is here.

    The first begins with the journal, or with its first attempt if that has an earlier stamp.
    """
    log = SiteLog(connection)
    every = runs(connection.execute)
    found: list[tuple[int, int]] = []
    for number, span in enumerate(spans(every)):
        run = span.run
        lost_ns = noted_number(log, f"{_LOST}{run}", -1)
        start_ns = max(span.start_ns, deleted_ns(log, run) + 1, lost_ns + 1)
        if number == 0 and start_ns == 0:
            begun = [each.begun.stamp_ns for each in every if each.root == run]
            start_ns = min(*begun, *(extent(log, run) or begun))
        if found and found[-1][1] == start_ns:
            found[-1] = found[-1][0], span.end_ns
        elif start_ns < span.end_ns:
            found.append((start_ns, span.end_ns))
    return tuple(found[-_MAX_STRETCHES:])


def horizon_ns(connection: sqlite3.Connection, limits: Limits, now_ns: int) -> int:
    """Return the wall time before which rows that were received are deleted now.

    The wall clock may be ahead. So the last arrival limits it, and one round, each minute, deletes
    an hour of data at most. A wrong clock that is soon corrected costs little.
    """
    log = SiteLog(connection)
    first = min((row[2] for row in outermost(log, "ASC")), default=now_ns)
    last = max((row[2] for row in outermost(log, "DESC")), default=now_ns)
    return min(min(now_ns, last) - int(limits.days * DAY_NS), first + HOUR_NS)


def purge_step(
    connection: sqlite3.Connection,
    limits: Limits,
    before_ns: int,
    forwarded_seq: int | None = None,
) -> bool:
    """Delete some rows that are too old or too many; returns whether there may be more.

    Rows that are too old but past `forwarded_seq` stay: the archive does not have them yet.
    """
    oldest = sorted(
        row
        for table in WRITTEN
        for row in connection.execute(
            f"SELECT seq, arrival_ns FROM {table} WHERE site = ? ORDER BY seq LIMIT ?",  # noqa: S608
            (LOCAL_SITE, _ROWS),
        )
    )[:_ROWS]
    is_too_large = used_bytes(connection) > limits.max_bytes
    last = 0
    for seq, arrival_ns in oldest:
        is_too_old = arrival_ns < before_ns and (forwarded_seq is None or seq <= forwarded_seq)
        if not (is_too_large or is_too_old):
            break
        last = seq
    if not last:
        return False
    _write_horizons(connection, last)
    delete_up_to(connection, last)
    # Numbers continue from here even if no row is left.
    set_meta(connection, PURGED_SEQ, last)
    return True


def delete_up_to(connection: sqlite3.Connection, last: int) -> None:
    """Delete the scans and inspections up to a number."""
    for table in WRITTEN:
        text = f"DELETE FROM {table} WHERE site = ? AND seq <= ?"  # noqa: S608  # constants
        connection.execute(text, (LOCAL_SITE, last))


def unmet_limit(connection: sqlite3.Connection, limits: Limits, before_ns: int) -> str:
    """Which limit is exceeded although nothing more can be deleted, in words; empty if none."""
    if used_bytes(connection) > limits.max_bytes:
        return "no scans are kept: the hours, which are never deleted, exceed journal_max_mb"
    if any(row[2] < before_ns for row in outermost(SiteLog(connection), "ASC")):
        return "what is older than journal_days is kept until it is forwarded"
    return ""


def _write_horizons(connection: sqlite3.Connection, last: int) -> None:
    for run, stamp_ns in connection.execute(
        "SELECT run, max(stamp_ns) FROM (SELECT run, stamp_ns FROM scan JOIN series"
        " ON series.site = scan.site AND series.series = scan.series"
        " WHERE scan.site = :site AND seq <= :last"
        " UNION ALL SELECT run, stamp_ns FROM look WHERE site = :site AND seq <= :last)"
        " GROUP BY run",
        {"site": LOCAL_SITE, "last": last},
    ).fetchall():
        set_meta(connection, f"{DELETED}{run}", max(stamp_ns, deleted_ns(SiteLog(connection), run)))


def shrink_step(connection: sqlite3.Connection) -> bool:
    """Give some free pages back to the disk; returns whether there are more."""
    pages, free, _ = pages_of(connection)
    spare = free - max(_FREE_PAGES, pages // 100)
    if spare <= 0:
        return False
    # As a script, because `execute` would do only its first step, which frees one page.
    connection.executescript(f"PRAGMA incremental_vacuum({min(spare, _PAGES)})")
    return spare > _PAGES


def pages_of(connection: sqlite3.Connection) -> tuple[int, int, int]:
    """How many pages a file has, how many of them are free, and their size."""
    pages, free, size = (
        int(connection.execute(f"PRAGMA {name}").fetchone()[0])
        for name in ("page_count", "freelist_count", "page_size")
    )
    return pages, free, size


RECORD: Final = "forgotten:"
_POSE: Final = "pose"
_OF_TAG: Final = "site = :site AND tag = :tag"
_OF_SERIES: Final = (
    f"site = :site AND series IN (SELECT series FROM series WHERE {_OF_TAG} AND series <= :upto)"  # noqa: S608
)


# Numbers of scans, inspections and places of a tag that were deleted.
Forgotten = tuple[int, int, int]


def forget(path: Path, tag_id: str, *, pose_only: bool, by: str, at_ns: int) -> Forgotten:
    """Delete a tag's places, or everything about it; `at_ns` is now, in wall time.

    Counts of the whole site (tallies) stay as they are.

    Raises:
        InUse: a twin writes it.
        NotPossible: the journal has no such tag, or no place of it.
        Empty, Foreign, DamagedFile, sqlite3.Error, OSError: as `open_named`.

    """
    with writing_alone(path, "lupin-twin journal forget") as connection, transaction(connection):
        _check_known(connection, path, tag_id)
        # Numbers continue from here even if the latest rows are deleted.
        last_seq = Appender(connection).last_seq
        set_meta(connection, LAST_SEQ, last_seq)
        forgotten = delete_tag(connection, tag_id, last_seq, pose_only=pose_only)
        if pose_only and not forgotten[-1]:
            raise NotPossible(f"the journal {path} has no place of tag {tag_id!r}")
        what = _POSE if pose_only else "all"
        log = SiteLog(connection)
        for run in runs(connection.execute):
            if (attempts := extent(log, run.id)) is not None:
                set_meta(connection, f"{FORGOTTEN}{run.id}", attempts[1])
        record = {"tag": tag_id, "what": what, "by": by, "at": at_ns, "seq": last_seq}
        number = 1 + sum(1 for _ in records(connection))
        set_meta(connection, f"{RECORD}{number}", json.dumps(record))
    return forgotten


def records(connection: sqlite3.Connection) -> Iterator[Mapping[str, object]]:
    """The records of what was forgotten, the oldest first.

    Keys: `tag`, `what`, `by`, `at` (ns of wall time), `seq` (the last number given before it).
    """
    found = connection.execute(
        "SELECT value FROM meta WHERE key LIKE ? ORDER BY length(key), key", (f"{RECORD}%",)
    )
    return (json.loads(text) for (text,) in found)


def _check_known(connection: sqlite3.Connection, path: Path, tag_id: str) -> None:
    query = {"site": LOCAL_SITE, "tag": tag_id}
    for table in ("series", "place"):
        found = connection.execute(f"SELECT 1 FROM {table} WHERE {_OF_TAG} LIMIT 1", query)  # noqa: S608
        if found.fetchone() is not None:
            return
    raise NotPossible(f"the journal {path} has no tag {tag_id!r}")


def delete_recorded(connection: sqlite3.Connection, record: str) -> None:
    """Repeat a deletion in a copy of the journal, from one of its `records`, as JSON.

    Raises:
        ValueError, KeyError, TypeError: it is not a record.

    """
    found = json.loads(record)
    is_pose = found["what"] == _POSE
    delete_tag(connection, found["tag"], found["seq"], pose_only=is_pose)


def delete_tag(
    connection: sqlite3.Connection, tag_id: str, upto: int, *, pose_only: bool
) -> Forgotten:
    """Delete a tag's places, or everything about it, up to a number."""

    def gone(table: str, which: str) -> int:
        query = {"site": LOCAL_SITE, "tag": tag_id, "upto": upto}
        return connection.execute(f"DELETE FROM {table} WHERE {which}", query).rowcount  # noqa: S608

    of_tag = f"{_OF_TAG} AND seq <= :upto"
    places = gone("place", of_tag)
    if pose_only:
        return 0, 0, places
    gone("hour", _OF_SERIES)
    gone("event", of_tag)
    scans, inspections = gone("scan", _OF_SERIES), gone("look", of_tag)
    gone("series", f"{_OF_TAG} AND series <= :upto")
    return scans, inspections, places
