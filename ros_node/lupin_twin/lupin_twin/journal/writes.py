"""What was received, write by write, in that order: see `lupin_twin.past_writes`."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any, Final

from lupin_twin.journal.reading import numbers_of, sensor_names
from lupin_twin.journal.rows import KIND_FLOWER, STATUS_OK
from lupin_twin.journal.runs import runs, span_at, spans
from lupin_twin.journal.schema import LOCAL_SITE
from lupin_twin.journal.site_log import SiteLog
from lupin_twin.past_writes import (
    RECENT_COUNT,
    PastWrite,
    PastWrites,
    RecentRequest,
    RunSpan,
    WritesRequest,
    recent_of,
)
from lupin_twin.state import sure_species

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
_LOOKS: Final = (
    "SELECT seq, run, tag, stamp_ns, species, confidence, anomaly, bug_count FROM look"
    " WHERE site = :site AND seq > :after AND is_copy = 0 ORDER BY seq LIMIT :count"
)
# Of each series, or tag, from the stamp on of the last that is recent.
_FIRST_RECENT: Final = (
    "coalesce((SELECT DISTINCT stamp_ns FROM {table} WHERE site = s.site AND {which}"
    " AND stamp_ns <= :at AND is_copy = 0 ORDER BY stamp_ns DESC LIMIT 1 OFFSET :more), 0)"
)
_FIRST_SCAN: Final = _FIRST_RECENT.format(table="scan", which="series = s.series")
_FIRST_LOOK: Final = _FIRST_RECENT.format(table="look", which="run = s.run AND tag = s.tag")
_IN_TIME: Final = "r.is_copy = 0 AND r.stamp_ns <= :at AND r.stamp_ns >="
_RECENT_SCANS: Final = (
    "SELECT r.seq, s.run, s.tag, r.stamp_ns, s.kind,"  # noqa: S608
    " r.status, s.sensors, r.readings FROM series AS s CROSS JOIN scan AS r"
    " WHERE s.site = :site AND s.run = :run AND s.kind = 0"
    " AND s.sensors != '[]' AND r.site = s.site"
    f" AND r.series = s.series AND {_IN_TIME} {_FIRST_SCAN}"
)
_RECENT_LOOKS: Final = (
    "SELECT r.seq, r.run, r.tag, r.stamp_ns, r.species, r.confidence,"  # noqa: S608
    " r.anomaly, r.bug_count FROM series AS s CROSS JOIN look AS r"
    " WHERE s.site = :site AND s.run = :run AND s.kind = 1"
    " AND r.site = s.site AND r.run = s.run AND r.tag = s.tag"
    f" AND {_IN_TIME} {_FIRST_LOOK}"
)


def recent(
    connection: Any, request: RecentRequest, site: str = LOCAL_SITE
) -> tuple[PastWrite, ...]:
    """What was recent at a moment."""
    log = SiteLog(connection, site)
    with log.one_view():
        span = span_at(runs(log.execute, log.site), request.at_ns)
        if span is None:
            return ()
        asked = {
            "run": span.run.id,
            "at": request.at_ns,
            "more": RECENT_COUNT - 1,
        }
        scans = log.execute(_RECENT_SCANS, asked).fetchall()
        looks = log.execute(_RECENT_LOOKS, asked).fetchall()
        return recent_of([*_of_scans(scans), *_of_looks(looks)], request.at_ns)


def writes(connection: Any, request: WritesRequest, site: str = LOCAL_SITE) -> PastWrites:
    """The next writes, copies left out."""
    log = SiteLog(connection, site)
    with log.one_view():
        newest = max(
            log.execute(_NEWEST.format(table)).fetchone()[0] or 0 for table in ("scan", "look")
        )
        after = request.after or _beginning(log, request, newest)
        asked = {"after": after, "count": request.max_count}
        scans = log.execute(_SCANS, asked).fetchall()
        looks = log.execute(_LOOKS, asked).fetchall()
        found = sorted([*_of_scans(scans), *_of_looks(looks)], key=lambda write: write.number)
        is_all = len(found) < request.max_count
        found = found[: request.max_count]
        last = max(newest, after) if is_all else found[-1].number
        axis = tuple(
            RunSpan(s.run.id, s.start_ns, s.end_ns) for s in spans(runs(log.execute, log.site))
        )
        return PastWrites(_journal_id(log), axis, tuple(found), last, is_all)


def _beginning(log: SiteLog, request: WritesRequest, newest: int) -> int:
    """The number before the first write that is asked for: arrivals ascend with numbers."""
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
    names = {text: sensor_names(text) for text in {row[6] for row in rows}}
    every = numbers_of([row[7] for row in rows])
    for row, values in zip(rows, every, strict=True):
        seq, run, tag, stamp_ns, kind, status, sensors, _ = row
        yield PastWrite(seq, run, tag, stamp_ns, kind, status, names[sensors], tuple(values))


def _of_looks(rows: list[tuple[Any, ...]]) -> Iterator[PastWrite]:
    for seq, run, tag, stamp_ns, species, confidence, anomaly, bug_count in rows:
        seen = (sure_species(species, confidence), bool(anomaly), bug_count)
        yield PastWrite(seq, run, tag, stamp_ns, KIND_FLOWER, STATUS_OK, (), (), True, *seen)


def _journal_id(log: SiteLog) -> str:
    """One log's name among logs: what was quarantined has another in its place."""
    found = log.execute(
        "SELECT value FROM meta WHERE site = :site AND key = :key", {"key": "journal_id"}
    ).fetchone()
    return str(found[0]) if found else ""
