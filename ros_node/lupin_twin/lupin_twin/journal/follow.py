# ruff: noqa: S608  # SQL is put together of constants
"""A log by its numbers: copied from where it left off, and what was received, write by write.

At least once on the way, exactly once in the file: a lot is one transaction, and rows that are
there are known by their numbers. A file holds one journal and has its identity; of another journal
another file is made. What is counted by the hour is counted anew of the rows that come; up to where
the journal has deleted rows, it comes as it was counted there. What is deleted or forgotten
meanwhile is deleted here too.
"""

from __future__ import annotations

import json
import sqlite3
import time
from collections.abc import Iterable, Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, NamedTuple

from lupin_twin.core.parameters import World
from lupin_twin.core.past import (
    HOUR_NS,
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
from lupin_twin.journal.appending import PURGED_SEQ, Stretch, simulated
from lupin_twin.journal.checking import WRITTEN
from lupin_twin.journal.events import FROM_SCAN
from lupin_twin.journal.hours import DELETED, FORGOTTEN, TALLIED, count_rows
from lupin_twin.journal.notes import id_behind, number_of
from lupin_twin.journal.retention import RECORD, Stretches, delete_recorded, kept
from lupin_twin.journal.rows import KIND_FLOWER, STATUS_OK, named_numbers, sensor_names
from lupin_twin.journal.runs import Span, cut, runs, span_at, spans, world_of
from lupin_twin.journal.schema import (
    DAY_LENGTH,
    LOCAL_SITE,
    ORIGIN,
    DamagedFile,
    SiteLog,
    get_meta,
    open_reader,
    open_writer,
    set_meta,
    transaction,
)

MAX_ROWS: Final = 2_000
_MAX_BYTES: Final = 1_000_000
# In the order in which rows of one number belong.
_NUMBERED: Final = ("series", "scan", "look", "place", "note")
_FACTS: Final = (
    *(DELETED, FORGOTTEN, "lost_ns:", PURGED_SEQ, "simulated_", RECORD, ORIGIN, DAY_LENGTH),
)
_FOLLOWED: Final = "followed_seq"
_COMPLETE: Final = "followed_to_ns"
_COLUMNS: Final = {
    "run": 7, "meta": 2, "series": 5, "scan": 11, "look": 16, "place": 13, "note": 7,
    "hour": 6, "tally": 9, "event": 6,
}  # fmt: skip
# Up to this hour rows of a run were deleted, or may have been.
_PURGED: Final = (
    "SELECT CAST(substr(key, instr(key, ':') + 1) AS INTEGER) AS run,"
    f" max(CAST(value AS INTEGER)) / {HOUR_NS} AS hour FROM meta WHERE site = :site"
    f" AND (key LIKE '{DELETED}%' OR key LIKE '{FORGOTTEN}%') GROUP BY 1"
)
_ATTEMPTS: Final = (
    f"SELECT series, run, stamp_ns / {HOUR_NS} AS hour FROM scan JOIN series USING (site, series)"
    " WHERE site = :site AND seq > :after AND seq <= :last AND is_copy = 0 UNION"
    f" SELECT NULL, run, stamp_ns / {HOUR_NS} FROM look"
    " WHERE site = :site AND seq > :after AND seq <= :last AND is_copy = 0"
)
# What is counted of such hours comes with the series, the rest with the first lot; and whenever
# attempts come late.
_WITH: Final = (
    f"WITH purged AS ({_PURGED}), late AS (SELECT DISTINCT a.series, a.run, a.hour"
    f" FROM ({_ATTEMPTS}) AS a JOIN purged AS p ON p.run = a.run AND a.hour <= p.hour)"
)
_EVENTS: Final = (
    "EXISTS (SELECT 1 FROM purged AS p WHERE p.run = event.run"
    f" AND event.stamp_ns < (p.hour + 1) * {HOUR_NS})"
    " AND (:after = 0 OR run IN (SELECT run FROM late))"
)
_COUNTED: Final = {
    "hour": (
        f"{_WITH} SELECT * FROM hour WHERE site = :site AND (series, hour) IN (SELECT series, hour"
        " FROM late) UNION SELECT h.* FROM series AS s JOIN purged AS p USING (run) JOIN hour AS h"
        " ON h.site = s.site AND h.series = s.series AND h.hour <= p.hour"
        " WHERE s.site = :site AND s.series > :after AND s.series <= :last"
    ),
    "tally": (
        f"{_WITH} SELECT t.* FROM purged AS p CROSS JOIN tally AS t ON t.site = :site"
        " AND t.run = p.run AND t.hour <= p.hour WHERE :after = 0"
        " UNION SELECT t.* FROM late CROSS JOIN tally AS t ON t.site = :site AND t.run = late.run"
        f" AND t.event IN {tuple(map(str, TALLIED))} AND t.hour = late.hour"
    ),
    "event": f"{_WITH} SELECT * FROM event WHERE site = :site AND {_EVENTS}",
}
_OTHER_EVENTS: Final = f"{_WITH} DELETE FROM event WHERE site = :site AND {_EVENTS}"
_HOURS_OF: Final = (
    "SELECT count(*) FROM hour WHERE site = :site AND series = :series AND hour <= :hour"
)
# What an hour takes as a row.
_HOUR_BYTES: Final = 120


class Lot(NamedTuple):
    """Rows behind a number, each a JSON list: its table, its columns but the site.

    `last` is the number to go on behind; `is_all`: nothing more was written yet.
    """

    journal: str
    rows: tuple[str, ...]
    last: int
    is_all: bool


@dataclass(frozen=True, slots=True)
class Followed:
    """How far a file is: the journal it is of, the last number, what it is of; as in `Condition`.

    A twin's own has no last number, and is complete up to its newest row.
    """

    journal: str
    last: int
    world: World
    complete_ns: int
    kept_ns: Stretches
    simulated_ns: Stretch | None


class NotALotError(ValueError):
    """Rows that are none of a log; the file is as it was."""


def read(connection: sqlite3.Connection, after: int, most: int = MAX_ROWS) -> Lot:
    """The rows behind a number, in the order of numbers, and all that is small."""
    log = SiteLog(connection)
    texts = [_text("run", row) for row in _all(log, "run")]
    texts += [_text("meta", row) for row in _all(log, "meta") if row[1].startswith(_FACTS)]
    found = [
        (number_of(row[1]) if table == "note" else row[1], rank, row)
        for rank, table in enumerate(_NUMBERED)
        for row in _behind(log, table, after, most)
    ]
    found.sort(key=lambda entry: entry[:2])
    purged: dict[int, int] = dict(log.execute(_PURGED).fetchall())
    last, weight, is_all = after, 0, True
    for place, (number, rank, row) in enumerate(found):
        if (place >= most or weight > _MAX_BYTES) and number != last:
            is_all = False
            break
        texts.append(_text(_NUMBERED[rank], row))
        last, weight = number, weight + len(texts[-1])
        if _NUMBERED[rank] == "series" and row[2] in purged:
            of_series = {"series": number, "hour": purged[row[2]]}
            weight += log.execute(_HOURS_OF, of_series).fetchone()[0] * _HOUR_BYTES
    if purged:
        for table, sql in _COUNTED.items():
            rows = log.execute(sql, {"after": after, "last": last}).fetchall()
            texts += [_text(table, row) for row in rows]
    return Lot(_journal_id(log), tuple(texts), last, is_all)


def write(path: Path, lot: Lot, complete_ns: int | None, behind: int = 0) -> Followed:
    """Put a lot, which was read `behind` a number, into its journal's file, made if need be.

    `complete_ns` is up to when the journal had all, ROS time, before it was asked for the lot; None
    where more follows.

    Raises:
        NotALotError: it cannot be what it says, or the file is no longer as far as `behind`.
        DamagedFile: it is not whole any more, and has to be made anew.
        Foreign, sqlite3.Error, OSError: as `open_writer`.

    """
    path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    with closing(open_writer(path)) as connection:
        with transaction(connection):
            if _last(connection) < behind:
                raise NotALotError(f"rows behind number {behind} for a file that ends before it")
            purged = _purged_seq(connection)
            set_meta(connection, "journal_id", lot.journal)
            try:
                _put(connection, lot)
            except (ValueError, TypeError, KeyError, IndexError, DamagedFile) as error:
                raise NotALotError(f"rows that are none of a log: {error}") from error
            if 0 < behind < _purged_seq(connection) != purged:
                raise DamagedFile("rows that it does not have yet were deleted in the journal")
            set_meta(connection, _FOLLOWED, max(lot.last, _last(connection)))
            if not lot.is_all or complete_ns is None:
                complete_ns = _newest_ns(connection)
            if complete_ns is not None:
                set_meta(connection, _COMPLETE, complete_ns)
        connection.execute("PRAGMA wal_checkpoint(PASSIVE)").fetchall()
        return _followed(connection)


def followed(path: Path) -> Followed:
    """How far a file is.

    Raises:
        Empty, Foreign, DamagedFile, sqlite3.Error, OSError: as `open_reader`.

    """
    with closing(open_reader(path)) as connection:
        return _followed(connection)


def _followed(connection: sqlite3.Connection) -> Followed:
    log = SiteLog(connection)
    return Followed(
        _journal_id(log),
        _last(connection),
        world_of(log),
        int(log.meta(_COMPLETE) or 0) or _newest_ns(connection) or 0,
        kept(connection),
        simulated(connection),
    )


def _last(connection: sqlite3.Connection) -> int:
    return int(get_meta(connection, _FOLLOWED) or 0)


def _newest_ns(connection: sqlite3.Connection) -> int | None:
    """The stamp of what was received last."""
    found = [
        row
        for table in WRITTEN
        for row in connection.execute(
            f"SELECT seq, stamp_ns FROM {table} WHERE site = ? ORDER BY seq DESC LIMIT 1",
            (LOCAL_SITE,),
        )
    ]
    return max(found)[1] if found else None


# --- out of a log ---------------------------------------------------------------------------------


def _all(log: SiteLog, table: str) -> list[tuple[Any, ...]]:
    return list(log.execute(f"SELECT * FROM {table} WHERE site = :site").fetchall())


def _behind(log: SiteLog, table: str, after: int, most: int) -> list[tuple[Any, ...]]:
    number = {"series": "series", "note": "id"}.get(table, "seq")
    return list(
        log.execute(
            f"SELECT * FROM {table} WHERE site = :site AND {number} > :after"
            f" ORDER BY {number} LIMIT :most",
            {"after": id_behind(after) if table == "note" else after, "most": most + 1},
        ).fetchall()
    )


def _text(table: str, row: Iterable[Any]) -> str:
    _, *columns = row
    return json.dumps([table, *columns], separators=(",", ":"), ensure_ascii=False)


def _journal_id(log: SiteLog) -> str:
    """One log's name among logs: what was quarantined has another in its place."""
    return log.meta("journal_id") or ""


# --- into a file ----------------------------------------------------------------------------------


def _put(connection: sqlite3.Connection, lot: Lot) -> None:
    after, log = _last(connection), SiteLog(connection)
    rows, counted = list(_rows(lot.rows)), []
    # First: what came since may be of a series with the same tag and sensors.
    for table, *row in rows:
        if table == "meta" and row[0].startswith(RECORD) and log.meta(row[0]) != row[1]:
            delete_recorded(connection, row[1])
    for table, *row in rows:
        if table in _COUNTED:
            counted.append((table, row))
        elif table not in WRITTEN or row[0] > after:
            _insert(connection, table, row, replaces=table in {"run", "meta"})
    purged = log.execute(_PURGED).fetchall()
    counted_ns = {run: (hour + 1) * HOUR_NS - 1 for run, hour in purged}
    count_rows(log, after, lot.last, counted_ns)
    # Another process may have put newer ones in.
    if lot.last >= after:
        log.execute(_OTHER_EVENTS, {"after": after, "last": lot.last})
        for table, row in counted:
            _insert(connection, table, row, replaces=True)
    for table in WRITTEN:
        connection.execute(
            f"DELETE FROM {table} WHERE site = ? AND seq <= ?",
            (LOCAL_SITE, _purged_seq(connection)),
        )


def _insert(connection: sqlite3.Connection, table: str, row: list[Any], *, replaces: bool) -> None:
    way, marks = "REPLACE" if replaces else "IGNORE", ", ?" * len(row)
    connection.execute(f"INSERT OR {way} INTO {table} VALUES ('{LOCAL_SITE}'{marks})", row)


def _purged_seq(connection: sqlite3.Connection) -> int:
    return int(get_meta(connection, PURGED_SEQ) or 0)


def _rows(texts: Iterable[str]) -> Iterator[list[Any]]:
    for text in texts:
        row = json.loads(text)
        if len(row) - 1 != _COLUMNS[row[0]] or not all(
            column is None or isinstance(column, str | int | float) for column in row
        ):
            raise ValueError(text[:64])
        yield row


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
    return PastWrites(_journal_id(log), _axis(axis), tuple(found), 0, is_all=True)


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
    return PastWrites(_journal_id(log), axis, tuple(found), last, is_all)


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
