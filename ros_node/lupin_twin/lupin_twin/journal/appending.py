"""Appends writes to the journal's tables, each only once, even if it is received again.

A write is identified by tag, kind, the stamp that it was sent with (`stamp_ns` if it has none) and
source. When a scan is received again, known sensors keep their first values; sensors that are new
are a further part of the same scan.
"""

from __future__ import annotations

import math
import sqlite3
from collections import defaultdict
from collections.abc import Iterable, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from lupin_twin.core.drops import valid_text
from lupin_twin.core.history import KNOWN_BY_NOTHING
from lupin_twin.core.state import KIND_FLOWER, Flower, Observation, Pin, Write
from lupin_twin.journal.counts import count_rows
from lupin_twin.journal.paths import Lock
from lupin_twin.journal.rows import noted_number, sensor_names, weight
from lupin_twin.journal.runs import Clock, Run, put_run
from lupin_twin.journal.schema import (
    LOCAL_SITE,
    SiteLog,
    insert_into,
    json_text,
    open_writer,
    set_meta,
    transaction,
)
from lupin_twin.journal.writes import last_number

PURGED_SEQ: Final = "purged_seq"
# New numbers are above this one, because rows with numbers up to it may have been deleted.
LAST_SEQ: Final = "last_seq"
# Groups cached at most; then the cache is emptied, and they are looked up in the file again.
_MAX_AT_HAND: Final = 100_000
# Readings, flowers and rows that wait for `flush`: a few MB.
_MAX_WAITING_WEIGHT: Final = 20_000

# The indices are named because SQLite assumes that `site` is selective, and would scan the table.
_KNOWN_SCAN: Final = (
    "SELECT stamp_ns, own_stamp_ns FROM scan INDEXED BY scan_at WHERE site = :site"
    " AND series = :series AND stamp_ns = :key AND source = :source"
    " AND coalesce(own_stamp_ns, 0) = 0 UNION ALL "
    "SELECT stamp_ns, own_stamp_ns FROM scan INDEXED BY scan_sent WHERE site = :site"
    " AND series = :series AND own_stamp_ns = :key AND source = :source LIMIT 1"
)
_KNOWN_INSPECTION: Final = (
    "SELECT 1 FROM look INDEXED BY look_at WHERE site = :site AND run = :run AND tag = :tag"
    " AND stamp_ns = :key AND source = :source AND coalesce(own_stamp_ns, 0) = 0 UNION ALL "
    "SELECT 1 FROM look INDEXED BY look_sent WHERE site = :site AND run = :run AND tag = :tag"
    " AND own_stamp_ns = :key AND source = :source LIMIT 1"
)


@dataclass(slots=True)
class _Group:
    """The series of one tag and kind in a run, and the latest stamp that identifies a write."""

    series: dict[tuple[str, ...], int]
    newest_ns: int


