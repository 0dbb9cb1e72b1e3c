"""Rows out of tables: what was handed over, and the texts of the tables as values."""

from __future__ import annotations

import json
import math
import sqlite3
from collections.abc import Sequence
from typing import Any, Final

from lupin_twin.journal.rows import LookRow, ScanRow
from lupin_twin.journal.schema import LOCAL_SITE, DamagedFile
from lupin_twin.state import Bloom, Flower, Reading

# Scans that are read at most for the histories of all tags.
_MAX_SCANS: Final = 20_000


def newest_rows(
    connection: sqlite3.Connection, run: int, per_series: int
) -> list[ScanRow | LookRow]:
    """The newest scans of each series of a run, and the newest look of each tag, as received."""
    asked: dict[str, Any] = {"site": LOCAL_SITE, "run": run}
    (count,) = connection.execute(
        "SELECT count(*) FROM series WHERE site = :site AND run = :run", asked
    ).fetchone()
    asked["depth"] = max(1, min(per_series, _MAX_SCANS // max(1, count)))
    newest = (
        "series AS s CROSS JOIN {0} AS r ON r.site = s.site AND r.seq IN (SELECT seq FROM {0}"
        " WHERE site = s.site AND {1} ORDER BY stamp_ns DESC, seq DESC LIMIT {2})"
        " WHERE s.site = :site AND s.run = :run"
    )
    found = _rows(
        connection,
        newest.format("scan", "series = s.series", ":depth"),
        newest.format("look", "run = s.run AND tag = s.tag", "1") + " AND s.kind = 1",
        asked,
    )
    return [row for _, row in sorted(found, key=lambda entry: entry[0])]


# --- rows as they were handed over ----------------------------------------------------------------


def listed_rows(
    connection: sqlite3.Connection, run: int, scans: Sequence[int], looks: Sequence[int]
) -> list[tuple[int, ScanRow | LookRow]]:
    """The scans and looks of a run with these seqs, each with its own."""
    asked = {
        "site": LOCAL_SITE, "run": run, "scans": json.dumps(scans), "looks": json.dumps(looks),
    }  # fmt: skip
    return _rows(
        connection,
        "scan AS r CROSS JOIN series AS s ON s.site = r.site AND s.series = r.series"
        " WHERE r.site = :site AND r.seq IN (SELECT value FROM json_each(:scans)) AND s.run = :run",
        "look AS r WHERE r.site = :site AND r.seq IN (SELECT value FROM json_each(:looks))"
        " AND r.run = :run",
        asked,
    )


def _rows(
    connection: sqlite3.Connection, scans: str, looks: str, asked: dict[str, Any]
) -> list[tuple[int, ScanRow | LookRow]]:
    """Scans and looks (`r`) with their seqs, out of these joins with the series (`s`)."""
    found: list[tuple[int, ScanRow | LookRow]] = []
    rows = connection.execute(
        "SELECT seq, tag, kind, sensors, readings, stamp_ns, own_stamp_ns, arrival_ns, status,"  # noqa: S608
        f" source, mission, detail FROM {scans}",
        asked,
    ).fetchall()
    for row, values in zip(rows, numbers_of([row[4] for row in rows]), strict=True):
        seq, tag, kind, sensors, _, stamp_ns, own_ns, arrival_ns, *told = row
        status, source, mission, detail = told
        readings = tuple(map(Reading, sensor_names(sensors), values))
        scan = ScanRow(
            tag, stamp_ns, arrival_ns, readings, kind, status, detail, source, mission, own_ns
        )
        found.append((seq, scan))
    for seq, tag, stamp_ns, own_ns, arrival_ns, source, mission, *flower in connection.execute(
        "SELECT seq, r.tag, stamp_ns, own_stamp_ns, arrival_ns, source, mission, species,"  # noqa: S608
        f" confidence, anomaly, flower_count, bug_count, blooms, box FROM {looks}",
        asked,
    ).fetchall():
        look = LookRow(tag, stamp_ns, arrival_ns, flower_of(flower), source, mission, own_ns)
        found.append((seq, look))
    return found


# --- texts of the tables as values ----------------------------------------------------------------


def numbers_of(texts: Sequence[str]) -> list[list[float]]:
    """Many JSON lists of numbers at once; null is NaN.

    Raises:
        DamagedFile: one of them is none.

    """
    joined = f"[{','.join(texts)}]"
    try:
        every: list[list[Any]] = json.loads(joined, parse_int=float)
        if "null" in joined:
            every = [[math.nan if value is None else value for value in row] for row in every]
        sum(map(sum, every))  # what is no number cannot be added
    except (ValueError, TypeError, RecursionError):
        every = []
    if len(every) != len(texts):
        raise DamagedFile("readings in the journal are no lists of numbers")
    return every


def sensor_names(text: str) -> tuple[str, ...]:
    """The names of a series' sensors.

    Raises:
        DamagedFile: it is no list of names.

    """
    try:
        names = json.loads(text)
    except (ValueError, RecursionError):
        names = None
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise DamagedFile(f"{text[:64]!r} is no list of sensors")
    return tuple(names)


def flower_of(row: Sequence[Any]) -> Flower:
    """A look at flowers, its columns from species on, without `is_copy`.

    Raises:
        DamagedFile: its blooms or its box are none.

    """
    species, confidence, anomaly, flower_count, bug_count, blooms, box = row
    try:
        return Flower(
            species,
            _number(confidence),
            bool(anomaly),
            flower_count,
            bug_count,
            () if blooms == "[]" else tuple(_bloom(*bloom) for bloom in json.loads(blooms)),
            () if box == "[]" else tuple(_point(*point) for point in json.loads(box)),
        )
    except (ValueError, TypeError, RecursionError):
        raise DamagedFile("blooms or a box in the journal are none") from None


def _bloom(  # noqa: PLR0917  # as it stands in the list
    x: Any, y: Any, z: Any, height_m: Any, species: str, confidence: Any, anomaly: int
) -> Bloom:
    sure = _number(confidence)
    return Bloom(
        _number(x), _number(y), _number(z), _number(height_m), species, sure, bool(anomaly)
    )


def _point(x: Any, y: Any, z: Any) -> tuple[float, float, float]:
    return _number(x), _number(y), _number(z)


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)
