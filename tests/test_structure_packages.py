"""What a robot's tools read: dependencies that are really used, files that are really there."""

from __future__ import annotations

import ast
import re
import sys
from pathlib import Path
from types import ModuleType
from typing import Any
from xml.etree import ElementTree

import pytest

ROS_NODE = Path(__file__).parents[1] / "ros_node"
PACKAGES = ("lupin_twin", "lupin_patrol")
# How rosdep calls what Python calls otherwise; None: rosdep does not know it.
ROSDEP_KEYS = {"numpy": "python3-numpy", "greenhouse_sim": None}


def imported(package: str) -> set[str]:
    """The packages that the modules and launch files of a ROS package import from."""
    found = set()
    for file in (ROS_NODE / package).rglob("*.py"):
        if file.name == "setup.py":
            continue
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                found |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                found.add((node.module or "").partition(".")[0])
    return found - set(sys.stdlib_module_names) - {package}


@pytest.mark.parametrize("package", PACKAGES)
def test_package_xml_lists_what_is_imported_and_nothing_else(package: str) -> None:
    document = ElementTree.parse(ROS_NODE / package / "package.xml")
    keys = {ROSDEP_KEYS.get(name, name) for name in imported(package)} - {None}
    assert {element.text for element in document.iter("exec_depend")} == keys


@pytest.fixture
def set_up(monkeypatch: pytest.MonkeyPatch) -> Any:
    """What a package's setup.py hands to setuptools."""

    def run(package: str) -> dict[str, Any]:
        told: dict[str, Any] = {}
        setuptools = ModuleType("setuptools")  # the real one would set up this process
        setuptools.setup = lambda **arguments: told.update(arguments)  # type: ignore[attr-defined]
        setuptools.find_packages = list  # type: ignore[attr-defined]
        monkeypatch.setitem(sys.modules, "setuptools", setuptools)
        monkeypatch.chdir(ROS_NODE / package)
        exec(compile(Path("setup.py").read_text(encoding="utf-8"), "setup.py", "exec"), {})
        return told

    return run


@pytest.mark.parametrize("package", PACKAGES)
def test_every_file_of_a_package_is_there_and_every_one_is_installed(
    package: str, set_up: Any
) -> None:
    installed = {file: to for to, files in set_up(package)["data_files"] for file in files}
    assert [file for file in installed if not Path(file).is_file()] == []
    assert installed.pop(f"resource/{package}") == "share/ament_index/resource_index/packages"
    assert installed.pop("package.xml") == f"share/{package}"
    shared = [p.as_posix() for d in ("launch", "config") for p in Path(d).glob("*") if p.is_file()]
    assert installed == {file: f"share/{package}/{Path(file).parent}" for file in shared}


@pytest.mark.parametrize("package", PACKAGES)
def test_names_versions_and_commands_agree(package: str, set_up: Any) -> None:
    told = set_up(package)
    document = ElementTree.parse("package.xml")
    for field in ("name", "version", "license"):
        assert told[field] == document.findtext(field)
    for script in told["entry_points"]["console_scripts"]:
        module, function = re.fullmatch(r"\w+ = ([\w.]+):(\w+)", script).groups()  # type: ignore[union-attr]
        source = Path(f"{module.replace('.', '/')}.py").read_text(encoding="utf-8")
        assert f"def {function}(" in source


class Launched:
    """Stands in for everything of `launch` and `launch_ros`, which are not to be had from PyPI."""

    def __init__(self, *args: Any, **named: Any) -> None:
        self.args, self.named = args, named

    def perform(self, given: dict[str, str]) -> str:
        """What a LaunchConfiguration does: the value of the argument, its default without."""
        return given[self.args[0]]


def launched(monkeypatch: pytest.MonkeyPatch, **given: str) -> dict[str, Any]:
    """The arguments of the node that the launch file starts."""
    for name in (
        "ament_index_python", "ament_index_python.packages", "launch", "launch.actions",
        "launch.substitutions", "launch_ros", "launch_ros.actions",
    ):  # fmt: skip
        module = ModuleType(name)
        module.__getattr__ = lambda _: Launched  # type: ignore[method-assign]
        monkeypatch.setitem(sys.modules, name, module)
    sys.modules["ament_index_python.packages"].get_package_share_directory = lambda _: "/share"  # type: ignore[attr-defined]
    file = ROS_NODE / "lupin_twin" / "launch" / "twin.launch.py"
    scope: dict[str, Any] = {"__name__": "twin_launch"}
    exec(compile(file.read_text(encoding="utf-8"), str(file), "exec"), scope)
    [*arguments, function] = scope["generate_launch_description"]().args[0]
    values = {argument.args[0]: argument.named["default_value"] for argument in arguments}
    [node] = function.named["function"](values | given)
    named: dict[str, Any] = node.named
    return named


def test_launched_alone_the_parameters_are_the_files(monkeypatch: pytest.MonkeyPatch) -> None:
    node = launched(monkeypatch)
    [file] = node["parameters"]
    assert (file.args[0], node["executable"]) == ("params_file", "twin_node")


@pytest.mark.parametrize("value", ["true", "false"])
def test_launched_with_use_sim_time_it_comes_after_the_file(
    monkeypatch: pytest.MonkeyPatch, value: str
) -> None:
    _, override = launched(monkeypatch, use_sim_time=value)["parameters"]
    assert list(override) == ["use_sim_time"]
