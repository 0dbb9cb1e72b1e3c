"""Where the packages are. pyproject.toml has the import rules (import-linter)."""

from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = {
    "lupin_twin": ROOT / "ros_node" / "lupin_twin" / "lupin_twin",
    "lupin_patrol": ROOT / "ros_node" / "lupin_patrol" / "lupin_patrol",
    "lupin_bridge": ROOT / "backend" / "lupin_bridge",
}
# The bridge's packages: its folders, and its top-level modules.
ROOMS = {
    path.stem
    for path in PACKAGES["lupin_bridge"].iterdir()
    if (path.suffix == ".py" or (path / "__init__.py").is_file()) and path.stem != "__init__"
}
ROS = frozenset(
    {
        "rclpy",
        "lupin_msgs",
        "builtin_interfaces",
        "geometry_msgs",
        "nav_msgs",
        "diagnostic_msgs",
        "rcl_interfaces",
        "rosgraph_msgs",
        "sensor_msgs",
        "std_msgs",
        "visualization_msgs",
    }
)
