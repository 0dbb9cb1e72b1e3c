"""Queries of a journal: order, end, and the reason for a missing answer."""

import sqlite3
import threading
from collections.abc import Iterator
from concurrent.futures import CancelledError, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from pathlib import Path

import pytest

from lupin_twin.core.diagnostics import Condition, JournalState
from lupin_twin.core.past import NotRemembered
from lupin_twin.runtime.journal_queries import Recall
from lupin_twin.runtime.workers import ShouldStop
from tests.support.journal import append, recording, scan, select
from tests.support.waiting import PATIENCE_S, wait_for

# Counts for longer than any test waits.
ENDLESS = (
    "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 1000000000000)"
    " SELECT count(*) FROM n"
)


def count(connection: sqlite3.Connection, _: ShouldStop) -> int:
    (found,) = connection.execute("SELECT count(*) FROM scan").fetchone()
    return int(found)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "j.sqlite"


@contextmanager
def recalling(path: Path, max_s: float = PATIENCE_S) -> Iterator[Recall]:
    recall = Recall(lambda: Condition(JournalState.RECORDING, path=str(path)), max_s)
    try:
        yield recall
    finally:
        recall.close()


def answer(recall: Recall) -> int:
    return recall.query(count).result(PATIENCE_S)


def why_not(recall: Recall) -> str:
    with pytest.raises(NotRemembered) as caught:
        answer(recall)
    return str(caught.value)


def test_a_query_sees_one_moment(path: Path) -> None:
    append(path, [scan(at_ns=1)])

    def twice(connection: sqlite3.Connection, should_stop: ShouldStop) -> tuple[int, int]:
        before = count(connection, should_stop)
        journal.write(scan(at_ns=2))
        written = "SELECT count(*) FROM scan"
        wait_for(lambda: select(path, written) == [(2,)], "the row")
        return before, count(connection, should_stop)

    with recording(path) as journal, recalling(path) as recall:
        assert recall.query(twice).result(PATIENCE_S) == (1, 1)
        assert answer(recall) == 2


@pytest.mark.parametrize(
    ("state", "detail", "then"),
    [
        (JournalState.IN_USE, "the journal j is in use by /other", "ask that twin"),
        # Not what is wrong with the old file, which would advise to name another one.
        (JournalState.UPGRADING, "the journal j is being upgraded: 40% is done", "ask again"),
    ],
)
def test_a_journal_of_another_twin_or_of_an_upgrade_is_not_read(
    path: Path, state: JournalState, detail: str, then: str
) -> None:
    append(path, [scan()])
    recall = Recall(lambda: Condition(state, detail, str(path)))
    assert f"{detail}: {then}" in why_not(recall)
    recall.close()


def test_a_missing_file_is_reported_and_found_when_it_appears(path: Path) -> None:
    with recalling(path) as recall:
        assert f"{path} is not there" in why_not(recall)
        path.touch()
        assert f"{path} is not there" in why_not(recall)
        append(path, [scan()])
        assert answer(recall) == 1


def test_a_backup_that_was_copied_over_the_file_is_read_from_then_on(path: Path) -> None:
    with ProcessPoolExecutor(1, get_context("spawn")) as elsewhere, recalling(path) as recall:

        def write(*stamps_ns: int) -> None:
            elsewhere.submit(append, path, [scan(at_ns=it) for it in stamps_ns]).result()

        write(1)
        backup = path.read_bytes()
        assert answer(recall) == 1
        write(2)
        assert answer(recall) == 2
        for end in ("-wal", "-shm"):
            path.with_name(path.name + end).unlink()
        path.write_bytes(backup)
        write(3, 4, 5)
        assert answer(recall) == 4


@pytest.mark.parametrize("where", [0, 3 * 1024 + 100])
def test_a_damaged_file_is_reported_with_a_remedy_and_read_again_when_it_is_repaired(
    path: Path, where: int
) -> None:
    append(path, [scan(at_ns=number) for number in range(1, 200)])
    whole = path.read_bytes()
    with recalling(path) as recall:
        path.write_bytes(whole[:where] + b"\xff" * (len(whole) - where))
        assert "is damaged" in why_not(recall)
        path.write_bytes(whole)
        assert answer(recall) == 199


def test_an_error_of_a_query_reaches_its_caller(path: Path) -> None:
    append(path, [scan()])
    with recalling(path) as recall:
        wrong = recall.query(lambda connection, _: connection.execute("SELECT x FROM scan"))
        with pytest.raises(sqlite3.OperationalError, match="no such column"):
            wrong.result(PATIENCE_S)
        assert answer(recall) == 1


def test_a_cancelled_query_ends(path: Path) -> None:
    append(path, [scan()])
    with recalling(path) as recall:
        begun = threading.Event()

        def requests(connection: sqlite3.Connection, _: ShouldStop) -> None:
            begun.set()
            connection.execute(ENDLESS).fetchone()

        future = recall.query(requests)
        assert begun.wait(PATIENCE_S)
        future.cancel()
        with pytest.raises(CancelledError):
            future.result(PATIENCE_S)
        assert answer(recall) == 1


def test_a_query_that_takes_too_long_ends(path: Path) -> None:
    append(path, [scan()])
    with recalling(path, 0.05) as recall:
        future = recall.query(lambda connection, _: connection.execute(ENDLESS).fetchone())
        with pytest.raises(NotRemembered, match=r"not answer within 0\.05 s"):
            future.result(PATIENCE_S)


def test_the_shutdown_ends_running_queries_and_leaves_nothing_open(path: Path) -> None:
    append(path, [scan()])
    with recalling(path) as recall:
        assert answer(recall) == 1
        running = recall.query(lambda connection, _: connection.execute(ENDLESS).fetchone())
        wait_for(running.running, "a question that runs")
        recall.close()
        with pytest.raises(CancelledError):
            running.result(PATIENCE_S)
        assert "is ending" in why_not(recall)
        descriptors = [
            link.readlink() for link in Path("/proc/self/fd").iterdir() if link.is_symlink()
        ]
        assert path not in descriptors
