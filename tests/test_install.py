"""Installed and deployed: wheels, sdist, the systemd unit, the image, and compose."""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from fnmatch import fnmatch
from importlib.metadata import distribution, distributions
from pathlib import Path

import httpx
import pytest
import yaml
from packaging.requirements import Requirement

from lupin_bridge import __version__
from lupin_bridge.cli import journal
from lupin_bridge.cli.command import main, parser
from lupin_bridge.feed.source import STUCK_AFTER_S
from lupin_bridge.settings import settings_from, strange_variables, variable
from lupin_twin.journal.paths import journal_path
from lupin_twin.runtime.process import USAGE_ERROR, split_ros_args
from tests.support.domains import ros_env
from tests.support.processes import Process, lupin_twin, url_of
from tests.support.programs import program
from tests.support.waiting import PATIENCE_S, wait_for

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def clone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The files of the project in git, as in the work tree."""
    folder = tmp_path_factory.mktemp("clone")
    listed = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT, check=True, capture_output=True, text=True,
    )  # fmt: skip
    for name in filter(None, listed.stdout.split("\0")):
        if name.startswith(("backend/", "pyproject.toml", "README.md", ".gitignore")):
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)
    # hatchling reads what git ignores.
    subprocess.run(["git", "init", "-q", folder], check=True)
    return folder


def installed(clone: Path, folder: Path) -> Path:
    """The bridge's package alone, installed into a folder; its libraries are those of the tests."""
    subprocess.run(
        [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation",
         "--no-index", "--target", folder, clone],
        check=True, env={**os.environ, "PIP_DISABLE_PIP_VERSION_CHECK": "1"},
    )  # fmt: skip
    return folder


def started(package: Path, domain: int) -> Process:
    command = [sys.executable, "-m", "lupin_bridge.cli.command", "web", "--port", "0"]
    return Process(command, ros_env(domain, PYTHONPATH=str(package)))


def test_without_the_page_the_start_and_the_address_say_how_to_build_it(
    clone: Path, domain: int, tmp_path: Path
) -> None:
    package = installed(clone, tmp_path)
    assert not (package / "lupin_bridge" / "static").exists()
    with started(package, domain) as process:
        url = url_of(process)
        for method in ("GET", "HEAD"):
            answer = httpx.request(method, f"{url}/", trust_env=False, timeout=PATIENCE_S)
            assert answer.status_code == 503
            assert "npm ci && npm run build" in answer.text or method == "HEAD"
        assert "WARNING" in process.wait_for_output("npm ci && npm run build")
        # The rest is there, with the package's data files.
        for path in ("/healthz", "/openapi.json", "/signin.css"):
            assert httpx.get(url + path, trust_env=False, timeout=PATIENCE_S).status_code == 200


