"""What is in a journal, for a person who looks at the file: size, rows, tags, runs, how far back.

Reads alone, also while a twin records.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from lupin_twin.journal.forgetting import records
from lupin_twin.journal.reading import sensor_names
from lupin_twin.journal.retention import KEPT_BYTES, KEPT_NS
from lupin_twin.journal.runs import Run, runs
from lupin_twin.journal.schema import get_meta
from lupin_twin.past import HOUR_NS

_COUNTED: Final = ("scan", "look", "place", "hour")


@dataclass(frozen=True, slots=True)
class RunExtent:
    """A run, and its first and last stamp in ns of ROS time; None where nothing is left of it."""

    run: Run
    first_ns: int | None
    last_ns: int | None


@dataclass(frozen=True, slots=True)
class Overview:
    """What a journal holds.

    `rows` counts by table, and `tag` by name; `failures` the scans that failed; copies are rows
    too. `hours_ns` is the stretch of the hours of wall time. `kept_ns` and `kept_bytes` are the
    limits that its last twin was given, 0 where none has said; `quarantined` names damaged journals
    beside it, with their sizes; `forgotten` are the records of `forgetting`.
    """

    file_bytes: int
    free_bytes: int
    log_bytes: int
    rows: dict[str, int]
    failures: int
    sensors: tuple[str, ...]
    runs: tuple[RunExtent, ...]
    hours_ns: tuple[int, int] | None
    kept_ns: int
    kept_bytes: int
    quarantined: tuple[tuple[str, int], ...]
    forgotten: tuple[Mapping[str, object], ...]


def overview(connection: sqlite3.Connection, path: Path) -> Overview:
    """What the journal at `path` holds, which the connection reads.

    Raises:
        sqlite3.Error: it cannot be read.

    """
    pages, free, size = (
        int(connection.execute(f"PRAGMA {name}").fetchone()[0])
        for name in ("page_count", "freelist_count", "page_size")
    )
    rows = {
        table: int(connection.execute(f"SELECT count(*) FROM {table}").fetchone()[0])  # noqa: S608
        for table in _COUNTED
    }
    (rows["tag"],) = connection.execute(
        "SELECT count(*) FROM (SELECT tag FROM series UNION SELECT tag FROM place)"
    ).fetchone()
    # Its index has none but those.
    (failures,) = connection.execute(
        "SELECT count(*) FROM scan WHERE status != 0 AND is_copy = 0"
    ).fetchone()
    return Overview(
        file_bytes=pages * size,
        free_bytes=free * size,
        log_bytes=_size(path.with_name(path.name + "-wal")),
        rows=rows,
        failures=int(failures),
        sensors=_sensors(connection),
        runs=_extents(connection),
        hours_ns=_hours(connection),
        kept_ns=int(get_meta(connection, KEPT_NS) or 0),
        kept_bytes=int(get_meta(connection, KEPT_BYTES) or 0),
        quarantined=quarantined_beside(path),
        forgotten=tuple(records(connection)),
    )


def quarantined_beside(path: Path) -> tuple[tuple[str, int], ...]:
    """(name, bytes) of the damaged journals that were put aside, the newest last."""
    prefix = f"{path.name}.damaged-"
    return tuple(
        (file.name, _size(file))
        for file in sorted(path.parent.iterdir())
        if file.name.startswith(prefix) and not file.name.endswith(("-wal", "-shm"))
    )


def _sensors(connection: sqlite3.Connection) -> tuple[str, ...]:
    names: set[str] = set()
    for (text,) in connection.execute("SELECT DISTINCT sensors FROM series"):
        names.update(sensor_names(text))
    return tuple(sorted(names))


# One step in the index for each series; an extent over all rows would read all of them.
_EXTENTS: Final = (
    "SELECT run, min(least), max(most) FROM ("
    "SELECT run, (SELECT min(stamp_ns) FROM scan WHERE site = s.site AND series = s.series"
    " AND is_copy = 0) AS least, (SELECT max(stamp_ns) FROM scan WHERE site = s.site"
    " AND series = s.series AND is_copy = 0) AS most FROM series AS s UNION ALL"
    " SELECT run, min(stamp_ns), max(stamp_ns) FROM look WHERE is_copy = 0 GROUP BY run"
    ") GROUP BY run"
)


def _extents(connection: sqlite3.Connection) -> tuple[RunExtent, ...]:
    found = {run: extent for run, *extent in connection.execute(_EXTENTS)}
    return tuple(
        RunExtent(run, *found.get(run.id, (None, None)))
        for run in runs(connection.execute)
        if run.joins is None
    )


def _hours(connection: sqlite3.Connection) -> tuple[int, int] | None:
    first, last = connection.execute(
        "SELECT min((SELECT min(hour) FROM hour WHERE site = s.site AND series = s.series)),"
        " max((SELECT max(hour) FROM hour WHERE site = s.site AND series = s.series))"
        " FROM series AS s JOIN run ON run.site = s.site AND run.run = s.run WHERE NOT is_simulated"
    ).fetchone()
    return None if first is None else (first * HOUR_NS, (last + 1) * HOUR_NS)


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except FileNotFoundError:
        return 0
