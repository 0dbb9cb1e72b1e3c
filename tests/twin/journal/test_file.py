import shutil
from dataclasses import replace
from itertools import count
from pathlib import Path
from random import Random

import pytest

from lupin_twin.core.diagnostics import JournalState
from lupin_twin.core.state import Reading
from lupin_twin.journal.retention import Limits
from lupin_twin.journal.salvage import quarantine
from tests.support.journal import (
    CLOCK,
    NOW,
    SECOND,
    append,
    is_whole,
    known,
    opened,
    recording,
    scan,
    select,
    wait_state,
)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "j.sqlite"


def test_a_row_that_cannot_be_written_is_lost_alone(path: Path) -> None:
    too_late = scan(at_ns=2**63)
    no_number = replace(scan("8"), readings=(Reading("t", "x"),))  # type: ignore[arg-type]
    assert append(path, [scan("1"), too_late, no_number, scan("2")]) == (2, 2)
    assert known(path) == {scan("1"), scan("2")}


def test_a_reading_with_all_digits_takes_at_most_60_bytes(path: Path) -> None:
    chance = Random(1)
    rows = [
        replace(
            scan(str(number % 20), NOW + number * 30 * SECOND),
            readings=tuple(Reading(name, chance.random()) for name in "abcde"),
        )
        for number in range(3_000)
    ]
    append(path, rows)
    assert path.stat().st_size / (5 * len(rows)) < 60


def test_runs_are_written_to_a_replaced_file(path: Path) -> None:
    with opened(path) as file:
        run = file.start(CLOCK, is_believed=False).run
        end = file.end
    path.unlink()
    with opened(path) as file:
        file.retain_run(run, end)
        file.retain_run(run, end)
        assert file.append([(run, scan())]) == (1, 0)
    assert known(path) == {scan()}


def test_maintenance_purges_and_checkpoints(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("lupin_twin.journal.file.LOG_BYTES", 10_000)
    monkeypatch.setattr("lupin_twin.journal.file.PURGE_EVERY_S", 0.0)
    with opened(path, Limits(days=36_500, max_bytes=60_000)) as file:
        run = file.start(CLOCK, is_believed=False).run
        file.append([(run, scan(at_ns=NOW + n)) for n in range(5000)])
        steps = 0
        while file.check_size(may_purge=True):
            steps += 1
        assert steps > 10
    ((left,),) = select(path, "SELECT count(*) FROM scan")
    assert isinstance(left, int)
    assert 0 < left < 1000
    assert path.stat().st_size < 400_000
    assert is_whole(path)


def test_a_lack_of_room_for_scans_beside_the_hours_is_reported(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lupin_twin.journal.file.PURGE_EVERY_S", 0.0)
    append(path, [scan(at_ns=NOW + n) for n in range(500)])
    with recording(path, limits=Limits(days=36_500, max_bytes=10_000)) as journal:
        wait_state(
            journal, JournalState.RECORDING, "no scans are kept: the hours, which are never deleted"
        )
    assert select(path, "SELECT count(*) FROM scan") == [(0,)]


@pytest.mark.parametrize("is_there", [True, False])
def test_a_salvage_that_was_killed_starts_again(path: Path, *, is_there: bool) -> None:
    append(path, [scan(at_ns=NOW + n) for n in range(300)])
    aside = quarantine(path)
    if not is_there:  # the file was removed
        aside.unlink()
    with opened(path):
        pass
    assert select(path, "SELECT count(*) FROM scan") == [(300 if is_there else 0,)]
    assert select(path, "SELECT * FROM meta WHERE key = 'salvage'") == []


@pytest.mark.parametrize("renamed", [0, 1, 2])
def test_a_quarantine_that_was_killed_is_completed(
    path: Path, monkeypatch: pytest.MonkeyPatch, renamed: int
) -> None:
    left = path.with_name("left.sqlite")
    with opened(path) as file:
        run = file.start(CLOCK, is_believed=False).run
        file.append([(run, scan(at_ns=NOW + n)) for n in range(300)])
        for end in ("", "-wal"):  # as a killed twin leaves them
            shutil.copy(f"{path}{end}", f"{left}{end}")
    rename, done = Path.rename, count()

    def killed(old: Path, new: Path) -> None:
        if next(done) == renamed:
            raise KeyboardInterrupt
        rename(old, new)

    with monkeypatch.context() as killing:
        killing.setattr(Path, "rename", killed)
        with pytest.raises(KeyboardInterrupt):
            quarantine(left)
    with opened(left) as file:
        assert Path(file.quarantined).name.startswith("left.sqlite.damaged-")
    assert select(left, "SELECT count(*) FROM scan") == [(300,)]
    assert not left.with_name("left.sqlite.new").exists()
