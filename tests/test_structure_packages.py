"""Package metadata, the targets of the Makefile, and the lengths of hand-written files."""

import ast
import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterable
from importlib.metadata import distributions, packages_distributions
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from lupin_bridge import __version__
from tests.support.structure import PACKAGES as OWN_PACKAGES
from tests.support.structure import ROOT, ROS

ROS_NODE = ROOT / "ros_node"
PACKAGES = ("lupin_twin", "lupin_patrol")
# rosdep's names where Python's differ; None: rosdep does not know it, or not its version.
ROSDEP_KEYS = {
    "numpy": "python3-numpy",
    "pytest": "python3-pytest",
    "yaml": "python3-yaml",
    "greenhouse_sim": None,
    "paho": None,
}


# What builds and tests the messages.
OF_CMAKE = {"ament_cmake", "ament_cmake_pytest", "rosidl_default_generators"}


def imported_names(files: Iterable[Path], package: str) -> set[str]:
    """The packages that these files of a package import, except itself and Python's own."""
    found = set()
    for file in files:
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                found |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                found.add((node.module or "").partition(".")[0])
    return found - set(sys.stdlib_module_names) - {package}


def imported(files: Iterable[Path], package: str) -> set[str]:
    """The rosdep keys of the packages that these files of a ROS package import."""
    names = imported_names(files, package)
    return {key for name in names if (key := ROSDEP_KEYS.get(name, name)) is not None}


def reported(package: str, *kinds: str) -> set[str]:
    """The dependencies of these kinds in package.xml."""
    document = ElementTree.parse(ROS_NODE / package / "package.xml")
    return {str(element.text) for kind in kinds for element in document.iter(kind)}


def test_pyproject_lists_what_its_packages_import() -> None:
    """FastAPI installs starlette, for example; our direct imports are listed as well."""
    extras = project()["optional-dependencies"]
    # And the packages of each extra.
    lines = [*project()["dependencies"], *extras["fleet"], *extras["science"]]
    listed = {re.split("[<>=[]", text)[0].lower() for text in lines}
    foreign = set()
    for package, folder in OWN_PACKAGES.items():
        foreign |= imported_names(folder.rglob("*.py"), package)
    foreign -= ROS | set(OWN_PACKAGES)
    distributions = packages_distributions()
    assert {distributions[name][0].lower().replace("_", "-") for name in foreign} == listed


def project() -> dict[str, Any]:
    """The metadata that pip reads."""
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    reported: dict[str, Any] = tomllib.loads(text)["project"]
    return reported


