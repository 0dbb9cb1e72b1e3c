"""The command `lupin-twin replay`: what is wrong is said in one line; it ends when told to."""

from __future__ import annotations

import signal
import sys
from pathlib import Path

import pytest

from lupin_bridge.bags import replay_command
from lupin_bridge.cli import main
from tests.support.domains import ros_env
from tests.support.messages import scan
from tests.support.processes import Process
from tests.support.recordings import OBSERVATIONS, Sent, replay_options, write_bag


def test_its_options_are_within_their_limits() -> None:
    for speed in ("0.1", "100", "1"):
        assert replay_options("a.mcap", "--speed", speed).speed == float(speed)
    assert replay_options("a.mcap", "--start", "0").start == 0.0


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["--speed", "0.09"], "--speed: '0.09' must be a number from 0.1 to 100"),
        (["--speed", "100.1"], "--speed: '100.1' must be a number from 0.1 to 100"),
        (["--speed", "nan"], "--speed: 'nan' must be"),
        (["--start", "-1"], "--start: '-1' must be a number from 0 to 1000000000"),
        (["--start", "noon"], "--start: 'noon' must be"),
        (["--state-as", ""], "--state-as: '' must be the name of a topic"),
    ],
)
def test_an_option_out_of_its_limits_is_named(
    words: list[str], named: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        replay_options("a.mcap", *words)
    assert ended.value.code == 2
    assert named in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["demo", "--start", "3"], "--start is for --from FILE.mcap"),
        (["demo", "--loop"], "--loop is for --from FILE.mcap"),
        (["demo", "--skip-gaps", "3"], "--skip-gaps is for --from FILE.mcap"),
        (["demo", "--from", "a.mcap", "--seed", "3"], "--seed is the patrol's"),
        (["demo", "--from", "a.mcap", "--speed", "500"], "--speed: '500' must be a number from"),
        (["demo", "--from", "/no/such.mcap", "--port", "0"], "cannot read /no/such.mcap: No such"),
        (["demo", "--from", "a" * 300, "--port", "0"], f"cannot read {'a' * 300}: File name too"),
        (["demo", "--from", "/no/a.mcap", "/no/b.mcap", "--loop"], "cannot read /no/a.mcap: No"),
    ],
)
def test_what_the_demo_hands_on_is_checked_by_the_demo(
    words: list[str], named: str, capsys: pytest.CaptureFixture[str]
) -> None:
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [])
    try:
        with pytest.raises(SystemExit) as ended:
            main(words)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
    assert ended.value.code == 2
    assert named in capsys.readouterr().err


def test_types_that_are_not_installed_are_named(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "nav_msgs.msg", None)
    for name in [name for name in sys.modules if name.startswith("lupin_bridge.bags.replay")]:
        monkeypatch.delitem(sys.modules, name)
    asked: list[bool] = []
    monkeypatch.setattr(replay_command, "_stop_asked", lambda: asked.append(True))
    assert main(["replay", "a.mcap"]) == 1
    assert asked, "a signal ends it also while that is still looked for"
    assert "cannot publish what is recorded" in (told := capsys.readouterr().err)
    assert "nav_msgs" in told


def test_a_file_that_cannot_be_played_is_named_and_a_signal_ends_it(
    domain: int, tmp_path: Path
) -> None:
    path = write_bag(tmp_path / "a.mcap", [Sent(OBSERVATIONS, 1.0, scan("1"))])
    with (
        replaying(domain, path, "--pause") as good,
        replaying(domain, tmp_path / "no.mcap") as bad,
    ):
        assert bad.wait() == 1
        said = f"lupin-twin: cannot read {tmp_path}/no.mcap: No such file or directory"
        assert bad.output.splitlines() == [said]
        good.wait_for_output(f"lupin-twin: {path}, 0.0 s: looking who would hear it")
        good.send(signal.SIGINT)
        assert good.stop(signal.SIGINT) == 0
        assert "Traceback" not in good.output


def replaying(domain: int, *words: object) -> Process:
    """A replay, with threads that were there before it could hold any signal back."""
    command = [sys.executable, "-m", "lupin_bridge.cli", "replay", *map(str, words)]
    return Process(command, ros_env(domain, OPENBLAS_NUM_THREADS="2"))
