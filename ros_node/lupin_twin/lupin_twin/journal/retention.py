"""What is given up, by age and by size, a little at a time: the oldest first.

Rows go by ranges of their numbers, which lie together in the file; the pages they leave are used
again, and what is left over is given back to the disk. Hours stay for ten years.
"""

from __future__ import annotations

import sqlite3
from dataclasses import dataclass
from typing import Final

from lupin_twin.journal.appending import PURGED_SEQ
from lupin_twin.journal.hours import delete_before, extent
from lupin_twin.journal.runs import runs, spans
from lupin_twin.journal.schema import LOCAL_SITE, get_meta, set_meta
from lupin_twin.journal.site_log import SiteLog
from lupin_twin.past import HOUR_NS

DAY_NS: Final = 24 * HOUR_NS
_HOURS_DAYS: Final = 3652  # ten years

# What one step deletes or moves: some ten milliseconds, for observations wait behind it.
_ROWS: Final = 300
_PAGES: Final = 128
# Free pages that are kept for what is written next: a hundredth of the file, and 256 at least.
_FREE_PAGES: Final = 256

# The limits stand in the file, for who looks at it without its twin.
KEPT_NS: Final = "kept_ns"
KEPT_BYTES: Final = "kept_bytes"
# With the number of a run behind it: see `purged_ns`.
_HORIZON: Final = "purged_ns:"
_LOST: Final = "lost_ns:"
# Stretches that are reported at most, the last ones.
_MAX_STRETCHES: Final = 16

# Of ROS time, `start <= stamp < end`, ns.
Stretches = tuple[tuple[int, int], ...]


@dataclass(frozen=True, slots=True)
class Limits:
    """How long scans and looks are kept, and how large the file may be."""

    days: float
    max_bytes: int


def note_limits(connection: sqlite3.Connection, limits: Limits) -> None:
    """Have the limits in the file."""
    for key, value in ((KEPT_NS, int(limits.days * DAY_NS)), (KEPT_BYTES, limits.max_bytes)):
        if get_meta(connection, key) != str(value):
            set_meta(connection, key, value)


def used_bytes(connection: sqlite3.Connection) -> int:
    """What is in use of the file."""
    pages, free, size = _pages(connection)
    return (pages - free) * size


def purged_ns(connection: sqlite3.Connection, run: int, site: str = LOCAL_SITE) -> int:
    """The last stamp of a run of which something was given up; -1 if nothing was."""
    found = get_meta(connection, f"{_HORIZON}{run}", site)
    return -1 if found is None else int(found)


def note_lost(connection: sqlite3.Connection, run: int, at_ns: int) -> None:
    """Have it in the file that some of what a run received up to a moment was never written."""
    before_ns = int(get_meta(connection, f"{_LOST}{run}") or -1)
    set_meta(connection, f"{_LOST}{run}", max(at_ns, before_ns))


def kept(connection: sqlite3.Connection) -> Stretches:
    """The stretches of ROS time of which all is here that their run has received.

    The first begins with the log, or with the first attempt in it, if that is of earlier.
    """
    log = SiteLog(connection)
    every = runs(connection.execute)
    found: list[tuple[int, int]] = []
    for number, span in enumerate(spans(every)):
        run = span.run.id
        lost_ns = int(get_meta(connection, f"{_LOST}{run}") or -1)
        start_ns = max(span.start_ns, purged_ns(connection, run) + 1, lost_ns + 1)
        if number == 0 and start_ns == 0:
            begun = [each.begun.stamp_ns for each in every if each.root == run]
            start_ns = min(*begun, *(extent(log, run) or begun))
        if found and found[-1][1] == start_ns:
            found[-1] = found[-1][0], span.end_ns
        elif start_ns < span.end_ns:
            found.append((start_ns, span.end_ns))
    return tuple(found[-_MAX_STRETCHES:])


def horizon_ns(connection: sqlite3.Connection, limits: Limits, now_ns: int) -> int:
    """What was received before this, by the wall's clock, goes now.

    That clock may be ahead: what was received last tells how far it has come, and no more than a
    day of what is there goes at once.
    """
    received = [
        connection.execute(
            f"SELECT arrival_ns FROM {table} WHERE site = ? ORDER BY seq {way} LIMIT 1",  # noqa: S608
            (LOCAL_SITE,),
        ).fetchone()
        for way in ("ASC", "DESC")
        for table in ("scan", "look")
    ]
    first = min((row[0] for row in received[:2] if row), default=now_ns)
    last = max((row[0] for row in received[2:] if row), default=now_ns)
    return min(min(now_ns, last) - int(limits.days * DAY_NS), first + DAY_NS)


def purge_step(
    connection: sqlite3.Connection,
    limits: Limits,
    before_ns: int,
    forwarded_seq: int | None = None,
) -> bool:
    """Delete some rows that are too old or too many; returns whether there may be more.

    Of what is too old, rows past `forwarded_seq` stay: the archive does not have them yet.
    """
    oldest = sorted(
        row
        for table in ("scan", "look")
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
    _keep_horizons(connection, last)
    for table in ("scan", "look"):
        connection.execute(
            f"DELETE FROM {table} WHERE site = ? AND seq <= ?",  # noqa: S608  # constants
            (LOCAL_SITE, last),
        )
    # The numbers go on when everything is gone.
    set_meta(connection, PURGED_SEQ, last)
    return True


def holds_older(connection: sqlite3.Connection, before_ns: int) -> bool:
    """Whether rows are there that are too old: they wait to be forwarded."""
    return any(
        row[0] < before_ns
        for table in ("scan", "look")
        for row in connection.execute(
            f"SELECT arrival_ns FROM {table} WHERE site = ? ORDER BY seq LIMIT 1",  # noqa: S608
            (LOCAL_SITE,),
        )
    )


def _keep_horizons(connection: sqlite3.Connection, last: int) -> None:
    for run, stamp_ns in connection.execute(
        "SELECT run, max(stamp_ns) FROM (SELECT run, stamp_ns FROM scan JOIN series"
        " ON series.site = scan.site AND series.series = scan.series"
        " WHERE scan.site = :site AND seq <= :last"
        " UNION ALL SELECT run, stamp_ns FROM look WHERE site = :site AND seq <= :last)"
        " GROUP BY run",
        {"site": LOCAL_SITE, "last": last},
    ).fetchall():
        set_meta(connection, f"{_HORIZON}{run}", max(stamp_ns, purged_ns(connection, run)))


def purge_hours(connection: sqlite3.Connection, now_ns: int) -> None:
    """Delete the hours that are past ten years; what a simulation said is as old as its arrival."""
    for run in runs(connection.execute):
        delete_before(SiteLog(connection), run.id, now_ns - run.lead_ns - _HOURS_DAYS * DAY_NS)


def shrink_step(connection: sqlite3.Connection) -> bool:
    """Give some free pages back to the disk; returns whether there are more."""
    pages, free, _ = _pages(connection)
    spare = free - max(_FREE_PAGES, pages // 100)
    if spare <= 0:
        return False
    # A script: `execute` would take the first of its steps alone, which is one page.
    connection.executescript(f"PRAGMA incremental_vacuum({min(spare, _PAGES)})")
    return spare > _PAGES


def _pages(connection: sqlite3.Connection) -> tuple[int, int, int]:
    pages, free, size = (
        int(connection.execute(f"PRAGMA {name}").fetchone()[0])
        for name in ("page_count", "freelist_count", "page_size")
    )
    return pages, free, size
