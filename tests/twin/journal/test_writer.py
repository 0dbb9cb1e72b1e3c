"""The journal's thread and its file: what is written, lost, replaced, and saved from damage."""

import os
import shutil
import sqlite3
import time
from contextlib import closing
from dataclasses import replace
from itertools import count
from pathlib import Path
from pkgutil import resolve_name
from random import Random

import pytest

from lupin_twin.core.diagnostics import JournalState
from lupin_twin.core.state import Write
from lupin_twin.journal.appending import prefill
from lupin_twin.journal.paths import Syncing
from lupin_twin.journal.retention import Limits
from lupin_twin.journal.runs import Clock, Turn
from lupin_twin.journal.salvage import salvage
from lupin_twin.journal.schema import DamagedFile, open_writer
from lupin_twin.journal.writer import Journal
from tests.support.journal import (
    CLOCK,
    LIMITS,
    NOW,
    SECOND,
    append,
    is_whole,
    known,
    opened,
    pin,
    recording,
    scan,
    select,
    wait_state,
)
from tests.support.waiting import wait_for


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "j.sqlite"


def scans_in(path: Path) -> int:
    ((rows,),) = select(path, "SELECT count(*) FROM scan")
    assert isinstance(rows, int)
    return rows


def test_a_write_is_stored_and_known_after_a_restart(tmp_path: Path) -> None:
    path = tmp_path / "state" / "j.sqlite"
    rows: set[Write] = {pin(), *(scan(str(n)) for n in range(1000))}
    with recording(path) as journal:
        assert journal.take_restored(30.0) is not None
        for row in rows:
            journal.write(row)
        wait_for(lambda: journal.condition.written == 1001, "all rows")
    with recording(path) as journal:
        restored = journal.take_restored(30.0)
        assert restored is not None
        assert set(restored.rows) == rows - {pin()}
        [placed] = [tag for tag in restored.known.tags if tag.pose is not None]
        assert placed.tag_id == pin().tag_id
        assert restored.last_seq == 1001
        assert journal.take_restored() is None
        journal.write(scan("5"))
    assert scans_in(path) == 1000, "the last one was there already"


def test_before_the_clock_starts_nothing_is_written_and_nothing_lost(path: Path) -> None:
    journal = Journal(path, "/twin", LIMITS)
    wait_state(journal, JournalState.RECORDING)
    journal.write(scan("early"))
    wait_for(lambda: journal.condition.behind_s > 1.0, "a disk that would be slow")
    assert journal.condition.state is JournalState.RECORDING
    assert journal.take_restored() is None
    journal.begin(CLOCK)
    wait_for(lambda: journal.condition.written == 1, "the row")
    journal.close(30.0)
    assert known(path) == {scan("early")}


def test_rows_belong_to_the_clock_by_which_they_were_received(path: Path) -> None:
    with recording(path, Clock(5 * SECOND, NOW, is_simulated=True)) as journal:
        journal.write(scan("a", 9 * SECOND))
        after = Clock(2 * SECOND, NOW + 9 * SECOND, is_simulated=True)
        journal.begin(after, turn=Turn.BACK, before_ns=11 * SECOND)
        journal.write(scan("b", 3 * SECOND))
    rows = "SELECT tag, run, is_copy FROM series JOIN scan USING (series) ORDER BY seq"
    assert select(path, rows) == [("a", 1, 0), ("a", 2, 1), ("b", 2, 0)]
    assert select(path, "SELECT run, joins, ended_stamp_ns FROM run") == [
        (1, None, 11 * SECOND),
        (2, None, None),
    ]


def test_a_second_twin_is_refused_by_name_and_takes_over_when_the_first_has_ended(
    path: Path,
) -> None:
    with recording(path) as first:
        wait_state(first, JournalState.RECORDING)
        second = Journal(path, "/second", LIMITS)
        second.begin(CLOCK)
        assert second.take_restored(30.0) is None
        message = wait_state(second, JournalState.IN_USE).detail
        assert (
            message == f"the journal {path} is in use by /test/lupin_twin (process {os.getpid()})"
        )
        second.write(scan("2"))
    wait_for(lambda: second.condition.written == 1, "the second's row")
    assert wait_state(second, JournalState.RECORDING).is_well
    second.close(30.0)


def test_a_damaged_file_is_quarantined_and_the_twin_goes_on(path: Path) -> None:
    path.write_text("nothing of the kind" * 1000)
    with recording(path) as journal:
        journal.write(scan())
        wait_for(lambda: journal.condition.written == 1, "the row")
        condition = wait_state(journal, JournalState.RECORDING, "quarantined as")
        assert Path(condition.quarantined).read_text() == "nothing of the kind" * 1000
    assert known(path) == {scan()}


