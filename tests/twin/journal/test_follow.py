"""A log copied lot by lot: the same answers, each row once, wherever it was broken off."""

import random
import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path

import pytest

from lupin_twin.core.notes import ACKNOWLEDGE, Note
from lupin_twin.core.state import Write
from lupin_twin.journal import follow
from lupin_twin.journal.follow import Followed, Lot, NotALotError
from lupin_twin.journal.retention import Limits, forget, purge_step
from lupin_twin.journal.schema import (
    DamagedFile,
    NotPossible,
    open_reader,
    open_writer,
    set_meta,
    transaction,
)
from tests.support.journal import NOW, SECOND, append, inspection, opened, pin, scan

TABLES = ("run", "series", "scan", "look", "place", "hour", "tally", "event", "note")


@contextmanager
def reading(path: Path) -> Iterator[sqlite3.Connection]:
    with closing(open_reader(path)) as connection:
        yield connection


def copy(source: Path, target: Path, most: int = 7, *, lots: int | None = None) -> Followed:
    """All that the target has not got yet, or so many lots of it."""
    after = follow.followed(target).last if target.exists() else 0
    while True:
        with reading(source) as connection:
            lot = follow.read(connection, after, most)
        found = follow.write(target, lot, NOW, after)
        after, lots = lot.last, lots and lots - 1
        if lot.is_all or lots == 0:
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
    rows: list[Write] = [pin(), inspection()]
    rows += [scan(at_ns=NOW + n * 600 * SECOND) for n in range(30)]
    append(path, [*rows, scan("8", NOW + 5 * SECOND, co2=400.0), inspection("8", anomaly=True)])
    return path


def test_a_copy_has_the_same_rows_and_counts(source: Path, tmp_path: Path) -> None:
    target = tmp_path / "copies" / "web.sqlite"
    found = copy(source, target)
    assert contents(target) == contents(source)
    assert (found.journal, found.complete_ns) == (follow.followed(source).journal, NOW)
    assert found.kept_ns == follow.followed(source).kept_ns
    # What comes later goes on from there; what is told again is nothing new.
    append(source, [scan(at_ns=NOW + n * 60 * SECOND, co2=1.0) for n in range(500, 540)])
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
    bad = (
        *('["scan",1]', "[]", "{", '["notes",1]', '["scan",99,98,1,null,1,0,"","","",0,"[1]"]'),
        *('["meta","purged_ns:1","x"]', '["meta","lost_ns:1","1e3"]', '["meta",7,"1"]'),
        *('["meta","purged_seq","1.5"]', '["meta","followed_from_seq","x"]', "[" * 100_000),
        *('["run",1,0,"x",1,1,null,null]', f'["run",{10**30},0,1,1,1,null,null]'),
        *('["hour",null,1,"","","",""]', '["meta","forgotten:1","{\\"tag\\":[],\\"what\\":1}"]'),
    )
    for text in bad:
        with pytest.raises(NotALotError):
            follow.write(target, Lot(id_, ('["meta","purged_ns:1","5"]', text), 999, True), NOW)
    assert contents(target) == before
    assert follow.followed(target).last == follow.followed(target).last < 999


def test_a_lot_changes_the_name_of_no_journal(tmp_path: Path) -> None:
    lot = Lot("a" * 32, ('["meta","journal_id","../accounts"]',), 0, True)
    assert follow.write(tmp_path / "web.sqlite", lot, NOW).journal == lot.journal


@pytest.mark.parametrize("key", ["purged_ns:1", "purged_seq", "forgotten:1", "followed_seq"])
def test_a_copy_that_says_nonsense_of_itself_is_damaged(
    key: str, source: Path, tmp_path: Path
) -> None:
    target = tmp_path / "web.sqlite"
    copy(source, target)
    with closing(open_writer(target)) as connection, transaction(connection):
        set_meta(connection, key, "x")
    with pytest.raises(DamagedFile, match="nonsense"):
        follow.followed(target)
    if key == "followed_seq":
        with reading(source) as connection:
            lot = follow.read(connection, 0, 7)
        with pytest.raises(DamagedFile, match="followed_seq in the journal is 'x'"):
            follow.write(target, lot, NOW)


