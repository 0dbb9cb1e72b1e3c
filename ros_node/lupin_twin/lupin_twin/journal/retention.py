"""What is given up, by age and by size, a little at a time: the oldest first.

Rows go by ranges of their numbers, which lie together in the file; the pages they leave are used
again, and what is left over is given back to the disk. Only what is in rollups and tallies already
goes.
"""

from __future__ import annotations

import sqlite3
from dataclasses import dataclass
from typing import Final

from lupin_twin.journal.rollups import get_meta, set_meta
from lupin_twin.journal.runs import Run
from lupin_twin.journal.tallying import TALLIED, purge_tallies
from lupin_twin.past import HOUR_NS

_DAY_NS: Final = 24 * HOUR_NS
ROLLUP_DAYS: Final = 3652  # ten years

# What one step deletes or moves: some ten milliseconds, for observations wait behind it.
_ROWS: Final = 300
_SERIES: Final = 200
_PAGES: Final = 128
# Free pages that are kept for what is written next: a hundredth of the file, and 256 at least.
_FREE_PAGES: Final = 256


# The limits stand in the file, for who looks at it without its twin.
KEPT_NS: Final = "kept_ns"
KEPT_BYTES: Final = "kept_bytes"
# With the number of a run behind it: see `purged_ns`.
_HORIZON: Final = "purged_ns:"


@dataclass(frozen=True, slots=True)
class Limits:
    """How long scans and looks are kept, and how large the file may be."""

    days: float
    max_bytes: int


def note_limits(connection: sqlite3.Connection, limits: Limits) -> None:
    """Have the limits in the file."""
    noted = {KEPT_NS: int(limits.days * _DAY_NS), KEPT_BYTES: limits.max_bytes}
    if any(get_meta(connection, key) != value for key, value in noted.items()):
        set_meta(connection, **noted)


def used_bytes(connection: sqlite3.Connection) -> int:
    """What is in use of the file."""
    pages, free, size = _pages(connection)
    return (pages - free) * size


def purge_step(connection: sqlite3.Connection, limits: Limits, now_ns: int) -> bool:
    """Delete some rows that are too old or too many; returns whether there may be more.

    `now_ns` is wall time: what a simulation said is as old as its arrival.
    """
    oldest = connection.execute(
        "SELECT scan.id, stamp_ns + lead_ns + 1000 * lag_us FROM scan"
        " JOIN series ON series.id = series JOIN run ON run.id = run ORDER BY scan.id LIMIT ?",
        (_ROWS,),
    ).fetchall()
    looks = connection.execute(
        "SELECT look.id, stamp_ns + lead_ns + 1000 * lag_us FROM look"
        " JOIN series ON series.id = series JOIN run ON run.id = run ORDER BY look.id LIMIT ?",
        (_ROWS,),
    ).fetchall()
    rolled_id = min(get_meta(connection, "rolled_id"), get_meta(connection, TALLIED))
    # Where both go on past what was read, only what both were read up to can go.
    reach = min((rows[-1][0] for rows in (oldest, looks) if len(rows) == _ROWS), default=rolled_id)
    known = [(n, arrival) for n, arrival in (*oldest, *looks) if n <= min(reach, rolled_id)]
    is_too_large = used_bytes(connection) > limits.max_bytes
    horizon_ns = now_ns - int(limits.days * _DAY_NS)
    last = max((n for n, arrival in known if is_too_large or arrival < horizon_ns), default=0)
    if not last:
        return False
    _keep_horizons(connection, last)
    connection.execute("DELETE FROM scan WHERE id <= ?", (last,))
    connection.execute("DELETE FROM look WHERE id <= ?", (last,))
    # The numbers go on when everything is gone.
    set_meta(connection, purged_id=max(last, get_meta(connection, "purged_id")))
    return True


def purged_ns(connection: sqlite3.Connection, run: Run) -> int:
    """The last stamp of a run of which something was given up; -1 if nothing was."""
    return get_meta(connection, f"{_HORIZON}{run.id}", -1)


def _keep_horizons(connection: sqlite3.Connection, last: int) -> None:
    for table in ("scan", "look"):
        for run, stamp_ns in connection.execute(
            f"SELECT run, max(stamp_ns) FROM {table}"  # noqa: S608  # a constant
            f" JOIN series ON series.id = series WHERE {table}.id <= ? GROUP BY run",
            (last,),
        ).fetchall():
            key = f"{_HORIZON}{run}"
            set_meta(connection, **{key: max(stamp_ns, get_meta(connection, key, -1))})


def purge_rollups_step(connection: sqlite3.Connection, now_ns: int, after_series: int) -> int:
    """Delete the rollups of some series that are past ten years; returns the last series, 0: done.

    `after_series` is what the last step returned, 0 at first.
    """
    series = connection.execute(
        "SELECT series.id, lead_ns FROM series JOIN run ON run.id = run"
        " WHERE series.id > ? ORDER BY series.id LIMIT ?",
        (after_series, _SERIES),
    ).fetchall()
    if not after_series:
        for run, lead_ns in connection.execute("SELECT id, lead_ns FROM run").fetchall():
            purge_tallies(connection, run, now_ns - ROLLUP_DAYS * _DAY_NS - lead_ns)
    for number, lead_ns in series:
        horizon = (now_ns - ROLLUP_DAYS * _DAY_NS - lead_ns) // HOUR_NS
        connection.execute("DELETE FROM rollup WHERE series = ? AND hour < ?", (number, horizon))
    return int(series[-1][0]) if len(series) == _SERIES else 0


def shrink_step(connection: sqlite3.Connection) -> bool:
    """Give some free pages back to the disk; returns whether there may be more."""
    pages, free, _ = _pages(connection)
    if free <= max(_FREE_PAGES, pages // 100):
        return False
    connection.execute(f"PRAGMA incremental_vacuum({_PAGES})").fetchall()
    return True


def _pages(connection: sqlite3.Connection) -> tuple[int, int, int]:
    pages, free, size = (
        int(connection.execute(f"PRAGMA {name}").fetchone()[0])
        for name in ("page_count", "freelist_count", "page_size")
    )
    return pages, free, size