@pytest.fixture(scope="module")
def dist(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("release") / "dist"
    subprocess.run([ROOT / ".ci" / "dist", folder], check=True, capture_output=True)
    return folder


def test_the_wheel_has_the_three_packages_the_page_and_the_operators_files(dist: Path) -> None:
    (wheel,) = dist.glob("lupin_twin-*-py3-none-any.whl")
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    data = f"lupin_twin-{__version__}.data/data/share/lupin-twin"
    for name in (
        "lupin_bridge/static/index.html",
        "lupin_bridge/guide/index.html",
        "lupin_bridge/guide/reference/settings.html",
        "lupin_bridge/sensors.json",
        "lupin_twin/py.typed",
        "lupin_patrol/__main__.py",
        f"{data}/lupin-twin.service",
        f"{data}/bridge.toml",
        f"{data}/sros2-policy.xml",
        f"{data}/twin.yaml",
    ):
        assert name in names
    tops = {name.partition("/")[0] for name in names} - {data.partition("/")[0]}
    own = {"lupin_bridge", "lupin_twin", "lupin_patrol"}
    assert tops == own | {f"lupin_twin-{__version__}.dist-info"}


def copy_libraries(of: str, venv: Path) -> None:
    """A package's dependencies, from the tests' own: pip takes as long as ten other tests."""
    (site,) = venv.glob("lib/python3*/site-packages")
    (found,) = distributions(path=[str(site)], name=Requirement(of).name)
    waiting, known = [(found, Requirement(of))], set[str]()
    while waiting:
        package, requested = waiting.pop()
        for text in package.requires or ():
            wanted = Requirement(text)
            environments = [{"extra": extra} for extra in (*requested.extras, "")]
            if wanted.marker and not any(map(wanted.marker.evaluate, environments)):
                continue
            if str(wanted) not in known:
                known.add(str(wanted))
                waiting.append((distribution(wanted.name), wanted))
        for file in () if package is found else package.files or ():
            source, target = Path(file.locate()), Path(os.path.normpath(site / file))
            if source.is_file() and not target.exists():
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(source, target)


def test_a_demo_runs_from_the_wheels_without_compiler_and_node(
    dist: Path, domain: int, tmp_path: Path
) -> None:
    venv = tmp_path / "venv"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", venv], check=True)
    env = ros_env(domain, PATH=str(venv / "bin"))
    # Those of the tests' own ROS wheels.
    for name in ("LD_LIBRARY_PATH", "_ROS_WHEELS_BOOTSTRAP_COMPLETE"):
        env.pop(name, None)
    subprocess.run(
        [sys.executable, "-m", "pip", "--python", venv, "install", "--quiet", "--no-deps",
         "--no-index", *dist.glob("*.whl")],
        check=True, env={**env, "PIP_DISABLE_PIP_VERSION_CHECK": "1"},
    )  # fmt: skip
    copy_libraries("lupin-twin[ros]", venv)
    command = str(venv / "bin" / "lupin-twin")
    version = subprocess.run([command, "--version"], env=env, capture_output=True, check=True)
    assert version.stdout.decode() == f"lupin-twin {__version__}\n"
    with Process([command, "demo", "--port", "0"], env, afresh=True) as process:
        url = url_of(process)
        assert "Lupin twin" in httpx.get(url, trust_env=False, timeout=PATIENCE_S).text

        def picture() -> httpx.Response | None:
            address = f"{url}/api/field.png?sensor_type=temperature"
            answer = httpx.get(address, trust_env=False, timeout=PATIENCE_S)
            return answer if answer.status_code == 200 else None

        field = wait_for(picture, "a picture of the field")
        assert field is not None
        assert field.content.startswith(b"\x89PNG")


def test_the_image_copies_from_its_context_and_builds_from_the_sdist(dist: Path) -> None:
    text = (dist / "Containerfile").read_text(encoding="utf-8").replace("\\\n", " ")
    copied = [line.split()[1:-1] for line in text.splitlines() if line.startswith("COPY ")]
    sources = [source for words in copied for source in words if not words[0].startswith("--from")]
    assert sources == ["lupin_twin-*.whl", "lupin_twin-*.tar.gz"]
    for source in sources:
        assert len(list(dist.glob(source))) == 1
    with tarfile.open(next(dist.glob("lupin_twin-*.tar.gz"))) as archive:
        names = [name.partition("/")[2] for name in archive.getnames()]
    for folder in re.findall(r"pip install \S+ \./(\S+)", text):
        assert f"{folder}/pyproject.toml" in names
    assert "ros_node/lupin_msgs/msg/Observation.msg" in names
    # Another build from it needs no Node, and no clone.
    assert "backend/lupin_bridge/static/index.html" in names
    assert [name for name in names if fnmatch(name, "*node_modules*") or ".venv" in name] == []


def test_the_files_that_compose_mounts_and_builds_lie_beside_it(dist: Path) -> None:
    compose = yaml.safe_load((dist / "compose.yaml").read_text(encoding="utf-8"))
    mounts = [v for service in compose["services"].values() for v in service.get("volumes", [])]
    files = [mount.split(":")[0] for mount in mounts if mount.startswith(".")]
    assert files == ["./twin.yaml", "./nginx.conf"]
    for file in files:
        assert (dist / file).is_file()
    volumes = {mount.split(":")[0] for mount in mounts if not mount.startswith(".")}
    assert volumes == set(compose["volumes"])
    assert [service["build"] for service in compose["services"].values() if "build" in service] == [
        "."
    ]


def test_dist_is_a_command_of_the_clone() -> None:
    assert os.access(ROOT / ".ci" / "dist", os.X_OK)
    assert "\n\t@.ci/dist dist\n" in (ROOT / "Makefile").read_text(encoding="utf-8")


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
