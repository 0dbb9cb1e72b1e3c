# ruff: noqa: S608  # SQL is put together of constants
"""What was received, write by write: behind a number, recently, in a period; copies left out."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from typing import Any, Final

from lupin_twin.core.past import (
    MAX_SCANS,
    RECENT_COUNT,
    PastWrite,
    PastWrites,
    PeriodRequest,
    RecentRequest,
    RunSpan,
    ScansRequest,
    WritesRequest,
    recent_of,
)
from lupin_twin.core.state import sure_species
from lupin_twin.journal.checking import WRITTEN
from lupin_twin.journal.events import FROM_SCAN
from lupin_twin.journal.rows import KIND_FLOWER, STATUS_OK, named_numbers, sensor_names
from lupin_twin.journal.runs import Span, cut, runs, span_at, spans
from lupin_twin.journal.schema import SiteLog

# What an answer of so many writes takes, about, s.
WRITES_S: Final = 0.05

_NEWEST: Final = "SELECT max(seq) FROM {} WHERE site = :site"
_ARRIVAL: Final = (
    "SELECT seq, arrival_ns FROM scan WHERE site = :site AND seq > :after ORDER BY seq LIMIT 1"
)
_SCANS: Final = (
    "SELECT seq, run, tag, stamp_ns, kind, status, sensors, readings FROM scan JOIN series"
    " ON series.site = scan.site AND series.series = scan.series"
    " WHERE scan.site = :site AND seq > :after AND is_copy = 0 ORDER BY seq LIMIT :count"
)
_INSPECTIONS: Final = (
    "SELECT seq, run, tag, stamp_ns, species, confidence, anomaly, bug_count FROM look"
    " WHERE site = :site AND seq > :after AND is_copy = 0 ORDER BY seq LIMIT :count"
)
# Of each series, or tag, from the stamp on of the last that is recent. With a limit neither engine
# makes the search part of the join, where PostgreSQL would do it again for each row.
_FIRST_RECENT: Final = (
    "(SELECT s.*, coalesce((SELECT DISTINCT stamp_ns FROM {table} WHERE site = s.site"
    " AND {which} AND stamp_ns <= :at AND is_copy = 0 ORDER BY stamp_ns DESC LIMIT 1 OFFSET :more),"
    " 0) AS first_ns FROM series AS s WHERE s.site = :site AND s.run = :run AND {kind}"
    " LIMIT 1000000) AS s CROSS JOIN {table} AS r"
)
_FIRST_SCAN: Final = _FIRST_RECENT.format(
    table="scan", which="series = s.series", kind="s.kind = 0 AND s.sensors != '[]'"
)
_FIRST_INSPECTION: Final = _FIRST_RECENT.format(
    table="look", which="run = s.run AND tag = s.tag", kind="s.kind = 1"
)
_IN_TIME: Final = "r.is_copy = 0 AND r.stamp_ns <= :at AND r.stamp_ns >= s.first_ns"
_RECENT_SCANS: Final = (
    "SELECT r.seq, s.run, s.tag, r.stamp_ns, s.kind,"
    f" r.status, s.sensors, r.readings FROM {_FIRST_SCAN}"
    f" WHERE r.site = s.site AND r.series = s.series AND {_IN_TIME}"
)
_RECENT_INSPECTIONS: Final = (
    "SELECT r.seq, r.run, r.tag, r.stamp_ns, r.species, r.confidence,"
    f" r.anomaly, r.bug_count FROM {_FIRST_INSPECTION}"
    f" WHERE r.site = s.site AND r.run = s.run AND r.tag = s.tag AND {_IN_TIME}"
)
_SCANS_BETWEEN: Final = (
    "SELECT seq, run, tag, stamp_ns, kind, status, sensors, readings " + FROM_SCAN.format(tag="")
)
_INSPECTIONS_BETWEEN: Final = (
    "SELECT seq, run, tag, stamp_ns, species, confidence, anomaly, bug_count FROM look"
    " WHERE site = :site AND run = :run AND stamp_ns >= :start AND stamp_ns < :end AND is_copy = 0"
)


def observed(connection: Any, request: PeriodRequest) -> PastWrites:
    """What was observed in a period; each moment is that of the run that holds it."""
    log = SiteLog(connection)
    axis = spans(runs(log.execute))
    found: list[PastWrite] = []
    for span in cut(axis, request.start_ns, request.end_ns):
        query = {"run": span.run.id, "start": span.start_ns, "end": span.end_ns}
        found += _of_scans(log.execute(_SCANS_BETWEEN, query).fetchall())
        found += _of_inspections(log.execute(_INSPECTIONS_BETWEEN, query).fetchall())
    found.sort(key=lambda write: (write.stamp_ns, write.number))
    return PastWrites(log.meta("journal_id") or "", _axis(axis), tuple(found), 0, is_all=True)


_SCANS_UP_TO: Final = (
    "SELECT seq, run, tag, stamp_ns, kind, status, sensors, readings"
    " FROM series AS s CROSS JOIN scan AS r WHERE s.site = :site AND run = :run AND kind = 0"
    " AND r.site = s.site AND r.series = s.series AND stamp_ns >= :since AND stamp_ns <= :at"
    " AND is_copy = 0 LIMIT :most"
)


def recent(connection: Any, request: RecentRequest) -> tuple[PastWrite, ...]:
    """What was recent at a moment."""
    log = SiteLog(connection)
    span = span_at(runs(log.execute), request.at_ns)
    if span is None:
        return ()
    query = {
        "run": span.run.id,
        "at": request.at_ns,
        "more": RECENT_COUNT - 1,
    }
    scans = log.execute(_RECENT_SCANS, query).fetchall()
    inspections = log.execute(_RECENT_INSPECTIONS, query).fetchall()
    return recent_of([*_of_scans(scans), *_of_inspections(inspections)], request.at_ns)


def scans(connection: Any, request: ScansRequest) -> tuple[PastWrite, ...]:
    """The scans of a stretch of time."""
    log = SiteLog(connection)
    span = span_at(runs(log.execute), request.at_ns)
    if span is None:
        return ()
    query = {"run": span.run.id, "since": request.since_ns, "at": request.at_ns}
    rows = log.execute(_SCANS_UP_TO, query | {"most": MAX_SCANS + 1}).fetchall()
    if len(rows) > MAX_SCANS:
        return ()
    wanted = {
        text: not request.sensors.isdisjoint(sensor_names(text))
        for text in {row[6] for row in rows}
    }
    found = _of_scans([row for row in rows if wanted[row[6]]])
    return tuple(sorted(found, key=lambda scan: (scan.stamp_ns, scan.number)))


def writes(connection: Any, request: WritesRequest) -> PastWrites:
    """The next writes, copies left out."""
    log = SiteLog(connection)
    newest = max(log.execute(_NEWEST.format(table)).fetchone()[0] or 0 for table in WRITTEN)
    after = request.after or _beginning(log, request, newest)
    query = {"after": after, "count": request.max_count}
    scans = log.execute(_SCANS, query).fetchall()
    inspections = log.execute(_INSPECTIONS, query).fetchall()
    found = sorted(
        [*_of_scans(scans), *_of_inspections(inspections)], key=lambda write: write.number
    )
    is_all = len(found) < request.max_count
    found = found[: request.max_count]
    last = max(newest, after) if is_all else found[-1].number
    axis = _axis(spans(runs(log.execute)))
    return PastWrites(log.meta("journal_id") or "", axis, tuple(found), last, is_all)


def _axis(found: Iterable[Span]) -> tuple[RunSpan, ...]:
    return tuple(RunSpan(span.run.id, span.start_ns, span.end_ns) for span in found)


def _beginning(log: SiteLog, request: WritesRequest, newest: int) -> int:
    """The number before the first write that is requested: arrivals ascend with numbers."""
    low, high = 0, newest
    if request.reach_count:
        low = max(0, newest - request.reach_count)
    if not request.reach_s:
        return low
    since_ns = time.time_ns() - int(request.reach_s * 1e9)
    while low < high:
        middle = (low + high) // 2
        row = log.execute(_ARRIVAL, {"after": middle}).fetchone()
        if row is None or row[1] >= since_ns:
            high = middle
        else:
            low = row[0]
    return low


def _of_scans(rows: list[tuple[Any, ...]]) -> Iterator[PastWrite]:
    every = named_numbers((row[6] for row in rows), [row[7] for row in rows])
    for row, (names, values) in zip(rows, every, strict=True):
        seq, run, tag, stamp_ns, kind, status, *_ = row
        yield PastWrite(seq, run, tag, stamp_ns, kind, status, names, tuple(values))


def _of_inspections(rows: list[tuple[Any, ...]]) -> Iterator[PastWrite]:
    for seq, run, tag, stamp_ns, species, confidence, anomaly, bug_count in rows:
        seen = (sure_species(species, confidence), bool(anomaly), bug_count)
        yield PastWrite(seq, run, tag, stamp_ns, KIND_FLOWER, STATUS_OK, (), (), True, *seen)
