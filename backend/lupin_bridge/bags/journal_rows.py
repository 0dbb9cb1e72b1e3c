"""What a journal holds of a period, write by write, in the order of hearing."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from typing import Any, Final

from lupin_twin.journal.packing import Damaged
from lupin_twin.journal.reading import (
    LOOK,
    SCAN,
    Names,
    Series,
    all_series,
    look_of,
    one_view,
    pins,
    scan_of,
)
from lupin_twin.journal.rows import LookRow, PinRow, Row, ScanRow
from lupin_twin.journal.runs import Run
from lupin_twin.journal.spans import behind, spans_within

# Rows that are read in one go, in one short transaction: the log may not grow meanwhile for long.
LOT: Final = 2_000


class JournalRows:
    """The writes with `start_ns <= stamp < end_ns`; `damaged` counts those that cannot be read.

    `places` are those that tags have before: by an earlier write, or an earlier run of the clock.
    """

    def __init__(self, connection: sqlite3.Connection, start_ns: int, end_ns: int) -> None:
        self.damaged = 0
        self._connection = connection
        self._period = (start_ns, end_ns)
        self._series: dict[int, Series] = {}
        self._names = Names(connection)
        with one_view(connection):
            self._spans = spans_within(connection, start_ns, end_ns)
            self.runs: dict[int, Run] = {span.run.id: span.run for span in self._spans}
            self.places, self._pinned = self._pins()

    @property
    def is_simulated(self) -> bool:
        """Whether any of it goes by a clock that was simulated."""
        return any(run.begun.is_simulated for run in self.runs.values())

    def __iter__(self) -> Iterator[tuple[Run, Row]]:
        """Each with the run of the clock that it belongs to."""
        pinned = sorted(self._pinned.items(), reverse=True)
        after = 0
        while True:
            with one_view(self._connection):
                found, last = self._lot(after)
            for number, run, row in found:
                while pinned and pinned[-1][0] <= number:
                    yield pinned.pop()[1]
                yield run, row
            if last is None:
                break
            after = last
        while pinned:
            yield pinned.pop()[1]

    def _pins(self) -> tuple[list[PinRow], dict[int, tuple[Run, PinRow]]]:
        """The places that tags have before, and those that they get within, by their numbers."""
        before: dict[str, tuple[int, PinRow]] = {}
        within: dict[int, tuple[Run, PinRow]] = {}
        for run in self.runs.values():
            for past, *_ in behind(self._connection, run):
                for _, number, pin in pins(self._connection, past):
                    if pin is None:
                        self.damaged += past is run
                    elif past.id in self.runs and self._holds(past, pin.stamp_ns):
                        within[number] = (past, pin)
                    elif past.id not in self.runs or pin.stamp_ns < self._period[0]:
                        kept = before.get(pin.tag_id)
                        if kept is None or number < kept[0]:
                            before[pin.tag_id] = (number, pin)
        ordered = sorted(before.values(), key=lambda entry: entry[0])
        return [pin for _, pin in ordered], within

    def _holds(self, run: Run, stamp_ns: int) -> bool:
        return any(
            span.run.id == run.id and span.start_ns <= stamp_ns < span.end_ns
            for span in self._spans
        )

    def _lot(self, after: int) -> tuple[list[tuple[int, Run, ScanRow | LookRow]], int | None]:
        """The next rows by their numbers, and the number of the last; None: that is all."""
        rows: list[tuple[int, str, tuple[Any, ...]]] = []
        last: int | None = None
        for table, what in (("scan", SCAN), ("look", LOOK)):
            found = self._connection.execute(
                f"SELECT {what} FROM {table} WHERE id > ? AND stamp_ns >= ? AND stamp_ns < ?"  # noqa: S608  # constants
                " ORDER BY id LIMIT ?",
                (after, *self._period, LOT),
            ).fetchall()
            rows += [(row[0], table, row) for row in found]
            if len(found) == LOT:
                last = found[-1][0] if last is None else min(last, found[-1][0])
        rows.sort(key=lambda entry: entry[0])
        made = [
            self._row(number, table, row)
            for number, table, row in rows
            if last is None or number <= last
        ]
        return [entry for entry in made if entry is not None], last

    def _row(
        self, number: int, table: str, row: tuple[Any, ...]
    ) -> tuple[int, Run, ScanRow | LookRow] | None:
        if row[1] not in self._series:  # some come while it is read
            self._series = {series.id: series for series in all_series(self._connection)}
        series = self._series.get(row[1])
        if series is None:
            self.damaged += 1
            return None
        if not self._holds(series.run, row[2]):
            return None
        make = scan_of if table == "scan" else look_of
        try:
            return number, series.run, make(row, series, self._names)
        except Damaged:
            self.damaged += 1
            return None
