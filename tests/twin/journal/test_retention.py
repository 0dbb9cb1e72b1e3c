from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from pathlib import Path

import pytest

from lupin_twin.journal.reading import runs
from lupin_twin.journal.retention import (
    ROLLUP_DAYS,
    Limits,
    purge_rollups_step,
    purge_step,
    purged_ns,
    shrink_step,
    used_bytes,
)
from lupin_twin.journal.rollups import set_meta
from lupin_twin.journal.schema import open_reader, open_writer, transaction
from lupin_twin.past import HOUR_NS, SLOT_NS
from tests.support.journal import NOW, SECOND, kept, look, pin, restored, scan

DAY = 24 * HOUR_NS
ENOUGH = 10**12
ROWS = 2_000


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A journal with a scan every minute, all of it in the rollups."""
    made = tmp_path / "j.sqlite"
    kept(made, [pin(), look(), *(scan(at_ns=NOW + n * 60 * SECOND) for n in range(ROWS))])
    return made


@pytest.fixture
def file(path: Path) -> Iterator[sqlite3.Connection]:
    connection = open_writer(path)
    set_meta(connection, rolled_id=ROWS + 2, tallied_id=ROWS + 2)
    yield connection
    connection.close()


def purge(file: sqlite3.Connection, limits: Limits, now_ns: int) -> int:
    """Purge all there is; returns the steps."""
    steps = 0
    while True:
        with transaction(file):
            if not purge_step(file, limits, now_ns):
                return steps
        steps += 1


def scans(file: sqlite3.Connection) -> list[int]:
    return [stamp for (stamp,) in file.execute("SELECT stamp_ns FROM scan ORDER BY id")]


def test_what_is_past_its_age_goes_and_nothing_else(file: sqlite3.Connection) -> None:
    now = NOW + 2 * DAY
    purge(file, Limits(1.5, ENOUGH), now)
    horizon = now - DAY * 3 // 2
    # A scan arrives a microsecond after its stamp.
    assert scans(file) == [
        at for at in (NOW + n * 60 * SECOND for n in range(ROWS)) if at + 1000 >= horizon
    ]
    assert file.execute("SELECT count(*) FROM look").fetchone() == (0,)
    assert file.execute("SELECT count(*) FROM pin").fetchone() == (1,)


def test_what_is_too_large_loses_its_oldest(file: sqlite3.Connection) -> None:
    limit = used_bytes(file) * 2 // 3
    steps = purge(file, Limits(ENOUGH, limit), NOW)
    assert 0.8 * limit < used_bytes(file) <= limit
    assert steps > 1
    left = scans(file)
    assert left == [NOW + n * 60 * SECOND for n in range(ROWS - len(left), ROWS)]


def test_within_its_limits_nothing_goes(file: sqlite3.Connection) -> None:
    assert purge(file, Limits(1.0, used_bytes(file)), NOW + DAY) == 0


@pytest.mark.parametrize("counted", ["rolled_id", "tallied_id"])
def test_what_is_in_no_rollup_or_tally_yet_stays(file: sqlite3.Connection, counted: str) -> None:
    set_meta(file, **{counted: 500})
    purge(file, Limits(0.0, 0), NOW + 99 * DAY)
    assert scans(file)[0] == NOW + 498 * 60 * SECOND


def test_purging_shrinks_the_file_in_small_steps(
    path: Path, file: sqlite3.Connection, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lupin_twin.journal.retention._FREE_PAGES", 8)
    monkeypatch.setattr("lupin_twin.journal.retention._PAGES", 16)
    before = path.stat().st_size
    purge(file, Limits(0.0, ENOUGH), NOW + 99 * DAY)
    steps = 0
    while shrink_step(file):
        steps += 1
    file.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchall()
    assert path.stat().st_size < before / 2
    assert steps > 3


def test_a_reader_is_not_blocked_and_sees_what_it_began_with(
    path: Path, file: sqlite3.Connection
) -> None:
    reader = open_reader(path)
    reader.execute("BEGIN")
    assert reader.execute("SELECT count(*) FROM scan").fetchone() == (ROWS,)
    purge(file, Limits(0.0, ENOUGH), NOW + 99 * DAY)
    assert reader.execute("SELECT count(*) FROM scan").fetchone() == (ROWS,)
    reader.close()
    assert scans(file) == []


def test_numbers_go_on_when_everything_is_gone(path: Path, file: sqlite3.Connection) -> None:
    file.execute("DELETE FROM pin")
    purge(file, Limits(0.0, ENOUGH), NOW + 99 * DAY)
    file.close()
    assert kept(path, [scan(at_ns=NOW + 200 * DAY)]) == (1, 0)
    assert restored(path).count == ROWS + 3


def test_rollups_are_kept_for_ten_years(file: sqlite3.Connection) -> None:
    hour = NOW // HOUR_NS
    file.executemany("INSERT INTO rollup VALUES (2, ?, x'00')", [(hour,), (hour + 1,)])
    assert purge_rollups_step(file, NOW + ROLLUP_DAYS * DAY, 0) == 0
    assert file.execute("SELECT count(*) FROM rollup").fetchone() == (2,)
    purge_rollups_step(file, (hour + 1 + ROLLUP_DAYS * 24) * HOUR_NS, 0)
    assert file.execute("SELECT hour FROM rollup").fetchall() == [(hour + 1,)]


def test_tallies_and_changes_are_kept_for_ten_years(file: sqlite3.Connection) -> None:
    for table, unit_ns in (("tally", SLOT_NS), ("tally_hour", HOUR_NS)):
        for slot in (NOW // unit_ns, NOW // unit_ns + 1):
            file.execute(
                f"INSERT INTO {table} (run, slot, first_ns, last_ns, gap_ns)"
                " VALUES (1, ?, 0, 0, 0)",
                (slot,),
            )
    file.execute("INSERT INTO change VALUES (1, 1, 1, ?, 1, 1)", (NOW,))
    purge_rollups_step(file, NOW + ROLLUP_DAYS * DAY, 0)
    assert [count(file, table) for table in ("tally", "tally_hour", "change")] == [2, 2, 1]
    purge_rollups_step(file, NOW + ROLLUP_DAYS * DAY + HOUR_NS, 0)
    assert [count(file, table) for table in ("tally", "tally_hour", "change")] == [0, 1, 0]


def count(file: sqlite3.Connection, table: str) -> int:
    return int(file.execute(f"SELECT count(*) FROM {table}").fetchone()[0])


def test_where_scans_were_given_up_is_known(file: sqlite3.Connection) -> None:
    run = runs(file)[1]
    assert purged_ns(file, run) == -1
    purge(file, Limits(1.0, ENOUGH), NOW + DAY + 10 * 60 * SECOND)
    assert purged_ns(file, run) == scans(file)[0] - 60 * SECOND


def test_rollups_of_many_series_go_in_steps(
    file: sqlite3.Connection, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lupin_twin.journal.retention._SERIES", 1)
    after, steps = 0, 0
    while (after := purge_rollups_step(file, NOW, after)) and steps < 9:
        steps += 1
    assert steps == 2  # the look's and the scans'
