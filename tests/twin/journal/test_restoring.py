from __future__ import annotations

import sqlite3
from dataclasses import replace
from pathlib import Path

import pytest

from lupin_twin.journal.asof import state_at
from lupin_twin.journal.file import JournalFile
from lupin_twin.journal.reading import ending
from lupin_twin.journal.restoring import restore
from lupin_twin.journal.rows import Row, ScanRow
from lupin_twin.journal.runs import Clock
from lupin_twin.journal.schema import open_reader, transaction
from lupin_twin.journal.spans import MAX_RUNS
from tests.support.journal import CLOCK, NOW, SECOND, kept, known, look, opened, pin, restored, scan


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "j.sqlite"


def sim(at_s: float, wall_s: float) -> Clock:
    return Clock(int(at_s * SECOND), NOW + int(wall_s * SECOND), is_simulated=True)


def sim_scan(tag_id: str, at_s: float) -> ScanRow:
    at_ns = int(at_s * SECOND)
    return replace(scan(tag_id, at_ns), arrival_ns=NOW + at_ns)


def test_of_each_sensor_set_the_newest_scans_by_stamp_are_known(path: Path) -> None:
    scans = [scan(at_ns=NOW + n * SECOND) for n in (3, 1, 2)]
    other = scan(at_ns=NOW - 9 * SECOND, humidity=50.0)
    failed = replace(scan(at_ns=NOW), readings=(), status=1)
    kept(path, [*scans, other, failed])
    assert set(restored(path, scans=2).rows) == {scans[0], scans[2], other, failed}
    assert set(restored(path, scans=1).rows) == {scans[0], other, failed}


def test_the_newest_look_and_the_place_are_known(path: Path) -> None:
    kept(path, [pin(), look(anomaly=True), look(at_ns=NOW + SECOND)])
    assert known(path) == {pin(), look(at_ns=NOW + SECOND)}


def test_tags_come_in_the_order_in_which_they_were_heard_of(path: Path) -> None:
    kept(path, [scan("9"), scan("10"), scan("1"), scan("9", NOW + SECOND)])
    assert [row.tag_id for row in restored(path, scans=1).rows] == ["9", "10", "1"]


def test_the_count_is_that_of_all_writes(path: Path) -> None:
    kept(path, [pin(), *(scan(at_ns=NOW + n) for n in range(99))])
    assert restored(path, scans=1).count == 100


def test_what_cannot_be_read_is_left_out_and_counted(path: Path) -> None:
    kept(path, [scan("1"), scan("2"), look("1"), look("2"), pin("1"), pin("2")])
    with opened(path) as file:
        run = file.first_run(CLOCK)
    connection = sqlite3.connect(path)
    for table, column in (("scan", "readings"), ("look", "shape"), ("pin", "pose")):
        connection.execute(f"UPDATE {table} SET {column} = x'00' WHERE id % 2 = 1")
    connection.commit()
    connection.close()
    reader = open_reader(path)
    found = restore(reader, run, 1)
    reader.close()
    assert found.damaged == 3
    assert set(found.rows) == {scan("2"), look("2"), pin("2")}


def test_yesterdays_simulation_is_not_known_in_todays(path: Path) -> None:
    rows: set[Row] = {pin(at_ns=9), sim_scan("7", 500)}
    kept(path, rows, sim(0, 0))
    assert known(path, sim(505, 506)) == rows
    assert known(path, sim(510, 86_400)) == set()


def test_a_house_whose_clock_was_lost_knows_its_places_alone(path: Path) -> None:
    kept(path, [pin(), scan()])
    at = 1000 * SECOND
    place = replace(pin(), stamp_ns=at)
    assert known(path, Clock(at, at, is_simulated=False)) == {place}


def test_what_the_twin_lived_through_is_held_to_the_next_runs_beginning(path: Path) -> None:
    with opened(path) as file:
        first = file.first_run(sim(0, 0))
        second = file.next_run(first, sim(100, 900))
        third = file.next_run(second, sim(50, 1000))
        early, late, later = sim_scan("1", 20), sim_scan("2", 800), sim_scan("3", 101)
        file.append([(first, early), (first, late), (second, later)])
        rows = file.restore(third, 1).rows
    begun = 50 * SECOND
    assert rows == (early, replace(late, stamp_ns=begun), replace(later, stamp_ns=begun))


def test_what_was_the_newest_as_the_clock_went_back_twice_stays_so(path: Path) -> None:
    with opened(path) as file:
        first = file.first_run(sim(0, 0))
        second = file.next_run(first, sim(50, 900))
        third = file.next_run(second, sim(30, 1000))
        newer, late = sim_scan("1", 100), sim_scan("1", 40)
        file.append([(first, newer), (second, late)])
        rows = file.restore(third, 1).rows
        (tag,) = state_at(file._connection, 35 * SECOND, "map").tags
    # The second was none when it came, though both are of one moment by now.
    begun = 30 * SECOND
    assert rows == (replace(late, stamp_ns=begun), replace(newer, stamp_ns=begun))
    assert [reading.observed_at_ns for reading in tag.readings] == [begun]


def test_thousands_of_runs_behind_cost_a_little_and_places_are_known_through_them(
    path: Path,
) -> None:
    count = 2_000
    kept(path, [pin(), scan("1"), scan("2")])
    with opened(path) as file:
        begun_ns = [NOW + n % 7 * SECOND for n in range(2, count + 2)]
        with transaction(file._connection):
            file._connection.executemany(
                "INSERT INTO run VALUES (?, 0, ?, ?, 0, ?, 2, NULL)",
                [(n, at, at + n, n - 1) for n, at in enumerate(begun_ns, 2)],
            )
        now = ending(file._connection, is_simulated=False)
        assert now is not None
        assert now.run.id == count + 1
        asked: list[str] = []
        file._connection.set_trace_callback(asked.append)
        assert file.restore(now.run, 2).rows == (replace(pin(), stamp_ns=min(begun_ns)),)
        assert len(asked) < 10 * MAX_RUNS
        asked.clear()
        (tag,) = state_at(file._connection, NOW + 60 * SECOND, "map").tags
        assert (tag.tag_id, tag.pose) == ("7", pin().pose)
        assert len(asked) < 20 * MAX_RUNS


def test_a_run_that_a_damaged_file_has_follow_itself_ends(path: Path) -> None:
    with opened(path) as file:
        run = file.first_run(CLOCK)
        file.append([(run, scan())])
        _follow_itself(file)
        assert file.restore(run, 1).rows == (scan(),)


def _follow_itself(file: JournalFile) -> None:
    with transaction(file._connection):
        file._connection.execute("UPDATE run SET follows = 1, carries = 2")
