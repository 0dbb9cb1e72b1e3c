# ruff: noqa: S608  # SQL is put together of constants and numbers
"""Tallies of the whole house: what was tried in each five minutes and each hour of a run.

Kept for ten years, so that a timeline reads no scan. Rows are counted in the order in which they
were written, each once, whatever its stamp; how far that has come stands in the file, and a reader
adds what came since. A disk that gets a page for each commit gets a few more in a minute.
"""

from __future__ import annotations

import sqlite3
from typing import Final

from lupin_twin.journal.rollups import get_meta, set_meta
from lupin_twin.past import HOUR_NS, SLOT_NS

# Rows that one step counts: some ten milliseconds, for observations wait behind it.
STEP: Final = 2_000
TALLIED: Final = "tallied_id"

KINDS: Final = ("scan", "failure", "look")
# Of each kind: how many, and the sum, the least and the largest of their values.
_PARTS: Final = ("n", "total", "low", "high")

# (which rows, their values) of a kind, among rows of `scan`; looks have a table of their own.
IN_SCAN: Final = {
    "scan": ("kind = 0 AND status = 0", "json_array_length(names)"),
    "failure": ("status != 0", "status"),
}
_IN_LOOK: Final = {"look": ("1", "bug_count")}
# Read in the order of writing.
FROM_SCAN: Final = (
    "scan CROSS JOIN series ON series.id = scan.series"
    " CROSS JOIN sensors ON sensors.id = series.sensors"
)
FROM_LOOK: Final = "look CROSS JOIN series ON series.id = look.series"


def tally_step(connection: sqlite3.Connection) -> bool:
    """Count some rows, in a transaction of the caller's; returns whether there may be more."""
    done = get_meta(connection, TALLIED)
    until, has_more = _until(connection, done)
    if until <= done:
        return False
    for table, source, kinds in (
        ("scan", FROM_SCAN, IN_SCAN),
        ("look", FROM_LOOK, _IN_LOOK),
    ):
        connection.execute(_counting(table, source, kinds), (done, until))
    hours = connection.execute(
        f"SELECT run, stamp_ns / {HOUR_NS} FROM {FROM_SCAN} WHERE scan.id > ?1 AND scan.id <= ?2"
        f" UNION SELECT run, stamp_ns / {HOUR_NS} FROM {FROM_LOOK}"
        " WHERE look.id > ?1 AND look.id <= ?2",
        (done, until),
    ).fetchall()
    connection.executemany(_HOUR, hours)
    set_meta(connection, **{TALLIED: until})
    return has_more


def purge_tallies(connection: sqlite3.Connection, run: int, before_ns: int) -> None:
    """Delete what is older than a stamp of a run."""
    for table, unit_ns in (("tally", SLOT_NS), ("tally_hour", HOUR_NS)):
        connection.execute(
            f"DELETE FROM {table} WHERE run = ? AND slot < ?",
            (run, before_ns // unit_ns),
        )
    connection.execute("DELETE FROM change WHERE run = ? AND stamp_ns < ?", (run, before_ns))


def _until(connection: sqlite3.Connection, done: int) -> tuple[int, bool]:
    """The last row that a step counts, and whether there are more."""
    reach, last = [], done
    for table in ("scan", "look"):
        (newest,) = connection.execute(f"SELECT max(id) FROM {table}").fetchone()
        last = max(last, newest or 0)
        found = connection.execute(
            f"SELECT id FROM {table} WHERE id > ? ORDER BY id LIMIT 1 OFFSET ?",
            (done, STEP - 1),
        ).fetchone()
        if found:
            reach.append(int(found[0]))
    until = min(reach, default=last)
    return until, until < last


def _counting(table: str, source: str, kinds: dict[str, tuple[str, str]]) -> str:
    counted, merged = [], []
    for kind, (which, value) in kinds.items():
        only = f"FILTER (WHERE {which})"
        counted += [
            f"count(*) {only}",
            f"coalesce(sum({value}) {only}, 0)",
            f"min({value}) {only}",
            f"max({value}) {only}",
        ]
        for part in ("n", "total"):
            column = f"{kind}_{part}"
            merged.append(f"{column} = coalesce({column}, 0) + excluded.{column}")
        for part, best in (("low", "min"), ("high", "max")):
            column = f"{kind}_{part}"
            both = f"{best}({column}, excluded.{column})"
            merged.append(f"{column} = coalesce({both}, {column}, excluded.{column})")
    into = ", ".join(f"{kind}_{part}" for kind in kinds for part in _PARTS)
    return (
        f"INSERT INTO tally (run, slot, first_ns, last_ns, gap_ns, {into})"
        f" SELECT run, stamp_ns / {SLOT_NS} AS slot, min(stamp_ns), max(stamp_ns), 0,"
        f" {', '.join(counted)} FROM {source} WHERE {table}.id > ? AND {table}.id <= ?"
        " GROUP BY run, slot ON CONFLICT (run, slot) DO UPDATE SET"
        " first_ns = min(first_ns, excluded.first_ns), last_ns = max(last_ns, excluded.last_ns),"
        f" {', '.join(merged)}"
    )


_AGGREGATE: Final = {"n": "sum", "total": "sum", "low": "min", "high": "max"}
# An hour is made anew of its slots. Within a slot there is no gap that anybody asks for.
_HOUR: Final = (
    "INSERT OR REPLACE INTO tally_hour SELECT run, ?2, min(first_ns), max(last_ns),"
    " coalesce(max(gap), 0), "
    + ", ".join(f"{_AGGREGATE[part]}({kind}_{part})" for kind in KINDS for part in _PARTS)
    + " FROM (SELECT *, first_ns - lag(last_ns) OVER (ORDER BY slot) AS gap FROM tally"
    f" WHERE run = ?1 AND slot >= ?2 * {HOUR_NS // SLOT_NS}"
    f" AND slot < (?2 + 1) * {HOUR_NS // SLOT_NS})"
)
