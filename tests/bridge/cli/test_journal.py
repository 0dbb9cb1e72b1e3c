"""`lupin-twin journal`: which file it reads, what it prints, its exit codes, and backups."""

import sqlite3
import subprocess
import sys
from contextlib import closing
from dataclasses import replace
from importlib.resources import files
from itertools import product
from pathlib import Path
from subprocess import CompletedProcess

import httpx
import pytest

from lupin_bridge.cli.command import main
from lupin_bridge.console import backup
from lupin_twin.journal.paths import demo_journal_path, journal_path
from lupin_twin.journal.runs import Clock
from lupin_twin.journal.schema import open_writer
from tests.support.bags import no_file_above
from tests.support.journal import NOW, SECOND, append, inspection, is_whole, pin, recording, scan
from tests.support.messages import scan as observed
from tests.support.processes import lupin_twin, run_here, url_of
from tests.support.ros import Peer
from tests.support.waiting import PATIENCE_S, wait_for

# Of a twin that starts after all of it was written.
LATER = Clock(NOW + 3000 * SECOND, NOW + 3000 * SECOND, is_simulated=False)
SIMULATED = Clock(5 * SECOND, NOW, is_simulated=True)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    made = tmp_path / "j.sqlite"
    failed = replace(scan("8"), readings={}, status=2, status_detail="no answer")
    scans = [scan(at_ns=NOW + n * SECOND, a=n / 3) for n in range(2000)]
    append(made, [pin(), failed, inspection(), *scans])
    return made


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setenv("ROS_DOMAIN_ID", "0")
    return tmp_path / "state" / "lupin-twin"


def journal(*words: object) -> CompletedProcess[str]:
    return run_here("journal", *words)


def reported(*words: object) -> dict[str, str]:
    """Lines of `info` by their names."""
    lines = (line.partition("  ") for line in journal("info", *words).stdout.splitlines())
    return {what: text.strip() for what, _, text in lines if what}


def test_the_default_file_is_found_by_the_rule_of_the_node(
    monkeypatch: pytest.MonkeyPatch, home: Path
) -> None:
    environ = {"XDG_STATE_HOME": str(home.parent)}
    home.mkdir(parents=True)
    for words, namespace in (
        ([], ""),
        (["--namespace", "/gh1/north"], "/gh1/north"),
    ):
        monkeypatch.setenv("ROS_DOMAIN_ID", "7")
        path = journal_path("", environ, 7, namespace)
        assert path is not None
        append(path, [])
        assert reported(*words)["file"] == str(path)
    append(demo_journal_path(environ, 2), [])
    assert "demo-seed-2.sqlite" in journal("info", "--demo", 2).stdout


ACTIONS = ("info", "check", "export", "vacuum")


def test_a_missing_or_inaccessible_file_is_named_and_not_created(
    tmp_path: Path, path: Path, home: Path
) -> None:
    before = sorted(tmp_path.iterdir())
    for action in ACTIONS:
        done = journal(action, "--journal", tmp_path / "none.sqlite")
        assert (done.returncode, done.stdout) == (1, "")
        line = f"lupin-twin: there is no journal {tmp_path}/none.sqlite; in its folder there are j."
        assert done.stderr.startswith(line)
    assert sorted(tmp_path.iterdir()) == before
    home.mkdir(parents=True)
    for action, option in product(ACTIONS, ("--journal", "--namespace")):
        done = journal(action, option, "x" * 300)
        assert (done.returncode, done.stdout) == (1, "")
        assert done.stderr.startswith("lupin-twin: cannot look for the journal /")
        assert done.stderr.endswith(": File name too long\n")


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["info", "--ros-args", "-p", "journal:=x"], "journal takes no ROS arguments: choose its"),
        (["info", "--journal", "x", "--demo", "0"], "--demo: not allowed with argument --journal"),
        ([], "the following arguments are required: ACTION"),
        (["burn"], "invalid choice: 'burn'"),
    ],
)
def test_a_mistake_is_one_clear_line(words: list[str], named: str) -> None:
    done = journal(*words)
    assert done.returncode == 2
    assert named in done.stderr


