"""A journal of an earlier version is upgraded: all answers stay, whatever happens meanwhile."""

import errno
import json
import os
import shutil
import signal
import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from lupin_twin.core.diagnostics import JournalState
from lupin_twin.core.past import DAY_NS
from lupin_twin.journal.checking import find_all_damage
from lupin_twin.journal.rebuild import old_version, upgrade
from lupin_twin.journal.runs import Clock
from lupin_twin.journal.schema import TABLES, get_meta, open_reader
from lupin_twin.journal.writer import Journal
from tests.support.journal import LIMITS, wait_state
from tests.support.journal_answers import NAMES, answer, answers, old, same
from tests.support.processes import run
from tests.support.waiting import wait_for
from tests.twin.journal.conftest import fail_on_a_full_disk

T0 = 1_763_683_200 * 10**9
CLOCK = Clock(T0 + 30 * DAY_NS, T0 + 30 * DAY_NS, is_simulated=False)
# One with counts of deleted rows, and a note.
VERSION4 = "version4/purged"


@contextmanager
def started(path: Path) -> Iterator[Journal]:
    """The journal of a twin that starts."""
    journal = Journal(path, "/test", LIMITS)
    journal.begin(CLOCK)
    try:
        yield journal
    finally:
        journal.close(30.0)


def check_states(path: Path, name: str) -> None:
    """The upgraded file gives the same state at every moment as the old one."""
    with closing(open_reader(path)) as connection:
        for query, right in answers(name):
            if query[0] == "state":
                assert same(answer(connection, query), right), query


def names_in(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


@pytest.mark.parametrize(("name", "kept"), [("day", "j.sqlite.v3"), (VERSION4, "j.sqlite.v4")])
def test_the_old_file_stays_unchanged_beside_the_new_one(
    name: str, kept: str, tmp_path: Path
) -> None:
    path = old(name, tmp_path)
    path.chmod(0o640)
    content = path.read_bytes()
    shares: list[float] = []
    assert upgrade(path, shares.append) == ""
    assert names_in(tmp_path) == {"j.sqlite", kept}
    assert path.with_name(kept).read_bytes() == content
    assert path.stat().st_mode & 0o777 == 0o640
    assert shares == sorted(shares)
    # Put back and upgraded again, nothing is overwritten.
    path.unlink()
    path.write_bytes(content)
    upgrade(path, shares.append)
    assert names_in(tmp_path) == {"j.sqlite", kept, f"{kept}-1"}


def test_the_wal_of_a_killed_twin_is_upgraded_too(tmp_path: Path) -> None:
    (tmp_path / "killed").mkdir()
    first = old("day", tmp_path)
    with closing(sqlite3.connect(first, isolation_level=None)) as writer:
        writer.execute("PRAGMA wal_autocheckpoint = 0")
        writer.execute("DELETE FROM look")
        for end in ("", "-wal"):
            shutil.copy(f"{first}{end}", tmp_path / "killed" / f"j.sqlite{end}")
    path = tmp_path / "killed" / "j.sqlite"
    upgrade(path, lambda share: None)
    assert names_in(path.parent) == {"j.sqlite", "j.sqlite.v3"}
    with closing(open_reader(path)) as connection:
        assert connection.execute("SELECT count(*) FROM look").fetchone() == (0,)
        assert connection.execute("SELECT count(*) > 300 FROM scan").fetchone() == (1,)


def test_damaged_rows_are_left_out_and_reported(tmp_path: Path) -> None:
    path = old("flipped", tmp_path)
    with started(path) as journal:
        assert journal.take_restored(30.0) is not None
        wait_for(lambda: journal.condition.state is JournalState.RECORDING, "recording")
        assert "7 rows of" in journal.condition.detail
        assert "j.sqlite.v3 are damaged and left out" in journal.condition.detail
    check_states(path, "flipped")


@pytest.mark.parametrize("name", NAMES)
def test_the_answers_are_those_of_the_old_file(name: str, tmp_path: Path) -> None:
    path = old(name, tmp_path)
    upgrade(path, lambda share: None)
    assert old_version(path) is None
    with closing(open_reader(path)) as connection:
        assert list(find_all_damage(connection, lambda what, share: None)) == []
        for query, right in answers(name):
            found = answer(connection, query)
            assert same(found, right) or is_another(name, query), query


def is_another(name: str, query: list[Any]) -> bool:
    """Whether a different answer is right, where the old build's was not."""
    if query[0] != "series":
        return False
    _, tag_id, sensor, *_ = query
    if sensor == "~silences":
        # To the old build, the usual interval was that between any two tags.
        return True
    if name in ("purged", VERSION4):
        # For deleted attempts the old build had counts by five minutes, now there are hours.
        return tag_id == "*" and sensor in ("~scans", "~failures", "~looks")
    # The old build had counted damaged rows: in an hour, in five minutes, and in the total of
    # an index. Now such a row is nowhere.
    return name in ("flipped", "damaged")


def test_version_4_keeps_its_identity_and_every_row(tmp_path: Path) -> None:
    path = old(VERSION4, tmp_path)
    upgrade(path, lambda share: None)
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("ATTACH ? AS old", (f"{path}.v4",))
        for table in ("site", "meta", *TABLES):
            rows, before = (
                connection.execute(f"SELECT * FROM {of}.{table}").fetchall()
                for of in ("main", "old")
            )
            if table == "meta":
                rows = [row for row in rows if not row[1].startswith("upgraded")]
            if table == "hour":
                lists = [map(json.loads, row[3:]) for row in before]
                before = [
                    (*row[:3], sensor, *counts)
                    for row, of in zip(before, lists, strict=True)
                    for sensor, counts in enumerate(zip(*of, strict=True))
                ]
            assert rows == before != [], table


def child(path: Path, number: int) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "tests.support.upgrade_child", str(path), str(number)]
    return run(command, os.environ)