@pytest.mark.parametrize("said", ["x", "nan", "-5", "0", "1e-300", "inf", "1e300"])
def test_a_day_of_no_length_is_the_usual_one(said: str, source: Path) -> None:
    with closing(open_writer(source)) as connection, transaction(connection):
        set_meta(connection, "day_length_s", said)
    assert follow.followed(source).world.day_length_s == 86_400.0


def test_a_copy_of_a_journal_that_was_put_back_from_a_backup_is_made_anew(
    source: Path, tmp_path: Path
) -> None:
    target, backup = tmp_path / "web.sqlite", tmp_path / "backup.sqlite"
    shutil.copy(source, backup)
    append(source, [scan(at_ns=NOW + (n + 60) * 600 * SECOND) for n in range(4)])
    copy(source, target)
    shutil.copy(backup, source)
    for more in range(6):
        if more:
            append(source, [scan(at_ns=NOW + (more + 60) * 600 * SECOND + 1)])
        with pytest.raises(DamagedFile, match="has other rows by now"):
            copy(source, target)
    target.unlink()
    copy(source, target)
    assert contents(target) == contents(source)


@pytest.mark.parametrize("seed", range(60))
def test_whatever_happens_to_a_journal_a_whole_copy_has_the_same(  # noqa: C901  # the cases
    seed: int, tmp_path: Path
) -> None:
    """Scans, inspections and notes, late ones, deleted and forgotten ones, copied lot by lot."""
    chance = random.Random(seed)
    source, target = tmp_path / "twin.sqlite", tmp_path / "web.sqlite"
    now_ns = NOW
    append(source, [scan(at_ns=now_ns)])

    def some(at_ns: int) -> Write:
        tag, made = chance.choice("789"), chance.randrange(3)
        if made == 0:
            return inspection(tag, at_ns, anomaly=chance.random() < 0.5)
        return scan(tag, at_ns) if made == 1 else scan(tag, at_ns, co2=400.0)

    for _ in range(chance.randrange(4, 20)):
        match chance.choice(("new", "new", "note", "late", "delete", "forget", "copy", "whole")):
            case "new":
                rows: list[Write] = [pin(chance.choice("789"), now_ns, x=chance.random())]
                for _ in range(chance.randrange(1, 10)):
                    now_ns += chance.choice((1, 60, 700, 3_600, 9_000)) * SECOND
                    rows.append(some(now_ns))
                append(source, rows)
            case "note":
                # One that was made in the fleet has a number of there.
                note_id = chance.choice(("", f"{1:016x}{chance.getrandbits(32):08x}"))
                with opened(source) as file:
                    file.put_note(Note(note_id, now_ns, "anna", ACKNOWLEDGE, "alarm:a", "seen"))
            case "late":
                append(source, [some(NOW + chance.randrange(now_ns - NOW + 1))])
            case "delete":
                with closing(open_writer(source)) as connection, transaction(connection):
                    purge_step(connection, Limits(1.0, 10**12), chance.randrange(NOW, now_ns + 1))
            case "forget":
                with suppress(NotPossible):
                    pose_only = chance.random() < 0.5
                    forget(source, chance.choice("789"), pose_only=pose_only, by="who", at_ns=NOW)
            case how:
                most = chance.choice((1, 3, 500))
                try:
                    copy(source, target, most, lots=1 if how == "copy" else None)
                except DamagedFile:
                    target.unlink()
                    copy(source, target, most)
                    how = "whole"
                if how == "whole":
                    assert contents(target) == contents(source)
                    assert follow.followed(target).kept_ns == follow.followed(source).kept_ns