class Appender:
    """Writes rows through a connection, inside its caller's transaction.

    Its cache of the file is wrong after a rollback: make a new one then. Rows are in the tables
    only after `flush`.
    """

    def __init__(self, connection: sqlite3.Connection) -> None:
        self._connection, log = connection, SiteLog(connection)
        newest = (
            f"SELECT coalesce(max(seq), 0) FROM {table} WHERE site = '{LOCAL_SITE}'"  # noqa: S608
            for table in ("scan", "look", "place")
        )
        self.last_seq: int = max(
            noted_number(log, PURGED_SEQ),
            noted_number(log, LAST_SEQ),
            last_number(log),
            *(connection.execute(text).fetchone()[0] for text in newest),
            *(row[0] - 1 for row in connection.execute("SELECT begun_seq FROM run")),
        )
        # By run, for some of them: the time up to which all rows are counted already.
        self.counted_ns: dict[int, int] = {}
        self._groups: dict[tuple[int, str, int], _Group] = {}
        self._waiting: dict[str, list[tuple[object, ...]]] = defaultdict(list)
        self._waiting_weight = 0
        self._counted_seq = self.last_seq

    def append(self, run: int, rows: Iterable[Write], *, are_copies: bool = False) -> int:
        """Add the rows that are not stored yet; returns how many were added."""
        new = 0
        for row in rows:
            new += self._append(run, row, int(are_copies))
            # Text takes more memory than values: a batch of the largest rows, hundreds of MB.
            self._waiting_weight += weight(row)
            if self._waiting_weight > _MAX_WAITING_WEIGHT:
                self.flush()
        return new

    def flush(self) -> None:
        """Write the added rows into the tables, and count them."""
        self._waiting_weight = 0
        for table, rows in self._waiting.items():
            self._connection.executemany(insert_into(table), rows)
        self._waiting.clear()
        if self.last_seq > self._counted_seq:
            log = SiteLog(self._connection)
            count_rows(log, self._counted_seq, self.last_seq, self.counted_ns)
            self._counted_seq = self.last_seq

    # --- the three kinds ----------------------------------------------------------------------

    def _append(self, run: int, row: Write, is_copy: int) -> bool:
        tag = valid_text(row.tag_id)
        if isinstance(row, Pin):
            pose = row.pose
            numbers = (pose.x, pose.y, pose.z, pose.qx, pose.qy, pose.qz, pose.qw)
            self.last_seq += 1
            at = (LOCAL_SITE, self.last_seq, run, tag, row.stamp_ns, row.arrival_ns)
            self._waiting["place"].append((*at, *numbers, is_copy))
            return True
        if row.flower is not None:
            return self._put_inspection(run, tag, row, row.flower, is_copy)
        return self._put_scan(run, tag, row, is_copy)

    def _put_scan(self, run: int, tag: str, scan: Observation, is_copy: int) -> bool:
        """A scan, or an attempt of either kind that failed."""
        kind = scan.kind
        readings = {valid_text(name): value for name, value in scan.readings.items()}
        stamp_ns, own_ns, source = scan.stamp_ns, _own_ns(scan), valid_text(scan.source)
        known = self._known((run, tag, kind), own_ns or stamp_ns, source, is_copy)
        if known is not None:
            known_ns, own_ns, sensors = known
            stamp_ns = min(stamp_ns, known_ns)
            readings = {name: value for name, value in readings.items() if name not in sensors}
            if not readings:
                return False
        self.last_seq += 1
        series = self._series((run, tag, kind), tuple(readings))
        self._waiting["scan"].append(
            (
                LOCAL_SITE,
                self.last_seq,
                series,
                stamp_ns,
                own_ns,
                scan.arrival_ns,
                scan.status,
                source,
                valid_text(scan.mission),
                valid_text(scan.status_detail),
                is_copy,
                _numbers(readings.values()),
            )
        )
        return True

    def _put_inspection(
        self, run: int, tag: str, inspection: Observation, flower: Flower, is_copy: int
    ) -> bool:
        at = (run, tag, KIND_FLOWER)
        source, key = valid_text(inspection.source), inspection.own_stamp_ns or inspection.stamp_ns
        if self._known(at, key, source, is_copy) is not None:
            return False
        self.last_seq += 1
        self._series(at, ())
        self._waiting["look"].append(
            (
                LOCAL_SITE,
                self.last_seq,
                run,
                tag,
                inspection.stamp_ns,
                _own_ns(inspection),
                inspection.arrival_ns,
                source,
                valid_text(inspection.mission),
                valid_text(flower.species),
                flower.confidence,
                int(flower.anomaly),
                flower.flower_count,
                flower.bug_count,
                is_copy,
                _blooms(flower),
                f"[{','.join(map(_numbers, flower.footprint))}]",
            )
        )
        return True

    # --- what is there already ----------------------------------------------------------------

    def _known(
        self, at: tuple[int, str, int], key: int, source: str, is_copy: int
    ) -> tuple[int, int | None, set[str]] | None:
        """The stamps and sensors of the stored write with this `key`; None if there is none."""
        (run, tag, kind), group = at, self._group(at)
        if is_copy or key > group.newest_ns:
            group.newest_ns = max(group.newest_ns, key)
            return None
        self.flush()
        query = {
            "site": LOCAL_SITE, "run": run, "tag": tag, "key": key, "source": source, "series": 0,
        }  # fmt: skip
        execute = self._connection.execute
        if kind == KIND_FLOWER and execute(_KNOWN_INSPECTION, query).fetchone() is not None:
            return 0, None, set()
        stamps: tuple[int, int | None] | None = None
        sensors: set[str] = set()
        for names, series in group.series.items():
            query["series"] = series
            found = execute(_KNOWN_SCAN, query).fetchone()
            if found is not None:
                stamps = found
                sensors.update(names)
        return None if stamps is None else (*stamps, sensors)

    def _group(self, at: tuple[int, str, int]) -> _Group:
        group = self._groups.get(at)
        if group is None:
            if len(self._groups) >= _MAX_AT_HAND:
                self.flush()
                self._groups.clear()
            group = self._groups[at] = self._look_up(*at)
        return group

    def _look_up(self, run: int, tag: str, kind: int) -> _Group:
        execute = self._connection.execute
        found = execute(
            "SELECT series, sensors FROM series WHERE site = ? AND run = ? AND tag = ?"
            " AND kind = ?",
            (LOCAL_SITE, run, tag, kind),
        ).fetchall()
        newest: list[int | None] = [0]
        for column in ("stamp_ns", "own_stamp_ns"):
            for series, _ in found:
                newest += execute(
                    f"SELECT max({column}) FROM scan WHERE site = ? AND series = ?"  # noqa: S608
                    f" AND {column} IS NOT NULL",
                    (LOCAL_SITE, series),
                ).fetchone()
            if kind == KIND_FLOWER:
                newest += execute(
                    f"SELECT max({column}) FROM look WHERE site = ? AND run = ?"  # noqa: S608
                    f" AND tag = ? AND {column} IS NOT NULL",
                    (LOCAL_SITE, run, tag),
                ).fetchone()
        return _Group(
            {sensor_names(text): series for series, text in found},
            max(stamp_ns for stamp_ns in newest if stamp_ns is not None),
        )

    def _series(self, at: tuple[int, str, int], names: tuple[str, ...]) -> int:
        """Return the series of the write `last_seq`, which begins one if there is none yet."""
        of_group = self._group(at).series
        series = of_group.get(names)
        if series is None:
            series = of_group[names] = self.last_seq
            row = (LOCAL_SITE, series, *at, json_text(names))
            self._connection.execute(insert_into("series"), row)
        return series


