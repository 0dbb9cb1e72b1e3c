from __future__ import annotations

import sqlite3
from pathlib import Path

import pytest

from lupin_twin.journal.schema import (
    DamagedFile,
    Foreign,
    find_damage,
    open_reader,
    open_writer,
    says_damaged,
    transaction,
)
from tests.support.journal import kept, scan


@pytest.fixture
def path(tmp_path: Path) -> Path:
    made = tmp_path / "j.sqlite"
    open_writer(made).close()
    return made


def test_a_new_file_is_ours_and_can_be_shrunk(path: Path) -> None:
    connection = open_writer(path)
    for pragma, value in {"journal_mode": "wal", "auto_vacuum": 2, "mmap_size": 0}.items():
        assert connection.execute(f"PRAGMA {pragma}").fetchone() == (value,)
    connection.close()
    assert find_damage(path) is None


def test_a_reader_cannot_write(path: Path) -> None:
    connection = open_reader(path)
    with pytest.raises(sqlite3.OperationalError, match="readonly"):
        connection.execute("DELETE FROM scan")
    connection.close()


def test_a_database_of_somebody_else_is_told_and_left(tmp_path: Path) -> None:
    foreign = tmp_path / "theirs.sqlite"
    connection = sqlite3.connect(foreign)
    connection.execute("CREATE TABLE theirs (x)")
    connection.close()
    before = foreign.read_bytes()
    for opens in (open_reader, open_writer):
        with pytest.raises(Foreign, match="not a journal of lupin-twin"):
            opens(foreign)
    assert foreign.read_bytes() == before
    assert find_damage(foreign) is None


def test_a_newer_version_is_told_and_left(path: Path) -> None:
    connection = sqlite3.connect(path)
    connection.execute("PRAGMA user_version = 2")
    connection.close()
    with pytest.raises(Foreign, match="version 2, this is version 1"):
        open_writer(path)


def test_a_file_that_is_no_database_is_damaged(tmp_path: Path) -> None:
    text = tmp_path / "j.sqlite"
    text.write_text("nothing of the kind\n" * 100)
    with pytest.raises(sqlite3.DatabaseError) as caught:
        open_writer(text)
    assert says_damaged(caught.value)
    assert find_damage(text)


def test_a_journal_with_a_damaged_header_is_damaged_and_not_somebody_elses(path: Path) -> None:
    whole = bytearray(path.read_bytes())
    whole[70] ^= 0x10  # the application id
    path.write_bytes(whole)
    with pytest.raises(DamagedFile) as caught:
        open_writer(path)
    assert says_damaged(caught.value)


def test_a_missing_file_and_a_locked_one_are_no_damage(tmp_path: Path) -> None:
    with pytest.raises(sqlite3.OperationalError) as caught:
        open_reader(tmp_path / "none.sqlite")
    assert not says_damaged(caught.value)


def test_a_transaction_is_all_or_nothing(path: Path) -> None:
    connection = open_writer(path)
    with pytest.raises(sqlite3.IntegrityError), transaction(connection):
        connection.executemany("INSERT INTO tag (tag_id) VALUES (?)", [("7",), ("7",)])
    assert connection.execute("SELECT count(*) FROM tag").fetchone() == (0,)
    connection.close()


def test_rows_can_be_read_with_any_sqlite(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    kept(path, [scan("7")])
    connection = sqlite3.connect(path)
    (row,) = connection.execute(
        "SELECT run, tag_id, stamp_ns - arrival_ns, status, source, mission, sensors FROM scans"
    )
    connection.close()
    assert row == (1, "7", -1000, 0, "robot", "m1", '["temperature"]')
