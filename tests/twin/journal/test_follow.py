"""A log copied lot by lot: the same answers, each row once, wherever it was broken off."""

import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest

from lupin_twin.core.state import Write
from lupin_twin.journal import follow
from lupin_twin.journal.follow import Followed, Lot, NotALotError
from lupin_twin.journal.rebuild import upgrade
from lupin_twin.journal.retention import Limits, purge_step
from lupin_twin.journal.schema import open_reader, open_writer, transaction
from tests.support.journal import NOW, SECOND, kept, look, pin, scan
from tests.support.journal_answers import NAMES, answer, answers, old, same

TABLES = ("run", "series", "scan", "look", "place", "hour", "tally", "event")


@contextmanager
def reading(path: Path) -> Iterator[sqlite3.Connection]:
    with closing(open_reader(path)) as connection:
        yield connection


def copy(source: Path, target: Path, most: int = 7) -> Followed:
    """All that the target has not got yet."""
    after = follow.followed(target).last if target.exists() else 0
    while True:
        with reading(source) as connection:
            lot = follow.read(connection, after, most)
        found = follow.write(target, lot, NOW)
        after = lot.last
        if lot.is_all:
            return found


def contents(path: Path) -> dict[str, list[tuple[object, ...]]]:
    with reading(path) as connection:
        return {
            table: sorted(connection.execute(f"SELECT * FROM {table}").fetchall(), key=repr)
            for table in TABLES
        }


@pytest.fixture
def source(tmp_path: Path) -> Path:
    path = tmp_path / "twin.sqlite"
    rows: list[Write] = [pin(), look()]
    rows += [scan(at_ns=NOW + n * 600 * SECOND) for n in range(30)]
    kept(path, [*rows, scan("8", NOW + 5 * SECOND, co2=400.0), look("8", anomaly=True)])
    return path


def test_a_copy_has_the_same_rows_and_counts(source: Path, tmp_path: Path) -> None:
    target = tmp_path / "copies" / "web.sqlite"
    found = copy(source, target)
    assert contents(target) == contents(source)
    assert (found.journal, found.complete_ns) == (follow.followed(source).journal, NOW)
    assert found.kept_ns == follow.followed(source).kept_ns
    # What comes later goes on from there; what is told again is nothing new.
    kept(source, [scan(at_ns=NOW + n * 60 * SECOND, co2=1.0) for n in range(500, 540)])
    with reading(source) as connection:
        first = follow.read(connection, 0, 10)
    follow.write(target, first, None)
    assert copy(source, target).last > found.last
    assert contents(target) == contents(source)


def test_a_lot_that_was_broken_off_leaves_the_file_as_it_was(source: Path, tmp_path: Path) -> None:
    target = tmp_path / "web.sqlite"
    copy(source, target)
    before = contents(target)
    id_ = follow.followed(source).journal
    bad = ('["scan",1]', "[]", "{", '["notes",1]', '["scan",99,98,1,null,1,0,"","","",0,"[1]"]')
    for text in bad:
        with pytest.raises(NotALotError):
            follow.write(target, Lot(id_, ('["meta","purged_ns:1","5"]', text), 999, True), NOW)
    assert contents(target) == before
    assert follow.followed(target).last == follow.followed(target).last < 999


def test_what_the_journal_deletes_is_deleted_in_the_copy_and_its_hours_stay(
    source: Path, tmp_path: Path
) -> None:
    target = tmp_path / "web.sqlite"
    copy(source, target)
    with closing(open_writer(source)) as connection, transaction(connection):
        purge_step(connection, Limits(1.0, 10**12), NOW + 3_600 * SECOND)
    copy(source, target)
    assert contents(target) == contents(source)
    assert follow.followed(target).kept_ns == follow.followed(source).kept_ns != ((NOW, 2**63 - 1),)


def test_a_lot_is_never_cut_between_a_series_and_its_first_row(source: Path) -> None:
    with reading(source) as connection:
        for most in range(1, 6):
            after = 0
            while not (lot := follow.read(connection, after, most)).is_all:
                assert lot.last > after
                after = lot.last


@pytest.mark.parametrize("name", [name for name in NAMES if name in {"day", "runs", "late"}])
def test_a_copy_answers_as_the_journal_does(name: str, tmp_path: Path) -> None:
    source = old(name, tmp_path)
    upgrade(source, lambda _: None)
    target = tmp_path / "web.sqlite"
    copy(source, target, 500)
    with reading(source) as one, reading(target) as other:
        for question, _ in answers(name):
            assert same(answer(other, question), answer(one, question)), question
