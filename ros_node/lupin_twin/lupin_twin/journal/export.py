"""Every reading and every try of a period, in the order of time, at the pace of whoever takes them.

A lot is read in one short transaction: whoever takes an hour over ten million rows keeps the log
from being put into the file for no longer than that, and what is kept of them is one stretch of
time, whose length follows from how much the last one held.
"""

from __future__ import annotations

import math
import sqlite3
from collections import deque
from collections.abc import Iterator
from typing import Any, Final

from lupin_twin.journal.packing import Damaged, columns, unpack_numbers, unseal
from lupin_twin.journal.reading import SCAN, Series, all_series, one_view, pins
from lupin_twin.journal.retention import purged_ns
from lupin_twin.journal.runs import Run
from lupin_twin.journal.spans import Span, behind, spans_within
from lupin_twin.past import NotRemembered, PastRow

LOT: Final = 1_000
# Scans that are read in one go, and what that costs, about, s; fewer of those with more readings.
_STRETCH: Final = 5_000
_READINGS: Final = 8
STRETCH_S: Final = 0.1
_FIRST_STRETCH_NS: Final = 60 * 1_000_000_000
_SCAN: Final = "SELECT " + ", ".join(f"scan.{column}" for column in SCAN.split(", "))
_NOWHERE: Final = (math.nan, math.nan)
_NO_READING: Final = (("", math.nan),)


def rows(
    connection: sqlite3.Connection,
    start_ns: int,
    end_ns: int,
    tag_id: str | None = None,
    sensor_type: str | None = None,
) -> Iterator[list[PastRow]]:
    """Lots of at most `LOT` rows, see `Export`."""
    export = Export(start_ns, end_ns, tag_id, sensor_type)
    while (found := export.step(connection)) is not None:
        yield from lots(found)


def lots(found: list[PastRow]) -> Iterator[list[PastRow]]:
    """Rows, `LOT` at a time."""
    for first in range(0, len(found), LOT):
        yield found[first : first + LOT]


class Export:
    """The rows of a period; None: of all tags; of all sensors, and of tries without a reading.

    Each step may be over another connection. An export that what is given up has overtaken is not
    whole, and does not look so.
    """

    def __init__(
        self, start_ns: int, end_ns: int, tag_id: str | None, sensor_type: str | None
    ) -> None:
        self._period = (start_ns, end_ns)
        self._tag_id = tag_id
        self._sensor_type = sensor_type
        self._spans: deque[Span] | None = None
        self._at_ns = 0
        self._length_ns = _FIRST_STRETCH_NS
        self._run: Run | None = None
        self._series: dict[int, Series] = {}
        self._scans = _STRETCH
        self._places: dict[int, tuple[float, float]] = {}
        # The last stamp of each run that was given up when the first row was told.
        self._given_up_ns: dict[int, int] = {}
        self._has_told = False

    def step(self, connection: sqlite3.Connection) -> list[PastRow] | None:
        """The rows of the next stretch of time, maybe none; None: that was all.

        Raises:
            NotRemembered: behind rows that were told, some are given up since.

        """
        with one_view(connection):
            if self._spans is None:
                self._spans = deque(spans_within(connection, *self._period))
            if not self._has_told:
                self._given_up_ns = {
                    span.run.id: purged_ns(connection, span.run) for span in self._spans
                }
            while self._spans and self._spans[0].end_ns <= self._at_ns:
                self._spans.popleft()
            return self._stretch(connection, self._spans[0]) if self._spans else None

    def _stretch(self, connection: sqlite3.Connection, span: Span) -> list[PastRow]:
        if self._run != span.run:
            self._run, self._places = span.run, _places(connection, span.run)
            self._know_series(connection, span.run)
        stretch = self._scans
        start_ns = max(self._at_ns, span.start_ns)
        given_up_ns = purged_ns(connection, span.run)
        if given_up_ns >= start_ns and given_up_ns > self._given_up_ns[span.run.id]:
            why = "scans that come next were given up while others were taken: begin again"
            raise NotRemembered(why, is_lasting=False)
        while True:
            until_ns = min(start_ns + self._length_ns, span.end_ns)
            # Of one stamp there are as many scans as there are.
            limit = -1 if self._length_ns == 1 else 4 * stretch
            scans = self._select(connection, f"{_SCAN} FROM {{}} LIMIT {limit}", start_ns, until_ns)
            if len(scans) != limit:
                break
            self._length_ns = max(1, self._length_ns // 8)
        self._at_ns = until_ns
        if not scans:
            ((next_ns,),) = self._select(
                connection, "SELECT min(stamp_ns) FROM {}", until_ns, span.end_ns
            )
            self._at_ns = span.end_ns if next_ns is None else next_ns
        more = stretch / max(len(scans), stretch // 8, 1)
        self._length_ns = max(1, int(self._length_ns * more))
        scans.sort(key=lambda scan: (scan[2], scan[0]))
        self._has_told |= bool(scans)
        return self._read(connection, scans, span.run)

    def _know_series(self, connection: sqlite3.Connection, run: Run) -> None:
        self._series = {series.id: series for series in all_series(connection, run)}
        widest = max((len(series.sensors) for series in self._series.values()), default=0)
        self._scans = max(1, _STRETCH * _READINGS // max(_READINGS, widest))

    def _select(
        self, connection: sqlite3.Connection, sql: str, start_ns: int, end_ns: int
    ) -> list[tuple[Any, ...]]:
        assert self._run is not None
        of_tag = "" if self._tag_id is None else "AND tag = (SELECT id FROM tag WHERE tag_id = ?)"
        source = (
            f"series CROSS JOIN scan ON series = series.id WHERE run = ? {of_tag}"
            " AND stamp_ns >= ? AND stamp_ns < ?"
        )
        tag = () if self._tag_id is None else (self._tag_id,)
        within = (self._run.id, *tag, start_ns, end_ns)
        return connection.execute(sql.format(source), within).fetchall()

    def _read(
        self, connection: sqlite3.Connection, scans: list[tuple[Any, ...]], run: Run
    ) -> list[PastRow]:
        found: list[PastRow] = []
        if not all(scan[1] in self._series for scan in scans):
            # Series come while it is taken.
            self._know_series(connection, run)
        for scan in scans:
            series = self._series.get(scan[1])
            if series is None:
                continue
            try:
                body = unseal(columns(*scan[1:-1]), scan[-1])
                values = unpack_numbers(body, len(series.sensors))
            except Damaged:
                continue
            x, y = self._places.get(series.tag, _NOWHERE)
            readings = zip(series.sensors, values, strict=True)
            found += [
                PastRow(scan[2], series.tag_id, x, y, sensor, value, series.status, series.source)
                for sensor, value in (readings if values else _NO_READING)
                if self._sensor_type in (None, sensor)
            ]
        return found


def _places(connection: sqlite3.Connection, run: Run) -> dict[int, tuple[float, float]]:
    """Where tags are, by their numbers: what was known first holds."""
    places: dict[int, tuple[float, float]] = {}
    for past, *_ in reversed(list(behind(connection, run))):
        for tag, _, pin in pins(connection, past):
            if pin is not None:
                places.setdefault(tag, (pin.pose.x, pin.pose.y))
    return places
