"""What the launch file's arguments make of a twin."""

import runpy
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import ament_index_python.packages
import pytest

from lupin_twin.core.parameters import ARGUMENTS, ParameterError

SHARE = Path("ros_node/lupin_twin")
NOT_GIVEN = {argument.name: argument.default for argument in ARGUMENTS}


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
    given = {"namespace": "gh1", "use_sim_time": "false", "journal": "off"}
    given |= {"layers": "temperature, co2,", "log_level": "rcl:=debug"}
    assert twin(NOT_GIVEN | given) == [
        {
            "package": "lupin_twin",
            "executable": "twin_node",
            "name": "lupin_twin",
            "namespace": "gh1",
            "output": "screen",
            "parameters": [
                file,
                {
                    "use_sim_time": (False, bool),
                    "journal": ("off", str),
                    "layers": (["temperature", "co2"], list[str]),
                },
            ],
            "ros_arguments": ["--log-level", "rcl:=debug"],
        }
    ]
    with pytest.raises(ParameterError, match=r"params_file is '/no\.yaml'"):
        twin(NOT_GIVEN | {"params_file": "/no.yaml"})
