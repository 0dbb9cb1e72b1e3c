"""Rows out of tables: what was handed over, with what the file keeps once for many."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Final

from lupin_twin.journal.packing import Damaged, columns, unpack_numbers, unpack_shape, unseal
from lupin_twin.journal.rows import LookRow, PinRow, ScanRow
from lupin_twin.journal.runs import Carries, Clock, Ending, Run
from lupin_twin.journal.schema import DamagedFile
from lupin_twin.state import Flower, Pose, Reading


@dataclass(frozen=True, slots=True)
class Series:
    """What scans or looks have in common; `tag` is the number of the tag, in order of hearing."""

    id: int
    run: Run
    tag: int
    tag_id: str
    kind: int
    status: int
    source: str
    sensors: tuple[str, ...]


_CARRIES: Final = frozenset(Carries)
SCAN: Final = "id, series, stamp_ns, own_stamp_ns, lag_us, mission, detail, readings"
LOOK: Final = (
    "id, series, stamp_ns, own_stamp_ns, lag_us, mission, species, anomaly, flower_count,"
    " bug_count, shape"
)


@contextmanager
def one_view(connection: sqlite3.Connection) -> Iterator[None]:
    """All that is read within is of one moment; keep it short, for the log grows meanwhile."""
    if connection.in_transaction:
        yield
        return
    connection.execute("BEGIN")
    try:
        yield
    finally:
        connection.rollback()  # does nothing where an interrupted statement has ended it


def runs(connection: sqlite3.Connection) -> dict[int, Run]:
    """Every run, by id, in the order in which they began."""
    return {
        row[0]: Run(row[0], Clock(row[2], row[3], bool(row[1])), row[5], _carries(row[6]))
        for row in connection.execute(
            "SELECT id, is_simulated, begun_stamp_ns, begun_arrival_ns, lead_ns, follows, carries"
            " FROM run ORDER BY id"
        )
    }


def _carries(number: int) -> Carries:
    return Carries(number) if number in _CARRIES else Carries.NOTHING


def sensor_names(text: str) -> tuple[str, ...]:
    """The names of a set of sensors.

    Raises:
        DamagedFile: it is no list of names.

    """
    try:
        names = json.loads(text)
    except (ValueError, RecursionError):
        names = None
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise DamagedFile(f"{text[:64]!r} is no set of sensors")
    return tuple(names)


def ending(connection: sqlite3.Connection, *, is_simulated: bool) -> Ending | None:
    """The newest run of that kind and the last that was heard in it, None if there is none."""
    run = next(
        (r for r in reversed(runs(connection).values()) if r.begun.is_simulated == is_simulated),
        None,
    )
    if run is None:
        return None
    last = run.begun
    for table in ("scan", "look"):
        # The rows of a run lie together at the end; only a latched one may be older than others.
        found = connection.execute(
            f"SELECT stamp_ns, lag_us FROM {table} JOIN series ON series.id = series"  # noqa: S608
            f" WHERE run = ? ORDER BY {table}.id DESC LIMIT 100",
            (run.id,),
        )
        for stamp_ns, lag_us in found:
            if stamp_ns > last.stamp_ns:
                last = Clock(stamp_ns, stamp_ns + run.lead_ns + 1000 * lag_us, is_simulated)
    return Ending(run, last)


def heard_until(connection: sqlite3.Connection, run: int) -> int:
    """The latest stamp in a run, 0 where there is none: a step for each of its series."""
    newest = "SELECT (SELECT max(stamp_ns) FROM {0} WHERE series = s.id) AS ns FROM series AS s"
    (last_ns,) = connection.execute(
        f"SELECT max(ns) FROM ({newest.format('scan')} WHERE run = ?1"  # noqa: S608  # constants
        f" UNION ALL {newest.format('look')} WHERE run = ?1"
        " UNION ALL SELECT max(stamp_ns) FROM pin WHERE run = ?1)",
        (run,),
    ).fetchone()
    return int(last_ns or 0)


class Names:
    """Texts by their numbers, read from the file as they are asked for."""

    def __init__(self, connection: sqlite3.Connection) -> None:
        self._connection = connection
        self._texts: dict[int, str] = {}

    def __getitem__(self, number: int) -> str:
        text = self._texts.get(number)
        if text is None:
            found = self._connection.execute("SELECT text FROM name WHERE id = ?", (number,))
            row = found.fetchone()
            if row is None:
                raise Damaged(f"name {number} is missing")
            text = self._texts[number] = str(row[0])
        return text


def all_series(connection: sqlite3.Connection, run: Run | None = None) -> Iterator[Series]:
    """The series of a run, or of all; tags in the order in which they were first heard of."""
    by_id = runs(connection) if run is None else {run.id: run}
    sensors = {
        number: sensor_names(names)
        for number, names in connection.execute("SELECT id, names FROM sensors")
    }
    where, values = ("", ()) if run is None else ("WHERE run = ?", (run.id,))
    found = connection.execute(
        "SELECT series.id, run, tag, tag.tag_id, kind, status, name.text, sensors"  # noqa: S608
        " FROM series JOIN tag ON tag.id = tag JOIN name ON name.id = source"
        f" {where} ORDER BY tag, series.id",
        values,
    )
    for number, of_run, tag, tag_id, kind, status, source, names in found:
        if of_run in by_id and names in sensors:
            yield Series(number, by_id[of_run], tag, tag_id, kind, status, source, sensors[names])


def scan_of(row: tuple[Any, ...], series: Series, names: Names) -> ScanRow:
    """The scan that a row, its columns as `SCAN` names them, was written for.

    Raises:
        Damaged: it is not what was written.

    """
    _, _, stamp_ns, own_stamp_ns, lag_us, mission, detail, packed = row
    body = unseal(columns(*row[1:-1]), packed)
    values = unpack_numbers(body, len(series.sensors))
    return ScanRow(
        tag_id=series.tag_id,
        stamp_ns=stamp_ns,
        arrival_ns=stamp_ns + series.run.lead_ns + 1000 * lag_us,
        readings=tuple(map(Reading, series.sensors, values)),
        kind=series.kind,
        status=series.status,
        detail=detail or "",
        source=series.source,
        mission=names[mission],
        own_stamp_ns=own_stamp_ns,
    )


def look_of(row: tuple[Any, ...], series: Series, names: Names) -> LookRow:
    """The look that a row, its columns as `LOOK` names them, was written for.

    Raises:
        Damaged: it is not what was written.

    """
    _, _, stamp_ns, own_stamp_ns, lag_us, *told, packed = row
    confidence, blooms, footprint = unpack_shape(unseal(columns(*row[1:-1]), packed))
    mission, species, anomaly, flower_count, bug_count = told
    return LookRow(
        tag_id=series.tag_id,
        stamp_ns=stamp_ns,
        arrival_ns=stamp_ns + series.run.lead_ns + 1000 * lag_us,
        flower=Flower(
            species=names[species],
            confidence=confidence,
            anomaly=bool(anomaly),
            flower_count=flower_count,
            bug_count=bug_count,
            blooms=blooms,
            footprint=footprint,
        ),
        source=series.source,
        mission=names[mission],
        own_stamp_ns=own_stamp_ns,
    )


def pins(connection: sqlite3.Connection, run: Run) -> Iterator[tuple[int, int, PinRow | None]]:
    """(number of the tag, id, pin) of a run's pins; None for one that is damaged."""
    found = connection.execute(
        "SELECT pin.id, tag, tag.tag_id, stamp_ns, lag_us, pose FROM pin"
        " JOIN tag ON tag.id = tag WHERE run = ? ORDER BY pin.id",
        (run.id,),
    )
    for number, tag, tag_id, stamp_ns, lag_us, packed in found:
        try:
            body = unseal(columns(run.id, tag, stamp_ns, lag_us), packed)
            pose = Pose(*unpack_numbers(body, 7))
        except Damaged:
            yield tag, number, None
            continue
        arrival_ns = stamp_ns + run.lead_ns + 1000 * lag_us
        yield tag, number, PinRow(tag_id, stamp_ns, arrival_ns, pose)
