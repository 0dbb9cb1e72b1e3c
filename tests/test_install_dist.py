"""The output of `make dist`: a demo from its wheels, and the context of the container image."""

import os
import re
import shutil
import subprocess
import sys
import tarfile
import zipfile
from fnmatch import fnmatch
from importlib.metadata import distribution, distributions
from pathlib import Path

import httpx
import pytest
import yaml
from packaging.requirements import Requirement

from lupin_bridge import __version__
from tests.support.domains import ros_env
from tests.support.processes import Process, url_of
from tests.support.waiting import PATIENCE_S, wait_for

ROOT = Path(__file__).parents[1]


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
