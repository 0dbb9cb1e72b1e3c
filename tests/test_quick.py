"""What `make check` runs: all that needs neither ROS nor a browser, and nothing that does."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.needs import OUTSIDE, TESTS, is_quick

FILES = sorted(TESTS.rglob("test_*.py"))


@pytest.mark.parametrize(
    ("name", "quick"),
    [
        ("twin/field/test_idw.py", True),
        ("twin/ros/test_node.py", False),  # imports rclpy
        ("bridge/access/test_policy.py", True),
        ("bridge/access/test_middleware.py", False),  # starts a bridge
        ("bridge/test_settings.py", True),
        ("bridge/test_supervisor.py", False),
        ("browser/test_house.py", False),
        ("test_deploy.py", False),  # asks systemd
        ("test_docs.py", True),  # the command's module, which imports ROS when it runs
        ("test_live_nginx.py", False),
        ("test_structure_lengths.py", True),
        ("browser", False),
        ("bridge", True),
    ],
)
def test_what_a_file_needs_is_read_off_its_imports(name: str, quick: bool) -> None:
    assert is_quick(TESTS / name) == quick


def test_a_need_is_found_through_any_module_and_not_in_functions(tmp_path: Path) -> None:
    for text, quick in (
        ("import numpy", True),
        ("import rclpy.node", False),
        ("from tests.support import processes", False),
        ("from tests.support.web import bridge", False),
        ("from lupin_bridge.cli import roles", False),
        ("try:\n    import rclpy\nexcept ImportError:\n    pass", False),
        ("def test():\n    import rclpy", True),
    ):
        file = tmp_path / f"{len(list(tmp_path.iterdir()))}.py"
        file.write_text(text, encoding="utf-8")
        assert is_quick(file) == quick, text


def test_a_good_part_is_quick_and_none_of_it_is_lost() -> None:
    quick = [file for file in FILES if is_quick(file)]
    assert len(FILES) / 3 < len(quick) < len(FILES)
    # Into a folder that is not quick pytest does not even look.
    folders = {folder for file in quick for folder in file.parents if folder.is_relative_to(TESTS)}
    assert [folder for folder in folders if not is_quick(folder)] == []


def test_what_is_not_to_be_had_cannot_be_imported_by_a_quick_test() -> None:
    script = (
        "from importlib import import_module\n"
        "from tests.support.needs import OUTSIDE, let_nothing_in\n"
        "let_nothing_in()\n"
        "for name in OUTSIDE:\n"
        "    try:\n"
        "        import_module(name)\n"
        "    except ImportError as error:\n"
        "        print(error)\n"
    )
    result = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True,
        cwd=TESTS.parent,
    )  # fmt: skip
    expected = {f"{name} is not for the quick tests (tests/support/needs.py)" for name in OUTSIDE}
    assert set(result.stdout.splitlines()) == expected
