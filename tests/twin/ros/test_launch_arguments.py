"""What the launch file's arguments make of a twin."""

import runpy
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import ament_index_python.packages
import pytest

from lupin_twin.core.parameters import ARGUMENTS, LaunchError, overrides, params_file

SHARE = Path("ros_node/lupin_twin")
NOT_GIVEN = {argument.name: argument.default for argument in ARGUMENTS}


def test_an_omitted_argument_overrides_nothing() -> None:
    assert overrides(NOT_GIVEN) == {}


def test_a_given_argument_overrides_the_file_with_its_type() -> None:
    given = {"use_sim_time": "false", "journal": "off", "layers": "temperature, co2,"}
    assert overrides(NOT_GIVEN | given) == {
        "use_sim_time": False,
        "journal": "off",
        "layers": ["temperature", "co2"],
    }
    assert overrides(NOT_GIVEN | {"use_sim_time": "true"}) == {"use_sim_time": True}


def test_a_missing_file_is_refused_by_name() -> None:
    given = NOT_GIVEN | {"params_file": "/no.yaml"}
    with pytest.raises(LaunchError, match=r"params_file is '/no\.yaml', expected an existing file"):
        params_file(given, "twin.yaml", lambda path: path == "twin.yaml")
    assert params_file(given, "twin.yaml", lambda path: path == "/no.yaml") == "/no.yaml"


def described(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """The launch file's content, by a stand-in: PyPI has no `launch`, which reads it."""

    def stand_in(name: str, **contents: Any) -> None:
        module = ModuleType(name)
        vars(module).update(contents)
        monkeypatch.setitem(sys.modules, name, module)

    def configuration(name: str) -> Any:
        return SimpleNamespace(perform=lambda given: given[name])

    stand_in("launch", LaunchContext=dict, LaunchDescription=list)
    stand_in(
        "launch.actions",
        DeclareLaunchArgument=lambda name, **more: (name, more),
        OpaqueFunction=lambda function: function,
    )
    stand_in("launch.substitutions", LaunchConfiguration=configuration)
    stand_in("launch_ros")
    stand_in("launch_ros.actions", Node=dict)
    stand_in(
        "launch_ros.parameter_descriptions",
        ParameterValue=lambda *it, value_type: (*it, value_type),
    )
    monkeypatch.setattr(
        ament_index_python.packages, "get_package_share_directory", {"lupin_twin": SHARE}.get
    )
    found: list[Any] = runpy.run_path(str(SHARE / "launch/twin.launch.py"))[
        "generate_launch_description"
    ]()
    return found


def test_the_launch_file_starts_the_twin_with_the_given_arguments(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    *declared, twin = described(monkeypatch)
    assert declared == [
        (
            one.name,
            {"default_value": one.default, "description": one.description, "choices": one.choices},
        )
        for one in ARGUMENTS
    ]
    file = str(SHARE / "config/twin.yaml")
    [plain] = twin(NOT_GIVEN)
    assert (plain["parameters"], plain["namespace"]) == ([file], "")
    given = {"namespace": "gh1", "layers": "co2", "journal": "off", "log_level": "rcl:=debug"}
    assert twin(NOT_GIVEN | given) == [
        {
            "package": "lupin_twin",
            "executable": "twin_node",
            "name": "lupin_twin",
            "namespace": "gh1",
            "output": "screen",
            "parameters": [file, {"journal": ("off", str), "layers": (["co2"], list[str])}],
            "ros_arguments": ["--log-level", "rcl:=debug"],
        }
    ]
    with pytest.raises(LaunchError, match=r"params_file is '/no\.yaml'"):
        twin(NOT_GIVEN | {"params_file": "/no.yaml"})
