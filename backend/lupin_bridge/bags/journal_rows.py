"""What a journal holds of a period, write by write, in the order of hearing."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from typing import Any, Final

from lupin_twin.journal.reading import listed_rows
from lupin_twin.journal.rows import PinRow, Row
from lupin_twin.journal.runs import Run, runs, spans_within
from lupin_twin.journal.schema import LOCAL_SITE, one_view
from lupin_twin.state import Pose

# Rows that are read in one go, in one short transaction: the log may not grow meanwhile for long.
LOT: Final = 2_000

_TABLES: Final = ("scan", "look", "place")


class JournalRows:
    """The writes with `start_ns <= stamp < end_ns`.

    `places` are those that tags have before: by an earlier write, or an earlier run of the clock.
    """

    def __init__(self, connection: sqlite3.Connection, start_ns: int, end_ns: int) -> None:
        self._connection = connection
        self._period = {"site": LOCAL_SITE, "start": start_ns, "end": end_ns, "lot": LOT}
        with one_view(connection):
            self._spans = spans_within(runs(connection.execute), start_ns, end_ns)
            self.runs: dict[int, Run] = {span.run.id: span.run for span in self._spans}
            self.places = self._places_before(start_ns)

    @property
    def is_simulated(self) -> bool:
        """Whether any of it goes by a clock that was simulated."""
        return any(run.begun.is_simulated for run in self.runs.values())

    def __iter__(self) -> Iterator[tuple[Run, Row]]:
        """Each with the run of the clock that it belongs to."""
        after = 0
        while True:
            with one_view(self._connection):
                found, last = self._lot(after)
            yield from found
            if last is None:
                return
            after = last

    def _places_before(self, start_ns: int) -> list[PinRow]:
        first: dict[str, PinRow] = {}
        for run in self.runs.values():
            for _, pin, is_copy in self._pins(run):
                if is_copy or pin.stamp_ns < start_ns:
                    first.setdefault(pin.tag_id, pin)
        return list(first.values())

    def _lot(self, after: int) -> tuple[list[tuple[Run, Row]], int | None]:
        """The next rows by their numbers, and the number of the last; None: that is all."""
        asked: dict[str, Any] = self._period | {"after": after}
        numbers = [
            [
                seq
                for (seq,) in self._connection.execute(
                    f"SELECT seq FROM {table} WHERE site = :site AND seq > :after"  # noqa: S608
                    " AND stamp_ns >= :start AND stamp_ns < :end AND is_copy = 0"
                    " ORDER BY seq LIMIT :lot",
                    asked,
                )
            ]
            for table in _TABLES
        ]
        last = min((found[-1] for found in numbers if len(found) == LOT), default=None)
        scans, looks, places = (
            [seq for seq in found if last is None or seq <= last] for found in numbers
        )
        within: list[tuple[int, Run, Row]] = []
        for run in self.runs.values():
            rows: list[tuple[int, Row]] = list(listed_rows(self._connection, run.id, scans, looks))
            rows += [(seq, pin) for seq, pin, _ in self._pins(run) if seq in places]
            within += [(seq, run, row) for seq, row in rows if self._holds(run, row.stamp_ns)]
        within.sort(key=lambda entry: entry[0])
        return [(run, row) for _, run, row in within], last

    def _pins(self, run: Run) -> Iterator[tuple[int, PinRow, bool]]:
        for seq, tag, stamp_ns, arrival_ns, is_copy, *pose in self._connection.execute(
            "SELECT seq, tag, stamp_ns, arrival_ns, is_copy, x, y, z, qx, qy, qz, qw FROM place"
            " WHERE site = :site AND run = :run ORDER BY seq",
            self._period | {"run": run.id},
        ):
            yield seq, PinRow(tag, stamp_ns, arrival_ns, Pose(*pose)), bool(is_copy)

    def _holds(self, run: Run, stamp_ns: int) -> bool:
        return any(
            span.run.id == run.id and span.start_ns <= stamp_ns < span.end_ns
            for span in self._spans
        )