def test_every_part_has_the_same_version() -> None:
    lock = json.loads((ROOT / "package-lock.json").read_text(encoding="utf-8"))
    messages = ROS_NODE / "lupin_msgs"
    of_pip = tomllib.loads((messages / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    versions = {
        "package.json": json.loads((ROOT / "package.json").read_text(encoding="utf-8"))["version"],
        "package-lock.json": lock["version"],
        "package-lock.json, packages": lock["packages"][""]["version"],
        "frontend/openapi.json": json.loads(
            (ROOT / "frontend" / "openapi.json").read_text(encoding="utf-8")
        )["info"]["version"],
        "ros_node/lupin_msgs/pyproject.toml": of_pip["version"],
        "pyproject.toml, [ros]": next(
            text.partition("==")[2]
            for text in project()["optional-dependencies"]["ros"]
            if text.startswith("lupin-msgs==")
        ),
    }
    for package in ("lupin_msgs", *PACKAGES):
        document = ElementTree.parse(ROS_NODE / package / "package.xml")
        versions[f"ros_node/{package}/package.xml"] = document.findtext("version")
    assert {name: it for name, it in versions.items() if it != __version__} == {}


def test_the_oldest_node_is_the_same_everywhere() -> None:
    manifest = json.loads((ROOT / "package.json").read_text(encoding="utf-8"))
    lock = json.loads((ROOT / "package-lock.json").read_text(encoding="utf-8"))
    floor = manifest["engines"]["node"].removeprefix(">=")
    assert lock["packages"][""]["engines"] == manifest["engines"]
    for name in (".ci/preflight", "README.md", "docs/compatibility.md", "package.json"):
        text = (ROOT / name).read_text(encoding="utf-8")
        named = set(re.findall(r"(?:Node|Node \|) (\d+(?:\.\d+)*)", text))
        assert named == {floor}, name


@pytest.mark.parametrize(("version", "is_taken"), [("20.18.3", False), ("20.19.0", True)])
def test_set_up_refuses_an_older_node(version: str, is_taken: bool, tmp_path: Path) -> None:
    """The preflight's own check, with a Node of another version."""
    text = (ROOT / ".ci" / "preflight").read_text(encoding="utf-8")
    requested = re.search(r"node -e '(.*?)'", text, re.DOTALL)[1]  # type: ignore[index]
    made = f"Object.defineProperty(process, 'versions', {{value: {{node: '{version}'}}}});"
    done = subprocess.run(["node", "-e", made + requested], cwd=tmp_path, check=False)
    assert (done.returncode == 0) == is_taken


@pytest.mark.parametrize("package", PACKAGES)
def test_package_xml_lists_exactly_what_is_imported(package: str) -> None:
    folder = ROS_NODE / package
    tests = set((folder / "test").rglob("*.py"))
    files = set(folder.rglob("*.py")) - tests - {folder / "setup.py"}
    assert reported(package, "exec_depend") == imported(files, package)
    assert reported(package, "test_depend") == (
        imported(tests, package) - reported(package, "exec_depend") | {"python3-pytest"}
    )


def test_package_xml_of_the_messages_lists_what_they_and_their_build_use() -> None:
    folder = ROS_NODE / "lupin_msgs"
    definitions = "".join(
        file.read_text(encoding="utf-8") for file in folder.glob("[ms][sr][gv]/*.[ms][sr][gv]")
    )
    used = set(re.findall(r"^(\w+)/\w+", definitions, re.MULTILINE))
    cmake = (folder / "CMakeLists.txt").read_text(encoding="utf-8")
    assert reported("lupin_msgs", "depend") == used
    assert set(re.findall(r"find_package\((\w+)", cmake)) == used | OF_CMAKE
    assert reported("lupin_msgs", "buildtool_depend", "test_depend") == OF_CMAKE | {
        "python3-pytest"
    }
    assert set(re.search(r"DEPENDENCIES (.*)", cmake)[1].split()) == used  # type: ignore[index]


def test_each_package_has_tests_of_its_own_that_need_nothing_of_the_repository(
    tmp_path: Path,
) -> None:
    folders = []
    for package in ("lupin_msgs", *PACKAGES):
        copy = tmp_path / package
        ignored = shutil.ignore_patterns("__pycache__", "build", "*.egg-info")
        shutil.copytree(ROS_NODE / package, copy, ignore=ignored)
        folders.append(f"{package}/test")
    # `-c`: a robot's workspace has no configuration of ours.
    command = [sys.executable, "-m", "pytest", "-q", "-c", os.devnull, "--rootdir=.", *folders]
    env = os.environ | {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    done = subprocess.run(
        command, cwd=tmp_path, env=env, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "skipped" not in done.stdout


@pytest.mark.parametrize(
    ("package", "executables"),
    [("lupin_twin", {"twin_node", "adapt"}), ("lupin_patrol", {"patrol_node"})],
)
def test_all_of_a_package_is_installed_where_ros2_looks_and_runs(
    package: str, executables: set[str], tmp_path: Path
) -> None:
    """Installed as colcon does; `ros2 run` takes it from lib/PACKAGE of the prefix in the index."""
    source, prefix = tmp_path / "source", tmp_path / "prefix"
    shutil.copytree(ROS_NODE / package, source)
    install = ("install", "--single-version-externally-managed", "--record", "record.txt")
    command = [sys.executable, "setup.py", "build", *install, "--prefix", str(prefix)]
    subprocess.run(command, cwd=source, check=True, capture_output=True)
    assert (prefix / "share/ament_index/resource_index/packages" / package).is_file()
    share = prefix / "share" / package
    shared = {
        path.relative_to(source)
        for folder in ("launch", "config", "rviz")
        for path in (source / folder).glob("*")
        if path.is_file()
    }
    files = {path.relative_to(share) for path in share.rglob("*") if path.is_file()}
    assert files == {Path("package.xml"), *shared}
    (own,) = prefix.glob("lib/python3*/site-packages")
    (installed,) = distributions(path=[str(own)])
    document = ElementTree.parse(share / "package.xml")
    assert installed.name.replace("-", "_") == package == document.findtext("name")
    for field in ("version", "license"):
        assert installed.metadata[field] == document.findtext(field)
    assert all(callable(script.load()) for script in installed.entry_points)
    found = list((prefix / "lib" / package).iterdir())
    assert {path.name for path in found if os.access(path, os.X_OK)} == executables
    if "adapt" in executables:
        env = {**os.environ, "PYTHONPATH": str(own)}
        command = [str(prefix / "lib" / package / "adapt"), "--help"]
        reported = subprocess.run(command, env=env, capture_output=True, text=True, check=True)
        assert "usage: adapt [-h] [--config FILE] [--check]" in reported.stdout


MAX_LINES = 450
HAND_WRITTEN = {
    "backend": ("*.py", "*.html", "*.css", "*.js"),
    "ros_node": ("*.py",),
    "tests": ("*.py", "*.mjs", "*.js"),
    "frontend/src": ("*.ts", "*.tsx", "*.css"),
    "frontend/scripts": ("*.mjs",),
}
# Generated, or built.
NOT_BY_HAND = (
    "frontend/src/contract/openapi.gen.ts",
    "backend/lupin_bridge/static/",
    "backend/lupin_bridge/guide/",
)


def test_no_hand_written_file_is_too_long() -> None:
    long = {}
    for folder, patterns in HAND_WRITTEN.items():
        for file in (file for pattern in patterns for file in (ROOT / folder).rglob(pattern)):
            path = file.relative_to(ROOT).as_posix()
            lines = len(file.read_text(encoding="utf-8").splitlines())
            if lines > MAX_LINES and not path.startswith(NOT_BY_HAND):
                long[path] = lines
    assert long == {}, f"more than {MAX_LINES} lines"


def commands_of(*target: str) -> str:
    """The commands of a target, none of them run."""
    own = ("MAKEFLAGS", "MFLAGS", "MAKELEVEL")
    result = subprocess.run(
        ["make", "--dry-run", "--no-print-directory", *target],
        capture_output=True, text=True, check=True, cwd=ROOT,
        env={name: value for name, value in os.environ.items() if name not in own},
    )  # fmt: skip
    return result.stdout


def test_every_check_is_part_of_make_test_and_two_run_at_a_time() -> None:
    lines = commands_of("test")
    for command in (
        "ruff check",
        "ruff format --check",
        "lint-imports",
        "npm run --silent lint\n",  # of all files
        "npm run --silent format:check",
        "mypy",
        "npm run --silent typecheck",
        "npm run --silent types:check",
        "npm run --silent test",
        "npm run --silent size",
        "pytest",
        "-j 2 --output-sync=target lint types docs hmi-test collect",
    ):
        assert command in lines
    assert "-j 2 --output-sync=target quick lint types hmi-test" in commands_of("check")


def test_a_warning_ends_the_build_of_the_guide() -> None:
    assert "sphinx-build --quiet -n -W " in commands_of("--what-if=docs/conf.py", "docs")


def test_processes_of_the_tests_compile_no_module_again() -> None:
    lines = [line for line in commands_of("test", "quick").splitlines() if "/pytest " in line]
    assert len(lines) == 3
    assert all(line.startswith("PYTHONDONTWRITEBYTECODE= ") for line in lines)