APPEND = "file.JournalFile.append"
DAMAGED, FULL = DamagedFile("as SQLite finds it"), OSError("the disk is full")


@pytest.mark.parametrize(
    ("faults", "is_quarantined"),
    [
        ({APPEND: FULL}, False),
        ({APPEND: DAMAGED}, True),
        ({APPEND: DAMAGED, "writer.salvage": FULL}, True),
        ({APPEND: DAMAGED, "salvage.open_writer": FULL}, True),
    ],
)
def test_a_file_that_fails_while_recording_keeps_its_rows_even_if_it_is_quarantined(
    path: Path,
    monkeypatch: pytest.MonkeyPatch,
    faults: dict[str, Exception],
    *,
    is_quarantined: bool,
) -> None:
    def fail_once(name: str, error: Exception) -> None:
        name = f"lupin_twin.journal.{name}"
        works = resolve_name(name)

        def fail(*_: object) -> None:
            monkeypatch.setattr(name, works)
            raise error

        monkeypatch.setattr(name, fail)

    with recording(path) as journal:
        journal.write(scan("1"))
        wait_for(lambda: journal.condition.written == 1, "the row")
        begun_ns = time.time_ns()
        for name, error in faults.items():
            fail_once(name, error)
        journal.write(scan("2"))
        wait_for(lambda: journal.condition.written == 2, "the row after it")
        condition = wait_state(journal, JournalState.RECORDING)
        assert Path(condition.quarantined).is_file() is is_quarantined
        # It may have lost any row up to now: the last ones too.
        assert (condition.kept_ns[0][0] > begun_ns) is is_quarantined
    assert known(path) == {scan("1"), scan("2")}


def test_a_removed_file_is_created_anew(path: Path) -> None:
    with recording(path) as journal:
        journal.write(scan("1"))
        wait_for(lambda: journal.condition.written == 1, "the row")
        # The file itself last: once it is gone it is created anew, with others beside it.
        for name in ("j.sqlite-wal", "j.sqlite-shm", "j.sqlite"):
            path.with_name(name).unlink()
        wait_for(path.exists, "a new file")
        journal.write(scan("2"))
        wait_for(lambda: journal.condition.written == 2, "the row after it")
    assert known(path) == {scan("2")}


@pytest.mark.parametrize("is_older", [True, False])
def test_what_a_file_put_in_its_place_lacks_does_not_count_as_complete(
    path: Path, tmp_path: Path, *, is_older: bool
) -> None:
    """A backup; or the file itself, put back after another was created in its place."""
    other = tmp_path / "other.sqlite"
    with recording(path) as journal:
        journal.write(scan("1"))
        wait_for(lambda: journal.condition.written == 1, "a row")
        if is_older:
            with closing(sqlite3.connect(path)) as own:
                own.execute("VACUUM INTO ?", (str(other),))
        else:
            path.rename(other)
            path.with_name("j.sqlite-wal").unlink()
            path.with_name("j.sqlite-shm").unlink()
            wait_for(path.exists, "a new file")
        journal.write(scan("2"))
        wait_for(lambda: journal.condition.written == 2, "a row that the other file lacks")
        replaced_ns = time.time_ns()
        other.replace(path)
        wait_for(lambda: journal.condition.kept_ns[0][0] > replaced_ns, "what is complete")
    assert known(path) == {scan("1")}


def test_a_removed_log_is_reported_and_a_kill_after_it_loses_nothing(
    path: Path, tmp_path: Path
) -> None:
    with recording(path) as journal:
        journal.write(scan("1"))
        wait_for(lambda: journal.condition.written == 1, "the row")
        log, away = path.with_name("j.sqlite-wal"), path.with_name("away")
        log.rename(away)
        wait_state(journal, JournalState.FAILING, "j.sqlite-wal was removed: restart the twin")
        away.rename(log)
        wait_state(journal, JournalState.RECORDING)
        log.unlink()
        wait_state(journal, JournalState.FAILING)
        journal.write(scan("2"))
        # As a killed process leaves it.
        left = tmp_path / "left.sqlite"
        wait_for(lambda: known(Path(shutil.copy(path, left))) == {scan("1"), scan("2")}, "both")
    with recording(path) as journal:
        wait_state(journal, JournalState.RECORDING)
    assert known(path) == {scan("1"), scan("2")}


