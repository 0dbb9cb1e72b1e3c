"""Parameters as ROS and the launch file pass them on; real nodes, in this process."""

import runpy
import sys
from contextlib import AbstractContextManager
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import ament_index_python.packages
import pytest
from builtin_interfaces.msg import Time
from rclpy.node import Node
from rclpy.parameter import Parameter

from lupin_twin.core.parameters import ARGUMENTS, ParameterError, TwinParameters
from lupin_twin.ros.parameters import AdjustableNode, declare, naming, naming_own_parameters
from tests.support.ros import node_in


def node_with(domain: int, *overrides: str, made: Any = Node) -> AbstractContextManager[Any]:
    arguments = [word for override in overrides for word in ("-p", override)]
    return node_in(domain, lambda it: made("any", context=it), "--ros-args", *arguments)


def test_all_are_declared_and_set_values_are_read(domain: int) -> None:
    with node_with(domain, "idw_power:=3", "state_topic:=/s") as node:
        assert declare(node) == TwinParameters(idw_power=3.0, state_topic="/s")


def test_descriptors_have_meaning_range_and_why_a_parameter_is_read_only(domain: int) -> None:
    with node_with(domain) as node:
        declare(node)
        power, length, journal = node.describe_parameters(["idw_power", "buffer_len", "journal"])
    assert "weights" in power.description
    [limits] = power.floating_point_range
    assert (limits.from_value, limits.to_value) == (0.01, 100.0)
    assert (power.read_only, power.additional_constraints) == (False, "")
    [whole] = length.integer_range
    assert (whole.from_value, whole.to_value, length.read_only) == (1, 10_000, True)
    assert journal.additional_constraints.startswith("read only: memory and files were set up")


def test_a_change_is_reported_once_with_all_parameters(domain: int) -> None:
    reported: list[TwinParameters] = []
    with node_with(domain, made=AdjustableNode) as node:
        node.parameters = declare(node)
        node.adjust = reported.append
        wanted = [Parameter("idw_power", value=3), Parameter("idw_max_distance_m", value=2.5)]
        assert node.set_parameters_atomically(wanted).successful
        assert node.set_parameters_atomically(wanted).successful, "and nothing is new"
        assert node.get_parameter("idw_power").value == 3
        # ROS's own, and those of any other node.
        [result] = node.set_parameters([Parameter("use_sim_time", value=False)])
        assert result.successful
    assert reported == [TwinParameters(idw_power=3.0, idw_max_distance_m=2.5)]


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("idw_power", 100.5, "parameter idw_power is 100.5, expected 0.01 to 100.0"),
        ("idw_power", "two", "parameter idw_power is 'two' (str), expected float"),
        ("idw_power", None, "parameter idw_power is None (NoneType), expected float"),
        (
            "buffer_len",
            5,
            "parameter buffer_len is 32 and cannot become 5 while the twin runs: memory",
        ),
    ],
)
def test_a_refused_change_changes_nothing_and_names_parameter_value_and_limit(
    domain: int, name: str, value: Any, reason: str
) -> None:
    with node_with(domain, made=AdjustableNode) as node:
        node.parameters = declare(node)
        node.adjust = lambda _: pytest.fail("it was notified")
        good = Parameter("idw_max_distance_m", value=9.0)
        result = node.set_parameters_atomically([good, Parameter(name, value=value)])
        assert not result.successful
        assert result.reason.startswith(reason)
        assert node.parameters == TwinParameters()
        for one in ("idw_max_distance_m", name):
            assert node.get_parameter(one).value == getattr(TwinParameters(), one)


def test_parameters_that_a_second_node_reads_are_validated_too(domain: int) -> None:
    with (
        node_with(domain, "idw_power:=abc") as node,
        pytest.raises(ParameterError, match="parameter idw_power is 'abc'"),
    ):
        declare(node, ["buffer_len"])


@pytest.mark.parametrize(
    ("name", "why"), [("a b", "Invalid topic name"), ("{a}", "topic name '{a}' is invalid")]
)
def test_an_error_about_a_name_names_the_parameter(domain: int, name: str, why: str) -> None:
    with (
        node_with(domain) as node,
        pytest.raises(ParameterError, match=f"parameter map_topic is '{name}': {why}"),
        naming("map_topic", name),
    ):
        node.create_subscription(Time, name, lambda _: None, 1)


def test_an_error_about_a_parameter_of_ros_names_it(domain: int) -> None:
    with (
        pytest.raises(
            ParameterError, match="parameter start_type_description_service is not a bool"
        ),
        naming_own_parameters(),
        node_with(domain, "start_type_description_service:=5"),
    ):
        pass


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
