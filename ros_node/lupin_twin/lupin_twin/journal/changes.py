"""Pests seen and cleared: the looks that differ from the look before them, as rows of their own.

They are few. Kept with each look that is written, in the same transaction: one that comes late
may be the change, in the place of the next one, and make the next one a change or none.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Callable

from lupin_twin.journal.rows import LookRow

_Execute = Callable[..., sqlite3.Cursor]


def put_change(execute: _Execute, number: int, at: tuple[int, int], look: LookRow) -> None:
    """Keep what a look, the newest write, changes; `at` are the numbers of its run and its tag."""
    anomaly = int(look.flower.anomaly)
    found = execute(
        "SELECT anomaly FROM change WHERE run = ? AND tag = ? AND stamp_ns <= ?"
        " ORDER BY stamp_ns DESC, id DESC LIMIT 1",
        (*at, look.stamp_ns),
    ).fetchone()
    # A tag without a look has no pest.
    if anomaly == (found[0] if found else 0):
        return
    _put(execute, number, at, (look.stamp_ns, anomaly, look.flower.bug_count))
    following = execute(
        "SELECT look.id, stamp_ns, anomaly, bug_count FROM series"
        " CROSS JOIN look ON look.series = series.id"
        " WHERE run = ? AND tag = ? AND kind = 1 AND stamp_ns > ?"
        " ORDER BY stamp_ns, look.id LIMIT 1",
        (*at, look.stamp_ns),
    ).fetchone()
    if following is None:
        return
    if following[2] == anomaly:
        execute("DELETE FROM change WHERE id = ?", following[:1])
    else:
        _put(execute, following[0], at, following[1:])


def _put(execute: _Execute, number: int, at: tuple[int, int], told: tuple[int, int, int]) -> None:
    execute("INSERT OR IGNORE INTO change VALUES (?, ?, ?, ?, ?, ?)", (number, *at, *told))
