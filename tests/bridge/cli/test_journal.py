"""`lupin-twin journal`: which file it takes, what it says of it, and how it ends."""

import subprocess
import sys
from contextlib import closing
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import pytest

from lupin_bridge.cli.command import main
from lupin_bridge.past import bodies
from lupin_twin.journal.beside import demo_journal_path, journal_path
from lupin_twin.journal.runs import Clock
from lupin_twin.journal.schema import open_writer
from tests.support.journal import NOW, SECOND, is_whole, kept, look, pin, recording, scan
from tests.support.waiting import PATIENCE_S, wait_for

# Of a twin that starts when all of it is written.
LATER = Clock(NOW + 3000 * SECOND, NOW + 3000 * SECOND, is_simulated=False)
SIMULATED = Clock(5 * SECOND, NOW, is_simulated=True)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    made = tmp_path / "j.sqlite"
    failed = replace(scan("8"), readings=(), status=2, status_detail="no answer")
    scans = [scan(at_ns=NOW + n * SECOND, a=n / 3) for n in range(2000)]
    kept(made, [pin(), failed, look(), *scans])
    return made


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setenv("ROS_DOMAIN_ID", "0")
    return tmp_path / "state" / "lupin-twin"


class Said:
    """What a command has said, and its exit code."""

    def __init__(self, capsys: pytest.CaptureFixture[str], *words: object) -> None:
        self.code = main(["journal", *map(str, words)])
        self.out, self.err = capsys.readouterr()

    @property
    def told(self) -> dict[str, str]:
        """Lines of `info` by their names."""
        lines = (line.partition("  ") for line in self.out.splitlines())
        return {what: text.strip() for what, _, text in lines if what}


# --- which file ----------------------------------------------------------------------------------


def test_the_file_is_that_of_the_node_s_own_rule(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, home: Path
) -> None:
    environ = {"XDG_STATE_HOME": str(home.parent)}
    home.mkdir(parents=True)
    for words, domain, namespace in (
        ([], 7, ""),
        (["--domain", 3], 3, ""),
        (["--namespace", "/gh1/north"], 7, "/gh1/north"),
        (["--domain", 3, "--namespace", "gh1"], 3, "/gh1"),
    ):
        monkeypatch.setenv("ROS_DOMAIN_ID", "7")
        path = journal_path("", environ, domain, namespace)
        assert path is not None
        kept(path, [])
        assert Said(capsys, "info", *words).told["file"] == str(path)
    kept(demo_journal_path(environ, 2), [])
    assert "demo-seed-2.sqlite" in Said(capsys, "info", "--demo", 2).out


