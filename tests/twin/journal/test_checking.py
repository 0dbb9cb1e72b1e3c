from __future__ import annotations

import random
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest

from lupin_twin.journal import checking
from lupin_twin.journal.checking import find_all_damage
from lupin_twin.journal.packing import pack_buckets, unpack_buckets
from lupin_twin.journal.schema import (
    FILE_ERRORS,
    Foreign,
    open_reader,
    open_writer,
    says_damaged,
)
from tests.support.journal import NOW, SECOND, kept, look, opened, pin, scan, select


@pytest.fixture
def path(tmp_path: Path) -> Path:
    made = tmp_path / "j.sqlite"
    kept(made, [pin(), look(), *(scan(at_ns=NOW + n * SECOND, a=n / 3) for n in range(300))])
    with opened(made) as file:
        while file.look_after():
            pass
    return made


def damage(path: Path) -> list[str]:
    with closing(open_reader(path)) as connection:
        return list(find_all_damage(connection, lambda what, share: None))


def changed(path: Path, sql: str) -> None:
    with closing(open_writer(path)) as connection:
        connection.execute(sql)


def test_a_whole_file_is_whole(path: Path) -> None:
    assert damage(path) == []


@pytest.mark.parametrize("where", ["structure", "scan"])
def test_to_be_interrupted_is_no_damage(where: str, path: Path) -> None:
    with closing(open_reader(path)) as connection:

        def tell(what: str, share: float) -> None:
            if what == where:
                connection.set_progress_handler(lambda: 1, 1)

        with pytest.raises(sqlite3.OperationalError, match="interrupted"):
            list(find_all_damage(connection, tell))


@pytest.mark.parametrize(
    ("sql", "said"),
    [
        ("UPDATE scan SET stamp_ns = stamp_ns + 1 WHERE id = 7", "scan 7 of tag '7' is not what"),
        ("UPDATE scan SET readings = x'00' WHERE id = 302", "scan 302 of tag '7' is not what"),
        ("UPDATE look SET bug_count = 9", "look 2 of tag '7' is not what was written"),
        ("UPDATE pin SET pose = zeroblob(58)", "pin 1 is not what was written"),
        ("UPDATE rollup SET buckets = x'00'", "the rollup of tag '7' in hour 489916 is not what"),
        ("UPDATE run SET lead_ns = 8", "run 1 is not what was written"),
        ("UPDATE run SET carries = 7", "run 1 is not what was written"),
        ("DELETE FROM sensors WHERE names != '[]'", "series 2: its run, tag, source or sensors"),
        (
            "UPDATE sensors SET names = '[' WHERE names != '[]'",
            "what rows have in common cannot be read: ",
        ),
    ],
)
def test_each_row_that_is_not_what_was_written_is_named(path: Path, sql: str, said: str) -> None:
    changed(path, sql)
    found = damage(path)
    assert len(found) == 1
    assert found[0].startswith(said)


def test_a_rollup_that_does_not_fit_its_scans_is_named_while_they_are_there(path: Path) -> None:
    [(packed,)] = select(path, "SELECT buckets FROM rollup")
    assert isinstance(packed, bytes)
    [bucket] = unpack_buckets(packed, 1)
    for change in ({"n": 299}, {"mean": bucket.mean + 1e-6}, {"low": -1.0}, {"high": 1e9}):
        with closing(open_writer(path)) as connection:
            wrong = pack_buckets([replace(bucket, **change)])
            connection.execute("UPDATE rollup SET buckets = ?", (wrong,))
        assert damage(path) == ["the rollup of tag '7' in hour 489916 does not fit its scans"]
    # What was given up by age, or lost to damage, is in rollups alone.
    changed(path, "DELETE FROM scan WHERE id < 100")
    changed(path, f"INSERT INTO meta VALUES ('purged_ns:1', {NOW + 97 * SECOND})")
    assert damage(path) == []
    changed(path, "DELETE FROM meta WHERE key = 'purged_ns:1'")
    assert len(damage(path)) == 1
    changed(path, "INSERT INTO meta VALUES ('salvaged_id', 1000000)")
    assert damage(path) == []


def test_of_many_rollups_some_are_held_against_their_scans(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept(path, [scan(at_ns=NOW + n * 3600 * SECOND, a=1.0) for n in range(1, 30)])
    with opened(path) as file:
        while file.look_after():
            pass
    monkeypatch.setattr(checking, "_COMPARED", 10)
    changed(path, "UPDATE rollup SET buckets = (SELECT buckets FROM rollup WHERE hour = 489916)")
    assert len(damage(path)) == 10


def test_all_of_them_are_found_and_how_far_it_is_is_told(path: Path) -> None:
    changed(path, "UPDATE scan SET readings = x'00' WHERE id % 2")
    told: list[tuple[str, float]] = []

    def found() -> Iterator[str]:
        with closing(open_reader(path)) as connection:
            yield from find_all_damage(connection, lambda what, share: told.append((what, share)))

    assert len(list(found())) == 150
    assert list(dict.fromkeys(what for what, _ in told)) == ["structure", "scan", "look", "rollup"]
    assert {what: share for what, share in told if what != "structure"} == {
        "scan": 1.0,
        "look": 1.0,
        "rollup": 1.0,
    }


def test_a_flipped_byte_is_found_unless_every_row_reads_as_before(path: Path) -> None:
    whole, rows = path.read_bytes(), select(path, "SELECT * FROM scans ORDER BY id")
    chance = random.Random(1)
    found = 0
    for _ in range(60):
        broken = bytearray(whole)
        broken[chance.randrange(len(whole))] ^= 1 << chance.randrange(8)
        path.write_bytes(broken)
        if is_found(path):
            found += 1
        else:
            assert select(path, "SELECT * FROM scans ORDER BY id") == rows
    assert found > 20


def is_found(path: Path) -> bool:
    try:
        return bool(damage(path))
    except Foreign:
        return True
    except FILE_ERRORS as error:
        return says_damaged(error)
