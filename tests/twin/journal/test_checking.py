import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from lupin_twin.journal.checking import find_all_damage
from lupin_twin.journal.fold import state_at
from lupin_twin.journal.schema import DamagedFile, open_reader, open_writer
from tests.support.journal import NOW, SECOND, append, inspection, pin, scan


@pytest.fixture
def path(tmp_path: Path) -> Path:
    made = tmp_path / "j.sqlite"
    scans = [scan(at_ns=NOW + n * SECOND, a=n / 3, b=float(n)) for n in range(300)]
    append(made, [pin(), inspection(), *scans])
    return made


def damage(path: Path) -> list[str]:
    with closing(open_reader(path)) as connection:
        return list(find_all_damage(connection, lambda what, share: None))


def changed(path: Path, sql: str) -> None:
    with closing(open_writer(path)) as connection:
        connection.execute(sql)


def test_a_sound_file_passes(path: Path) -> None:
    assert damage(path) == []


@pytest.mark.parametrize("where", ["structure", "scan"])
def test_an_interruption_is_no_damage(where: str, path: Path) -> None:
    with closing(open_reader(path)) as connection:

        def report(what: str, share: float) -> None:
            if what == where:
                connection.set_progress_handler(lambda: 1, 1)

        with pytest.raises(sqlite3.OperationalError, match="interrupted"):
            list(find_all_damage(connection, report))


@pytest.mark.parametrize(
    ("sql", "message"),
    [
        ("UPDATE scan SET readings = '[1.0]' WHERE seq = 7", "scan 7 of tag '7' is not what was"),
        ("UPDATE scan SET readings = '[1.0,' WHERE seq = 7", "scan 7 of tag '7' is not what was"),
        ("UPDATE scan SET series = 99 WHERE seq = 7", "scan 7 of tag None is not what was"),
        ("UPDATE scan SET status = 'x' WHERE seq = 7", "scan 7 of tag '7' is not what was"),
        (
            "UPDATE scan SET readings = '[1.0,[]]' WHERE seq = 7",
            "scan 7 of tag '7' is not what was",
        ),
        ("UPDATE look SET blooms = '[[1,2]]'", "look 2 of tag '7' is not what was written"),
        ("UPDATE look SET blooms = '[['", "look 2 of tag '7' is not what was written"),
        ("UPDATE look SET run = 5", "look 2 of tag '7' is not what was written"),
        ("UPDATE place SET run = 5", "place 1 of tag '7' is not what was written"),
        ("UPDATE run SET joins = 3", "run 1 joins run 3, which is missing"),
    ],
)
def test_damage_is_reported_by_row(path: Path, sql: str, message: str) -> None:
    changed(path, sql)
    assert any(found.startswith(message) for found in damage(path))


def test_all_damage_is_found_and_progress_is_reported(path: Path) -> None:
    changed(path, "UPDATE scan SET readings = '[]' WHERE seq % 2")
    reported: list[tuple[str, float]] = []

    def found() -> Iterator[str]:
        with closing(open_reader(path)) as connection:
            yield from find_all_damage(
                connection, lambda what, share: reported.append((what, share))
            )

    assert len([wrong for wrong in found() if wrong.startswith("scan")]) == 150
    order = ["structure", "scan", "look", "place"]
    assert list(dict.fromkeys(what for what, _ in reported)) == order
    assert {what: share for what, share in reported if what != "structure"} == dict.fromkeys(
        order[1:], 1.0
    )


@pytest.mark.parametrize("text", ["[1,", "[1],[2]", "7", '["x",1]', "", "[[1]]"])
def test_a_query_that_meets_an_invalid_list_of_numbers_reports_damage(
    path: Path, text: str
) -> None:
    changed(path, f"UPDATE scan SET readings = '{text}'")
    with closing(open_reader(path)) as connection, pytest.raises(DamagedFile):
        state_at(connection, NOW + 300 * SECOND, "map")
