"""Disk faults and the journal: full, read-only, slow, without power."""

import os
import random
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.support.disk import Disk, Weather, after_power_cut, build, notes
from tests.support.journal import NOW, append, is_whole, scan, select
from tests.support.waiting import PATIENCE_S, wait_for

ROOT = Path(__file__).parents[1]
SECOND = 1_000_000_000
RATE = 200


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(tmp_path_factory.mktemp("disk"))


@pytest.fixture
def disk(tmp_path: Path, library: Path) -> Disk:
    folder = tmp_path / "disk"
    folder.mkdir()
    return Disk(folder, library, tmp_path / "control")


class TwinUpdate:
    """The child's reports of its journal."""

    def __init__(self, child: subprocess.Popen[str]) -> None:
        self.last = ("", 0, 0, "")
        self._child = child
        self._thread = threading.Thread(target=self._read)
        self._thread.start()

    def _read(self) -> None:
        assert self._child.stdout is not None
        for line in self._child.stdout:
            state, written, lost, detail = line.rstrip("\n").split("\t")
            self.last = (state, int(written), int(lost), detail)

    def join(self) -> None:
        self._thread.join()

    def wait(self, state: str, part: str = "", written: int = 0) -> None:
        wait_for(
            lambda: self.last[0] == state and part in self.last[3] and self.last[1] >= written,
            f"a journal that is {state} ({part}), {written} rows written",
        )


@contextmanager
def feeding(disk: Disk, log_bytes: int = 8_000_000) -> Iterator[TwinUpdate]:
    """A child that passes rows to its journal, ended by the end of its input."""
    command = [sys.executable, "-m", "tests.support.journal_child"]
    child = subprocess.Popen(
        [*command, str(disk.folder / "j.sqlite"), str(RATE), str(log_bytes)],
        env={**os.environ, **disk.env},
        cwd=ROOT,
        text=True,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    reported = TwinUpdate(child)
    try:
        yield reported
    finally:
        assert child.stdin is not None
        child.stdin.close()
        try:
            child.wait(PATIENCE_S)
        finally:
            child.kill()
            reported.join()
            child.wait()
            if child.stdout is not None:
                child.stdout.close()


def numbers(path: Path) -> list[int]:
    rows = select(path, "SELECT stamp_ns FROM scan ORDER BY seq")
    return [stamp - NOW for (stamp,) in rows if isinstance(stamp, int)]


def assert_whole(disk: Disk) -> None:
    found = numbers(disk.folder / "j.sqlite")
    assert found == list(range(1, len(found) + 1))


@pytest.mark.parametrize(
    ("fault", "message"), [("full", ""), ("readonly", "Read-only file system")]
)
def test_a_fault_from_the_start_is_reported_and_heals(
    disk: Disk, fault: Weather, message: str
) -> None:
    disk.be(fault)
    with feeding(disk) as reported:
        reported.wait("failing", message)
        disk.be("well")
        reported.wait("recording", written=100)
    assert_whole(disk)


def test_a_journal_in_a_read_only_folder_can_be_read(disk: Disk) -> None:
    path = disk.folder / "j.sqlite"
    append(path, [scan()])
    disk.be("readonly")
    command = (sys.executable, "-m", "lupin_bridge.cli.command", "journal")
    for action, message in (
        ("info", "scans        1, 0 of them failed"),
        ("check", f"{path} is whole"),
    ):
        done = subprocess.run(
            [*command, action, "--journal", path],
            env={**os.environ, **disk.env},
            check=True,
            capture_output=True,
            text=True,
        )
        assert message in done.stdout
    assert not any(disk.folder.glob("*-*"))


def test_a_slow_sync_delays_no_commit(disk: Disk) -> None:
    with feeding(disk) as reported:
        reported.wait("recording", written=50)
        disk.be("slow-sync")
        reported.wait("recording", written=reported.last[1] + 300)
        assert reported.last[2] == 0
        disk.be("well")


def test_a_slow_disk_is_reported_and_nothing_is_lost(disk: Disk) -> None:
    with feeding(disk) as reported:
        reported.wait("recording", written=50)
        disk.be("slow-write")
        reported.wait("slow", "the disk is slow: the journal is ")
        disk.be("well")
        reported.wait("recording", written=reported.last[1] + 200)
    assert_whole(disk)


@pytest.mark.parametrize("log_bytes", [50_000, 8_000_000])
def test_a_power_cut_costs_at_most_the_last_second(
    disk: Disk, tmp_path: Path, log_bytes: int
) -> None:
    """At any moment, rows passed on a second before are on the disk.

    The disk records every write and every sync in order; the files are rebuilt as of a moment
    from what was synced by then, and from nothing else. A short WAL is checkpointed, and restarted,
    many times.
    """
    disk.log = tmp_path / "log"
    with feeding(disk, log_bytes=log_bytes) as reported:
        reported.wait("recording", written=4 * RATE)
    done = notes(disk.log)
    handed_over = [
        (note.at_ns, int(note.data))
        for note in done
        if note.kind == "W" and note.name.endswith("/marks")
    ]
    first_ns = next(at_ns for at_ns, number in handed_over if number == RATE)
    moments = [index for index, note in enumerate(done) if note.at_ns > first_ns]
    for cut in random.Random(1).sample(moments, 25):
        into = tmp_path / f"cut{cut}"
        into.mkdir()
        after_power_cut(done[: cut + 1], into)
        # A second, and another for threads that wait for a core on a busy machine.
        safe = [number for at_ns, number in handed_over if at_ns < done[cut].at_ns - 2 * SECOND]
        found = numbers(into / "j.sqlite")
        assert found == list(range(1, len(found) + 1))
        assert len(found) >= (safe[-1] if safe else 0), f"cut at operation {cut}"
        assert is_whole(into / "j.sqlite")
