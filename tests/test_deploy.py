"""The examples in `backend/deploy/`: they work, as far as it can be tested here."""

import json
import os
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import yaml

from lupin_bridge.cli import journal
from lupin_bridge.cli.command import main, parser
from lupin_bridge.feed.source import STUCK_AFTER_S
from lupin_bridge.settings import settings_from, strange_variables, variable
from lupin_twin.journal.paths import journal_path
from lupin_twin.runtime.process import USAGE_ERROR, split_ros_args
from tests.support.domains import ros_env
from tests.support.processes import Process, lupin_twin, url_of
from tests.support.programs import program

ROOT = Path(__file__).parents[1]
DEPLOY = ROOT / "backend" / "deploy"
UNIT = DEPLOY / "lupin-twin.service"


def unit() -> dict[str, list[str]]:
    """The unit's directives by name, in order; continued lines are one."""
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
    # An unknown directive is reported and ignored.
    assert (result.returncode, result.stderr) == (0, "")


def test_the_unit_has_what_the_service_needs(environment: dict[str, str]) -> None:
    for directive in ("Wants", "After"):
        assert "time-sync.target" in unit()[directive][0].split()
    assert unit()["Restart"] == ["always"]
    assert unit()["RestartPreventExitStatus"] == [str(USAGE_ERROR)]
    assert unit()["Type"] == ["notify"]
    (seconds,) = unit()["WatchdogSec"]
    assert int(seconds) > STUCK_AFTER_S
    assert unit()["ProtectSystem"] == ["strict"]
    assert unit()["PrivateTmp"] == ["yes"], "/tmp would be read-only"
    assert environment["FASTDDS_BUILTIN_TRANSPORTS"] == "UDPv4", "it is another user"
    assert environment["ROS_LOG_DIR"] == f"/var/log/{unit()['LogsDirectory'][0]}"
    (credential,) = unit()["LoadCredential"]
    assert environment[variable("token_file")] == f"%d/{credential.partition(':')[0]}"
    assert "EnvironmentFile" not in unit()
    assert unit()["DynamicUser"] == ["yes"]
    assert unit()["StateDirectory"] == unit()["LogsDirectory"] == unit()["User"]


def test_the_command_line_is_valid_for_the_bridge() -> None:
    own, ros = split_ros_args(shlex.split(script().rpartition("lupin-twin serve")[2]))
    options = parser().parse_args(["serve", *own])
    assert Path(options.config).name == "bridge.toml"
    assert ros[:2] == ["--ros-args", "--params-file"]


def script() -> str:
    """The script of the unit's shell."""
    (start,) = unit()["ExecStart"]
    return shlex.split(start)[2].replace("$$", "$")


