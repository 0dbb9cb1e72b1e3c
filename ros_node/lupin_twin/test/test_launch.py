"""Tests of the launch file, through `launch` itself where it is installed, as on a robot."""

from __future__ import annotations

import ast
import importlib.util
from pathlib import Path

from lupin_twin.core.parameters import ARGUMENTS

FILE = Path(__file__).parents[1] / "launch" / "twin.launch.py"
ROS_HAS_LAUNCH = importlib.util.find_spec("launch_ros") is not None


def declared() -> dict[str, str]:
    """The launch file's arguments with their descriptions."""
    if not ROS_HAS_LAUNCH:
        return declared_in_the_text()
    from launch.launch_description_sources import get_launch_description_from_python_launch_file

    description = get_launch_description_from_python_launch_file(str(FILE))
    return {argument.name: argument.description for argument in description.get_launch_arguments()}


def declared_in_the_text() -> dict[str, str]:
    """The same from the source text: its only declaration goes over the entries of ARGUMENTS."""
    calls = [
        node
        for node in ast.walk(ast.parse(FILE.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call)
    ]
    [declaring] = [call for call in calls if ast.unparse(call.func) == "DeclareLaunchArgument"]
    named = {word.arg: ast.unparse(word.value) for word in declaring.keywords}
    assert (ast.unparse(declaring.args[0]), named["description"]) == (
        "argument.name",
        "argument.description",
    )
    return {argument.name: argument.description for argument in ARGUMENTS}


def test_every_argument_is_declared_and_described() -> None:
    arguments = declared()
    assert set(arguments) == {argument.name for argument in ARGUMENTS}
    assert all(len(description) > 10 for description in arguments.values())


def test_the_file_that_it_starts_with_and_the_program_are_in_the_package() -> None:
    package = FILE.parents[1]
    assert (package / "config" / "twin.yaml").is_file()
    assert "twin_node = " in (package / "setup.py").read_text(encoding="utf-8")
