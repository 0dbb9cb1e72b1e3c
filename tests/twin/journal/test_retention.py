"""What is put into a journal beforehand, and what goes from it by age and by size."""

import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from lupin_twin.core.diagnostics import JournalState
from lupin_twin.core.past import FOREVER_NS, HOUR_NS
from lupin_twin.core.state import Write
from lupin_twin.journal import retention
from lupin_twin.journal.appending import prefill, simulated
from lupin_twin.journal.counts import deleted_ns
from lupin_twin.journal.retention import Limits, horizon_ns, note_lost, purge_step, used_bytes
from lupin_twin.journal.runs import Clock
from lupin_twin.journal.schema import SiteLog, open_reader, open_writer, transaction
from tests.support.journal import (
    CLOCK,
    NOW,
    SECOND,
    append,
    inspection,
    is_whole,
    known,
    opened,
    pin,
    recording,
    restored,
    scan,
    select,
    wait_state,
)

DAY = 24 * HOUR_NS
ENOUGH = 10**12
ROWS = 2_000


@pytest.fixture
def path(tmp_path: Path) -> Path:
    made = tmp_path / "j.sqlite"
    append(made, [pin(), inspection(), *(scan(at_ns=NOW + n * 60 * SECOND) for n in range(ROWS))])
    return made


@pytest.fixture
def file(path: Path) -> Iterator[sqlite3.Connection]:
    connection = open_writer(path)
    yield connection
    connection.close()


def purge(file: sqlite3.Connection, limits: Limits, now_ns: int) -> int:
    """Purge all there is; returns the steps."""
    steps = 0
    while True:
        with transaction(file):
            if not purge_step(file, limits, now_ns - int(limits.days * DAY)):
                return steps
        steps += 1


def scans(file: sqlite3.Connection) -> list[int]:
    return [stamp for (stamp,) in file.execute("SELECT stamp_ns FROM scan ORDER BY seq")]


def test_rows_past_their_age_are_deleted_and_nothing_else(file: sqlite3.Connection) -> None:
    now = NOW + 2 * DAY
    purge(file, Limits(1.5, ENOUGH), now)
    horizon = now - DAY * 3 // 2
    # A scan arrives a microsecond after its stamp.
    assert scans(file) == [
        at for at in (NOW + n * 60 * SECOND for n in range(ROWS)) if at + 1000 >= horizon
    ]
    assert file.execute("SELECT count(*) FROM look").fetchone() == (0,)
    assert file.execute("SELECT count(*) FROM place").fetchone() == (1,)


def test_a_file_that_is_too_large_loses_its_oldest_rows(file: sqlite3.Connection) -> None:
    limit = used_bytes(file) * 2 // 3
    steps = purge(file, Limits(ENOUGH, limit), NOW)
    assert 0.8 * limit < used_bytes(file) <= limit
    assert steps > 1
    left = scans(file)
    assert left == [NOW + n * 60 * SECOND for n in range(ROWS - len(left), ROWS)]


def test_numbers_continue_when_everything_is_deleted(path: Path, file: sqlite3.Connection) -> None:
    file.execute("DELETE FROM place")
    purge(file, Limits(0.0, ENOUGH), NOW + 99 * DAY)
    file.close()
    assert append(path, [scan(at_ns=NOW + 200 * DAY)]) == 1
    assert restored(path).last_seq == ROWS + 3


def test_data_start_with_the_log_and_after_deleted_or_lost_rows(
    path: Path, file: sqlite3.Connection
) -> None:
    assert retention.kept(file) == ((NOW, FOREVER_NS),)
    with transaction(file):
        note_lost(file, 1, NOW + 5)
        note_lost(file, 1, NOW + 3)
    assert retention.kept(file) == ((NOW + 6, FOREVER_NS),)
    purge(file, Limits(1.0, ENOUGH), NOW + 2 * DAY)
    assert retention.kept(file) == ((deleted_ns(SiteLog(file), 1) + 1, FOREVER_NS),)
    # Another run has data from before the end of the first, and has lost nothing.
    file.close()
    with opened(path) as again:
        first = again.start(CLOCK, is_believed=True).run
        back = Clock(NOW - 9, NOW + DAY, is_simulated=False)
        again.begin(back, first, ended_ns=NOW + 2 * DAY)
        assert again.kept() == ((NOW - 9, FOREVER_NS),)


def test_rows_from_before_the_log_start_the_data(path: Path) -> None:
    with opened(path) as file:
        run = file.start(CLOCK, is_believed=True).run
        assert file.kept()[0][0] == NOW
        file.append([(run, scan("late", NOW - HOUR_NS))])
        assert file.kept()[0][0] == NOW - HOUR_NS


def test_a_clock_that_is_a_year_ahead_deletes_nothing_at_once(file: sqlite3.Connection) -> None:
    limits, last = Limits(90.0, ENOUGH), NOW + (ROWS - 1) * 60 * SECOND + 1000
    # Nothing has been received by that clock yet: all ages are unchanged.
    assert horizon_ns(file, limits, NOW + 365 * DAY) == last - 90 * DAY
    # After that, one round deletes at most an hour of it.
    file.execute("UPDATE scan SET arrival_ns = ? WHERE seq = ?", (NOW + 365 * DAY, ROWS + 2))
    assert horizon_ns(file, limits, NOW + 365 * DAY) == NOW + 1000 + HOUR_NS


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
    assert {getattr(row, "kind", "pin") for row in known(path, CLOCK)} == {"pin", 0, 1}
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
