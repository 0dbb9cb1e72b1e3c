import os
import sqlite3
from contextlib import closing, suppress
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from lupin_twin.journal import schema
from lupin_twin.journal.checking import is_damaged
from lupin_twin.journal.schema import (
    FILE_ERRORS,
    UPGRADED,
    VERSION,
    DamagedFile,
    Empty,
    Foreign,
    is_damage_error,
    open_reader,
    open_writer,
)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    made = tmp_path / "j.sqlite"
    open_writer(made).close()
    return made


def test_a_foreign_database_is_reported_and_left_alone(tmp_path: Path) -> None:
    foreign = tmp_path / "theirs.sqlite"
    connection = sqlite3.connect(foreign)
    connection.execute("CREATE TABLE theirs (x)")
    connection.close()
    before = foreign.read_bytes()
    for opens in (open_reader, open_writer):
        with pytest.raises(Foreign, match="not a journal of lupin-twin"):
            opens(foreign)
    assert foreign.read_bytes() == before
    assert not is_damaged(foreign)


@pytest.mark.parametrize("after", range(6))
def test_a_file_being_created_is_empty_or_complete_but_never_foreign(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, after: int
) -> None:
    """Its tables appear after the reader's fifth query."""
    path = tmp_path / "j.sqlite"
    maker = sqlite3.connect(path, isolation_level=None, timeout=0.0)
    make = (
        f"BEGIN; {schema.SQLITE_TABLES} PRAGMA application_id = {schema.APPLICATION_ID};"
        f"PRAGMA user_version = {VERSION}"
    )
    for statement in make.split(";"):
        maker.execute(statement)
    steps = iter(range(after))

    class Reader(sqlite3.Connection):
        def execute(self, *requested: Any) -> sqlite3.Cursor:
            if next(steps, None) is None and maker.in_transaction:
                with suppress(sqlite3.OperationalError):  # it waits for the reader
                    maker.execute("COMMIT")
            return super().execute(*requested)

    connect = sqlite3.connect
    monkeypatch.setattr(sqlite3, "connect", partial(connect, factory=Reader))
    with closing(maker), suppress(Empty):
        open_reader(path).close()


def test_a_file_being_created_is_called_empty_and_not_damaged(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    with closing(sqlite3.connect(path, isolation_level=None)) as maker:
        maker.execute("BEGIN IMMEDIATE")
        maker.execute("CREATE TABLE meta (x)")
        with pytest.raises(Empty, match="is empty: a journal that is just being created"):
            open_reader(path)
        assert not is_damaged(path)


@pytest.mark.parametrize("version", [1, 2, *UPGRADED, VERSION + 1])
def test_another_version_is_left_alone_and_the_message_says_what_happens_to_it(
    path: Path, version: int
) -> None:
    with closing(sqlite3.connect(path)) as connection:
        connection.execute(f"PRAGMA user_version = {version}")
    other = "install the lupin-twin that wrote it"
    what = "a twin that starts with it upgrades it" if version in UPGRADED else other
    with pytest.raises(Foreign, match=f"version {version}, this is version {VERSION}: {what}"):
        open_writer(path)


def test_a_file_that_is_no_database_is_damaged(tmp_path: Path) -> None:
    text = tmp_path / "j.sqlite"
    text.write_text("nothing of the kind\n" * 100)
    with pytest.raises(sqlite3.DatabaseError) as caught:
        open_writer(text)
    assert is_damage_error(caught.value)
    assert is_damaged(text)


def test_a_path_that_is_no_file_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "fifo")
    for path in (tmp_path / "fifo", tmp_path, Path("/dev/zero")):
        with pytest.raises(Foreign, match="is not a journal: it is not a regular file"):
            open_reader(path)


def test_a_journal_with_a_damaged_header_is_damaged_and_not_foreign(path: Path) -> None:
    whole = bytearray(path.read_bytes())
    whole[70] ^= 0x10  # the application id
    path.write_bytes(whole)
    with pytest.raises(DamagedFile) as caught:
        open_writer(path)
    assert is_damage_error(caught.value)


def test_a_flipped_letter_in_a_table_definition_is_damage(path: Path) -> None:
    whole = path.read_bytes()
    for letter in ("scan_at", "stamp_ns BIGINT", "readings TEXT"):
        at = whole.index(letter.encode())
        for bit in (0x02, 0x80):  # another letter, and none at all
            broken = bytearray(whole)
            broken[at + 2] ^= bit
            path.write_bytes(broken)
            assert is_damaged(path), f"{letter} {bit}"
            with pytest.raises(FILE_ERRORS) as caught:
                open_writer(path)
            assert is_damage_error(caught.value)
