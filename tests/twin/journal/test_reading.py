from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from lupin_twin.journal.packing import Damaged
from lupin_twin.journal.reading import Names, all_series, ending, runs
from lupin_twin.journal.runs import Carries, Clock
from lupin_twin.journal.schema import open_reader
from tests.support.journal import CLOCK, NOW, SECOND, kept, look, opened, scan

SIM = Clock(5 * SECOND, NOW, is_simulated=True)


def test_runs_come_back(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    with opened(path) as file:
        first = file.first_run(CLOCK)
        second = file.next_run(first, SIM)
    connection = open_reader(path)
    assert runs(connection) == {1: first, 2: second}
    connection.close()
    assert (second.follows, second.carries, second.begun) == (1, Carries.ALL, SIM)


def test_the_ending_is_the_last_that_was_heard_in_the_newest_run_of_a_kind(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    kept(path, [scan(at_ns=NOW + 9 * SECOND), look(at_ns=NOW + 3 * SECOND)])
    at = SIM.stamp_ns + 7 * SECOND
    kept(path, [replace(scan(at_ns=at), arrival_ns=NOW + 8 * SECOND)], SIM)
    connection = open_reader(path)
    wall, sim = (ending(connection, is_simulated=kind) for kind in (False, True))
    connection.close()
    assert wall is not None
    assert sim is not None
    assert wall.last == Clock(NOW + 9 * SECOND, NOW + 9 * SECOND + 1000, is_simulated=False)
    assert sim.last == Clock(at, NOW + 8 * SECOND, is_simulated=True)


def test_a_journal_without_runs_has_no_ending(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    with opened(path):
        pass
    connection = open_reader(path)
    assert ending(connection, is_simulated=False) is None
    connection.close()


def test_series_come_in_the_order_in_which_their_tags_were_heard_of(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    kept(path, [scan("9"), scan("10"), scan("9", humidity=1.0), look("10")])
    connection = open_reader(path)
    found = [(series.tag_id, series.sensors) for series in all_series(connection)]
    assert found == [
        ("9", ("temperature",)),
        ("9", ("humidity",)),
        ("10", ("temperature",)),
        ("10", ()),
    ]
    with pytest.raises(Damaged, match="name 99"):
        _ = Names(connection)[99]
    connection.close()
