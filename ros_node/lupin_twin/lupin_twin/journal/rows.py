"""Reads scans and inspections from the journal's tables, and parses the JSON in them."""

from __future__ import annotations

import json
import math
import sqlite3
from collections.abc import Iterable, Sequence
from contextlib import suppress
from functools import lru_cache
from typing import Any, Final

from lupin_twin.core.drops import valid_text
from lupin_twin.core.history import KIND_FLOWER
from lupin_twin.core.past import FOREVER_NS
from lupin_twin.core.state import STATUS_OK, Bloom, Flower, Inspection, Reading, Scan, Write
from lupin_twin.journal import sql
from lupin_twin.journal.runs import Run, runs, span_at
from lupin_twin.journal.schema import LOCAL_SITE, WRITTEN, DamagedFile, SiteLog


def weight(write: Write) -> int:
    """The size of a write in memory, counted in readings, flowers and footprint points."""
    if isinstance(write, Scan):
        return 1 + len(write.readings)
    if isinstance(write, Inspection) and write.flower is not None:
        return 1 + len(write.flower.blooms) + len(write.flower.footprint)
    return 1


# More than all publishers of a robot latch.
LATCHED: Final = 1_000


def last_rows(connection: sqlite3.Connection, run: Run, most: int) -> list[Scan | Inspection]:
    """The last scans and inspections that were received in a run, in that order."""
    query = {"site": LOCAL_SITE, "run": run.id, "since": run.begun_seq, "most": most}
    found = [
        *_scans(connection, sql.LAST_SCANS, query),
        *_inspections(connection, sql.LAST_INSPECTIONS, query),
    ]
    return [row for _, row in sorted(found, key=lambda entry: entry[0])[-most:]]


def outermost(
    log: SiteLog, way: str, upto: int = FOREVER_NS, tables: Sequence[str] = WRITTEN
) -> list[tuple[int, int, int]]:
    """Number, stamp and arrival of each table's first (ASC) or last (DESC) row up to a number."""
    return [
        row
        for table in tables
        for row in log.execute(sql.outermost(table, way), {"upto": upto}).fetchall()
    ]


def last_row(log: SiteLog, upto: int = FOREVER_NS) -> tuple[int, int, int]:
    """Number, stamp and arrival of the last write up to a number; all 0 if there is none."""
    return max(outermost(log, "DESC", upto, (*WRITTEN, "place")), default=(0, 0, 0))


def latest(connection: sqlite3.Connection, tag_id: str, count: int) -> list[Scan | Inspection]:
    """The last `count` rows of each of a tag's series in the current run, in order of arrival."""
    span = span_at(runs(connection.execute), FOREVER_NS)
    if span is None:
        return []
    parameters: dict[str, Any] = {"site": LOCAL_SITE, "run": span.run}
    parameters |= {"tag": tag_id, "depth": count}
    found = _inspections(connection, sql.LATEST_INSPECTIONS, parameters)
    for (number,) in connection.execute(sql.SERIES_OF_TAG, parameters).fetchall():
        found += _scans(connection, sql.LATEST_SCANS, parameters | {"series": number})
    return [row for _, row in sorted(found, key=lambda entry: entry[0])]


# --- rows as they were handed over ----------------------------------------------------------------


def listed_rows(
    connection: sqlite3.Connection, run: int, scans: Sequence[int], inspections: Sequence[int]
) -> list[tuple[int, Scan | Inspection]]:
    """The scans and inspections of a run with these seqs, as (seq, write)."""
    query = {"site": LOCAL_SITE, "run": run, "scans": json.dumps(scans)}
    query["looks"] = json.dumps(inspections)
    return [
        *_scans(connection, sql.LISTED_SCANS, query),
        *_inspections(connection, sql.LISTED_INSPECTIONS, query),
    ]


