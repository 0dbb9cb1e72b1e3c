"""Start the twin: `ros2 launch lupin_twin twin.launch.py [namespace:=gh1] [use_sim_time:=true]`.

`ros2 launch lupin_twin twin.launch.py --show-args` lists the arguments.
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
    """Describe one node, with parameters from a file and from launch arguments."""
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
    """Return the node. Its parameters are the file's, overridden by the given arguments."""
    given = {a.name: LaunchConfiguration(a.name).perform(context) for a in ARGUMENTS}
    default = Path(get_package_share_directory("lupin_twin")) / "config" / "twin.yaml"
    parameters = [params_file(given, str(default), lambda path: Path(path).is_file())]
    if changed := overrides(given):
        # With their types: launch would parse a text as YAML, and turn `off` into false.
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


def typed(value: bool | str | list[str]) -> ParameterValue:
    """Wrap a value with its type, so that launch does not parse it as YAML."""
    return ParameterValue(value, value_type=list[str] if isinstance(value, list) else type(value))
