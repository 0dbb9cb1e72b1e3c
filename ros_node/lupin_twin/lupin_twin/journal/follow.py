# ruff: noqa: S608  # SQL is put together of constants
"""Copies a journal into another file by its row numbers, continuing where the last lot ended.

A row may be sent several times, but is stored once: a lot is one transaction, and stored rows are
recognised by their numbers. A file holds one journal, and has its id; another journal gets another
file. Hourly counts are made from the rows that arrive; where the journal has deleted rows, its own
counts are copied. What the journal deletes or forgets meanwhile is deleted here too.

Forwarding to an archive reads the same rows, see `rows_behind`. An archive takes all counts from
the journal, because it keeps rows that the journal deletes.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterable, Iterator
from contextlib import closing
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path
from typing import Any, Final, NamedTuple

from lupin_twin.core.parameters import World
from lupin_twin.core.past import FOREVER_NS, HOUR_NS, Event
from lupin_twin.journal import sql
from lupin_twin.journal.appending import PURGED_SEQ, simulated
from lupin_twin.journal.counts import DELETED, FORGOTTEN, TALLIED, count_rows
from lupin_twin.journal.retention import (
    RECORD,
    Stretches,
    delete_recorded,
    delete_up_to,
    kept,
    records,
)
from lupin_twin.journal.rows import last_row, noted_number
from lupin_twin.journal.runs import world_of
from lupin_twin.journal.schema import (
    DAY_LENGTH,
    LOCAL_SITE,
    ORIGIN,
    WRITTEN,
    DamagedFile,
    Row,
    SiteLog,
    columns,
    get_meta,
    insert_into,
    open_reader,
    open_writer,
    set_meta,
    transaction,
    upsert_into,
)
from lupin_twin.journal.writes import id_behind, number_of

MAX_ROWS: Final = 2_000
_MAX_BYTES: Final = 1_000_000
# Newest notes in each lot.
_NOTES: Final = 20
# Ordered as rows with the same number have to be written.
_NUMBERED: Final = ("series", "scan", "look", "place", "note")
_COPIED: Final = {*_NUMBERED, "run", "meta", "hour", "tally", "event"}
_FACTS: Final = (
    *(DELETED, FORGOTTEN, "lost_ns:", PURGED_SEQ, "simulated_", RECORD, ORIGIN, DAY_LENGTH),
)
_FOLLOWED: Final = "followed_seq"
_COMPLETE: Final = "followed_to_ns"
_UP_TO: Final = "followed_row"
# The last number of the journal when the first lot was read.
_BEGUN: Final = "followed_from_seq"
# For each run, the hour up to which counts are read: rows were deleted, or may have been.
_PURGED: Final = (
    "SELECT CAST(substr(key, instr(key, ':') + 1) AS INTEGER) AS run,"
    f" max(CAST(value AS INTEGER)) / {HOUR_NS} AS hour FROM meta WHERE site = :site"
    f" AND (key LIKE '{DELETED}%' OR key LIKE '{FORGOTTEN}%') GROUP BY 1"
    f" UNION ALL SELECT run, {FOREVER_NS} FROM run WHERE site = :site AND :every"
)
_ATTEMPTS: Final = (
    f"SELECT series, run, stamp_ns / {HOUR_NS} AS hour FROM scan JOIN series USING (site, series)"
    " WHERE site = :site AND seq > :after AND seq <= :last AND is_copy = 0 UNION"
    f" SELECT NULL, run, stamp_ns / {HOUR_NS} FROM look"
    " WHERE site = :site AND seq > :after AND seq <= :last AND is_copy = 0"
)
# Counts of such hours are sent with their series, other counts with the first lot; and again
# whenever attempts arrive late.
_WITH: Final = (
    f"WITH purged AS ({_PURGED}), late AS (SELECT DISTINCT a.series, a.run, a.hour"
    f" FROM ({_ATTEMPTS}) AS a JOIN purged AS p ON p.run = a.run AND a.hour <= p.hour)"
)
# A silence that ends later is counted in the copy, by the first attempt after it.
_EVENTS: Final = (
    "(run IN (SELECT run FROM late) OR :after = 0 AND EXISTS (SELECT 1 FROM purged AS p"
    " WHERE p.run = event.run AND (p.hour + 1) *"
    f" {HOUR_NS} > event.stamp_ns + iif(event.event = '{Event.SILENCES}', event.value, 0)))"
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
# Size of a sensor's hour as a row.
_HOUR_BYTES: Final = 80
# Errors that rows of a hostile or damaged journal raise. Other errors of `sqlite3` are the file's.
_UNUSABLE: Final = (
    *(ValueError, TypeError, LookupError, ArithmeticError, AttributeError, RecursionError),
    *(sqlite3.IntegrityError, sqlite3.ProgrammingError, DamagedFile),
)


class Lot(NamedTuple):
    """Rows after a number, each a JSON list: its table, and its columns except for the site.

    `last` is the number after which to continue; `is_all`: nothing more was written yet.
    """

    journal: str
    rows: tuple[str, ...]
    last: int
    is_all: bool


@dataclass(frozen=True, slots=True)
class Followed:
    """How far a copy is: its journal's id, the last number, the world; others as in `Condition`.

    A twin's own file has no last number, and is complete up to its latest row.
    """

    journal: str
    last: int
    world: World
    complete_ns: int
    kept_ns: Stretches
    simulated_ns: tuple[int, int] | None


class NotALotError(ValueError):
    """The rows are not those of a journal; the file is unchanged."""


def read(connection: sqlite3.Connection, after: int, most: int = MAX_ROWS) -> Lot:
    """Read a lot for a copy: rows, and facts about the whole journal."""
    log = SiteLog(connection)
    found, last, is_all = rows_behind(log, after, most)
    found += [("meta", row) for row in _all(log, "meta") if row[1].startswith(_FACTS)]
    found.append(("meta", ("", _UP_TO, _up_to(connection, after))))
    # A note that was made in the fleet has a number of there, which may not be after this one.
    notes = log.execute(sql.NEWEST_NOTES, {"most": _NOTES}).fetchall()
    found += [("note", ("", *note)) for note in notes]
    if after == 0:
        begun = max(last_row(log)[0], _gone_seq(connection))
        found.append(("meta", ("", _BEGUN, str(begun))))
    texts = (
        json.dumps([table, *row[1:]], separators=(",", ":"), ensure_ascii=False)
        for table, row in found
    )
    return Lot(log.journal_id, tuple(texts), last, is_all)


def rows_behind(
    log: SiteLog, after: int, most: int, *, every: bool = False
) -> tuple[list[tuple[str, Row]], int, bool]:
    """Read the next rows after a number with their tables: all runs, and about `most` others.

    Adds counts and events of hours whose rows were deleted; if `every`, counts of all hours that
    these rows are in, and no events. Also returns the number after which to continue, and whether
    nothing more was written yet.
    """
    found = [("run", row) for row in _all(log, "run")]
    numbered = [
        (number_of(row[1]) if table == "note" else row[1], rank, row)
        for rank, table in enumerate(_NUMBERED)
        for row in _behind(log, table, after, most)
    ]
    numbered.sort(key=itemgetter(0, 1))
    purged = _purged(log, every=every)
    last, weight, is_all = after, 0, True
    for place, (number, rank, row) in enumerate(numbered):
        if (place >= most or weight > _MAX_BYTES) and number != last:
            is_all = False
            break
        found.append((_NUMBERED[rank], row))
        last, weight = number, weight + len(str(row))
        if _NUMBERED[rank] == "series" and row[2] in purged:
            of_series = {"series": number, "hour": purged[row[2]]}
            weight += log.execute(_HOURS_OF, of_series).fetchone()[0] * _HOUR_BYTES
    if purged:
        within = {"after": after, "last": last, "every": every}
        for table in ("hour", "tally") if every else _COUNTED:
            found += [(table, row) for row in log.execute(_COUNTED[table], within).fetchall()]
    return found, last, is_all


def write(path: Path, lot: Lot, complete_ns: int | None, behind: int = 0) -> Followed:
    """Write a lot, read after the number `behind`, into the copy of its journal; may create it.

    `complete_ns` is up to when the journal was complete, ROS time, before the lot was requested;
    None if more follows.

    Raises:
        NotALotError: the lot is invalid, or the file ends before `behind`.
        DamagedFile: the copy is not complete any more, and has to be made anew.
        Foreign, sqlite3.Error, OSError: as `open_writer`.

    """
    path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    with closing(open_writer(path)) as connection:
        with transaction(connection):
            last, purged = _last(connection), _purged(SiteLog(connection))
            if last < behind:
                raise NotALotError(f"rows behind number {behind} for a file that ends before it")
            try:
                _put(connection, lot)
                # Overrides what the rows say: the file is named by it.
                set_meta(connection, "journal_id", lot.journal)
                _followed(connection)
                gone, begun = _gone_seq(connection), noted_number(SiteLog(connection), _BEGUN)
            except _UNUSABLE as error:
                raise NotALotError(f"rows that are not those of a log: {error}") from error
            # A journal that was restored from a backup gives the same numbers to other rows.
            there, here = get_meta(connection, _UP_TO) or "", _up_to(connection, behind)
            if there.startswith(f"{behind} ") and there != here:
                raise DamagedFile("the journal has other rows by now")
            # Rows from before the copy began are in the counts of those hours. Without this rule,
            # no copy of a journal that deletes every minute would ever be complete.
            is_counted = gone <= begun and _purged(SiteLog(connection)) == purged
            if 0 < last < gone and not is_counted:
                raise DamagedFile("rows that it does not have yet were deleted in the journal")
            set_meta(connection, _FOLLOWED, max(lot.last, last))
            if not lot.is_all or complete_ns is None:
                complete_ns = last_row(SiteLog(connection))[1]
            if complete_ns:
                set_meta(connection, _COMPLETE, complete_ns)
        connection.execute("PRAGMA wal_checkpoint(PASSIVE)").fetchall()
        return _followed(connection)


def followed(path: Path) -> Followed:
    """Return how far a copy is.

    Raises:
        Empty, Foreign, DamagedFile, sqlite3.Error, OSError: as `open_reader`.

    """
    with closing(open_reader(path)) as connection:
        try:
            _gone_seq(connection)  # `write` relies on it
            return _followed(connection)
        except _UNUSABLE as error:
            raise DamagedFile(f"{path} contradicts itself: {error}") from error


def _followed(connection: sqlite3.Connection) -> Followed:
    log = SiteLog(connection)
    return Followed(
        log.journal_id,
        _last(connection),
        world_of(log),
        noted_number(log, _COMPLETE) or last_row(log)[1],
        kept(connection),
        simulated(connection),
    )


def _last(connection: sqlite3.Connection) -> int:
    return noted_number(SiteLog(connection), _FOLLOWED)


# --- reading a journal ----------------------------------------------------------------------------


def _all(log: SiteLog, table: str) -> list[Row]:
    return list(log.execute(f"SELECT * FROM {table} WHERE site = :site").fetchall())


def _behind(log: SiteLog, table: str, after: int, most: int) -> list[Row]:
    number = {"series": "series", "note": "id"}.get(table, "seq")
    return list(
        log.execute(
            f"SELECT * FROM {table} WHERE site = :site AND {number} > :after"
            f" ORDER BY {number} LIMIT :most",
            {"after": id_behind(after) if table == "note" else after, "most": most + 1},
        ).fetchall()
    )


def _up_to(connection: sqlite3.Connection, after: int) -> str:
    """A number, and what identifies the last row up to it: its own number, and its arrival."""
    seq, _, arrival_ns = last_row(SiteLog(connection), after)
    return f"{after} {seq} {arrival_ns}"


# --- writing a copy -------------------------------------------------------------------------------


def _put(connection: sqlite3.Connection, lot: Lot) -> None:
    after, log = _last(connection), SiteLog(connection)
    rows, counted = list(_rows(lot.rows)), []
    # Delete first: rows written since may be of a series with the same tag and sensors.
    for table, *row in rows:
        if table == "meta" and row[0].startswith(RECORD) and log.meta(row[0]) != row[1]:
            delete_recorded(connection, row[1])
    for table, *row in rows:
        if table in _COUNTED:
            counted.append((table, row))
        elif table not in WRITTEN or row[0] > after:
            is_anew = table in {"run", "meta"}
            statement = (
                upsert_into(table) if is_anew else f"{insert_into(table)} ON CONFLICT DO NOTHING"
            )
            connection.execute(statement, (LOCAL_SITE, *row))
    # Another process may have written later counts.
    if lot.last >= after:
        log.execute(_OTHER_EVENTS, {"after": after, "last": lot.last, "every": False})
        for table, row in counted:
            connection.execute(upsert_into(table), (LOCAL_SITE, *row))
    # Then count the other rows: whether their pests are new depends on what was before.
    counted_ns = {run: (hour + 1) * HOUR_NS - 1 for run, hour in _purged(log).items()}
    count_rows(log, after, lot.last, counted_ns)
    delete_up_to(connection, noted_number(log, PURGED_SEQ))


def _purged(log: SiteLog, *, every: bool = False) -> dict[int, int]:
    return dict(log.execute(_PURGED, {"every": every}).fetchall())


def _gone_seq(connection: sqlite3.Connection) -> int:
    """The number up to which counted rows were deleted: by age, by size, or forgotten."""
    forgotten = (int(str(record["seq"])) for record in records(connection))
    return max(noted_number(SiteLog(connection), PURGED_SEQ), 0, *forgotten)


def _rows(texts: Iterable[str]) -> Iterator[list[Any]]:
    for text in texts:
        row = json.loads(text)
        if (
            row[0] not in _COPIED
            or len(row) != len(columns(row[0]))
            or not all(column is None or isinstance(column, str | int | float) for column in row)
        ):
            raise ValueError(text[:64])
        yield row
