"""The journal of a running twin: what it restores, and queries of its past."""

import sqlite3
import tempfile
import threading
from collections.abc import Iterator
from concurrent.futures import CancelledError, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import closing, contextmanager
from dataclasses import replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import pytest

from lupin_twin.core.diagnostics import Condition, JournalState
from lupin_twin.core.past import NotRemembered
from lupin_twin.core.state import Flower, Observation, Pin, TwinStore
from lupin_twin.field.idw import never
from lupin_twin.journal.fold import state_at
from lupin_twin.journal.paths import journal_path, state_folder
from lupin_twin.journal.runs import Clock
from lupin_twin.runtime.journal_queries import Recall
from lupin_twin.runtime.memory import MAX_NEW_RUNS, Memory, open_journal
from lupin_twin.runtime.workers import ShouldStop
from tests.support.journal import append, is_whole, recording, scan, select
from tests.support.memory_life import HERE, NOW, S, twin
from tests.support.waiting import PATIENCE_S, wait_for

FLOWER = Flower("lupin", 0.9, False, 3, 1)


def test_a_file_that_replaces_the_journal_is_read_once_the_twin_has_opened_it(
    tmp_path: Path,
) -> None:
    path, other = tmp_path / "j.sqlite", tmp_path / "other.sqlite"
    refusals: list[str] = []

    def how_many(connection: sqlite3.Connection, _: ShouldStop) -> int:
        return len(connection.execute("SELECT readings FROM scan").fetchall())

    def is_read(count: int) -> bool:
        try:
            return memory.recall.answer(how_many, never) == count
        except NotRemembered as error:
            refusals.append(str(error))
            return False

    with twin(path) as life:
        memory = life.memory
        for count in (1, 2, 3):
            append(other, [scan(at_ns=n + 1) for n in range(count)])
            wait_for(lambda: memory.condition.inode, "the journal to be written")
            other.replace(path)
            wait_for(partial(is_read, count), "the new file")
            assert memory.condition.inode in (0, path.stat().st_ino)
        with closing(sqlite3.connect(other)) as foreign:
            foreign.execute("CREATE TABLE of_others (x)")
        other.replace(path)
        wait_for(lambda: memory.condition.state is JournalState.FOREIGN, "it to be looked at")
        with pytest.raises(NotRemembered, match="name another file"):
            memory.recall.answer(how_many, never)
    why = "was replaced; the twin opens the new one within seconds"
    assert f"the journal {path} {why}" in refusals


