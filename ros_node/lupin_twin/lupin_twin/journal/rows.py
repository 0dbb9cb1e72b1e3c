"""Reads scans and inspections from the journal's tables, and parses the JSON in them."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Sequence
from functools import lru_cache
from operator import attrgetter
from typing import Any, Final

from lupin_twin.core.drops import valid_text
from lupin_twin.core.past import FOREVER_NS
from lupin_twin.core.state import (
    KIND_FLOWER,
    NO_FLOWER,
    STATUS_OK,
    Bloom,
    Flower,
    Observation,
    Pin,
    Write,
)
from lupin_twin.journal import sql
from lupin_twin.journal.runs import Run, runs, span_at
from lupin_twin.journal.schema import WRITTEN, DamagedFile, SiteLog


def weight(write: Write) -> int:
    """The size of a write in memory, counted in readings, flowers and footprint points."""
    if isinstance(write, Pin):
        return 1
    flower = write.flower or NO_FLOWER
    return 1 + len(write.readings) + len(flower.blooms) + len(flower.footprint)


# More than all publishers of a robot latch.
LATCHED: Final = 1_000


def last_rows(log: SiteLog, run: Run, most: int) -> list[Observation]:
    """The last scans and inspections that were received in a run, in that order."""
    query = {"run": run.id, "since": run.begun_seq, "most": most}
    return observations(log, sql.LAST_SCANS, sql.LAST_INSPECTIONS, query)[-most:]


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


def latest(log: SiteLog, tag_id: str, count: int) -> list[Observation]:
    """The last `count` rows of each of a tag's series in the current run, in order of arrival."""
    span = span_at(runs(log.execute), FOREVER_NS)
    if span is None:
        return []
    query: dict[str, Any] = {"run": span.run, "tag": tag_id, "depth": count}
    found = inspections_of(log.execute(sql.LATEST_INSPECTIONS, query).fetchall())
    for (number,) in log.execute(sql.SERIES_OF_TAG, query).fetchall():
        rows = log.execute(sql.LATEST_SCANS, query | {"series": number})
        found += scans_of(rows.fetchall())
    return sorted(found, key=_number_of)


# --- rows as they were handed over ----------------------------------------------------------------

_number_of = attrgetter("number")


def observations(
    log: SiteLog, scans: str, inspections: str, query: dict[str, Any]
) -> list[Observation]:
    """What two statements find, by number; `sql` has statements with the right columns."""
    found = [
        *scans_of(log.execute(scans, query).fetchall()),
        *inspections_of(log.execute(inspections, query).fetchall()),
    ]
    return sorted(found, key=_number_of)


def listed_rows(
    log: SiteLog, run: int, scans: Sequence[int], inspections: Sequence[int]
) -> list[Observation]:
    """The scans and inspections of a run with these numbers."""
    query = {"run": run, "scans": json.dumps(scans), "looks": json.dumps(inspections)}
    return observations(log, sql.LISTED_SCANS, sql.LISTED_INSPECTIONS, query)


def scans_of(rows: Sequence[Sequence[Any]]) -> list[Observation]:
    """Rows of `scan`: scans, and attempts of either kind that failed."""
    every = named_numbers((row[0] for row in rows), [row[1] for row in rows])
    found, same = [], dict[str, str]()
    for row, (names, values) in zip(rows, every, strict=True):
        _, _, tag, stamp_ns, status, detail, source, own_ns, mission, *of, seq, run = row
        # Many rows name few tags, sources and missions. Python 3.12 never forgets what is interned.
        tag, source, mission = (same.setdefault(it, it) for it in (tag, source, mission))
        reported = (None, status, detail, source, own_ns, mission, *of, None, seq, run)
        found.append(Observation(tag, stamp_ns, dict(zip(names, values, strict=True)), *reported))
    return found


def inspections_of(rows: Iterable[Sequence[Any]]) -> list[Observation]:
    """Rows of `look`: inspections that saw flowers."""
    found = []
    for seq, run, tag, stamp_ns, source, own_ns, mission, arrival_ns, *flower in rows:
        reported = (STATUS_OK, "", source, own_ns, mission, arrival_ns, KIND_FLOWER)
        of = (None, *reported, flower_of(flower), seq, run)
        found.append(Observation(tag, stamp_ns, {}, *of))
    return found


# --- texts of the tables as values ----------------------------------------------------------------


def noted_number(log: SiteLog, key: str, otherwise: int = 0) -> int:
    """A number that is noted about the journal as a whole; `otherwise` if none is.

    Raises:
        DamagedFile: something else is noted.

    """
    text = log.meta(key)
    if text is None or is_number(text):
        return otherwise if text is None else int(text)
    raise DamagedFile(f"{key} in the journal is {text[:64]!r}, which is not a number")


def is_number(text: str) -> bool:
    """Whether it is a number that can be noted: a time, ns of ROS time, or the number of a row."""
    return text.isdecimal() and len(text) < 20 and int(text) <= FOREVER_NS // 2


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
