"""A damaged file: set aside under a name that says when, and read as far as it can be read."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote

from lupin_twin.journal.carving import carve
from lupin_twin.journal.packing import Damaged, columns, unseal
from lupin_twin.journal.reading import LOOK, SCAN, sensor_names
from lupin_twin.journal.rollups import get_meta, set_meta
from lupin_twin.journal.schema import PAGE_SIZE, DamagedFile, transaction

_ROWS: Final = 500
_LEAST_ROW_BYTES: Final = 20
# What gives the other rows their meaning, and the few that are looked up by what they say.
_SMALL: Final = {
    "run": "id, is_simulated, begun_stamp_ns, begun_arrival_ns, lead_ns, follows, carries,"
    " ended_stamp_ns",
    "tag": "id, tag_id",
    "name": "id, text",
    "sensors": "id, names",
    "series": "id, run, tag, kind, status, source, sensors",
    "pin": "id, run, tag, stamp_ns, lag_us, pose",
    "change": "id, run, tag, stamp_ns, anomaly, bug_count",
}
_LARGE: Final = {
    "scan": SCAN,
    "look": LOOK,
}
_LAST_ID: Final = 2**62


def set_aside(path: Path, when: str) -> Path:
    """Rename a file and its log; returns the new name. Nothing is ever deleted or overwritten."""
    number = 0
    while True:
        aside = path.with_name(f"{path.name}.damaged-{when}" + (f"-{number}" if number else ""))
        if not aside.exists():
            break
        number += 1
    log = path.with_name(path.name + "-wal")
    if log.exists():
        log.rename(aside.with_name(aside.name + "-wal"))
    # The index of the log is made anew from the log; one that is left behind is of another file.
    path.with_name(path.name + "-shm").unlink(missing_ok=True)
    path.rename(aside)
    return aside


class Salvage:
    """Copies what can be read of a damaged journal into a new one, the newest first.

    Rows keep their numbers. A row whose check does not fit, or whose series is lost, is left. Where
    the tree above rows is damaged, they are looked for on every page.
    """

    def __init__(self, aside: Path, connection: sqlite3.Connection) -> None:
        self._aside = aside
        self._connection = connection
        self.rows = 0
        self._is_torn = False

    def steps(self) -> Iterator[None]:
        """Each step is one transaction; after the first, names, series and pins are there.

        What was salvaged is folded into rollups again where those cannot be read: until the last
        step is done nothing may be folded or purged. Steps that were done before do no harm.
        """
        try:
            source = _open_damaged(self._aside)
        except sqlite3.Error:
            return
        with closing(source):
            kept: dict[str, set[int]] = {}
            with transaction(self._connection):
                for table, what in _SMALL.items():
                    rows = [row for lot in _readable(source, table, what) for row in lot]
                    rows = [row for row in rows if _has_meaning(table, row, kept)]
                    self._insert(table, what, rows)
                    kept[table] = {row[0] for row in rows}
                known = kept["series"]
                # The numbers go on past all that may have been lost at the end.
                last_id = max(_largest_id(source), *_noted(source), self._most_rows())
                set_meta(
                    self._connection, purged_id=last_id + 1_000_000, salvaged_id=last_id + 1_000_000
                )
            yield
            for table in _LARGE:
                for lot in _readable(source, table, _LARGE[table], self._tear):
                    self._keep(table, lot, known)
                    yield
            if self._is_torn:
                yield from self._carve(known, _noted(source)[0])
            yield from self._tallies(source)
            yield from self._rollups(source, sorted(known))

    def _tear(self) -> None:
        self._is_torn = True

    def _keep(self, table: str, rows: list[tuple[Any, ...]], known: set[int]) -> None:
        whole = [row for row in rows if row[1] in known and _is_whole(row)]
        with transaction(self._connection):
            self._insert(table, _LARGE[table], whole)
        self.rows += len(whole)

    def _carve(self, known: set[int], purged_id: int) -> Iterator[None]:
        """What stands on the pages, found without the trees; some of it is there already."""
        tables = {len(what.split(",")): table for table, what in _LARGE.items()}
        found: dict[str, list[tuple[Any, ...]]] = {table: [] for table in _LARGE}
        for rows in carve(self._aside, PAGE_SIZE, tuple(tables)):
            for row in rows:
                # What was given up stays so, though its page was not written since.
                if row[0] > purged_id:
                    found[tables[len(row)]].append(row)
            for table, waiting in found.items():
                if len(waiting) >= _ROWS:
                    self._keep(table, waiting, known)
                    waiting.clear()
                    yield
        for table, waiting in found.items():
            self._keep(table, waiting, known)
        yield

    def _most_rows(self) -> int:
        return self._aside.stat().st_size // _LEAST_ROW_BYTES

    def _tallies(self, source: sqlite3.Connection) -> Iterator[None]:
        """All of them or none: without, what was salvaged is counted again."""
        tallied = 0
        for table in ("tally", "tally_hour"):
            try:
                ((tallied,),) = source.execute("SELECT value FROM meta WHERE key = 'tallied_id'")
                rows = source.execute(f"SELECT * FROM {table}").fetchall()  # noqa: S608
            except (sqlite3.Error, ValueError):
                with transaction(self._connection):
                    self._connection.execute("DELETE FROM tally")
                return
            for first in range(0, len(rows), _ROWS):
                with transaction(self._connection):
                    self._connection.executemany(
                        f"INSERT OR REPLACE INTO {table} VALUES ({', '.join('?' * 17)})",  # noqa: S608
                        rows[first : first + _ROWS],
                    )
                yield
        with transaction(self._connection):
            set_meta(self._connection, tallied_id=int(tallied))

    def _rollups(self, source: sqlite3.Connection, known: list[int]) -> Iterator[None]:
        try:
            rolled = source.execute(
                "SELECT key, value FROM meta WHERE key LIKE 'roll%' OR key LIKE 'purged_ns:%'"
                " OR key LIKE 'simulated%'"
            ).fetchall()
        except sqlite3.Error:
            return
        for first in range(0, len(known), _ROWS):
            with transaction(self._connection):
                for series in known[first : first + _ROWS]:
                    try:
                        rows = source.execute(
                            "SELECT series, hour, buckets FROM rollup WHERE series = ?", (series,)
                        ).fetchall()
                    except sqlite3.Error:
                        continue
                    self._insert("rollup", "series, hour, buckets", rows)
            yield
        with transaction(self._connection):
            set_meta(self._connection, **{str(key): int(value) for key, value in rolled})

    def _insert(self, table: str, what: str, rows: list[tuple[Any, ...]]) -> None:
        marks = ", ".join("?" * len(what.split(",")))
        self._connection.executemany(
            f"INSERT OR IGNORE INTO {table} ({what}) VALUES ({marks})",  # noqa: S608  # constants
            rows,
        )


def _noted(source: sqlite3.Connection) -> tuple[int, int]:
    """Up to which number rows were given up, and folded; 0 where that cannot be read."""
    try:
        return get_meta(source, "purged_id"), get_meta(source, "rolled_id")
    except sqlite3.Error:
        return 0, 0


def _largest_id(source: sqlite3.Connection) -> int:
    lots = [next(_readable(source, table, "id"), []) for table in (*_LARGE, "pin")]
    return max((int(lot[0][0]) for lot in lots if lot), default=0)


def _has_meaning(table: str, row: tuple[Any, ...], kept: Mapping[str, set[int]]) -> bool:
    """Whether a small row says something, and what it refers to is there.

    A series without its tag or sensors would be found damaged at each start again.
    """
    if table == "sensors":
        try:
            sensor_names(row[1])
        except DamagedFile:
            return False
    if table == "series":
        _, _, tag, _, _, source, sensors = row
        return tag in kept["tag"] and source in kept["name"] and sensors in kept["sensors"]
    return True


def _is_whole(row: tuple[Any, ...]) -> bool:
    try:
        unseal(columns(*row[1:-1]), row[-1])
    except (Damaged, TypeError):
        return False
    return True


def _open_damaged(path: Path) -> sqlite3.Connection:
    connection = sqlite3.connect(
        f"file:{quote(str(path))}?mode=ro", uri=True, isolation_level=None, timeout=5.0
    )
    # Without it SQLite refuses all of a file that is shorter than its header says.
    connection.execute("PRAGMA writable_schema = ON")
    return connection


def _readable(
    source: sqlite3.Connection, table: str, what: str, on_damage: Callable[[], None] = lambda: None
) -> Iterator[list[tuple[Any, ...]]]:
    """The rows of a table in lots, newest first, without those that cannot be reached."""
    below = _LAST_ID
    while True:
        sizes = (_ROWS, _ROWS // 20, 1)
        lots = (_lot(source, table, what, below, size) for size in sizes)
        lot = next((lot for lot in lots if lot is not None), None)
        if lot is None:
            on_damage()
            below = _past_damage(source, table, what, below)
            if below <= 0:
                return
            continue
        if not lot:
            return
        yield lot
        # Where pages are mixed up, rows come that were not asked for: never go round in circles.
        below = min(int(lot[-1][0]), below - 1)


def _lot(
    source: sqlite3.Connection, table: str, what: str, below: int, limit: int
) -> list[tuple[Any, ...]] | None:
    try:
        return source.execute(
            f"SELECT {what} FROM {table} WHERE id < ? ORDER BY id DESC LIMIT ?",  # noqa: S608
            (below, limit),
        ).fetchall()
    except sqlite3.Error:
        return None


def _past_damage(source: sqlite3.Connection, table: str, what: str, below: int) -> int:
    """The largest number under which a row can be read again; 0 if there is none."""
    bad, good, step = below, below, 1
    while _lot(source, table, what, good, 1) is None:
        bad = good
        # From the very end, where no number is known yet, by halves; else by ever longer steps.
        good = bad // 2 if below == _LAST_ID else bad - step
        step *= 2
        if good <= 0:
            return 0
    while bad - good > 1:
        middle = (good + bad) // 2
        if _lot(source, table, what, middle, 1) is None:
            bad = middle
        else:
            good = middle
    return good