def test_the_service_serves_and_the_journal_command_finds_its_file(
    environment: dict[str, str],
    domain: int,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """All of it except systemd: its folders are elsewhere."""
    settings = tmp_path / "etc" / "lupin-twin"
    settings.mkdir(parents=True)
    bare = (DEPLOY / "bridge.toml").read_text(encoding="utf-8").replace("8000", "0")
    (settings / "bridge.toml").write_text(bare, encoding="utf-8")
    parameters = ROOT / "ros_node" / "lupin_twin" / "config" / "twin.yaml"
    (settings / "twin.yaml").write_bytes(parameters.read_bytes())
    token = tmp_path / "token"
    token.write_text("0123456789abcdef\n", encoding="ascii")
    token.chmod(0o600)
    ros = tmp_path / "opt" / "ros" / "jazzy"
    ros.mkdir(parents=True)
    (ros / "setup.bash").write_text("echo sourced\n", encoding="ascii")
    elsewhere = (
        ("/opt/lupin-twin/bin", str(Path(sys.executable).parent)),
        ("/opt/", f"{tmp_path}/opt/"),
        ("/etc/", f"{tmp_path}/etc/"),
        ("/var/", f"{tmp_path}/var/"),
        ("%d", str(tmp_path)),
    )

    def moved(text: str) -> str:
        for here, there in elsewhere:
            text = text.replace(here, there)
        return text

    env = {name: moved(value) for name, value in environment.items()}
    assert env.pop("ROS_DOMAIN_ID") == "0"
    command = ["/bin/bash", "-c", moved(script())]
    with Process(command, ros_env(domain, **env), afresh=True) as process:
        url_of(process)
        assert process.output.startswith("sourced\n")
        folder = Path(moved(str(journal.SERVICE_FOLDER)))
        file = folder / f"domain-{domain}.sqlite"
        assert file.is_file()
        monkeypatch.setattr(journal, "SERVICE_FOLDER", folder)
        monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
        assert main(["journal", "info"]) == 0
        assert str(file) in capsys.readouterr().out


@pytest.mark.parametrize("is_bare", [True, False])
def test_the_settings_are_valid_including_those_that_are_commented_out(
    is_bare: bool, tmp_path: Path
) -> None:
    text = (DEPLOY / "bridge.toml").read_text(encoding="utf-8")
    file = tmp_path / "bridge.toml"
    file.write_text(text if is_bare else text.replace("\n# tls", "\ntls"), encoding="utf-8")
    settings = settings_from({}, {}, str(file))
    assert settings.host == "0.0.0.0"
    assert bool(settings.tls_key) != is_bare


def image() -> dict[str, str]:
    """The last of each instruction in the image's last stage; ENV by its variables."""
    text = (DEPLOY / "Containerfile").read_text(encoding="utf-8").replace("\\\n", " ")
    stage = re.split(r"^FROM .*$", text, flags=re.MULTILINE)[-1]
    lines = [line for line in stage.splitlines() if line and not line.startswith("#")]
    found = {name: rest for name, _, rest in (line.partition(" ") for line in lines)}
    return found | dict(pair.split("=", 1) for pair in found["ENV"].split())


def test_the_image_has_its_journal_in_the_volume_as_a_user_without_rights() -> None:
    path = journal_path("", {"XDG_STATE_HOME": image()["XDG_STATE_HOME"]}, 0, "")
    assert path is not None
    assert image()["VOLUME"] == str(path.parent)
    uid, home = re.search(r"--uid (\d+) --home-dir (\S+) --create-home", image()["RUN"]).groups()  # type: ignore[union-attr]
    assert (uid, home) == (image()["USER"], image()["VOLUME"])
    assert int(uid) > 0


def test_the_image_needs_no_shared_memory_of_the_host_and_starts_a_role() -> None:
    assert image()["FASTDDS_BUILTIN_TRANSPORTS"] == "UDPv4"
    assert json.loads(image()["ENTRYPOINT"]) == ["lupin-twin"]
    assert parser().parse_args(json.loads(image()["CMD"])).role == "serve"


def test_the_health_check_reports_whether_the_bridge_lives(domain: int) -> None:
    python, *arguments = json.loads(image()["HEALTHCHECK"].partition(" CMD ")[2])
    assert python == "python"

    def check(port: str) -> int:
        env = {**os.environ, variable("port"): port}
        result = subprocess.run(
            [sys.executable, *arguments], env=env, capture_output=True, check=False
        )
        return result.returncode

    # As in the compose file: below a path.
    with lupin_twin(domain, "web", "--path-prefix", "/gh1") as process:
        port = re.search(r":(\d+)", url_of(process).removeprefix("http:"))[1]  # type: ignore[index]
        assert check(port) == 0
        process.stop()
        assert check(port) != 0


def test_compose_runs_the_image_as_nginx_expects_it() -> None:
    compose = yaml.safe_load((DEPLOY / "compose.yaml").read_text(encoding="utf-8"))
    services = compose["services"]
    nginx = (DEPLOY / "nginx.conf").read_text(encoding="utf-8")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert services["twin"]["entrypoint"][0] in project["scripts"]
    assert f"/{services['twin']['volumes'][0].partition('/')[2]}" == image()["VOLUME"]
    bridges = {name: it for name, it in services.items() if name.startswith("bridge")}
    ports = []
    for bridge in bridges.values():
        assert parser().parse_args(bridge["command"]).role == "web"
        assert strange_variables(bridge["environment"]) == []
        settings = settings_from({}, bridge["environment"], None)
        ports.append(settings.port)
        assert f"location {settings.path_prefix}/ " in nginx
        assert settings.allow_host == tuple(re.findall(r"server_name (\S+);", nginx))
    assert ports == [int(port) for port in re.findall(r"server 127\.0\.0\.1:(\d+)", nginx)]
    for service in ("twin", *bridges):
        assert services[service]["network_mode"] == "host"