@pytest.mark.parametrize(("name", "kept"), [("late", "j.sqlite.v3"), (VERSION4, "j.sqlite.v4")])
def test_killed_at_any_moment_it_is_completed_at_the_next_start(
    name: str, kept: str, tmp_path: Path
) -> None:
    whole = old(name, tmp_path)
    content = whole.read_bytes()
    moments = int(child(whole, 0).stdout)
    assert moments > 10
    for number in range(1, moments + 1):
        folder = tmp_path / str(number)
        folder.mkdir()
        path = old(name, folder)
        assert child(path, number).returncode == -signal.SIGKILL
        # Until it is done, all is in the old file.
        assert old_version(path) is None or path.read_bytes() == content
        with started(path) as journal:
            assert journal.take_restored(30.0) is not None, number
        assert names_in(folder) == {"j.sqlite", kept, "j.sqlite.lock"}
        assert path.with_name(kept).read_bytes() == content
        check_states(path, name)


@pytest.mark.parametrize("name", ["flipped", "purged", VERSION4])
def test_killed_again_and_again_it_is_completed_without_doing_anything_twice(
    name: str, tmp_path: Path
) -> None:
    (tmp_path / "whole").mkdir()
    moments = int(child(old(name, tmp_path / "whole"), 0).stdout)
    path = old(name, tmp_path)
    kills = 0
    while child(path, moments // 2).returncode == -signal.SIGKILL:
        kills += 1
        # Half of the steps of an upgrade that begins anew would never complete it.
        assert kills < 5
    assert kills
    with (
        closing(open_reader(path)) as connection,
        closing(open_reader(tmp_path / "whole" / "j.sqlite")) as whole,
    ):
        assert list(find_all_damage(connection, lambda what, share: None)) == []
        for table in TABLES:
            rows, at_once = (
                log.execute(f"SELECT * FROM {table}").fetchall() for log in (connection, whole)
            )
            assert rows == at_once, table
        assert get_meta(connection, "upgraded") == get_meta(whole, "upgraded")


def test_the_remains_of_the_upgrade_of_another_file_are_not_used(tmp_path: Path) -> None:
    path = old("day", tmp_path)
    assert child(path, 12).returncode == -signal.SIGKILL
    assert (tmp_path / "j.sqlite.upgrade").exists()
    old("late", tmp_path)
    upgrade(path, lambda share: None)
    assert names_in(tmp_path) == {"j.sqlite", "j.sqlite.v3"}
    check_states(path, "late")


@pytest.mark.parametrize("name", ["day", VERSION4])
def test_a_disk_that_fills_leaves_the_old_file_unchanged(name: str, tmp_path: Path) -> None:
    path = old(name, tmp_path)
    content = path.read_bytes()
    code = "from lupin_twin.journal.rebuild import upgrade; upgrade(path, print)"
    fail_on_a_full_disk(code, path, 50_000)
    assert path.read_bytes() == content
    assert names_in(tmp_path) == {"j.sqlite"}


def test_without_room_for_the_new_file_the_upgrade_is_refused_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = old("day", tmp_path)
    with monkeypatch.context() as full:
        full.setattr("shutil.disk_usage", lambda _: SimpleNamespace(free=20_000))
        with started(path) as journal:
            needs = "its upgrade needs 0.1 MB of disk, 0.0 MB are free"
            condition = wait_state(journal, JournalState.FAILING, needs)
            assert condition.file_bytes == 0
            assert names_in(tmp_path) == {"j.sqlite", "j.sqlite.lock"}
            full.undo()
            wait_state(journal, JournalState.RECORDING)
    check_states(path, "day")


def test_without_links_and_room_for_a_copy_nothing_is_left_behind(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*_: object) -> None:
        raise OSError(errno.EPERM, "no links")

    def half(source: Path, target: Path) -> None:
        target.write_bytes(source.read_bytes()[:5_000])
        raise OSError(errno.ENOSPC, "no room")

    path = old("day", tmp_path)
    content = path.read_bytes()
    monkeypatch.setattr("os.link", refused)
    with monkeypatch.context() as full:
        full.setattr("shutil.copyfile", half)
        with pytest.raises(OSError, match="no room"):
            upgrade(path, lambda share: None)
    assert path.read_bytes() == content
    assert names_in(tmp_path) == {"j.sqlite"}
    upgrade(path, lambda share: None)
    assert names_in(tmp_path) == {"j.sqlite", "j.sqlite.v3"}


def test_it_waits_for_readers_of_the_file(tmp_path: Path) -> None:
    path = old("day", tmp_path)
    with (
        closing(sqlite3.connect(path, isolation_level=None)) as writer,
        closing(sqlite3.connect(path, isolation_level=None)) as reader,
    ):
        reader.execute("BEGIN")
        reader.execute("SELECT count(*) FROM scan").fetchone()
        writer.execute("UPDATE run SET begun_arrival_ns = begun_arrival_ns + 1")
        with pytest.raises(sqlite3.OperationalError, match="another process reads"):
            upgrade(path, lambda share: None)
        reader.execute("ROLLBACK")
        # A reader may go on with its open file, whatever is written.
        upgrade(path, lambda share: None)
        with started(path) as journal:
            assert journal.take_restored(30.0) is not None
            assert reader.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
        assert reader.execute("SELECT count(*) FROM scan").fetchone()[0] > 300
    check_states(path, "day")


@pytest.mark.parametrize(
    ("name", "damage"),
    [
        ("day", "DROP TABLE run"),
        (VERSION4, "UPDATE hour SET n = '[1' WHERE hour = (SELECT max(hour) FROM hour)"),
    ],
)
def test_a_file_that_cannot_be_upgraded_is_quarantined(
    name: str, damage: str, tmp_path: Path
) -> None:
    path = old(name, tmp_path)
    # Of deleted scans, the hours are all that is left.
    hours = "SELECT DISTINCT hour FROM hour WHERE hour < 489948 ORDER BY hour"
    left = []
    with closing(sqlite3.connect(path)) as connection, connection:
        if name == VERSION4:
            left = connection.execute(hours).fetchall()
        connection.execute(damage)
    with started(path) as journal:
        wait_for(lambda: journal.condition.state is JournalState.RECORDING, "recording", 30.0)
        assert "j.sqlite.damaged-" in journal.condition.quarantined
    assert old_version(path) is None
    with closing(open_reader(path)) as connection:
        assert connection.execute(hours).fetchall() == left
