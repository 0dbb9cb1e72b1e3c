"""ament_python package: built by colcon on a robot, by pip beside the ROS wheels."""

from setuptools import find_packages, setup

setup(
    name="lupin_patrol",
    version="0.1.0",
    description="A simulated robot on patrol in a greenhouse, as a ROS 2 node.",
    license="Apache-2.0",
    python_requires=">=3.10",
    packages=find_packages(exclude=["test"]),
    package_data={"lupin_patrol": ["py.typed"]},
    # The messages come from lupin_msgs, rclpy from ROS (apt) or the ROS wheels (PyPI): naming
    # them here would make pip look for what colcon has already built.
    install_requires=["mdp-greenhouse>=1.0.8,<1.1", "numpy>=1.26,<3"],
    extras_require={"test": ["pytest"]},  # tells colcon to test with pytest
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/lupin_patrol"]),
        ("share/lupin_patrol", ["package.xml"]),
    ],
    entry_points={"console_scripts": ["patrol_node = lupin_patrol.cli:main"]},
)
