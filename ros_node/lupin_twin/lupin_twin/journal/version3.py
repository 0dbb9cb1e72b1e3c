# ruff: noqa: S608  # SQL is put together of constants
"""Reads a journal of version 3, whose rows are packed bytes, as far as its upgrade needs it.

Numbers are little-endian, float32 if that holds all of a row exactly, else float64. The last two
bytes of a row's blob are a check over the row's other columns and the bytes before: the high half
of Adler-32 (RFC 1950, section 8.2). A row whose check fails is left out and counted.
"""

from __future__ import annotations

import heapq
import sqlite3
import struct
import zlib
from collections.abc import Iterator
from contextlib import suppress
from typing import Any, Final, NamedTuple

from lupin_twin.core.past import HOUR_NS, SILENCE_NS, SLOT_NS, Event
from lupin_twin.core.state import (
    KIND_FLOWER,
    STATUS_OK,
    Bloom,
    Flower,
    Observation,
    Pin,
    Pose,
    Write,
)
from lupin_twin.journal.rows import sensor_names
from lupin_twin.journal.runs import Clock
from lupin_twin.journal.salvage import readable
from lupin_twin.journal.schema import DamagedFile, is_damage_error

VERSION: Final = 3

_SCAN: Final = "id, series, stamp_ns, own_stamp_ns, lag_us, mission, detail, readings"
_TALLIED: Final = {"scan": Event.SCANS, "failure": Event.FAILURES, "look": Event.INSPECTIONS}
_NOTHING: Final = -(2**63)
# What a run carries over from an earlier one: only places, or everything.
_PLACES, _ALL = 1, 2
_COLUMN: Final = struct.Struct("<q")
_SHAPE: Final = struct.Struct("<HHH")  # flowers, corners of the box, species named
_LENGTH: Final = struct.Struct("<H")
_BLOOM: Final = struct.Struct("<?H")  # anomaly, which species
# An hour of one sensor: count, mean, least, largest.
_BUCKETS: Final = {
    layout.size: layout for layout in map(struct.Struct, ("<Hdff", "<Idff", "<Hddd", "<Iddd"))
}

Bucket = tuple[int, float, float, float]


class OldRun(NamedTuple):
    """A run of the clock; it carries over what was known in the run `follows`, or only places."""

    id: int
    begun: Clock
    follows: int | None
    places_only: bool
    ended_ns: int | None


# An hour of a set of sensors at a tag, for each of them count, sum, least and largest.
OldHour = tuple[str, int, tuple[str, ...], int, list[Bucket]]


# A write's number, and its run; None for a damaged one.
_Numbered = tuple[int, int, Write | None]


class _Series(NamedTuple):
    run: int
    tag: int
    tag_id: str
    kind: int
    status: int
    source: str
    sensors: tuple[str, ...]


class _BadRow(ValueError):
    """The row is not what was written."""


