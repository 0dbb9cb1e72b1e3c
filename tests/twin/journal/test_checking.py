from __future__ import annotations

import json
import random
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from lupin_twin.journal import checking
from lupin_twin.journal.checking import find_all_damage
from lupin_twin.journal.schema import (
    FILE_ERRORS,
    Foreign,
    open_reader,
    open_writer,
    says_damaged,
)
from tests.support.journal import NOW, SECOND, kept, look, pin, scan, select


@pytest.fixture
def path(tmp_path: Path) -> Path:
    made = tmp_path / "j.sqlite"
    scans = [scan(at_ns=NOW + n * SECOND, a=n / 3, b=float(n)) for n in range(300)]
    kept(made, [pin(), look(), *scans])
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
        ("UPDATE scan SET readings = '[1.0]' WHERE seq = 7", "scan 7 of tag '7' is not what was"),
        ("UPDATE scan SET readings = '[1.0,' WHERE seq = 7", "scan 7 of tag '7' is not what was"),
        ("UPDATE scan SET readings = '[9.5,4.0]' WHERE seq = 7", "hour 489916 of tag '7' does not"),
        ("UPDATE scan SET series = 99 WHERE seq = 7", "scan 7 of tag None is not what was"),
        ("UPDATE scan SET status = 'x' WHERE seq = 7", "scan 7 of tag '7' is not what was"),
        ("UPDATE look SET blooms = '[['", "look 2 of tag '7' is not what was written"),
        ("UPDATE look SET run = 5", "look 2 of tag '7' is not what was written"),
        ("UPDATE place SET run = 5", "place 1 of tag '7' is not what was written"),
        ("UPDATE hour SET n = '[300,299]'", "hour 489916 of tag '7' does not fit its scans"),
        ("UPDATE hour SET high = '['", "hour 489916 of tag '7' does not fit its scans"),
        ("UPDATE run SET joins = 3", "run 1 joins run 3, which is missing"),
    ],
)
def test_what_is_not_what_was_written_is_named(path: Path, sql: str, said: str) -> None:
    changed(path, sql)
    assert any(found.startswith(said) for found in damage(path))


def test_an_hour_is_held_against_its_scans_while_they_are_there(path: Path) -> None:
    changed(path, "DELETE FROM scan WHERE seq < 100")
    assert damage(path) == ["hour 489916 of tag '7' does not fit its scans"]
    changed(path, f"INSERT INTO meta VALUES ('local', 'purged_ns:1', '{NOW + 97 * SECOND}')")
    assert damage(path) == []


def test_of_many_hours_some_are_held_against_their_scans(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept(path, [scan(at_ns=NOW + n * 3600 * SECOND, a=1.0, b=1.0) for n in range(1, 30)])
    monkeypatch.setattr(checking, "_COMPARED", 10)
    changed(path, "UPDATE hour SET low = '[0,0]'")
    assert len(damage(path)) == 10


def test_all_of_them_are_found_and_how_far_it_is_is_told(path: Path) -> None:
    changed(path, "UPDATE scan SET readings = '[]' WHERE seq % 2")
    told: list[tuple[str, float]] = []

    def found() -> Iterator[str]:
        with closing(open_reader(path)) as connection:
            yield from find_all_damage(connection, lambda what, share: told.append((what, share)))

    assert len([wrong for wrong in found() if wrong.startswith("scan")]) == 150
    order = ["structure", "scan", "look", "place", "hour"]
    assert list(dict.fromkeys(what for what, _ in told)) == order
    assert {what: share for what, share in told if what != "structure"} == dict.fromkeys(
        order[1:], 1.0
    )


def test_a_flipped_bit_is_found_unless_every_row_reads_as_before(path: Path) -> None:
    """But in texts that nothing is held against, and in the last digits of a reading."""
    whole, right = path.read_bytes(), rows(path)
    chance = random.Random(1)
    found = 0
    for _ in range(100):
        broken = bytearray(whole)
        broken[chance.randrange(len(whole))] ^= 1 << chance.randrange(8)
        path.write_bytes(broken)
        if is_found(path):
            found += 1
        else:
            for (readings, *rest), (their_readings, *their_rest) in zip(
                rows(path), right, strict=True
            ):
                assert rest == their_rest
                assert readings == pytest.approx(their_readings, abs=1e-6)
    assert found > 40


def rows(path: Path) -> list[list[Any]]:
    found = select(path, "SELECT readings, seq, series, stamp_ns, status FROM scan ORDER BY seq")
    return [[json.loads(str(readings)), *rest] for readings, *rest in found]


def is_found(path: Path) -> bool:
    try:
        return bool(damage(path))
    except Foreign:
        return True
    except FILE_ERRORS as error:
        return says_damaged(error)
