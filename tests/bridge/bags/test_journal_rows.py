from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest

from lupin_bridge.bags import journal_export
from lupin_bridge.bags.journal_export import JournalRows
from lupin_twin.core.state import Pin, Write
from lupin_twin.journal.runs import Carries, Clock
from lupin_twin.journal.schema import open_reader
from tests.support.journal import NOW, SECOND, kept, look, opened, pin, scan

ROWS: list[Write] = [
    pin("7"),
    scan("7", NOW),
    pin("8", NOW + SECOND, x=8.5),
    look("8", NOW + SECOND),
    scan("7", NOW + 2 * SECOND),
    scan("8", NOW + SECOND),  # late
    scan("7", NOW + 3 * SECOND),
    look("7", NOW + 3 * SECOND),
    pin("9", NOW + 3 * SECOND),
]


def held(path: Path, start_ns: int = 0, end_ns: int = 2**62) -> tuple[list[Write], list[Pin]]:
    """The rows of a period, and the places before it."""
    with closing(open_reader(path)) as connection:
        rows = JournalRows(connection, start_ns, end_ns)
        found = [row for _, row in rows]
        return found, rows.places


def test_all_of_it_in_the_order_of_hearing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "j.sqlite"
    kept(path, ROWS)
    for lot in (1, 2, 3, 2_000):
        monkeypatch.setattr(journal_export, "LOT", lot)
        assert held(path) == (ROWS, [])


def test_a_period_begins_at_its_start_and_ends_before_its_end(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    kept(path, ROWS)
    assert held(path, NOW + SECOND, NOW + 3 * SECOND) == (ROWS[2:6], [pin("7")])
    assert held(path, NOW + SECOND + 1, NOW + 2 * SECOND + 1) == (
        [ROWS[4]],
        [pin("7"), pin("8", NOW + SECOND, x=8.5)],
    )
    assert held(path, 0, NOW + SECOND) == (ROWS[:2], [])
    assert held(path, NOW + 4 * SECOND) == ([], [ROWS[0], ROWS[2], ROWS[-1]])


def test_what_comes_while_it_is_read_is_read_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, later = tmp_path / "j.sqlite", scan("10", NOW + 4 * SECOND, light=1.0)
    kept(path, ROWS)
    monkeypatch.setattr(journal_export, "LOT", 1)
    with closing(open_reader(path)) as connection:
        rows = JournalRows(connection, 0, 2**62)
        reading = iter(rows)
        first = [next(reading)[1] for _ in range(2)]
        kept(path, [later])
        assert [*first, *(row for _, row in reading)] == [*ROWS, later]


def test_of_an_earlier_run_the_places_are_known(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    again = Clock(50 * SECOND, NOW + 60 * SECOND, is_simulated=True)
    row = replace(scan("7", 60 * SECOND), arrival_ns=NOW + 70 * SECOND)
    with opened(path) as file:
        first = file.start(Clock(100 * SECOND, NOW, is_simulated=True), is_believed=False).run
        file.append([(first, pin("7", 100 * SECOND)), (first, scan("7", 100 * SECOND))])
        file.append([(file.begin(again, first, Carries.ALL), row)])
    with closing(open_reader(path)) as connection:
        rows = JournalRows(connection, 55 * SECOND, 90 * SECOND)
        [(run, found)] = list(rows)
    assert (run.begun, found) == (again, row)
    assert rows.is_simulated
    assert [place.tag_id for place in rows.places] == ["7"]