def test_beyond_the_limit_the_oldest_writes_are_lost_and_counted(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lupin_twin.journal.writer.MAX_WEIGHT", 20)
    path.mkdir(parents=True)  # a folder cannot be written to
    with recording(path) as journal:
        wait_state(journal, JournalState.FAILING)
        for n in range(15):
            journal.write(scan(str(n)))
        condition = wait_state(journal, JournalState.FAILING, "5 observations were lost")
        assert (condition.lost, condition.waiting) == (5, 10)
        path.rmdir()
        wait_for(lambda: journal.condition.written == 10, "healing")
        assert wait_state(journal, JournalState.RECORDING).is_well
    assert known(path) == {scan(str(n)) for n in range(5, 15)}


def test_age_and_size_limits_are_applied(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("lupin_twin.journal.file.PURGE_EVERY_S", 0.0)
    now = time.time_ns()
    old = now - 3 * 86_400 * SECOND
    with recording(path, Clock(old, old, is_simulated=False), limits=Limits(1.0, 10**9)) as journal:
        for n in range(1000):
            journal.write(scan(at_ns=old + n))
        journal.write(scan(at_ns=now))
        wait_for(lambda: journal.condition.written == 1001, "all rows")
        wait_for(lambda: scans_in(path) == 1, "the purge")
        assert journal.condition.state is JournalState.RECORDING


def test_a_reading_with_all_digits_takes_at_most_60_bytes(path: Path) -> None:
    chance = Random(1)
    rows = [
        replace(
            scan(str(number % 20), NOW + number * 30 * SECOND),
            readings={name: chance.random() for name in "abcde"},
        )
        for number in range(3_000)
    ]
    append(path, rows)
    assert path.stat().st_size / (5 * len(rows)) < 60


def test_runs_are_written_to_a_replaced_file(path: Path) -> None:
    with opened(path) as file:
        run = file.start(CLOCK, is_believed=False).run
        end = file.end
    path.unlink()
    with opened(path) as file:
        file.retain_run(run, end)
        file.retain_run(run, end)
        assert file.append([(run, scan())]) == 1
    assert known(path) == {scan()}


def test_maintenance_purges_and_checkpoints(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("lupin_twin.journal.file.LOG_BYTES", 10_000)
    monkeypatch.setattr("lupin_twin.journal.file.PURGE_EVERY_S", 0.0)
    with opened(path, Limits(days=36_500, max_bytes=60_000)) as file:
        run = file.start(CLOCK, is_believed=False).run
        file.append([(run, scan(at_ns=NOW + n)) for n in range(5000)])
        steps = 0
        while file.check_size(may_purge=True):
            steps += 1
        assert steps > 10
    ((left,),) = select(path, "SELECT count(*) FROM scan")
    assert isinstance(left, int)
    assert 0 < left < 1000
    assert path.stat().st_size < 400_000
    assert is_whole(path)


def test_a_lack_of_room_for_scans_beside_the_hours_is_reported(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lupin_twin.journal.file.PURGE_EVERY_S", 0.0)
    append(path, [scan(at_ns=NOW + n) for n in range(500)])
    with recording(path, limits=Limits(days=36_500, max_bytes=10_000)) as journal:
        wait_state(
            journal, JournalState.RECORDING, "no scans are kept: the hours, which are never deleted"
        )
    assert select(path, "SELECT count(*) FROM scan") == [(0,)]


@pytest.mark.parametrize("renamed", [0, 1])
def test_a_salvage_that_was_killed_loses_nothing(
    path: Path, monkeypatch: pytest.MonkeyPatch, renamed: int
) -> None:
    rename, done = Path.rename, count()

    def killed(old: Path, new: Path) -> None:
        if next(done) == renamed:
            raise KeyboardInterrupt
        rename(old, new)

    append(path, [scan(at_ns=NOW + n) for n in range(300)])
    with monkeypatch.context() as killing:
        killing.setattr(Path, "rename", killed)
        with pytest.raises(KeyboardInterrupt):
            salvage(path)
    assert path.exists() is not bool(renamed)
    if path.exists():
        path.with_name("j.sqlite.new").write_text("killed before the old one was removed")
    # Any program that writes, not the twin alone, finds the journal as it was.
    assert not prefill(path, "the demo", [scan()], NOW)
    assert not path.with_name("j.sqlite.new").exists()
    with recording(path) as journal:
        assert journal.take_restored(30.0) is not None
    salvage(path)
    assert select(path, "SELECT count(*) FROM scan WHERE is_copy = 0") == [(300,)]


def test_a_failed_sync_is_reported_with_the_next_write(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(descriptor: int) -> None:
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(os, "fdatasync", fail)
    path = tmp_path / "j.sqlite"
    connection = open_writer(path)
    connection.execute("INSERT INTO site VALUES ('7', '')")
    syncing = Syncing(path, period_s=0.0)

    def write() -> str:
        try:
            syncing.has_written()
        except OSError as error:
            return str(error)
        return ""

    assert "Input/output error" in wait_for(write, "the error")
    with pytest.raises(OSError, match="Input/output"):
        syncing.has_written()
    syncing.close()
    connection.close()