def _scans(
    connection: sqlite3.Connection, select: str, query: dict[str, Any]
) -> list[tuple[int, Scan | Inspection]]:
    found: list[tuple[int, Scan | Inspection]] = []
    rows = connection.execute(select, query).fetchall()
    every = named_numbers((row[3] for row in rows), [row[4] for row in rows])
    for row, (names, values) in zip(rows, every, strict=True):
        seq, tag, kind, _, _, stamp_ns, own_ns, arrival_ns, *reported = row
        status, source, mission, detail = reported
        sent_ns = stamp_ns if own_ns is None else own_ns
        reported = (None, status, detail, source, sent_ns, mission, arrival_ns)
        if kind == KIND_FLOWER:
            found.append((seq, Inspection(tag, stamp_ns, None, *reported)))
        else:
            readings = tuple(map(Reading, names, values))
            found.append((seq, Scan(tag, stamp_ns, readings, *reported)))
    return found


def _inspections(
    connection: sqlite3.Connection, select: str, query: dict[str, Any]
) -> list[tuple[int, Scan | Inspection]]:
    found: list[tuple[int, Scan | Inspection]] = []
    for row in connection.execute(select, query).fetchall():
        seq, tag, stamp_ns, own_ns, arrival_ns, source, mission, *flower = row
        sent_ns = stamp_ns if own_ns is None else own_ns
        seen = flower_of(flower)
        reported = (None, STATUS_OK, "", source, sent_ns, mission, arrival_ns)
        found.append((seq, Inspection(tag, stamp_ns, seen, *reported)))
    return found


# --- texts of the tables as values ----------------------------------------------------------------


def noted_number(log: SiteLog, key: str, otherwise: int = 0) -> int:
    """A number that is noted about the journal as a whole; `otherwise` if none is.

    Raises:
        DamagedFile: something else is noted.

    """
    text = log.meta(key) or str(otherwise)
    with suppress(ValueError):
        if abs(found := int(text)) <= FOREVER_NS:
            return found
    raise DamagedFile(f"{key} in the journal is {text[:64]!r}, which is not a number")


def numbers_of(texts: Sequence[str]) -> list[list[float]]:
    """Parse many JSON lists of numbers at once; null is NaN.

    Raises:
        DamagedFile: a text is not a list of numbers.

    """
    joined = f"[{','.join(texts)}]"
    try:
        every: list[list[Any]] = json.loads(joined, parse_int=float)
        if "null" in joined:
            every = [[math.nan if value is None else value for value in row] for row in every]
        sum(map(sum, every))  # raises unless all are numbers
    except (ValueError, TypeError, RecursionError):
        every = []
    if len(every) != len(texts):
        raise DamagedFile("readings in the journal are not lists of numbers")
    return every


def named_numbers(
    sensors: Iterable[str], readings: Sequence[str]
) -> list[tuple[tuple[str, ...], list[float]]]:
    """Parse the sensor names and the readings of many scans.

    Raises:
        DamagedFile: a text is invalid, or there are more or fewer readings than sensors.

    """
    found = list(zip(map(sensor_names, sensors), numbers_of(readings), strict=True))
    if any(len(names) != len(values) for names, values in found):
        raise DamagedFile("a scan has another number of readings than its series has sensors")
    return found


@lru_cache(maxsize=4096)
def sensor_names(text: str) -> tuple[str, ...]:
    """The names of a series' sensors.

    Raises:
        DamagedFile: it is no list of names.

    """
    try:
        names = json.loads(text)
        if isinstance(names, list):
            return tuple(map(valid_text, names))
    except (AttributeError, ValueError, RecursionError):
        pass
    raise DamagedFile(f"{text[:64]!r} is not a list of sensors")


def flower_of(row: Sequence[Any]) -> Flower:
    """Make a flower from the columns of an inspection, from species on, without `is_copy`.

    Raises:
        DamagedFile: its blooms or its box are invalid.

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
    except (AttributeError, ArithmeticError, ValueError, TypeError, RecursionError):
        raise DamagedFile("flowers or a box in the journal are invalid") from None


def _bloom(*of: Any) -> Bloom:
    *at, species, confidence, anomaly = of
    x, y, z, height_m = map(_number, at)
    return Bloom(x, y, z, height_m, valid_text(species), _number(confidence), bool(anomaly))


def _point(x: Any, y: Any, z: Any) -> tuple[float, float, float]:
    return _number(x), _number(y), _number(z)


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)