@pytest.mark.parametrize(
    ("words", "domain", "named"),
    [
        ("info --journal off", "0", "--journal is 'off', expected a file"),
        ("info", "232", "domain-232.sqlite"),
        ("info", "233", "ROS_DOMAIN_ID is '233', must be a whole number from 0 to 232"),
        ("info", "x", "ROS_DOMAIN_ID is 'x', must be a whole number from 0 to 232"),
        ("export --from yesterday", "", "--from is 'yesterday', expected ROS seconds as a dec"),
        ("export --to 2026-11-21T00:00:00", "", "--to is '2026-11-21T00:00:00', expected ROS"),
        ("export --from 2 --to 1", "", "--to is 1.000000000, before --from, 2.000000000"),
    ],
)
def test_an_invalid_domain_journal_or_period_is_one_clear_line(
    words: str, domain: str, named: str, path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without a domain: of a journal that is there."""
    monkeypatch.setenv("ROS_DOMAIN_ID", domain)
    done = journal(*words.split(), *([] if domain else ["--journal", path]))
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (1, "", 1)
    assert done.stderr.startswith("lupin-twin: ")
    assert named in done.stderr


def test_a_file_of_another_application_is_left_alone_and_named(tmp_path: Path) -> None:
    foreign, recorded, empty = (tmp_path / name for name in ("theirs.sqlite", "rot.mcap", "empty"))
    with closing(open_writer(foreign)) as connection:
        connection.execute("PRAGMA application_id = 7")
        connection.execute("DROP TABLE scan")
    recorded.write_bytes(b"\x89MCAP0\r\n" * 1000)
    empty.touch()
    for path, named in (
        (foreign, "is a database, but not a journal of lupin-twin"),
        (recorded, f"{recorded} is not a journal: it does not begin as an SQLite file\n"),
        (empty, "is empty: a journal that is just being created, or none"),
    ):
        before = path.read_bytes()
        for action in ACTIONS:
            done = journal(action, "--journal", path)
            assert (done.returncode, done.stdout) == (1, "")
            assert named in done.stderr
        assert path.read_bytes() == before
    assert {*tmp_path.iterdir()} - {*tmp_path.glob("theirs*")} == {recorded, empty}


def test_info_lists_the_content(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", "x")  # not needed for a file that is named
    append(path, [scan("9", 7 * SECOND)], SIMULATED)
    done = journal("info", "--journal", path)
    assert (done.returncode, done.stderr) == (0, "")
    found = reported("--journal", path)
    assert found["recording"] == "nobody"
    assert found["scans"] == "2,002, 1 of them failed"
    assert (found["inspections"], found["places"], found["tags"]) == ("1", "1", "3")
    assert found["sensors"] == "a, temperature"
    assert found["reach"] == "2025-11-21T04:40:00Z to 2025-11-21T05:13:19Z"
    assert "2: simulated clock, begun 2025-11-21T04:40:00Z: second 7.000 to 7.000\n" in done.stdout


def test_a_journal_in_use_can_be_read_and_not_shrunk(path: Path) -> None:
    with recording(path, LATER) as twin:
        for number in range(300):
            twin.write(scan("new", NOW + number, a=1.0))
        wait_for(lambda: twin.condition.written == 300, "all of it written")
        info = reported("--journal", path)
        assert info["scans"] == "2,301, 1 of them failed"
        assert info["recording"].startswith("/test/lupin_twin (process ")
        assert journal("check", "--journal", path).returncode == 0
        refused = journal("vacuum", "--journal", path)
        assert (refused.returncode, refused.stdout) == (1, "")
        assert "is in use by /test/lupin_twin (process " in refused.stderr
        twin.write(scan("newer"))
        wait_for(lambda: twin.condition.written == 301, "one more")


def test_the_wal_of_a_killed_twin_is_read_too(path: Path) -> None:
    connection = open_writer(path)
    connection.execute("DELETE FROM look")
    # As a killed process leaves them: file and WAL, with no owner.
    for name in ("j.sqlite", "j.sqlite-wal"):
        path.with_name(name.replace("j", "k", 1)).write_bytes(path.with_name(name).read_bytes())
    connection.close()
    assert reported("--journal", path.with_name("k.sqlite"))["inspections"] == "0"


def test_check_reports_the_damage_and_exits_with_1(path: Path) -> None:
    whole = journal("check", "--journal", path)
    assert (whole.returncode, whole.stdout) == (0, f"{path} is whole\n")
    assert whole.stderr == "structure\nscan\nlook\nplace\n"
    with closing(open_writer(path)) as connection:
        connection.execute("UPDATE scan SET readings = '[' WHERE seq % 200 = 0")
    done = journal("check", "--journal", path)
    assert done.returncode == 1
    lines = done.stdout.splitlines()
    assert lines[0] == "scan 200 of tag '7' is not what was written"
    assert lines[-1] == f"{path} is damaged in 10 places"
    assert len(lines) == 11
    content = path.read_bytes()
    refused = journal("vacuum", "--journal", path)
    assert (refused.returncode, refused.stdout) == (1, "")
    assert f"{path} is damaged and left as it is (scan 200 of tag '7'" in refused.stderr
    assert path.read_bytes() == content
    path.write_bytes(path.read_bytes()[:9000])
    done = journal("check", "--journal", path)
    assert done.returncode == 1
    assert "damaged" in done.stdout + done.stderr


def test_export_writes_the_same_rows_as_the_route(path: Path) -> None:
    def exported(*words: str) -> list[str]:
        done = journal("export", "--journal", path, *words)
        assert (done.returncode, done.stderr) == (0, "")
        return done.stdout.splitlines()

    every = exported()
    assert every[0] == "time_iso,stamp,tag_id,x_m,y_m,sensor,unit,value,status,source"
    assert len(every) == 2002
    assert "2025-11-21T04:40:00.000000000Z,1763700000.000000000,8,,,,,,2,robot" in every
    assert "2025-11-21T04:40:03.000000000Z,1763700003.000000000,7,1.5,2.5,a,,1.0,0,robot" in every
    two = exported("--from", "1763700003", "--to", "2025-11-21T05:40:05+01:00")
    assert [line.split(",")[7] for line in two[1:]] == ["1.0", "1.3333333333333333"]


def test_export_uses_the_units_of_the_operators_file(
    monkeypatch: pytest.MonkeyPatch, path: Path, tmp_path: Path
) -> None:
    sensors = tmp_path / "own.json"
    own = files("lupin_bridge").joinpath("sensors.json").read_text(encoding="utf-8")
    sensors.write_text(own.replace('"temperature": {', '"a": {'), encoding="utf-8")

    monkeypatch.setenv("LUPIN_SENSORS", str(sensors))
    assert "7,1.5,2.5,a,°C,1.0" in journal("export", "--journal", path).stdout
    monkeypatch.setenv("LUPIN_SENSORS", str(tmp_path / "none"))
    done = journal("export", "--journal", path)
    assert (done.returncode, "LUPIN_SENSORS" in done.stderr) == (1, True)


def test_vacuum_prints_the_size_before_and_after(path: Path) -> None:
    with closing(open_writer(path)) as connection:
        connection.execute("DELETE FROM scan")
        connection.execute("DELETE FROM hour")
    done = journal("vacuum", "--journal", path)
    assert (done.returncode, done.stdout) == (0, f"{path}: 0.2 MB before, 0.0 MB after\n")
    assert is_whole(path)


@pytest.mark.parametrize(
    ("words", "code", "out", "err"),
    [
        ("export >/dev/full", 1, "", "lupin-twin: cannot write to the standard output: No space"),
        ("export | true", 1, "", ""),  # its reader closes it
        ("check 2>/dev/full", 0, "is whole", ""),
    ],
)
def test_a_closed_output_is_an_error_only_where_output_is_wanted(
    path: Path, words: str, code: int, out: str, err: str
) -> None:
    action, _, redirected = words.partition(" ")
    line = f'"$1" -m lupin_bridge.cli.command journal {action} --journal "$2" {redirected}'
    done = subprocess.run(
        ["/bin/bash", "-c", f"{line}; exit ${{PIPESTATUS[0]}}", "bash", sys.executable, str(path)],
        check=False,
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
    )
    assert done.returncode == code
    for printed, expected in ((done.stdout, out), (done.stderr, err)):
        assert expected in printed
        assert printed.count("\n") == bool(expected)


def test_a_name_that_is_not_valid_text_is_printed_escaped(path: Path) -> None:
    strange = path.with_name("j\udcff.sqlite")
    path.rename(strange)
    done = journal("check", "--journal", strange)
    assert (done.returncode, done.stdout) == (0, f"{strange} is whole\n")


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
        robot.observe(observed("before", {"co2": 1.0}))
        wait_for(lambda: "before" in tags(url), "the first tag")
        wait_for(
            lambda: "before" in run_here("journal", "export", "--journal", source).stdout, "its row"
        )
        assert run_here("journal", "backup", copy, "--journal", source).returncode == 0
        # It is complete by itself: no file lies beside it.
        assert list(tmp_path.glob("copy.sqlite*")) == [copy]
        robot.observe(observed("after", {"co2": 3.0}))
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
    append(source, [scan(at_ns=NOW + n, a=n / 3) for n in range(2000)])
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
    append(source, [scan(at_ns=NOW + n, a=n / 3) for n in range(2000)])
    assert source.stat().st_size > 40_960
    # Enough for SQLite's 32 kB beside the journal, not for the copy.
    with no_file_above(40_960):
        assert main(["journal", "backup", str(copy), "--journal", str(source)]) == 1
    assert f"\nlupin-twin: cannot copy to {copy}: " in capsys.readouterr().err
    assert list(tmp_path.glob("copy*")) == []
