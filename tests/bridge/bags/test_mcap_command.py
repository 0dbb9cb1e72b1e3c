from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from lupin_bridge import cli
from lupin_bridge.bags import mcap_command
from lupin_bridge.bags.bag_file import BagFile
from lupin_bridge.bags.recover import Saved
from tests.support.bags import CLOCK, MAP, TOPICS, read
from tests.support.waiting import PATIENCE_S


def killed(path: Path) -> None:
    """What a killed recorder leaves."""
    file = BagFile(path, TOPICS)
    file.write(MAP, 1_763_700_000_000_000_000, 1, b"map")
    file.write(CLOCK, 1_763_700_001_000_000_000, 2, b"clock")
    file.flush()
    file.close()


def test_what_was_saved_and_what_was_lost_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    killed(tmp_path / "a.mcap")
    assert cli.main(["mcap", "recover", str(tmp_path / "a.mcap")]) == 0
    assert capsys.readouterr().out == (
        "lost: it was not finished: it has no end\n"
        "2 messages (/clock 1, /map 1), from 2025-11-21T04:40:00+00:00 to "
        f"2025-11-21T04:40:01+00:00, are saved in {tmp_path / 'a_recovered.mcap'}\n"
    )
    assert [data for *_, data in read(tmp_path / "a_recovered.mcap")] == [b"map", b"clock"]
    out = tmp_path / "b.mcap"
    assert cli.main(["mcap", "recover", str(tmp_path / "a_recovered.mcap"), "-o", str(out)]) == 0
    assert f"+00:00; nothing was lost, are saved in {out}\n" in capsys.readouterr().out


def test_what_is_saved_counts_where_nothing_of_it_can_be_told(tmp_path: Path) -> None:
    killed(tmp_path / "a.mcap")
    said = {}
    for number, streams in enumerate((">/dev/full", ">&-", "<&- >&- 2>&-", "> >(:)")):
        out = tmp_path / f"{number}.mcap"
        command = [sys.executable, "-m", "lupin_bridge.cli", "mcap", "recover"]
        ended = subprocess.run(
            [
                "bash",
                "-c",
                f'exec "$@" {streams}',
                "bash",
                *command,
                tmp_path / "a.mcap",
                "-o",
                out,
            ],
            stderr=subprocess.PIPE,
            text=True,
            timeout=PATIENCE_S,
            check=False,
        )
        assert ended.returncode == 0
        assert len(read(out)) == 2
        said[streams] = ended.stderr
    assert said.pop(">/dev/full") == (
        "lupin-twin: cannot write to the standard output: No space left on device\n"
    )
    assert set(said.values()) == {""}


def test_of_many_losses_the_first_are_told_and_how_many_more_there_are(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    saved = Saved({"/map": 1}, lost=[f"{n}" for n in range(21)])
    monkeypatch.setattr(mcap_command, "recover", lambda *_: saved)
    killed(tmp_path / "a.mcap")
    assert cli.main(["mcap", "recover", str(tmp_path / "a.mcap")]) == 0
    *lost, more, _ = capsys.readouterr().out.splitlines()
    assert (lost, more) == ([f"lost: {n}" for n in range(20)], "lost: and 1 more")


def test_what_cannot_be_done_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def refused(*args: str | Path) -> tuple[int, str]:
        code = cli.main(["mcap", "recover", *map(str, args)])
        return code, capsys.readouterr().err

    there, out = tmp_path / "there.mcap", tmp_path / "out.mcap"
    there.write_bytes(b"mine")
    killed(tmp_path / "a.mcap")
    assert refused(tmp_path / "a.mcap", "-o", there) == (
        2,
        f"lupin-twin: {there} is there already, and nothing is overwritten\n",
    )
    assert there.read_bytes() == b"mine"
    assert refused(tmp_path / "gone.mcap") == (2, f"lupin-twin: there is no {tmp_path}/gone.mcap\n")
    os.mkfifo(tmp_path / "pipe")
    for no_file in (tmp_path / "pipe", tmp_path):
        assert refused(no_file, "-o", out) == (2, f"lupin-twin: {no_file} is no file\n")
    assert refused(there, "-o", out) == (
        1,
        f"lupin-twin: {there} holds no message that can be saved\n",
    )
    assert not out.exists()
    for folder in (tmp_path / "no", there):
        assert refused(tmp_path / "a.mcap", "-o", folder / "out.mcap") == (
            2,
            f"lupin-twin: cannot make {folder}/out.mcap: there is no folder {folder}\n",
        )
    for name in (".", "/", ""):
        assert refused(name) == (2, f"lupin-twin: {name or '.'} is no file\n")
    too_long = "a" * 300
    for source in (too_long, f"{too_long}/a.mcap"):
        assert refused(source) == (1, f"lupin-twin: cannot read {source}: File name too long\n")
    assert refused(tmp_path / "a.mcap", "-o", too_long) == (
        1,
        f"lupin-twin: cannot make {too_long}: File name too long\n",
    )
    nowhere = tmp_path / "nowhere.mcap"
    nowhere.symlink_to("nothing")
    assert refused(tmp_path / "a.mcap", "-o", nowhere) == (
        2,
        f"lupin-twin: {nowhere} is a link that leads nowhere, and nothing is overwritten\n",
    )
    with pytest.raises(SystemExit):
        refused("a.mcap", "--ros-args", "-r", "__ns:=/a")
