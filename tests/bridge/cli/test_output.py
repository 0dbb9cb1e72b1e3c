from __future__ import annotations

import os
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import pytest

from lupin_bridge.cli.output import writing
from lupin_bridge.past import bodies
from lupin_twin.journal.schema import open_reader
from tests.bridge.cli.test_journal import LATER, Said
from tests.support.bags import no_file_above
from tests.support.journal import NOW, SECOND, is_whole, kept, pin, recording, scan
from tests.support.waiting import PATIENCE_S, wait_for

OWN = ("", "-wal", "-shm", "-journal", ".lock")


@pytest.fixture
def path(tmp_path: Path) -> Path:
    made = tmp_path / "j.sqlite"
    kept(made, [pin(), *(scan(at_ns=NOW + n * SECOND, a=n / 3) for n in range(2000))])
    return made


def everything(folder: Path) -> dict[str, bytes]:
    return {file.name: file.read_bytes() for file in folder.iterdir() if file.is_file()}


def test_a_new_file_gets_all_of_it(tmp_path: Path) -> None:
    target = tmp_path / "out.csv"
    with writing(str(target), tmp_path / "j.sqlite") as write:
        write(b"a")
        write(b"bc" * 1_000_000)
    assert target.read_bytes() == b"a" + b"bc" * 1_000_000


