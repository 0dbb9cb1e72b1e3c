"""ament_python package: built by colcon on a robot, by pip beside the ROS wheels."""

from setuptools import find_packages, setup

setup(
    name="lupin_twin",
    version="0.1.0",
    description="Digital twin of a greenhouse as a ROS 2 node.",
    license="Apache-2.0",
    python_requires=">=3.11",
    packages=find_packages(exclude=["test"]),
    package_data={"lupin_twin": ["py.typed"]},
    # The messages come from lupin_msgs, rclpy from ROS (apt) or the ROS wheels (PyPI): naming
    # them here would make pip look for what colcon has already built.
    install_requires=["numpy>=1.26,<3", "PyYAML>=6,<7"],
    extras_require={"test": ["pytest"]},  # tells colcon to test with pytest
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/lupin_twin"]),
        ("share/lupin_twin", ["package.xml"]),
        ("share/lupin_twin/launch", ["launch/twin.launch.py"]),
        ("share/lupin_twin/config", ["config/twin.yaml"]),
        ("share/lupin_twin/rviz", ["rviz/twin.rviz"]),
    ],
    entry_points={
        "console_scripts": [
            "twin_node = lupin_twin.cli:command",
            "adapt = lupin_twin.adapt.cli:command",
        ]
    },
)
