"""Start the twin: `ros2 launch lupin_twin twin.launch.py [namespace:=gh1] [use_sim_time:=true]`.

`ros2 launch lupin_twin twin.launch.py --show-args` lists what can be given.
"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from launch import LaunchContext, LaunchDescription
from lupin_twin.core.parameters import ARGUMENTS, overrides, params_file


def generate_launch_description() -> LaunchDescription:
    """One node, its parameters from a file, and what of them is given here."""
    return LaunchDescription(
        [
            *(
                DeclareLaunchArgument(
                    argument.name,
                    default_value=argument.default,
                    description=argument.description,
                    choices=argument.choices,
                )
                for argument in ARGUMENTS
            ),
            OpaqueFunction(function=twin),
        ]
    )


def twin(context: LaunchContext) -> list[Node]:
    """The node. What stands after the file overrides it, so only what was given stands there."""
    given = {a.name: LaunchConfiguration(a.name).perform(context) for a in ARGUMENTS}
    default = Path(get_package_share_directory("lupin_twin")) / "config" / "twin.yaml"
    parameters = [params_file(given, str(default), lambda path: Path(path).is_file())]
    if changed := overrides(given):
        # With their types: launch would read a text as YAML, and `off` as false.
        parameters.append({name: typed(value) for name, value in changed.items()})
    return [
        Node(
            package="lupin_twin",
            executable="twin_node",
            name="lupin_twin",
            namespace=given["namespace"],
            output="screen",
            parameters=parameters,
            ros_arguments=["--log-level", given["log_level"]],
        )
    ]


def typed(value: bool | str | list[str]) -> ParameterValue:  # a value
    """The value as it is."""
    return ParameterValue(value, value_type=list[str] if isinstance(value, list) else type(value))
