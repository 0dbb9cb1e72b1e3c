"""Every reading and every attempt of a period, in the order of time, at the pace of its reader.

A lot is read in one short transaction: a reader that takes an hour over ten million rows keeps the
log from being put into the file for no longer than that. What is in memory is one stretch of time,
whose length follows from how much the last one held.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator
from typing import Any, Final

from lupin_twin.journal.hours import deleted_ns
from lupin_twin.journal.reading import numbers_of, sensor_names
from lupin_twin.journal.runs import Run, Span, runs, spans_within
from lupin_twin.journal.schema import LOCAL_SITE
from lupin_twin.journal.site_log import SiteLog
from lupin_twin.past import NotRemembered, PastRow

LOT: Final = 1_000
# Readings that are read in one go, about, and what that costs, s.
_STRETCH: Final = 40_000
STRETCH_S: Final = 0.1
_FIRST_STRETCH_NS: Final = 60 * 1_000_000_000
_NOWHERE: Final = (math.nan, math.nan)
_NO_READING: Final = (("", math.nan),)

_FROM: Final = (
    "FROM series CROSS JOIN scan WHERE series.site = :site AND run = :run{tag}"
    " AND scan.site = :site AND scan.series = series.series"
    " AND stamp_ns >= :start AND stamp_ns < :end AND is_copy = 0"
)
_SCANS: Final = f"SELECT stamp_ns, seq, tag, sensors, status, source, readings {_FROM}"
_NEXT: Final = f"SELECT min(stamp_ns) {_FROM}"  # constants


def rows(  # noqa: PLR0917
    connection: Any,
    start_ns: int,
    end_ns: int,
    tag_id: str | None = None,
    sensor_type: str | None = None,
    site: str = LOCAL_SITE,
) -> Iterator[list[PastRow]]:
    """Lots of at most `LOT` rows, see `Export`."""
    export = Export(start_ns, end_ns, tag_id, sensor_type, site)
    while (found := export.step(connection)) is not None:
        yield from lots(found)


def lots(found: list[PastRow]) -> Iterator[list[PastRow]]:
    """Rows, `LOT` at a time."""
    for first in range(0, len(found), LOT):
        yield found[first : first + LOT]


class Export:
    """The rows of a period; None: of all tags; of all sensors, and of attempts without a reading.

    Each step may be over another connection. An export that deleting has overtaken is not whole,
    and does not look so.
    """

    def __init__(
        self,
        start_ns: int,
        end_ns: int,
        tag_id: str | None,
        sensor_type: str | None,
        site: str = LOCAL_SITE,
    ) -> None:
        self._period = (start_ns, end_ns)
        self._tag_id = tag_id
        self._sensor_type = sensor_type
        self._site = site
        self._spans: deque[Span] | None = None
        self._at_ns = 0
        self._length_ns = _FIRST_STRETCH_NS
        self._run: Run | None = None
        self._places: dict[str, tuple[float, float]] = {}
        # The last stamp of each run that was deleted when the first row was given.
        self._deleted_ns: dict[int, int] = {}
        self._has_begun = False

    def step(self, connection: Any) -> list[PastRow] | None:
        """The rows of the next stretch of time, maybe none; None: that was all.

        Raises:
            NotRemembered: behind rows that were given, some are deleted since.

        """
        log = SiteLog(connection, self._site)
        with log.one_view():
            if self._spans is None:
                self._spans = deque(spans_within(runs(log.execute, log.site), *self._period))
            if not self._has_begun:
                self._deleted_ns = {s.run.id: deleted_ns(log, s.run.id) for s in self._spans}
            while self._spans and self._spans[0].end_ns <= self._at_ns:
                self._spans.popleft()
            return self._stretch(log, self._spans[0]) if self._spans else None

    def _stretch(self, log: SiteLog, span: Span) -> list[PastRow]:
        if self._run != span.run:
            self._run, self._places = span.run, _places(log, span.run)
        start_ns = max(self._at_ns, span.start_ns)
        horizon_ns = deleted_ns(log, span.run.id)
        if horizon_ns >= start_ns and horizon_ns > self._deleted_ns[span.run.id]:
            why = "scans that come next were deleted while others were taken: begin again"
            raise NotRemembered(why, is_lasting=False)
        while True:
            until_ns = min(start_ns + self._length_ns, span.end_ns)
            # Of one stamp there are as many scans as there are.
            limit = "" if self._length_ns == 1 else f" LIMIT {_STRETCH}"
            scans = self._ask(log, _SCANS + limit, start_ns, until_ns)
            read = sum(1 + scan[-1].count(",") for scan in scans)
            if self._length_ns == 1 or read < _STRETCH:
                break
            self._length_ns = max(1, self._length_ns // 8)
        self._at_ns = until_ns
        if not scans:
            ((next_ns,),) = self._ask(log, _NEXT, until_ns, span.end_ns)
            self._at_ns = span.end_ns if next_ns is None else next_ns
        more = _STRETCH / 4 / max(read, _STRETCH // 32)
        self._length_ns = max(1, int(self._length_ns * more))
        self._has_begun |= bool(scans)
        return self._read(sorted(scans))

    def _ask(self, log: SiteLog, sql: str, start_ns: int, end_ns: int) -> list[tuple[Any, ...]]:
        assert self._run is not None
        of_tag = "" if self._tag_id is None else " AND tag = :tag"
        asked = {"run": self._run.id, "tag": self._tag_id, "start": start_ns, "end": end_ns}
        return list(log.execute(sql.replace("{tag}", of_tag), asked).fetchall())

    def _read(self, scans: list[tuple[Any, ...]]) -> list[PastRow]:
        found: list[PastRow] = []
        names = {text: sensor_names(text) for text in {scan[3] for scan in scans}}
        every = numbers_of([scan[-1] for scan in scans])
        for (stamp_ns, _, tag, sensors, status, source, _), values in zip(
            scans, every, strict=True
        ):
            x, y = self._places.get(tag, _NOWHERE)
            readings = zip(names[sensors], values, strict=True)
            found += [
                PastRow(stamp_ns, tag, x, y, sensor, value, status, source)
                for sensor, value in (readings if values else _NO_READING)
                if self._sensor_type in (None, sensor)
            ]
        return found


def _places(log: SiteLog, run: Run) -> dict[str, tuple[float, float]]:
    """Where tags are: what was known first holds, what was carried into the run before all."""
    found = log.execute(
        "SELECT tag, x, y FROM place WHERE site = :site AND run = :run ORDER BY seq DESC",
        {"run": run.id},
    )
    return {tag: (x, y) for tag, x, y in found.fetchall()}
