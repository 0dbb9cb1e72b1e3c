"""The options of `patrol_node`."""

import signal
import sys
from pathlib import Path

import pytest

from lupin_patrol.cli import parser
from tests.support.domains import ros_env
from tests.support.processes import Process
from tests.support.waiting import wait_for


@pytest.mark.parametrize(
    ("option", "value", "limits"),
    [
        ("--speed", "0", "a number from 0.1 to 50"),
        ("--speed", "nan", "a number from 0.1 to 50"),
        ("--day-speed", "-0.1", "a number from 0 to 3600"),
        ("--day-speed", "inf", "a number from 0 to 3600"),
        ("--since-morning", "86401", "a number from 0 to 86400"),
        ("--seed", "1.5", "a whole number from 0 to 4294967295"),
        ("--seed", "-1", "a whole number from 0 to 4294967295"),
        ("--seed", "4294967296", "a whole number from 0 to 4294967295"),
    ],
)
def test_a_bad_value_is_refused_with_option_value_and_limits(
    capsys: pytest.CaptureFixture[str], option: str, value: str, limits: str
) -> None:
    with pytest.raises(SystemExit) as refusal:
        parser().parse_args([option, value])
    assert refusal.value.code == 2
    line = capsys.readouterr().err.splitlines()[-1]
    assert line.startswith(f"patrol_node: error: argument {option}: {value!r} is ")
    assert line.endswith(f"expected {limits}")


@pytest.mark.parametrize("arguments", [["--spee", "2"], ["--twice"], ["stray"]])
def test_an_unknown_option_is_refused_by_name(
    capsys: pytest.CaptureFixture[str], arguments: list[str]
) -> None:
    with pytest.raises(SystemExit) as refusal:
        parser().parse_args(arguments)
    assert refusal.value.code == 2
    line = capsys.readouterr().err.splitlines()[-1]
    assert arguments[0] in line


def test_it_ends_with_its_parent_even_when_that_is_killed(domain: int) -> None:
    parent = [
        sys.executable,
        "-c",
        (
            "import subprocess, sys; "
            "patrol = [sys.executable, '-m', 'lupin_patrol', '--end-with-parent']; "
            "child = subprocess.Popen(patrol); "
            "print('child', child.pid, flush=True); child.wait()"
        ),
    ]
    with Process(parent, ros_env(domain)) as process:
        child = Path("/proc", process.wait_for_output("child").split()[1])
        process.wait_for_output("patrol starts")
        process.send(signal.SIGKILL)
        process.wait()
        wait_for(lambda: not child.exists(), "the end of the patrol")
