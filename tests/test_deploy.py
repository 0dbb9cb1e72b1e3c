"""The examples in `backend/deploy/`: what they promise holds, as far as it can be held here."""

from __future__ import annotations

import shlex
import subprocess
from pathlib import Path

import pytest

from lupin_bridge.cli import USAGE_ERROR, _parser, split_ros_args
from lupin_bridge.configuration import settings_from
from lupin_bridge.settings import variable
from lupin_bridge.twin.source import STUCK_AFTER_S
from tests.support.programs import program

DEPLOY = Path(__file__).parents[1] / "backend" / "deploy"
UNIT = DEPLOY / "lupin-twin.service"


def unit() -> dict[str, list[str]]:
    """The unit's directives by name, in their order; continued lines are one."""
    found: dict[str, list[str]] = {}
    for line in UNIT.read_text(encoding="utf-8").replace("\\\n", " ").splitlines():
        if line and not line.startswith(("#", "[")):
            name, _, value = line.partition("=")
            found.setdefault(name, []).append(value)
    return found


@pytest.fixture
def environment() -> dict[str, str]:
    return dict(line.split("=", 1) for line in unit()["Environment"])


def test_systemd_finds_nothing_wrong_with_the_unit(tmp_path: Path) -> None:
    checked = tmp_path / UNIT.name
    checked.write_bytes(UNIT.read_bytes())
    result = subprocess.run(
        [program("systemd-analyze"), "verify", checked], capture_output=True, text=True, check=False
    )
    # What it does not know it tells of, and goes on.
    assert (result.returncode, result.stderr) == (0, "")


def test_bad_settings_are_not_tried_again_for_ever() -> None:
    assert unit()["Restart"] == ["always"]
    assert unit()["RestartPreventExitStatus"] == [str(USAGE_ERROR)]


def test_the_watchdog_waits_longer_than_a_callback_may_take() -> None:
    assert unit()["Type"] == ["notify"]
    (seconds,) = unit()["WatchdogSec"]
    assert int(seconds) > STUCK_AFTER_S


def test_it_has_a_place_to_write_in_and_shares_memory_with_other_nodes(
    environment: dict[str, str],
) -> None:
    assert unit()["ProtectSystem"] == ["strict"]
    assert unit()["PrivateTmp"] == ["yes"], "/tmp would be read-only"
    assert not {"PrivateDevices", "PrivateIPC", "DynamicUser"} & set(unit()), "/dev/shm"
    assert environment["ROS_LOG_DIR"] == f"/var/log/{unit()['LogsDirectory'][0]}"


def test_the_token_is_a_credential(environment: dict[str, str]) -> None:
    (credential,) = unit()["LoadCredential"]
    assert environment[variable("token_file")] == f"%d/{credential.partition(':')[0]}"
    assert "EnvironmentFile" not in unit()


def test_the_command_line_is_one_that_the_bridge_takes() -> None:
    (start,) = unit()["ExecStart"]
    script = shlex.split(start)[2]
    own, ros = split_ros_args(shlex.split(script.rpartition("lupin-twin serve")[2]))
    options = _parser().parse_args(["serve", *own])
    assert Path(options.config).name == "bridge.toml"
    assert ros[:2] == ["--ros-args", "--params-file"]


@pytest.mark.parametrize("is_bare", [True, False])
def test_the_settings_are_settings_those_that_are_commented_out_too(
    is_bare: bool, tmp_path: Path
) -> None:
    text = (DEPLOY / "bridge.toml").read_text(encoding="utf-8")
    file = tmp_path / "bridge.toml"
    file.write_text(text if is_bare else text.replace("\n# tls", "\ntls"), encoding="utf-8")
    settings = settings_from({}, {}, str(file))
    assert settings.host == "0.0.0.0"
    assert bool(settings.tls_key) != is_bare
