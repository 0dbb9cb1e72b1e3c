from __future__ import annotations

import os
import sqlite3
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest

from lupin_twin.journal import file as file_module
from lupin_twin.journal import rollups
from lupin_twin.journal.file import JournalFile
from lupin_twin.journal.packing import unpack_buckets
from lupin_twin.journal.retention import Limits
from lupin_twin.journal.rollups import get_meta
from lupin_twin.journal.runs import Carries, Clock
from lupin_twin.state import Reading
from tests.support.journal import (
    CLOCK,
    LIMITS,
    NOW,
    SECOND,
    is_whole,
    kept,
    known,
    opened,
    scan,
    select,
)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "j.sqlite"


def test_a_row_that_cannot_be_written_costs_itself_alone(path: Path) -> None:
    too_late = scan(at_ns=2**63)
    no_number = replace(scan("8"), readings=(Reading("t", "x"),))  # type: ignore[arg-type]
    assert kept(path, [scan("1"), too_late, no_number, scan("2")]) == (2, 2)
    assert known(path) == {scan("1"), scan("2")}


def test_a_wall_clock_goes_on_in_its_run_and_one_set_back_begins_another(path: Path) -> None:
    with opened(path) as file:
        first = file.first_run(CLOCK)
        file.append([(first, scan())])
        assert file.first_run(Clock(NOW + SECOND, NOW + SECOND, is_simulated=False)) == first
        second = file.first_run(Clock(SECOND, SECOND, is_simulated=False))
        assert (second.id, second.follows, second.carries) == (2, 1, Carries.PLACES)
        third = file.next_run(second, Clock(1, 1, is_simulated=False))
        assert (third.follows, third.carries) == (2, Carries.ALL)


def test_the_first_run_of_a_file_carries_nothing(path: Path) -> None:
    with opened(path) as file:
        assert file.first_run(CLOCK).carries is Carries.NOTHING


def test_runs_are_kept_in_a_file_that_takes_anothers_place(path: Path) -> None:
    with opened(path) as file:
        run = file.first_run(CLOCK)
    path.unlink()
    with opened(path) as file:
        file.keep_runs([run])
        file.keep_runs([run])
        assert file.append([(run, scan())]) == (1, 0)
    assert known(path) == {scan()}