def _own_ns(write: Observation) -> int | None:
    """The stamp that the write was sent with; None if that is its `stamp_ns`."""
    return None if write.own_stamp_ns == write.stamp_ns else write.own_stamp_ns


def _numbers(values: Iterable[float]) -> str:
    """A JSON list; numbers that are not finite are null."""
    text = ",".join([repr(float(value)) for value in values])
    return json_text(list(map(_finite, values))) if "n" in text else f"[{text}]"  # nan, inf


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _blooms(flower: Flower) -> str:
    """A JSON list of lists: x, y, z, height, species, confidence, anomaly."""
    return json_text(
        [
            [
                *map(_finite, (bloom.x, bloom.y, bloom.z, bloom.height_m)),
                valid_text(bloom.species),
                _finite(bloom.confidence),
                int(bloom.anomaly),
            ]
            for bloom in flower.blooms
        ]
    )


def _held(row: Write, begun_ns: int, *, retains_key: bool) -> Write:
    """A copy of a row, not later than `begun_ns`. `retains_key`: it counts as the same write."""
    if row.stamp_ns <= begun_ns:
        return row
    if isinstance(row, Pin):
        return replace(row, stamp_ns=begun_ns)
    own_ns = (row.own_stamp_ns or row.stamp_ns) if retains_key else KNOWN_BY_NOTHING
    return replace(row, stamp_ns=begun_ns, own_stamp_ns=own_ns)


def copy_known(appender: Appender, before: Run, run: Run, rows: Iterable[Write]) -> None:
    """Copy what was known in a run (see `copies`) into a run, or a step of it, that begins now."""
    begun, found = run.begun, []
    for row in rows:
        is_here = before.root == run.root and row.stamp_ns <= begun.stamp_ns
        if not (is_here and isinstance(row, Pin)):
            # A simulation that starts over repeats its stamps for new writes; wall time does not.
            row = replace(row, arrival_ns=begun.arrival_ns)  # noqa: PLW2901
            found.append(_held(row, begun.stamp_ns, retains_key=not begun.is_simulated))
    appender.append(run.root, found, are_copies=True)
    appender.flush()


_FROM: Final = "simulated_from_ns"
_UNTIL: Final = "simulated_until_ns"
_LOT: Final = 1_000


def is_empty(connection: sqlite3.Connection) -> bool:
    """Whether a journal has never had an observation."""
    return not Appender(connection).last_seq


def prefill(path: Path, holder: str, rows: Sequence[Write], until_ns: int) -> bool:
    """Write rows of wall time into a journal that is new or empty, all or none.

    `rows` are in the order of their stamps, all before `until_ns`. Returns whether it was done: a
    journal that ever had an observation is left as it is.

    Raises:
        InUse: a twin writes it.
        Foreign, DamagedFile, sqlite3.Error, OSError: it cannot be written.

    """
    if not rows:
        return False
    path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    with closing(Lock(path, holder)), closing(open_writer(path)) as connection:
        if not is_empty(connection):
            return False
        first = rows[0]
        with transaction(connection):
            # Runs of twins that received nothing.
            connection.execute("DELETE FROM run")
            put_run(connection, Run(1, Clock(first.stamp_ns, first.arrival_ns, False), 1))
            appender = Appender(connection)
            for start in range(0, len(rows), _LOT):
                appender.append(1, rows[start : start + _LOT])
                appender.flush()
            set_meta(connection, _FROM, first.stamp_ns)
            set_meta(connection, _UNTIL, until_ns)
        connection.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchall()
    return True


def simulated(connection: sqlite3.Connection) -> tuple[int, int] | None:
    """The period of a journal that was filled in, ns of ROS time; None if there is none."""
    start_ns, end_ns = (noted_number(SiteLog(connection), key) for key in (_FROM, _UNTIL))
    return (start_ns, end_ns) if start_ns and end_ns else None
