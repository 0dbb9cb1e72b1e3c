"""A copy of a journal: made while its twin writes, complete, and enough for a restart."""

import sqlite3
from contextlib import closing
from pathlib import Path

import httpx
import pytest

from lupin_bridge.cli.command import main
from lupin_bridge.console import backup
from tests.support.bags import no_file_above
from tests.support.journal import NOW, append
from tests.support.journal import scan as row
from tests.support.messages import scan
from tests.support.processes import lupin_twin, run_here, url_of
from tests.support.ros import Peer
from tests.support.waiting import PATIENCE_S, wait_for


def test_another_twin_starts_from_a_backup_of_a_running_one(domain: int, tmp_path: Path) -> None:
    source, copy = tmp_path / "twin.sqlite", tmp_path / "copy.sqlite"

    def tags(url: str) -> set[str]:
        answer = httpx.get(f"{url}/api/state", trust_env=False, timeout=PATIENCE_S)
        return {tag["tag_id"] for tag in answer.json()["tags"]}

    def rows() -> str:
        return run_here("journal", "export", "--journal", source).stdout

    with (
        Peer(domain) as robot,
        lupin_twin(domain, "serve", "--ros-args", "-p", f"journal:={source}") as twin,
    ):
        url = url_of(twin)
        robot.observe(scan("before", {"co2": 1.0}))
        wait_for(lambda: "before" in tags(url), "the first tag")
        wait_for(
            lambda: "before" in run_here("journal", "export", "--journal", source).stdout, "its row"
        )
        assert run_here("journal", "backup", copy, "--journal", source).returncode == 0
        # It is complete by itself: no file lies beside it.
        assert list(tmp_path.glob("copy.sqlite*")) == [copy]
        robot.observe(scan("after", {"co2": 3.0}))
        wait_for(lambda: "after" in tags(url), "the last tag")
        wait_for(
            lambda: "after" in run_here("journal", "export", "--journal", source).stdout, "its row"
        )
        twin.stop()
    # As the docs say.
    for beside in ("-wal", "-shm"):
        source.with_name(source.name + beside).unlink(missing_ok=True)
    source.write_bytes(copy.read_bytes())
    assert run_here("journal", "check", "--journal", source).returncode == 0
    # The robot has gone: it would repeat what it published after the copy.
    with lupin_twin(domain, "serve", "--ros-args", "-p", f"journal:={source}") as twin:
        assert tags(url_of(twin)) == {"before"}


def test_writes_during_the_backup_do_not_get_in_and_do_not_restart_it(tmp_path: Path) -> None:
    source, copy = tmp_path / "large.sqlite", tmp_path / "copy.sqlite"
    shares: list[float] = []
    with closing(sqlite3.connect(source, isolation_level=None)) as writer:
        writer.execute("PRAGMA journal_mode = WAL")
        writer.execute("CREATE TABLE large AS SELECT zeroblob(20000000) AS bytes")

        def report(share: float) -> None:
            shares.append(share)
            assert len(shares) < 100, "begun anew, again and again"
            writer.execute(f"CREATE TABLE meanwhile_{len(shares)} (number)")

        with closing(sqlite3.connect(source, isolation_level=None)) as reader:
            assert backup(reader, copy, report) == copy.stat().st_size > 20_000_000
    assert len(shares) > 2
    assert shares == sorted(set(shares))
    with closing(sqlite3.connect(copy)) as found:
        assert found.execute("SELECT name FROM sqlite_schema").fetchall() == [("large",)]


def test_nothing_is_overwritten_and_a_failed_backup_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = tmp_path / "twin.sqlite"
    append(source, [row(at_ns=NOW + n, a=n / 3) for n in range(2000)])
    taken = tmp_path / "taken"
    taken.write_text("mine", encoding="ascii")
    for target, why in (
        (taken, "already exists, and nothing is overwritten"),
        (source, "already exists, and nothing is overwritten"),
        (tmp_path / "none" / "copy", "No such file or directory"),
    ):
        assert main(["journal", "backup", str(target), "--journal", str(source)]) == 1
        message = capsys.readouterr().err
        assert message.startswith("lupin-twin: ")
        assert str(target) in message
        assert message.endswith(f"{why}\n")
    assert taken.read_text(encoding="ascii") == "mine"


def test_a_failed_backup_leaves_no_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source, copy = tmp_path / "twin.sqlite", tmp_path / "copy.sqlite"
    append(source, [row(at_ns=NOW + n, a=n / 3) for n in range(2000)])
    assert source.stat().st_size > 40_960
    # Enough for SQLite's 32 kB beside the journal, not for the copy.
    with no_file_above(40_960):
        assert main(["journal", "backup", str(copy), "--journal", str(source)]) == 1
    assert f"\nlupin-twin: cannot copy to {copy}: " in capsys.readouterr().err
    assert list(tmp_path.glob("copy*")) == []
