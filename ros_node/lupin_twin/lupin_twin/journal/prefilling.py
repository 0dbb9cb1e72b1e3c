"""A past for a journal that has none: rows of a simulation, marked as such in the file.

The mark is for whoever shows them: nobody may take them for what a robot has observed.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Sequence
from pathlib import Path
from typing import Final, NamedTuple

from lupin_twin.journal.appending import Appender
from lupin_twin.journal.lock import Lock
from lupin_twin.journal.rollups import get_meta, set_meta
from lupin_twin.journal.rows import Row
from lupin_twin.journal.runs import Clock, Run
from lupin_twin.journal.schema import open_writer, transaction

_FROM: Final = "simulated_from_ns"
_UNTIL: Final = "simulated_until_ns"


class Stretch(NamedTuple):
    """From one moment of ROS time to another, ns."""

    start_ns: int
    end_ns: int


def is_empty(connection: sqlite3.Connection) -> bool:
    """Whether nothing was ever observed into a journal."""
    rows = [
        connection.execute(f"SELECT 1 FROM {table} LIMIT 1").fetchone()  # noqa: S608  # constants
        for table in ("scan", "look", "pin", "rollup")
    ]
    return rows == [None] * 4 and not get_meta(connection, "purged_id")


def prefill(path: Path, holder: str, rows: Sequence[Row], until_ns: int) -> bool:
    """Write rows of wall time into a journal that is new or empty, all or none.

    `rows` are in the order of their stamps, all before `until_ns`. Returns whether it was done:
    into a journal that anybody has ever recorded, nothing is written.

    Raises:
        InUse: a twin has it.
        Foreign, DamagedFile, sqlite3.Error, OSError: it cannot be written.

    """
    if not rows:
        return False
    path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    with Lock(path, holder):
        connection = open_writer(path)
        try:
            if not is_empty(connection):
                return False
            first = rows[0]
            run = Run(1, Clock(first.stamp_ns, first.arrival_ns, is_simulated=False))
            with transaction(connection):
                # Of twins that have heard nothing.
                connection.execute("DELETE FROM run")
                connection.execute(
                    "INSERT INTO run VALUES (?, 0, ?, ?, 0, NULL, 0, NULL)",
                    (run.id, run.begun.stamp_ns, run.begun.arrival_ns),
                )
                Appender(connection).append(run, rows)
                set_meta(connection, **{_FROM: first.stamp_ns, _UNTIL: until_ns})
        finally:
            connection.close()
    return True


def simulated(connection: sqlite3.Connection) -> Stretch | None:
    """The stretch of a journal that was filled in, None if nothing was."""
    until_ns = get_meta(connection, _UNTIL)
    return Stretch(get_meta(connection, _FROM), until_ns) if until_ns else None
