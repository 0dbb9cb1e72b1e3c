"""The command: its options, ROS's arguments, and one clear line where something is wrong."""

import json
import logging
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from lupin_bridge.cli import command
from lupin_twin.runtime.process import split_ros_args
from tests.support.processes import lupin_twin, run_here
from tests.support.waiting import wait_for
from tests.support.web import bridge


@pytest.fixture
def signals() -> Iterator[None]:
    """The command holds signals back; restore them for the test process."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ())
    yield
    signal.pthread_sigmask(signal.SIG_SETMASK, before)


@pytest.mark.parametrize(
    ("given_", "own", "ros"),
    [
        ([], [], []),
        (["serve", "--port", "1"], ["serve", "--port", "1"], []),
        (
            ["serve", "--ros-args", "-p", "a:=1", "--", "--port", "1", "--ros-args", "-p", "b:=2"],
            ["serve", "--port", "1"],
            ["--ros-args", "-p", "a:=1", "--", "--ros-args", "-p", "b:=2"],
        ),
        (["serve", "--", "x"], ["serve", "--", "x"], []),
    ],
)
def test_arguments_after_ros_args_belong_to_ros_up_to_a_double_dash(
    given_: list[str], own: list[str], ros: list[str]
) -> None:
    assert split_ros_args(given_) == (own, ros)


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["serve", "--port", "70000"], "--port is '70000': input should be less than or equal"),
        (
            ["serve", "--max-client", "5"],
            "--max-client is not an option of serve",
        ),
        (["demo", "--seeed", "1"], "--seeed is not an option of demo"),
        (["serve", "-p", "a:=1"], "-p is not an option of serve: put it after --ros-args"),
        (["journal", "info", "x"], "x is not an option of journal"),
        (["web", "--ros-args", "-p", "a=1"], "-p is 'a=1', expected NAME:=VALUE"),
        (["demo", "--speed", "0"], "--speed is 0.0, it must be from 0.1 to 50.0"),
        (["demo", "--speed", "101", "--from", "x"], "--speed is 101.0, it must be from 0.1 to 100"),
        (["demo", "--seed", "-1"], "--seed is -1, it must be from 0 to 4294967295"),
        (["fly"], "invalid choice: 'fly'"),
        ([], "the following arguments are required: ROLE"),
    ],
)
def test_a_mistake_in_the_command_line_is_named(
    arguments: list[str], named: str, signals: None
) -> None:
    done = run_here(*arguments)
    assert done.returncode == 2
    assert named in done.stderr.splitlines()[-1]


def test_without_a_home_directory_it_still_serves(tmp_path: Path) -> None:
    with bridge(HOME="", ROS_LOG_DIR="", TMPDIR=str(tmp_path)) as live:
        assert live.get("/healthz").status_code == 200


def test_a_signal_before_it_serves_ends_it_once_it_serves(domain: int) -> None:
    with lupin_twin(domain, "serve", afresh=True) as process:
        # The command blocks both before its first slow import.
        wait_for(process.holds_signals_back, "signals to be held back")
        process.send(signal.SIGINT)
        assert process.wait() == 0
        assert "Traceback" not in process.output


LEVELS = ["debug", "info", "warning", "error"]


@pytest.fixture(autouse=True)
def untouched_root(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """`set_up` changes the root logger, which the test run uses too."""
    monkeypatch.setattr(logging.root, "handlers", [])
    monkeypatch.setattr(logging.root, "level", logging.WARNING)
    yield
    for name in ("lupin_bridge", "lupin_twin"):
        logging.getLogger(name).setLevel(logging.NOTSET)


@pytest.fixture
def now_s(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    now_s = [100.0]
    monkeypatch.setattr(time, "monotonic", lambda: now_s[0])
    return now_s


def test_json_is_one_object_a_line_with_the_error(capsys: pytest.CaptureFixture[str]) -> None:
    command.set_up_log("json")
    log = logging.getLogger("lupin_bridge.test")
    log.info("tag %s\nsecond line", "7°")
    log.error("failed", exc_info=ValueError("broken"))
    first, second = (json.loads(line) for line in capsys.readouterr().err.splitlines())
    assert first["message"] == "tag 7°\nsecond line"
    assert (first["level"], first["logger"]) == ("info", "lupin_bridge.test")
    assert first["time"].endswith("+00:00")
    assert "error" not in first
    assert second["error"].endswith("ValueError: broken")


@pytest.mark.parametrize("level", LEVELS)
def test_lines_below_the_level_are_left_out(level: str, capsys: pytest.CaptureFixture[str]) -> None:
    command.set_up_log("text", level)
    for least in LEVELS:
        logging.getLogger("lupin_bridge.test").log(getattr(logging, least.upper()), "ours")
        # As the nodes log: bypassing all loggers.
        record = logging.LogRecord("ros", getattr(logging, least.upper()), "", 0, "ros", (), None)
        logging.root.handle(record)
    logging.getLogger("asyncio").debug("a library's")
    logging.getLogger("uvicorn.error").info("a library's: Started server process")
    run_here = capsys.readouterr().err
    expected = len(LEVELS) - LEVELS.index(level)
    assert (run_here.count(": ours"), run_here.count(": ros")) == (expected, expected)
    assert "library" not in run_here


def test_each_logger_is_limited_by_level_and_tells_how_many_it_left_out(
    now_s: list[float], capsys: pytest.CaptureFixture[str]
) -> None:
    command.set_up_log("text")
    log = logging.getLogger("uvicorn.error")
    for number in range(command.AT_ONCE + 7):
        log.warning("wrong token from %s", f"10.0.0.{number}")
    log.error("another level")
    logging.getLogger("lupin_bridge").warning("another logger")
    err = capsys.readouterr().err
    assert err.count("wrong token from") == command.AT_ONCE
    assert ("another level" in err, "another logger" in err) == (True, True)
    now_s[0] += command.PERIOD_S
    log.warning("wrong token from %s", "10.0.0.9")
    log.warning("wrong token from %s", "10.0.0.9")
    (line,) = capsys.readouterr().err.splitlines()
    assert line.endswith(" wrong token from 10.0.0.9 (7 more since the last time)")
