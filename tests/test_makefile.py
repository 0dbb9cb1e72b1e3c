"""What the two commands of a newcomer's run, as `make` itself would tell."""

from __future__ import annotations

import os
import subprocess
from functools import cache

import pytest

from tests.support.needs import TESTS


@cache
def told(*target: str) -> str:
    """The commands of a target, none of them run."""
    own = ("MAKEFLAGS", "MFLAGS", "MAKELEVEL")
    result = subprocess.run(
        ["make", "--dry-run", "--no-print-directory", *target],
        capture_output=True, text=True, check=True, cwd=TESTS.parent,
        env={name: value for name, value in os.environ.items() if name not in own},
    )  # fmt: skip
    return result.stdout


@pytest.mark.parametrize(
    "command",
    [
        "ruff check",
        "ruff format --check",
        "lint-imports",
        "npm run --silent lint\n",  # of all files
        "npm run --silent format:check",
        "mypy",
        "npm run --silent typecheck",
        "npm run --silent types:check",
        "npm run --silent test",
        "npm run --silent size",
        "pytest",
    ],
)
def test_every_check_is_among_those_of_make_test(command: str) -> None:
    lines = told("test").splitlines(keepends=True)
    assert any(command in line for line in lines), lines


@pytest.mark.parametrize(
    ("target", "parts"),
    [("test", "lint types docs hmi-test collect"), ("check", "quick lint types hmi-test")],
)
def test_what_keeps_no_two_cores_busy_is_run_two_at_a_time(target: str, parts: str) -> None:
    assert f"-j 2 --output-sync=target {parts}" in told(target)


def test_a_warning_ends_the_build_of_the_guide() -> None:
    assert "sphinx-build --quiet -n -W " in told("--what-if=docs/conf.py", "docs")


@pytest.mark.parametrize("target", ["unit", "quick", "collect"])
def test_what_the_tests_start_compiles_no_module_again(target: str) -> None:
    pytest_lines = [line for line in told(target).splitlines() if "/pytest " in line]
    assert pytest_lines
    assert all(line.startswith("PYTHONDONTWRITEBYTECODE= ") for line in pytest_lines)