@pytest.mark.parametrize("end", OWN)
def test_no_file_of_a_journal_is_written(
    end: str, path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    link = path.with_name("link.csv")
    target = path.with_name(path.name + end)
    link.symlink_to(target)
    alias = path.with_name("alias.sqlite")
    alias.symlink_to(path)
    with recording(path, LATER) as journal:
        journal.write(scan("new", NOW + 3000 * SECOND))
        wait_for(lambda: journal.condition.written == 1, "it records")
        for journal_name, output in ((path, target), (path, link), (alias, target)):
            said = Said(capsys, "export", "--journal", journal_name, "--output", output)
            assert (said.code, said.out) == (1, "")
            assert said.err == (
                f"lupin-twin: {output} is a file of the journal itself, and nothing is"
                " overwritten\n"
            )
        journal.write(scan("newer", NOW + 3000 * SECOND))
        wait_for(lambda: journal.condition.written == 2, "one more")
    assert is_whole(path)
    with closing(open_reader(path)) as connection:
        assert connection.execute("SELECT count(*) FROM scan").fetchone() == (2002,)


@pytest.mark.parametrize("name", ["there.csv", "link.csv", "nothing.csv"])
def test_what_is_there_is_left_as_it_is(
    name: str, path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "there.csv").write_bytes(b"mine")
    (tmp_path / "link.csv").symlink_to("there.csv")
    (tmp_path / "nothing.csv").symlink_to("nowhere.csv")
    with closing(open_reader(path)):
        before = everything(tmp_path)
        said = Said(capsys, "export", "--journal", path, "--output", tmp_path / name)
        assert (said.code, said.out) == (1, "")
        assert said.err == (
            f"lupin-twin: {tmp_path / name} is there already, and nothing is overwritten\n"
        )
        assert everything(tmp_path) == before


@pytest.mark.parametrize(
    ("output", "text"),
    [
        ("", "--output is '', must name a file"),
        ("run.mcap", "for a recording name it without --output, lupin-twin journal export run.m"),
        ("run.MCAP", "--output run.MCAP would be CSV"),
        (".", "cannot write .: Is a directory"),
        ("x" * 300, "x: File name too long"),
        ("/dev/fd/999", "cannot write /dev/fd/999: Bad file descriptor"),
    ],
)
def test_a_name_that_is_none_for_csv_is_one_clear_line(
    output: str,
    text: str,
    path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(path.parent)
    said = Said(capsys, "export", "--journal", path, "--output", output)
    assert (said.code, said.out) == (1, "")
    assert text in said.err
    assert said.err.count("\n") == 1
    assert not list(path.parent.glob("run.*"))


def test_of_a_part_no_file_is_left(
    path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "out.csv"
    # Room for what SQLite has beside a journal that is read, 32 KiB, and not for all of it.
    with no_file_above(45_000):
        said = Said(capsys, "export", "--journal", path, "--output", target)
    assert (said.code, said.err) == (1, f"lupin-twin: cannot write {target}: File too large\n")
    assert not target.exists()

    def interrupted() -> None:
        with writing(str(target), path) as write:
            write(b"half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert not target.exists()


def test_special_files_are_written_as_they_are(
    path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    fifo = tmp_path / "fifo"
    os.mkfifo(fifo)
    reader = os.open(fifo, os.O_RDONLY | os.O_NONBLOCK)
    try:
        assert Said(capsys, "export", "--journal", path, "--to", "1", "--output", fifo).code == 0
        assert os.read(reader, 10_000) == bodies.CSV_HEADER
    finally:
        os.close(reader)
    # By a link: were this broken, root would take the device itself from everybody.
    full = tmp_path / "full"
    full.symlink_to("/dev/full")
    said = Said(capsys, "export", "--journal", path, "--output", full)
    assert said.err == f"lupin-twin: cannot write {full}: No space left on device\n"
    assert full.is_symlink()
    assert fifo.is_fifo()


def test_a_fifo_s_reader_that_goes_away_is_no_complaint(tmp_path: Path) -> None:
    fifo = tmp_path / "fifo"
    os.mkfifo(fifo)
    reader = os.open(fifo, os.O_RDONLY | os.O_NONBLOCK)
    with writing(str(fifo), tmp_path / "j.sqlite") as write:
        os.close(reader)
        with pytest.raises(BrokenPipeError):
            write(b"x")
    assert fifo.is_fifo()


@pytest.mark.parametrize("name", ["/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"])
def test_what_the_shell_has_opened_goes_on_where_it_is(
    name: str, path: Path, tmp_path: Path
) -> None:
    target = tmp_path / "all.csv"
    target.write_bytes(b"before\n")
    command = [sys.executable, "-m", "lupin_bridge.cli.command", "journal", "export"]
    with target.open("ab") as file:
        ended = subprocess.run(
            [*command, "--journal", str(path), "--to", "1", "--output", name],
            check=False,
            stdout=file,
            stderr=subprocess.PIPE,
            timeout=PATIENCE_S,
        )
    assert (ended.returncode, ended.stderr) == (0, b"")
    assert target.read_bytes() == b"before\n" + bodies.CSV_HEADER


def ended(
    words: str, path: Path, redirected: str, *, stdout: int = subprocess.PIPE
) -> tuple[int, bytes, bytes]:
    """Exit code, output and errors of the command as a shell runs it."""
    line = f'exec "$1" -m lupin_bridge.cli.command journal {words} --journal "$2" {redirected}'
    done = subprocess.run(
        ["/bin/bash", "-c", line, "bash", sys.executable, str(path)],
        check=False,
        stdout=stdout,
        stderr=subprocess.PIPE,
        timeout=PATIENCE_S,
    )
    return (
        done.returncode,
        done.stdout,
        done.stderr.removeprefix(b"structure\nscan\nlook\nplace\n"),
    )


@pytest.mark.parametrize("action", ["info", "check", "export", "vacuum"])
def test_a_standard_output_that_is_full_is_named_and_a_closed_one_is_none(
    action: str, path: Path
) -> None:
    full = b"lupin-twin: cannot write to the standard output: No space left on device\n"
    assert ended(action, path, ">/dev/full") == (1, b"", full)
    # As after >/dev/null: who closes it wants to hear nothing.
    assert ended(action, path, ">&-") == (0, b"", b"")


def test_without_a_standard_output_a_file_is_written_all_the_same(path: Path) -> None:
    target = path.with_name("out.csv")
    for redirected in (">&-", "2>&-", ">&- 2>&-"):
        words = f'export --output "{target}" --to 1'
        assert ended(words, path, redirected) == (0, b"", b"")
        assert target.read_bytes() == bodies.CSV_HEADER
        target.unlink()


@pytest.mark.parametrize("redirected", ["2>&-", "2>/dev/full"])
def test_without_a_standard_error_all_is_said_that_can_be(redirected: str, path: Path) -> None:
    assert ended("check", path, redirected) == (0, f"{path} is whole\n".encode(), b"")
    missing = path.with_name("missing.sqlite")
    assert ended("check", missing, redirected) == (1, b"", b"")


def test_a_name_that_is_no_text_is_told_as_it_is(path: Path) -> None:
    strange = path.with_name("j\udcff.sqlite")
    path.rename(strange)
    code, out, err = ended("check", strange, "")
    assert (code, out, err) == (0, os.fsencode(strange) + b" is whole\n", b"")
