"""A past for a journal that has none: rows of a simulation, marked as such in the file.

The mark is for whoever shows them: nobody may take them for what a robot has observed.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import Final, NamedTuple

from lupin_twin.journal.appending import Appender
from lupin_twin.journal.lock import Lock
from lupin_twin.journal.rows import Row
from lupin_twin.journal.schema import LOCAL_SITE, get_meta, open_writer, set_meta, transaction

_FROM: Final = "simulated_from_ns"
_UNTIL: Final = "simulated_until_ns"
_LOT: Final = 1_000


class Stretch(NamedTuple):
    """From one moment of ROS time to another, ns."""

    start_ns: int
    end_ns: int


def is_empty(connection: sqlite3.Connection) -> bool:
    """Whether nothing was ever observed into a journal."""
    return not Appender(connection).last_seq


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
    with Lock(path, holder), closing(open_writer(path)) as connection:
        if not is_empty(connection):
            return False
        first = rows[0]
        with transaction(connection):
            # Of twins that have heard nothing.
            connection.execute("DELETE FROM run")
            connection.execute(
                "INSERT INTO run VALUES (?, 1, 0, ?, ?, 1, NULL, NULL)",
                (LOCAL_SITE, first.stamp_ns, first.arrival_ns),
            )
            appender = Appender(connection)
            for start in range(0, len(rows), _LOT):
                appender.append(1, rows[start : start + _LOT])
                appender.flush()
            set_meta(connection, _FROM, first.stamp_ns)
            set_meta(connection, _UNTIL, until_ns)
        connection.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchall()
    return True


def simulated(connection: sqlite3.Connection) -> Stretch | None:
    """The stretch of a journal that was filled in, None if nothing was."""
    start_ns, end_ns = get_meta(connection, _FROM), get_meta(connection, _UNTIL)
    return Stretch(int(start_ns), int(end_ns)) if start_ns and end_ns else None