@pytest.mark.parametrize("action", ["info", "check", "export", "vacuum"])
def test_a_file_that_is_not_there_is_named_and_not_made(
    action: str, capsys: pytest.CaptureFixture[str], tmp_path: Path, path: Path
) -> None:
    before = sorted(tmp_path.iterdir())
    said = Said(capsys, action, "--journal", tmp_path / "none.sqlite")
    assert (said.code, said.out) == (1, "")
    line = f"lupin-twin: there is no journal {tmp_path}/none.sqlite; in its folder there are j.sql"
    assert said.err.startswith(line)
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["info", "--ros-args", "-p", "journal:=x"], "journal takes no arguments of ROS: name its"),
        (["info", "--domain", "x"], "argument --domain: invalid int value: 'x'"),
        (["info", "--journal", "x", "--demo", "0"], "--demo: not allowed with argument --journal"),
        ([], "the following arguments are required: ACTION"),
        (["burn"], "invalid choice: 'burn'"),
    ],
)
def test_a_mistake_is_one_clear_line(
    words: list[str], named: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        Said(capsys, *words)
    assert ended.value.code == 2
    assert named in capsys.readouterr().err


def test_a_domain_or_a_journal_that_is_none_is_named(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    off = Said(capsys, "info", "--journal", "off")
    assert off.err == "lupin-twin: --journal is 'off', must be a file\n"
    monkeypatch.setenv("ROS_DOMAIN_ID", "x")
    said = Said(capsys, "info")
    assert said.err == "lupin-twin: ROS_DOMAIN_ID is 'x', must be a whole number\n"


@pytest.mark.parametrize("domain", ["-1", "233"])
def test_a_domain_that_ros_has_not_is_named_with_its_limits(
    domain: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    said = Said(capsys, "info", "--domain", domain)
    line = f"lupin-twin: --domain is {domain}, must be from 0 to 232\n"
    assert (said.code, said.out, said.err) == (1, "", line)
    monkeypatch.setenv("ROS_DOMAIN_ID", "233")
    said = Said(capsys, "info")
    assert said.err == "lupin-twin: ROS_DOMAIN_ID is 233, must be from 0 to 232\n"
    for within in ("0", "232"):
        assert f"domain-{within}.sqlite" in Said(capsys, "info", "--domain", within).err


def test_a_domain_is_not_for_a_file_that_is_named(
    capsys: pytest.CaptureFixture[str], path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for words, named in ((["--demo", "0"], "--demo 0"), (["--journal", str(path)], str(path))):
        said = Said(capsys, "info", *words, "--domain", 5)
        line = f"lupin-twin: --domain 5 is for a twin's own file, not with {named}\n"
        assert (said.code, said.out, said.err) == (1, "", line)
    monkeypatch.setenv("ROS_DOMAIN_ID", "x")
    assert Said(capsys, "info", "--journal", path).code == 0


@pytest.mark.parametrize("action", ["info", "check", "export", "vacuum"])
@pytest.mark.parametrize("option", ["--journal", "--namespace"])
def test_a_place_that_cannot_be_looked_at_is_named(
    option: str, action: str, capsys: pytest.CaptureFixture[str], home: Path
) -> None:
    home.mkdir(parents=True)
    said = Said(capsys, action, option, "x" * 300)
    assert (said.code, said.out) == (1, "")
    assert said.err.startswith("lupin-twin: cannot look for the journal /")
    assert said.err.endswith(": File name too long\n")


def test_a_journal_that_is_just_being_made_is_called_empty(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "j.sqlite"
    path.touch()
    for action in ("info", "check", "export", "vacuum"):
        said = Said(capsys, action, "--journal", path)
        assert said.code == 1
        assert "j.sqlite is empty: a journal that is just being made, or none" in said.err


def test_somebody_else_s_file_is_left_and_named(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    foreign = tmp_path / "theirs.sqlite"
    with closing(open_writer(foreign)) as connection:
        connection.execute("PRAGMA application_id = 7")
        connection.execute("DROP TABLE scan")
    before = foreign.read_bytes()
    for action in ("info", "check", "vacuum"):
        said = Said(capsys, action, "--journal", foreign)
        assert said.code == 1
        assert "is a database, but not a journal of lupin-twin" in said.err
    assert foreign.read_bytes() == before
    recorded = tmp_path / "rot.mcap"
    recorded.write_bytes(b"\x89MCAP0\r\n" * 1000)
    for action in ("info", "check", "export", "vacuum"):
        said = Said(capsys, action, "--journal", recorded)
        assert (said.code, said.out) == (1, "")
        line = f"lupin-twin: {recorded} is no journal: it does not begin as SQLite's files do\n"
        assert said.err == line


# --- what it says --------------------------------------------------------------------------------


def test_info_tells_what_is_in_it(capsys: pytest.CaptureFixture[str], path: Path) -> None:
    kept(path, [scan("9", 7 * SECOND)], SIMULATED)
    path.with_name("j.sqlite.damaged-20261121T141500Z").write_bytes(b"x" * 2_000_000)
    said = Said(capsys, "info", "--journal", path)
    assert (said.code, said.err) == (0, "")
    told = said.told
    assert told["recording"] == "nobody"
    assert told["scans"] == "2,002, of them 1 failed"
    assert (told["looks"], told["places"], told["tags"]) == ("1", "1", "3")
    assert told["sensors"] == "a, temperature"
    assert told["reach"] == "2025-11-21T04:40:00Z to 2025-11-21T05:13:19Z"
    assert told["quarantined"] == "j.sqlite.damaged-20261121T141500Z, 2.0 MB"
    assert "2: simulated clock, begun 2025-11-21T04:40:00Z: second 7.000 to 7.000\n" in said.out


def test_while_a_twin_records_all_can_be_read_and_nothing_shrunk(
    capsys: pytest.CaptureFixture[str], path: Path
) -> None:
    with recording(path, LATER) as journal:
        for number in range(300):
            journal.write(scan("new", NOW + number, a=1.0))
        wait_for(lambda: journal.condition.written == 300, "all of it written")
        info = Said(capsys, "info", "--journal", path)
        assert info.told["scans"] == "2,301, of them 1 failed"
        assert info.told["recording"].startswith("/test/lupin_twin (process ")
        assert Said(capsys, "check", "--journal", path).code == 0
        refused = Said(capsys, "vacuum", "--journal", path)
        assert (refused.code, refused.out) == (1, "")
        assert "is in use by /test/lupin_twin (process " in refused.err
        journal.write(scan("newer"))
        wait_for(lambda: journal.condition.written == 301, "one more")


def test_the_log_of_a_killed_twin_is_read_too(
    capsys: pytest.CaptureFixture[str], path: Path
) -> None:
    connection = open_writer(path)
    connection.execute("DELETE FROM look")
    # As a killed process leaves them: file and log, nobody's.
    for name in ("j.sqlite", "j.sqlite-wal"):
        path.with_name(name.replace("j", "k", 1)).write_bytes(path.with_name(name).read_bytes())
    connection.close()
    assert Said(capsys, "info", "--journal", path.with_name("k.sqlite")).told["looks"] == "0"


def test_check_says_what_is_damaged_and_ends_with_1(
    capsys: pytest.CaptureFixture[str], path: Path
) -> None:
    whole = Said(capsys, "check", "--journal", path)
    assert (whole.code, whole.out) == (0, f"{path} is whole\n")
    assert whole.err == "structure\nscan\nlook\nplace\n"
    with closing(open_writer(path)) as connection:
        connection.execute("UPDATE scan SET readings = '[' WHERE seq % 200 = 0")
    said = Said(capsys, "check", "--journal", path)
    assert said.code == 1
    lines = said.out.splitlines()
    assert lines[0] == "scan 200 of tag '7' is not what was written"
    assert lines[-1] == f"{path} is damaged in 10 places"
    assert len(lines) == 11
    content = path.read_bytes()
    refused = Said(capsys, "vacuum", "--journal", path)
    assert (refused.code, refused.out) == (1, "")
    assert f"{path} is damaged and left as it is (scan 200 of tag '7'" in refused.err
    assert path.read_bytes() == content
    path.write_bytes(path.read_bytes()[:9000])
    said = Said(capsys, "check", "--journal", path)
    assert said.code == 1
    assert "damaged" in said.out + said.err


def test_export_writes_the_rows_of_a_period_as_the_route_does(
    capsysbinary: pytest.CaptureFixture[bytes], path: Path
) -> None:
    def exported(*words: str) -> list[bytes]:
        assert main(["journal", "export", "--journal", str(path), *words]) == 0
        out, err = capsysbinary.readouterr()
        assert err == b""
        return bytes(out).splitlines()

    every = exported()
    assert every[0] + b"\r\n" == bodies.CSV_HEADER
    assert len(every) == 2002
    assert b"2025-11-21T04:40:00.000000000Z,1763700000.000000000,8,,,,,,2,robot" in every
    assert b"2025-11-21T04:40:03.000000000Z,1763700003.000000000,7,1.5,2.5,a,,1.0,0,robot" in every
    two = exported("--from", "1763700003", "--to", "2025-11-21T05:40:05+01:00", "--tag", "7")
    assert [line.split(b",")[7] for line in two[1:]] == [b"1.0", b"1.3333333333333333"]
    assert exported("--sensor", "none") == every[:1]


def test_export_has_the_units_of_the_operators_file(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, path: Path, tmp_path: Path
) -> None:
    sensors, settings = tmp_path / "own.json", tmp_path / "own.toml"
    own = files("lupin_bridge").joinpath("sensors.json").read_text(encoding="utf-8")
    sensors.write_text(own.replace('"temperature": {', '"a": {'), encoding="utf-8")
    settings.write_text(f"sensors = '{sensors}'")

    def unit(*words: str) -> str:
        assert main(["journal", "export", "--journal", str(path), "--sensor", "a", *words]) == 0
        return capsys.readouterr().out.splitlines()[1].split(",")[6]

    assert unit() == ""
    assert unit("--sensors", str(sensors)) == "°C"
    assert unit("--config", str(settings)) == "°C"
    monkeypatch.setenv("LUPIN_SENSORS", str(sensors))
    assert unit() == "°C"
    monkeypatch.setenv("LUPIN_SENSORS", str(tmp_path / "none"))
    said = Said(capsys, "export", "--journal", path)
    assert (said.code, "LUPIN_SENSORS" in said.err) == (1, True)


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["--from", "yesterday"], "--from is 'yesterday', expected ROS seconds as a decimal"),
        (["--to", "2026-11-21T00:00:00"], "--to is '2026-11-21T00:00:00', expected ROS seconds"),
        (["--from", "2", "--to", "1"], "--to is 1.000000000, before --from, 2.000000000"),
    ],
)
def test_an_export_that_cannot_be_made_is_one_clear_line(
    words: list[str], named: str, capsys: pytest.CaptureFixture[str], path: Path
) -> None:
    said = Said(capsys, "export", "--journal", path, *words)
    assert (said.code, said.out) == (1, "")
    assert said.err.startswith(f"lupin-twin: {named}")
    assert said.err.count("\n") == 1


def test_vacuum_says_before_and_after(capsys: pytest.CaptureFixture[str], path: Path) -> None:
    with closing(open_writer(path)) as connection:
        connection.execute("DELETE FROM scan")
        connection.execute("DELETE FROM hour")
    said = Said(capsys, "vacuum", "--journal", path)
    assert (said.code, said.out) == (0, f"{path}: 0.2 MB before, 0.0 MB after\n")
    assert is_whole(path)


@pytest.mark.parametrize("action", ["info", "export"])
def test_a_reader_that_goes_away_is_no_error(action: str, path: Path) -> None:
    module = [sys.executable, "-m", "lupin_bridge.cli.command"]
    command = [*module, "journal", action, "--journal", str(path)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert process.stdout is not None
    process.stdout.close()
    assert process.stderr is not None
    assert process.stderr.read() == b""
    process.stderr.close()
    assert process.wait(PATIENCE_S) == 1
