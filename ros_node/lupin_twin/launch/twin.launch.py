"""Start the twin: `ros2 launch lupin_twin twin.launch.py [namespace:=gh1] [use_sim_time:=true]`.

`params_file:=…` names a file of parameters.
"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from launch import LaunchContext, LaunchDescription


def generate_launch_description() -> LaunchDescription:
    """One node, its parameters from a file, and the clock to go by where it is given here."""
    default_params = Path(get_package_share_directory("lupin_twin")) / "config" / "twin.yaml"
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "params_file", default_value=str(default_params), description="parameters, YAML"
            ),
            DeclareLaunchArgument(
                "namespace",
                default_value="",
                description="moves the node, its topics and its services, such as gh1",
            ),
            DeclareLaunchArgument(
                "use_sim_time",
                default_value="",
                description="true follows /clock; not given: what the file says",
            ),
            OpaqueFunction(function=twin),
        ]
    )


def twin(context: LaunchContext) -> list[Node]:
    """The node. What stands after the file overrides it, so only what was given stands there."""
    parameters = [LaunchConfiguration("params_file")]
    if LaunchConfiguration("use_sim_time").perform(context):
        parameters.append({"use_sim_time": LaunchConfiguration("use_sim_time")})
    return [
        Node(
            package="lupin_twin",
            executable="twin_node",
            name="lupin_twin",
            namespace=LaunchConfiguration("namespace"),
            output="screen",
            parameters=parameters,
        )
    ]
