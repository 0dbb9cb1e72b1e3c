"""The command: its options, ROS's arguments, and one clear line where something is wrong."""

import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lupin_bridge.cli.command import main, split_ros_args
from tests.support.processes import lupin_twin
from tests.support.waiting import wait_for
from tests.support.web import bridge


@pytest.fixture
def signals() -> Iterator[None]:
    """The command holds signals back; the tests' own process needs them."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ())
    yield
    signal.pthread_sigmask(signal.SIG_SETMASK, before)


# --- arguments ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("given_", "own", "ros"),
    [
        ([], [], []),
        (["serve", "--port", "1"], ["serve", "--port", "1"], []),
        (["serve", "--ros-args", "-p", "a:=1"], ["serve"], ["--ros-args", "-p", "a:=1"]),
        (
            ["--ros-args", "-r", "x:=y", "--", "serve", "--port", "1"],
            ["serve", "--port", "1"],
            ["--ros-args", "-r", "x:=y", "--"],
        ),
        (
            ["serve", "--ros-args", "-p", "a:=1", "--", "--port", "1", "--ros-args", "-p", "b:=2"],
            ["serve", "--port", "1"],
            ["--ros-args", "-p", "a:=1", "--", "--ros-args", "-p", "b:=2"],
        ),
        (["serve", "--", "x"], ["serve", "--", "x"], []),
    ],
)
def test_what_follows_ros_args_is_ros_up_to_a_double_dash(
    given_: list[str], own: list[str], ros: list[str]
) -> None:
    assert split_ros_args(given_) == (own, ros)


@given(st.lists(st.sampled_from(["--ros-args", "--", "-p", "a:=1", "serve"]), max_size=12))
def test_no_argument_is_lost_but_for_what_ends_a_ros_part(arguments: list[str]) -> None:
    own, ros = split_ros_args(arguments)
    assert sorted(own + ros) == sorted(arguments)
    assert "--ros-args" not in own


# --- mistakes ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["serve", "--port", "70000"], "--port is '70000': input should be less than or equal"),
        (["web", "--max-clients", "0"], "--max-clients is '0': input should be greater than or"),
        (["demo", "--reading-validity-s", "nan"], "--reading-validity-s is 'nan': input should"),
        (["serve", "--host", ""], "--host is '': string should have at least 1 char"),
        (["serve", "--port", "http"], "--port is 'http': input should be a valid integer"),
        (["serve", "--max-client", "5"], "unrecognized arguments: --max-client 5"),
        (["demo", "--speed", "abc"], "argument --speed: invalid float value: 'abc'"),
        (["demo", "--seed", "x"], "argument --seed: invalid int value: 'x'"),
        (["fly"], "invalid choice: 'fly'"),
        ([], "the following arguments are required: ROLE"),
    ],
)
def test_a_mistake_in_the_command_line_is_named(
    arguments: list[str], named: str, capsys: pytest.CaptureFixture[str], signals: None
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 2
    assert named in capsys.readouterr().err.splitlines()[-1]


# --- the process ----------------------------------------------------------------------------------


def test_without_a_home_directory_it_serves_all_the_same(tmp_path: Path) -> None:
    with bridge(HOME="", ROS_LOG_DIR="", TMPDIR=str(tmp_path)) as live:
        assert live.get("/healthz").status_code == 200


def test_a_signal_before_it_serves_is_kept_for_then(domain: int) -> None:
    with lupin_twin(domain, "serve", afresh=True) as process:
        # The command holds both back from before its first slow import; see /proc/[pid]/status.
        held_back = 1 << (signal.SIGINT - 1) | 1 << (signal.SIGTERM - 1)
        wait_for(lambda: blocked_signals(process.pid) & held_back == held_back, "them held back")
        process.send(signal.SIGINT)
        assert process.wait() == 0
        assert "Traceback" not in process.output


def blocked_signals(pid: int) -> int:
    """The signals that a process's main thread holds back, as a bit mask."""
    status = Path(f"/proc/{pid}/status").read_text(encoding="ascii")
    (mask,) = [line.split()[1] for line in status.splitlines() if line.startswith("SigBlk")]
    return int(mask, 16)