def test_damage_found_by_a_reader_quarantines_the_file_while_the_twin_records(
    tmp_path: Path,
) -> None:
    path = tmp_path / "j.sqlite"
    count = 5_000
    append(path, [scan(str(n % 30), NOW - (count - n) * S, t=n) for n in range(count)])

    def how_many(memory: Memory) -> int:
        def request(connection: sqlite3.Connection, _: ShouldStop) -> int:
            return len(connection.execute("SELECT readings FROM scan").fetchall())

        return memory.recall.answer(request, never)

    with twin(path, 5) as life:
        memory = life.memory
        # Damage found earlier is handled by the check at the start.
        wait_for(lambda: memory.condition.state is JournalState.RECORDING, "the journal")
        # Not through the memory: its cached pages would hide the damage.
        assert select(path, "SELECT count(readings) FROM scan") == [(count,)]
        with path.open("r+b") as file:
            file.seek(path.stat().st_size // 2)
            file.write(b"\xff" * 4096)
        with pytest.raises(NotRemembered, match="the twin quarantines it and retains what"):
            how_many(memory)
        memory.apply(SCAN, NOW)
        wait_for(lambda: memory.condition.quarantined, "the damaged file to be quarantined")
        wait_for(lambda: memory.condition.written == 2, "what came meanwhile, and its place")
        assert Path(memory.condition.quarantined).exists()
        # A few pages are lost, and the rest is salvaged.
        wait_for(lambda: count * 0.9 < how_many(memory) <= count, "what can be read")
        # If this were an error of a query and no damage, copies would fill the disk.
        before = memory.condition.quarantined
        memory.journal.heal("again, the same day")
        memory.apply(replace(SCAN, stamp_ns=NOW + 9, own_stamp_ns=NOW + 9), NOW)
        wait_for(lambda: memory.condition.written == 3, "what came after it")
        assert memory.condition.quarantined == before
        assert len(list(tmp_path.glob("*.damaged-*Z"))) == 1
    assert is_whole(path)


def test_a_restored_state_is_logged_once(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    for tags, writes in ((0, WRITES), (3, ())):
        memory = Memory(TwinStore(), open_journal(path, "/twin", 1e4, 1e4))
        said = [memory.follow(Clock(NOW + at_s * S, NOW + at_s * S, False)) for at_s in (5, 6)]
        assert said == [f"journal {path}: restored {tags} tags", None]
        for write in writes:
            assert memory.apply(write, NOW) is None
        memory.close()


def at(write: Observation, stamp_ns: int) -> Observation:
    return replace(write, stamp_ns=stamp_ns, own_stamp_ns=stamp_ns)


SCAN = Observation("7", NOW, {"t": 21.5, "h": 0.1}, HERE, source="a", own_stamp_ns=NOW)
PART = Observation("7", NOW - 5 * S, {"co2": 400.0}, source="b", own_stamp_ns=NOW - 5 * S)
FAILED = Observation("7", NOW + S, {}, None, 2, "no answer", "a", NOW + S)
LOOK = Observation("8", NOW + S, source="a", own_stamp_ns=NOW + S, kind=1, flower=FLOWER)
BLIND = Observation("8", NOW + 2 * S, {}, None, 1, "dark", "a", NOW + 2 * S, kind=1)
WRITES = (SCAN, PART, FAILED, LOOK, BLIND, Pin("8", HERE), Pin("9", HERE))


def test_a_restarted_twin_has_the_state_from_before_and_repeated_messages_change_nothing(
    tmp_path: Path,
) -> None:
    path = tmp_path / "j.sqlite"
    with twin(path, 5) as life:
        for write in WRITES:
            assert life.memory.apply(write, NOW) is None
        before = life.live
        count = life.store.observation_count
    with twin(path, 9) as life:
        assert list(life.live) == ["7", "8", "9"]
        for tag_id, tag in before.items():
            same = life.live[tag_id]
            assert set(same.readings) == set(tag.readings)
            assert replace(same, readings=tag.readings) == tag
        restored, again = life.live, life.store.observation_count
        assert again >= count
        for write in WRITES:
            life.memory.apply(write, NOW + 9 * S)
        assert life.live == restored
        assert life.store.observation_count == again
        wait_for(lambda: not life.memory.condition.waiting, "all that were there")
        assert life.memory.condition.written == 0


def test_a_simulation_that_starts_over_is_empty_and_one_that_goes_on_is_not(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    with twin(path, 500, is_simulated=True) as life:
        life.memory.apply(at(SCAN, 499 * S), NOW + 499 * S)
        life.memory.apply(at(SCAN, 600 * S), NOW + 600 * S)
    with twin(path, 605, is_simulated=True, wall_s=610) as life:
        assert "7" in life.live
    with twin(path, 610, is_simulated=True, wall_s=86_400) as life:
        assert "7" not in life.live


def test_nothing_is_known_before_a_simulated_clock_has_started(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    with twin(path, 5, is_simulated=True) as life:
        life.memory.apply(at(SCAN, 4 * S), NOW)
        life.memory.apply(at(SCAN, 300 * S), NOW + 295 * S)
    with twin(path, is_simulated=True) as life:
        life.memory.apply(at(LOOK, 301 * S), NOW + 296 * S)
        assert "7" not in life.live
        life.at(305, wall_s=300)
        assert {"7", "8"} <= life.live.keys()


def test_a_clock_that_goes_back_all_the_time_begins_few_runs(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    with twin(path, 9000, is_simulated=True, wall_s=0) as life:
        for number in range(1000):
            life.at(1000, wall_s=number / 100)
            life.at(9000, wall_s=number / 100)
    assert select(path, "SELECT count(*) FROM run") == [(1 + MAX_NEW_RUNS,)]


def test_off_is_a_temporary_file_that_answers_and_is_removed_at_the_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with twin(None, 5) as life:
        memory = life.memory
        memory.apply(SCAN, NOW)
        assert "7" in life.live
        wait_for(lambda: memory.condition.written == 2, "the scan and its place")
        answer = memory.recall.answer(lambda c, _: state_at(c, NOW, "map"), never)
        assert [tag.tag_id for tag in answer.tags] == ["7"]
        assert Path(memory.condition.path).is_relative_to(tmp_path)
        assert memory.condition.state is JournalState.OFF
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("given", "namespace", "path"),
    [
        ("", "/", "/state/lupin-twin/domain-3.sqlite"),
        ("", "/house1/west", "/state/lupin-twin/domain-3.house1.west.sqlite"),
        ("/data/j.sqlite", "/house1", "/data/j.sqlite"),
    ],
)
def test_the_file_is_the_given_one_or_named_by_domain_and_namespace(
    given: str, namespace: str, path: str
) -> None:
    assert journal_path(given, {"XDG_STATE_HOME": "/state"}, 3, namespace) == Path(path)


@pytest.mark.parametrize("given", ["", "relative/path"])
def test_without_a_valid_folder_it_is_the_users(
    given: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", "/home/somebody")
    assert state_folder({"XDG_STATE_HOME": given}) == Path("/home/somebody/.local/state/lupin-twin")


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
    return recall.answer(count, never)


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
        assert recall.answer(twice, never) == (1, 1)
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
        with pytest.raises(sqlite3.OperationalError, match="no such column"):
            recall.answer(lambda log, _: log.execute("SELECT x FROM scan"), never)
        assert answer(recall) == 1


def endless(connection: sqlite3.Connection, _: ShouldStop) -> None:
    connection.execute(ENDLESS).fetchone()


def test_an_abandoned_query_ends(path: Path) -> None:
    append(path, [scan()])
    with recalling(path) as recall:
        looks = iter(range(1_000))
        with pytest.raises(CancelledError):
            recall.answer(endless, lambda: next(looks) > 3)
        assert answer(recall) == 1


def test_a_query_that_takes_too_long_ends(path: Path) -> None:
    append(path, [scan()])
    timeout = pytest.raises(NotRemembered, match=r"not answer within 0\.05 s")
    with recalling(path, 0.05) as recall, timeout:
        recall.answer(endless, never)


def test_the_shutdown_ends_running_queries_and_leaves_nothing_open(path: Path) -> None:
    append(path, [scan()])
    with recalling(path) as recall:
        assert answer(recall) == 1
        looked = threading.Event()

        def asked() -> bool:
            looked.set()
            return False

        with ThreadPoolExecutor(1) as elsewhere:
            running = elsewhere.submit(recall.answer, endless, asked)
            assert looked.wait(PATIENCE_S)
            recall.close()
            with pytest.raises(CancelledError):
                running.result(PATIENCE_S)
        assert "is ending" in why_not(recall)
        descriptors = [
            link.readlink() for link in Path("/proc/self/fd").iterdir() if link.is_symlink()
        ]
        assert path not in descriptors
