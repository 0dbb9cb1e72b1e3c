"""What is in a journal, for a person who looks at the file: size, rows, tags, runs, how far back.

Reads alone, also while a twin records.
"""

from __future__ import annotations

import sqlite3
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from lupin_twin.journal.reading import runs, sensor_names
from lupin_twin.journal.retention import KEPT_BYTES, KEPT_NS
from lupin_twin.journal.rollups import get_meta
from lupin_twin.journal.runs import Run
from lupin_twin.past import HOUR_NS

_COUNTED: Final = ("scan", "look", "pin", "tag", "rollup")


@dataclass(frozen=True, slots=True)
class RunExtent:
    """A run, and its first and last stamp in ns of ROS time; None where nothing is left of it."""

    run: Run
    first_ns: int | None
    last_ns: int | None


@dataclass(frozen=True, slots=True)
class Overview:
    """What a journal holds.

    `rows` counts by table, `failures` the scans of it that failed. `rolled_ns` is the stretch of
    the rollups of wall time. `kept_ns` and `kept_bytes` are the limits that its last twin was
    given, 0 where none has said; `set_aside` names damaged journals beside it, with their sizes.
    """

    file_bytes: int
    free_bytes: int
    log_bytes: int
    rows: dict[str, int]
    failures: int
    sensors: tuple[str, ...]
    runs: tuple[RunExtent, ...]
    rolled_ns: tuple[int, int] | None
    kept_ns: int
    kept_bytes: int
    set_aside: tuple[tuple[str, int], ...]


def overview(connection: sqlite3.Connection, path: Path) -> Overview:
    """What the journal at `path` holds, which the connection reads.

    Raises:
        sqlite3.Error: it cannot be read.

    """
    pages, free, size = (
        int(connection.execute(f"PRAGMA {name}").fetchone()[0])
        for name in ("page_count", "freelist_count", "page_size")
    )
    failures = connection.execute(
        "SELECT coalesce(sum((SELECT count(*) FROM scan WHERE series = s.id)), 0)"
        " FROM series AS s WHERE s.status != 0"
    ).fetchone()[0]
    return Overview(
        file_bytes=pages * size,
        free_bytes=free * size,
        log_bytes=_size(path.with_name(path.name + "-wal")),
        rows={
            table: int(connection.execute(f"SELECT count(*) FROM {table}").fetchone()[0])  # noqa: S608
            for table in _COUNTED
        },
        failures=int(failures),
        sensors=_sensors(connection),
        runs=_extents(connection),
        rolled_ns=_rolled(connection),
        kept_ns=get_meta(connection, KEPT_NS),
        kept_bytes=get_meta(connection, KEPT_BYTES),
        set_aside=set_aside_beside(path),
    )


def set_aside_beside(path: Path) -> tuple[tuple[str, int], ...]:
    """(name, bytes) of the damaged journals that were set aside, the newest last."""
    prefix = f"{path.name}.damaged-"
    return tuple(
        (file.name, _size(file))
        for file in sorted(path.parent.iterdir())
        if file.name.startswith(prefix) and not file.name.endswith(("-wal", "-shm"))
    )


def _sensors(connection: sqlite3.Connection) -> tuple[str, ...]:
    names: set[str] = set()
    for (text,) in connection.execute("SELECT names FROM sensors"):
        names.update(sensor_names(text))
    return tuple(sorted(names))


def _extents(connection: sqlite3.Connection) -> tuple[RunExtent, ...]:
    stamps: dict[int, list[int]] = {}
    for table in ("scan", "look"):
        # Two steps in the index for each series; an extent over all rows would read all of them.
        found = connection.execute(
            f"SELECT run, (SELECT min(stamp_ns) FROM {table} WHERE series = s.id),"  # noqa: S608
            f" (SELECT max(stamp_ns) FROM {table} WHERE series = s.id) FROM series AS s"
        )
        for run, first, last in found:
            if first is not None:
                stamps.setdefault(run, []).extend((first, last))
    return tuple(
        RunExtent(run, min(found_in, default=None), max(found_in, default=None))
        for run in runs(connection).values()
        for found_in in (stamps.get(run.id, []),)
    )


def _rolled(connection: sqlite3.Connection) -> tuple[int, int] | None:
    first, last = connection.execute(
        "SELECT min((SELECT min(hour) FROM rollup WHERE series = s.id)),"
        " max((SELECT max(hour) FROM rollup WHERE series = s.id))"
        " FROM series AS s JOIN run ON run.id = s.run WHERE NOT is_simulated"
    ).fetchone()
    return None if first is None else (first * HOUR_NS, (last + 1) * HOUR_NS)


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except FileNotFoundError:
        return 0