class Version3:
    """Reads an open file of version 3.

    `damaged` counts what was left out, except the rows that `rows` returns as None.

    Raises:
        sqlite3.Error: the file cannot be read at all.

    """

    def __init__(self, connection: sqlite3.Connection) -> None:
        self._connection = connection
        self.damaged = 0
        self.runs = {run.id: run for run in self._runs()}
        self._leads = {
            run.id: run.begun.arrival_ns - run.begun.stamp_ns if run.begun.is_simulated else 0
            for run in self.runs.values()
        }
        self._tags = {row[0]: str(row[1]) for row in self._table("tag", "id, tag_id")}
        self._names = {row[0]: str(row[1]) for row in self._table("name", "id, text")}
        self._series = dict(self._every_series())
        # Only numbers are used, see `meta`.
        self._meta = {row[0]: row[1] for row in connection.execute("SELECT key, value FROM meta")}

    def meta(self, key: str, default: int = 0) -> int:
        """A number in the file's table `meta`; `default` if it was never set."""
        value = self._meta.get(key)
        return value if isinstance(value, int) else default

    def rows(self, after: int) -> Iterator[_Numbered]:
        """Each write after a number, in the order in which they were received."""
        every = self._scans(after), self._inspections(after), self._pins(after)
        yield from heapq.merge(*every, key=lambda row: row[0])

    def last_id(self) -> int:
        """The approximate number of the last write."""
        found = self._all("SELECT max(id) FROM scan UNION SELECT max(id) FROM look", ())
        return max(1, *(number or 0 for (number,) in found))

    def hours(self, run: int, until: int) -> Iterator[OldHour]:
        """The counts of readings up to an hour, for each series by itself."""
        # Tags in the order in which they were first received.
        for number, series in sorted(self._series.items(), key=lambda entry: entry[1].tag):
            if series.run != run or not series.sensors:
                continue
            for hour, packed in self._all(
                "SELECT hour, buckets FROM rollup WHERE series = ? AND hour <= ? ORDER BY hour",
                (number, until),
            ):
                try:
                    buckets = _buckets(packed, len(series.sensors))
                except _BadRow:
                    self.damaged += 1
                else:
                    yield series.tag_id, series.kind, series.sensors, hour, buckets

    def tally(self, run: int, until: int) -> Iterator[tuple[object, ...]]:
        """Attempts up to an hour: the event, hour, count, sum, least, largest, first and last."""
        columns = ", ".join(
            f"{kind}_{part}" for kind in _TALLIED for part in ("n", "total", "low", "high")
        )
        for hour, first_ns, last_ns, *numbers in self._all(
            f"SELECT slot, first_ns, last_ns, {columns} FROM tally_hour"
            " WHERE run = ? AND slot <= ?",
            (run, until),
        ):
            for index, event in enumerate(_TALLIED.values()):
                if numbers[4 * index]:
                    yield event, hour, *numbers[4 * index : 4 * index + 4], first_ns, last_ns

    def event(self, run: int, until: int) -> Iterator[tuple[object, ...]]:
        """Rare events up to an hour: silences of more than ten minutes, and changes of pests.

        Yields event, stamp, number, tag, value.
        """
        last: int | None = None
        for first_ns, last_ns in self._all(
            "SELECT first_ns, last_ns FROM tally WHERE run = ? AND slot < ? ORDER BY slot",
            (run, (until + 1) * HOUR_NS // SLOT_NS),
        ):
            if last is not None and first_ns - last > SILENCE_NS:
                yield Event.SILENCES, last, 0, "", first_ns - last
            last = last_ns
        for number, tag, stamp_ns, anomaly, bugs in self._all(
            "SELECT id, tag, stamp_ns, anomaly, bug_count FROM change WHERE run = ?"
            " AND (stamp_ns < ? OR id NOT IN (SELECT id FROM look))",
            (run, (until + 1) * HOUR_NS),
        ):
            if tag in self._tags:
                event = Event.PESTS_SEEN if anomaly else Event.PESTS_CLEARED
                yield event, stamp_ns, number, self._tags[tag], bugs

    def _all(self, sql: str, values: tuple[object, ...]) -> list[tuple[Any, ...]]:
        """Query the counts of deleted rows; returns none if they are damaged."""
        try:
            return self._connection.execute(sql, values).fetchall()
        except sqlite3.Error as error:
            if not is_damage_error(error):
                raise
            self.damaged += 1
            return []

    # --- small tables -------------------------------------------------------------------------

    def _runs(self) -> Iterator[OldRun]:
        for row in self._table(
            "run",
            "id, is_simulated, begun_stamp_ns, begun_arrival_ns, follows, carries, ended_stamp_ns",
        ):
            number, is_simulated, stamp_ns, arrival_ns, follows, carries, ended_ns = row
            begun = Clock(stamp_ns, arrival_ns, bool(is_simulated))
            is_known = carries in {_PLACES, _ALL} and follows is not None and follows < number
            yield OldRun(number, begun, follows if is_known else None, carries == _PLACES, ended_ns)

    def _every_series(self) -> Iterator[tuple[int, _Series]]:
        sets: dict[int, tuple[str, ...]] = {}
        for number, text in self._table("sensors", "id, names"):
            with suppress(DamagedFile):
                sets[number] = sensor_names(text)
        for row in self._table("series", "id, run, tag, kind, status, source, sensors"):
            number, run, tag, kind, status, source, sensors = row
            known = (run in self.runs, tag in self._tags, source in self._names, sensors in sets)
            if all(known):
                reported = (self._tags[tag], kind, status, self._names[source], sets[sensors])
                yield number, _Series(run, tag, *reported)

    # --- rows ---------------------------------------------------------------------------------

    def _scans(self, after: int) -> Iterator[_Numbered]:
        for row in self._table("scan", _SCAN, after):
            number, series_number, stamp_ns, own_stamp_ns, lag_us, mission, detail, packed = row
            try:
                series = self._series[series_number]
                values = _numbers(_unsealed(row[1:-1], packed), len(series.sensors))
                sent_ns = stamp_ns if own_stamp_ns is None else own_stamp_ns
                arrival_ns = stamp_ns + self._leads[series.run] + 1000 * lag_us
                of = (sent_ns, self._names[mission], arrival_ns)
                reported = (None, series.status, detail or "", series.source, *of, series.kind)
                named = dict(zip(series.sensors, values, strict=True))
                yield number, series.run, Observation(series.tag_id, stamp_ns, named, *reported)
            except (_BadRow, KeyError):
                yield number, 0, None

    def _inspections(self, after: int) -> Iterator[_Numbered]:
        what = (
            "id, series, stamp_ns, own_stamp_ns, lag_us, mission, species, anomaly, flower_count,"
            " bug_count, shape"
        )
        for row in self._table("look", what, after):
            number, series_number, stamp_ns, own_stamp_ns, lag_us, mission, *seen, packed = row
            species, anomaly, count, bugs = seen
            try:
                series = self._series[series_number]
                confidence, blooms, box = _shape(_unsealed(row[1:-1], packed))
                name = self._names[species]
                flower = Flower(name, confidence, bool(anomaly), count, bugs, blooms, box)
                arrival_ns = stamp_ns + self._leads[series.run] + 1000 * lag_us
                sent_ns = stamp_ns if own_stamp_ns is None else own_stamp_ns
                of = (sent_ns, self._names[mission], arrival_ns)
                reported = (None, STATUS_OK, "", series.source, *of, KIND_FLOWER, flower)
                yield number, series.run, Observation(series.tag_id, stamp_ns, {}, *reported)
            except (_BadRow, KeyError):
                yield number, 0, None

    def _pins(self, after: int) -> Iterator[_Numbered]:
        for row in self._table("pin", "id, run, tag, stamp_ns, lag_us, pose", after):
            number, run, tag, stamp_ns, lag_us, packed = row
            try:
                pose = Pose(*_numbers(_unsealed(row[1:-1], packed), 7))
                arrival_ns = stamp_ns + self._leads[run] + 1000 * lag_us
                yield number, run, Pin(self._tags[tag], pose, stamp_ns, arrival_ns)
            except (_BadRow, KeyError):
                yield number, 0, None

    def _table(self, table: str, what: str, after: int = -1) -> Iterator[tuple[Any, ...]]:
        """The rows of a table after a number, in their order, without unreadable ones."""
        for lot in readable(self._connection, f"SELECT {what} FROM {table} WHERE", "id", after):
            self.damaged += not lot
            yield from lot


# --- bytes ----------------------------------------------------------------------------------------


def _unsealed(columns: tuple[Any, ...], sealed: object) -> bytes:
    """Verify a row's check, and return its packed bytes."""
    if not isinstance(sealed, bytes) or len(sealed) < 2:
        raise _BadRow
    try:
        check = zlib.adler32(
            b"".join(
                value.encode("utf-8", "surrogatepass")
                if isinstance(value, str)
                else _COLUMN.pack(_NOTHING if value is None else value)
                for value in columns
            )
        )
    except struct.error as error:
        raise _BadRow from error
    if zlib.adler32(sealed[:-2], check) >> 16 != int.from_bytes(sealed[-2:], "little"):
        raise _BadRow
    return sealed[:-2]


def _numbers(packed: bytes, count: int) -> tuple[float, ...]:
    for letter in "df":
        layout = f"<{count}{letter}"
        if struct.calcsize(layout) == len(packed):
            return struct.unpack(layout, packed)
    raise _BadRow


def _buckets(packed: bytes, count: int) -> list[Bucket]:
    layout = _BUCKETS.get(len(packed) // count)
    if layout is None or layout.size * count != len(packed):
        raise _BadRow
    return [(n, n * mean, low, high) for n, mean, low, high in layout.iter_unpack(packed)]


def _shape(
    packed: bytes,
) -> tuple[float, tuple[Bloom, ...], tuple[tuple[float, float, float], ...]]:
    """(confidence, blooms, box) of an inspection."""
    try:
        bloom_count, corner_count, species_count = _SHAPE.unpack_from(packed)
        at = _SHAPE.size
        species = []
        for _ in range(species_count):
            (length,) = _LENGTH.unpack_from(packed, at)
            at += _LENGTH.size
            species.append(packed[at : at + length].decode("utf-8", "surrogatepass"))
            at += length
        marks = [_BLOOM.unpack_from(packed, at + i * _BLOOM.size) for i in range(bloom_count)]
        at += bloom_count * _BLOOM.size
        numbers = iter(_numbers(packed[at:], 1 + 5 * bloom_count + 3 * corner_count))
        confidence = next(numbers)
        blooms = []
        for is_odd, index in marks:
            x, y, z, height_m, sure = (next(numbers) for _ in range(5))
            blooms.append(Bloom(x, y, z, height_m, species[index], sure, is_odd))
        box = tuple((next(numbers), next(numbers), next(numbers)) for _ in range(corner_count))
    except (struct.error, UnicodeDecodeError, IndexError) as error:
        raise _BadRow from error
    return confidence, tuple(blooms), box
