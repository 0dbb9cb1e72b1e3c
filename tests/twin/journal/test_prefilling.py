from contextlib import closing
from pathlib import Path

import pytest

from lupin_twin.core.diagnostics import JournalState
from lupin_twin.core.state import Write
from lupin_twin.journal.appending import prefill, simulated
from lupin_twin.journal.runs import Clock
from lupin_twin.journal.schema import open_reader
from tests.support.journal import (
    CLOCK,
    NOW,
    SECOND,
    append,
    inspection,
    is_whole,
    known,
    pin,
    recording,
    restored,
    scan,
    select,
    wait_state,
)

DAY = 86_400 * SECOND
START = NOW - 3 * DAY
PAST: list[Write] = [
    pin(at_ns=START),
    scan(at_ns=START),
    inspection(at_ns=NOW - DAY),
    scan(at_ns=NOW - SECOND),
]


def filled(path: Path) -> bool:
    return prefill(path, "a test", PAST, NOW)


def mark(path: Path) -> tuple[int, int] | None:
    with closing(open_reader(path)) as connection:
        return simulated(connection)


def test_a_missing_journal_gets_a_past_that_continues(tmp_path: Path) -> None:
    path = tmp_path / "state" / "j.sqlite"
    assert filled(path)
    assert is_whole(path)
    assert mark(path) == (START, NOW)
    assert {type(row).__name__ for row in known(path, CLOCK)} == {"Pin", "Scan", "Inspection"}
    # Past and present are one run of the clock.
    append(path, [scan(at_ns=NOW + SECOND)], CLOCK)
    assert select(path, "SELECT run, begun_stamp_ns FROM run") == [(1, START)]
    assert restored(path).last_seq == 5


def test_a_twin_that_received_nothing_leaves_it_empty(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    append(path, [], CLOCK)
    assert filled(path)
    assert select(path, "SELECT run, begun_stamp_ns FROM run") == [(1, START)]


@pytest.mark.parametrize("row", [scan(), inspection(), pin()])
def test_a_journal_with_recorded_rows_is_not_filled(tmp_path: Path, row: Write) -> None:
    path = tmp_path / "j.sqlite"
    append(path, [row], CLOCK)
    assert not filled(path)
    assert mark(path) is None


def test_a_running_journal_knows_which_part_is_simulated(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    filled(path)
    for at_ns, is_simulated in ((NOW + SECOND, False), (5 * SECOND, True)):
        with recording(path, Clock(at_ns, NOW + SECOND, is_simulated)) as journal:
            assert wait_state(journal, JournalState.RECORDING).simulated_ns == (START, NOW)