def test_a_file_that_is_removed_or_replaced_is_noticed(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lupin_twin.journal.file._LOOK_EVERY_S", 0.0)
    with opened(path) as file:
        file.look_after()
        path.rename(path.with_name("moved"))
        with pytest.raises(FileNotFoundError, match="removed or replaced"):
            file.look_after()


def test_of_what_waits_to_be_folded_so_much_is_held_in_memory_and_all_of_it_is_folded(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept(path, [scan(at_ns=NOW + n * 600 * SECOND, t=1.0) for n in range(600)])
    monkeypatch.setattr(file_module, "_FOLD_ROWS", 100)
    monkeypatch.setattr(rollups, "_ROWS_READ", 30)
    most = 0
    with opened(path) as file:
        while file.look_after():
            folding = file._folding
            most = max(most, 0 if folding is None else len(folding._hours))
        assert get_meta(file._connection, "rolled_id") == 600
        # A hundred rows, six an hour.
        assert 15 <= most <= 18
        assert not file.look_after()
    with opened(path) as file:
        rolled = file._connection.execute("SELECT buckets FROM rollup").fetchall()
    assert sum(unpack_buckets(packed, 1)[0].n for (packed,) in rolled) == 600


def test_upkeep_folds_purges_shrinks_and_checkpoints(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lupin_twin.journal.file._LOG_BYTES", 10_000)
    monkeypatch.setattr("lupin_twin.journal.file._PURGE_EVERY_S", 0.0)
    with opened(path, Limits(days=36_500, max_bytes=60_000)) as file:
        run = file.first_run(CLOCK)
        file.append([(run, scan(at_ns=NOW + n)) for n in range(5000)])
        steps = 0
        while file.look_after():
            steps += 1
        assert steps > 10
        assert get_meta(file._connection, "rolled_id") == 5000
    ((left,),) = select(path, "SELECT count(*) FROM scan")
    assert isinstance(left, int)
    assert 0 < left < 1000
    assert path.stat().st_size < 400_000
    assert is_whole(path)


def test_the_log_is_put_into_the_file_when_it_is_long(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lupin_twin.journal.file._LOG_BYTES", 10_000)
    with opened(path) as file:
        run = file.first_run(CLOCK)
        for lot in range(50):
            file.append([(run, scan(at_ns=NOW + 100 * lot + n)) for n in range(100)])
            file.look_after()
        assert file._log_bytes() < 100_000
        assert file.size() > path.stat().st_size


def _truncate(path: Path) -> None:
    os.truncate(path, path.stat().st_size * 9 // 10)


def _overwrite_header(path: Path) -> None:
    with path.open("rb+") as file:
        file.write(b"nothing of the kind")


def _flip_a_value(path: Path) -> None:
    whole = path.read_bytes()
    (packed,) = (
        sqlite3.connect(path).execute("SELECT readings FROM scan WHERE id = 1999").fetchone()
    )
    at = whole.index(packed)
    path.write_bytes(whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :])


@pytest.mark.parametrize(
    ("damage", "at_least"), [(_truncate, 20), (_overwrite_header, 0), (_flip_a_value, 99)]
)
def test_a_damaged_file_is_set_aside_and_read_as_far_as_it_goes(
    path: Path, damage: object, at_least: int
) -> None:
    rows = [scan(str(tag), NOW + n, temperature=n / 7) for n in range(20) for tag in range(100)]
    kept(path, rows)
    assert callable(damage)
    damage(path)
    damaged = path.read_bytes()
    with opened(path) as file:
        found = set(file.restore(file.first_run(CLOCK), 1).rows)
        aside = Path(file.set_aside)
    assert found <= set(rows)
    assert len(found) >= at_least
    assert aside.name.startswith("j.sqlite.damaged-20")
    assert aside.read_bytes() == damaged
    assert is_whole(path)


@pytest.mark.parametrize(
    ("flipped", "lost"),
    [
        ("UPDATE sensors SET names = '[\"temperature\"}' WHERE names LIKE '%co2%'", "co2"),
        ("UPDATE sensors SET names = '5' WHERE names LIKE '%co2%'", "co2"),
        ("UPDATE sensors SET names = '[[1]]' WHERE names LIKE '%co2%'", "co2"),
        ("UPDATE tag SET tag_id = CAST(x'b7' AS TEXT) WHERE tag_id = 'lily'", "lily"),
        ("UPDATE name SET text = CAST(x'f27f' AS TEXT) WHERE text = 'other'", "other"),
        ("UPDATE run SET carries = 7", ""),
    ],
)
def test_a_flipped_byte_in_a_text_costs_what_it_names_and_nothing_else(
    path: Path, flipped: str, lost: str
) -> None:
    """No check of SQLite's sees it; until it is set aside, nothing could be restored or written."""
    rows = [
        scan("1", temperature=1.0),
        scan("1", co2=400.0),
        scan("lily", temperature=2.0),
        scan("1", NOW + 1, source="other", temperature=3.0),
    ]
    kept(path, rows)
    with closing(sqlite3.connect(path)) as connection:
        connection.execute(flipped)
        connection.commit()
    with opened(path) as file:
        found = set(file.restore(file.first_run(CLOCK), 1).rows)
        assert bool(file.set_aside) is bool(lost)
        assert file.append([(file.first_run(CLOCK), scan("1", NOW + 2, co2=500.0))]) == (1, 0)
    assert found == {row for row in rows if not lost or lost not in repr(row)}
    # What was lost is not found damaged at every start again.
    with opened(path) as file:
        assert file.restore(file.first_run(CLOCK), 1).damaged == 0
        assert not file.set_aside


def test_salvage_that_takes_long_goes_on_in_steps_and_after_a_restart(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept(path, [scan(at_ns=NOW + n) for n in range(3000)])
    monkeypatch.setattr("lupin_twin.journal.file._SALVAGE_S", 0.0)
    file = JournalFile(path, LIMITS, is_sound=False)
    assert file.look_after()
    file.close()
    with opened(path) as file:
        while file.look_after():
            pass
    assert select(path, "SELECT count(*) FROM scan") == [(3000,)]
    assert select(path, "SELECT * FROM meta WHERE key = 'salvage'") == []


def test_a_file_that_was_found_sound_is_not_read_through_again(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept(path, [scan()])

    def never(path: Path) -> str:
        raise AssertionError("checked")

    monkeypatch.setattr("lupin_twin.journal.file.find_damage", never)
    JournalFile(path, LIMITS, is_sound=True).close()
