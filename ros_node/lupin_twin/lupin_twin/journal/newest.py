"""The newest rows of a run of the clock up to a moment, one of each series, without the damaged."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lupin_twin.journal.columns import Columns, fetch, whole
from lupin_twin.journal.packing import Damaged, columns, unpack_numbers, unseal
from lupin_twin.journal.reading import LOOK, SCAN, sensor_names
from lupin_twin.journal.rows import KIND_FLOWER, KIND_READING, STATUS_OK

# The newest (or first) row of each series is one step in the index of series and stamps.
_OF_EACH: Final = (
    "FROM series AS s JOIN {table} AS r ON r.id = (SELECT id FROM {table}"
    " WHERE series = s.id AND stamp_ns <= ?2 {but}ORDER BY stamp_ns {way}, id {way} LIMIT 1)"
    " WHERE s.run = ?1 AND {which}"
)
# Looks that saw flowers have a table of their own; those that failed are like scans.
_IS_LOOK: Final = f"s.kind = {KIND_FLOWER} AND s.status = {STATUS_OK}"
# In the order in which a row is sealed, then what else is needed; the stamp that was sent, which
# is sealed third, comes last, for it is seldom there.
_SCAN_NUMBERS: Final = (
    "s.id",
    "r.stamp_ns",
    "r.lag_us",
    "r.mission",
    "r.id",
    "s.tag",
    "(s.sensors << 16) + (s.kind << 8) + s.status",
)
_LOOK_NUMBERS: Final = (
    "s.id",
    "r.stamp_ns",
    "r.lag_us",
    "r.mission",
    "r.species",
    "r.anomaly",
    "r.flower_count",
    "r.bug_count",
    "r.id",
    "s.tag",
)


class Scans:
    """Scans and failed looks, one of each series, a column each."""

    def __init__(self, found: Columns, sets: Mapping[int, tuple[str, ...]]) -> None:
        self.series, self.stamp, lag, mission, self.id, self.tag, what, own = found.numbers
        self.sealed_with = (self.series, self.stamp, own, lag, mission)
        self.set, self.kind, self.status = what >> 16, what >> 8 & 0xFF, what & 0xFF
        self.readings, self.detail = found.packed
        self.sets = sets
        counts = np.zeros(max(sets, default=0) + 1, dtype=np.int64)
        counts[list(sets)] = [len(names) for names in sets.values()]
        self.sensors = counts[np.minimum(self.set, len(counts) - 1)]  # how many

    @classmethod
    def of(cls, connection: sqlite3.Connection, run: int, until_ns: int, way: str) -> Scans:
        """The newest (DESC) or the first (ASC) of each series."""
        sets = {
            number: sensor_names(names)
            for number, names in connection.execute("SELECT id, names FROM sensors")
        }

        def is_whole(found: Columns) -> NDArray[np.bool_]:
            scans = cls(found, sets)
            bytes_each = scans.readings.lengths - 2
            fit = (bytes_each == 4 * scans.sensors) | (bytes_each == 8 * scans.sensors)
            is_whole: NDArray[np.bool_] = whole(scans.sealed_with, scans.readings, scans.detail)
            is_whole &= fit
            return is_whole

        found = _of_each(
            _Asked(connection, run, until_ns, "scan", f"NOT ({_IS_LOOK})", way),
            partial(
                fetch,
                numbers=_SCAN_NUMBERS,
                packed=("r.readings",),
                seldom=("r.own_stamp_ns",),
                seldom_packed=("r.detail",),
            ),
            is_whole,
        )
        return cls(found, sets)

    @property
    def brought(self) -> NDArray[np.bool_]:
        """Which of them observed anything."""
        brought: NDArray[np.bool_] = (self.status == STATUS_OK) | (self.sensors > 0)
        brought &= self.kind == KIND_READING
        return brought


class Looks:
    """Looks that saw flowers, one of each series, a column each."""

    def __init__(self, found: Columns) -> None:
        self.series, self.stamp, lag, mission, *told, self.id, self.tag, own = found.numbers
        self.told = told  # species, anomaly, number of flowers, of bugs
        self.sealed_with = (self.series, self.stamp, own, lag, mission, *told)
        (self.shape,) = found.packed


def looks_of(connection: sqlite3.Connection, run: int, until_ns: int) -> Looks:
    """The newest look at the flowers of each tag, by each source."""

    def is_whole(found: Columns) -> NDArray[np.bool_]:
        looks = Looks(found)
        return whole(looks.sealed_with, looks.shape)

    found = _of_each(
        _Asked(connection, run, until_ns, "look", _IS_LOOK, "DESC"),
        partial(fetch, numbers=_LOOK_NUMBERS, packed=("r.shape",), seldom=("r.own_stamp_ns",)),
        is_whole,
    )
    return Looks(found)


class _Asked(NamedTuple):
    connection: sqlite3.Connection
    run: int
    until_ns: int
    table: str
    which: str
    way: str


def _of_each(
    asked: _Asked,
    fetched: Callable[..., Columns],
    is_whole: Callable[[Columns], NDArray[np.bool_]],
) -> Columns:
    """The newest (DESC) or first (ASC) row of each series that is whole."""

    def ask(but: str, *values: object) -> Columns:
        text = _OF_EACH.format(but=but, **asked._asdict())
        return fetched(asked.connection, found=text, values=(asked.run, asked.until_ns, *values))

    found = ask("")
    is_sound = is_whole(found)
    if is_sound.all():
        return found
    damaged = [
        number
        for series in found.numbers[0][~is_sound].tolist()
        for number in _damaged(asked, series)
    ]
    return ask("AND id NOT IN (SELECT value FROM json_each(?3)) ", json.dumps(damaged))


def _damaged(asked: _Asked, series: int) -> Iterator[int]:
    """The rows of a series before the first that is whole, from that end."""
    what, way = (SCAN, asked.way) if asked.table == "scan" else (LOOK, asked.way)
    names = asked.connection.execute(
        "SELECT names FROM series JOIN sensors ON sensors.id = sensors WHERE series.id = ?",
        (series,),
    ).fetchone()
    sensors = len(sensor_names(names[0])) if names else 0
    for row in asked.connection.execute(
        f"SELECT {what} FROM {asked.table} WHERE series = ? AND stamp_ns <= ?"  # noqa: S608
        f" ORDER BY stamp_ns {way}, id {way}",
        (series, asked.until_ns),
    ):
        try:
            body = unseal(columns(series, *row[2:-1]), row[-1])
            if asked.table == "scan":
                unpack_numbers(body, sensors)
        except Damaged:
            yield row[0]
        else:
            return
