from __future__ import annotations

import os
from pathlib import Path

import pytest

from lupin_bridge import cli
from lupin_bridge.bags import mcap_command
from lupin_bridge.bags.bag_file import BagFile
from lupin_bridge.bags.recover import Saved
from tests.support.bags import CLOCK, MAP, TOPICS, read


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


def test_of_many_losses_the_first_are_told_and_how_many_more_there_are(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    saved = Saved({"/map": 1}, lost=[f"{n}" for n in range(21)])
    monkeypatch.setattr(mcap_command, "recover", lambda *_: saved)
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
    code, said = refused(tmp_path / "a.mcap", "-o", tmp_path / "no" / "out.mcap")
    assert (code, "there is no" in said) == (2, True)
    with pytest.raises(SystemExit):
        refused("a.mcap", "--ros-args", "-r", "__ns:=/a")
