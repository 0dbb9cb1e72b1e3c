"""The commands behind a newcomer's two targets, as `make` itself lists them."""

import os
import subprocess

from tests.support.structure import ROOT


def reported(*target: str) -> str:
    """The commands of a target, none of them run."""
    own = ("MAKEFLAGS", "MFLAGS", "MAKELEVEL")
    result = subprocess.run(
        ["make", "--dry-run", "--no-print-directory", *target],
        capture_output=True, text=True, check=True, cwd=ROOT,
        env={name: value for name, value in os.environ.items() if name not in own},
    )  # fmt: skip
    return result.stdout


def test_every_check_is_part_of_make_test_and_two_run_at_a_time() -> None:
    lines = reported("test")
    for command in (
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
        "-j 2 --output-sync=target lint types docs hmi-test collect",
    ):
        assert command in lines
    assert "-j 2 --output-sync=target quick lint types hmi-test" in reported("check")


def test_a_warning_ends_the_build_of_the_guide() -> None:
    assert "sphinx-build --quiet -n -W " in reported("--what-if=docs/conf.py", "docs")


def test_processes_of_the_tests_compile_no_module_again() -> None:
    lines = [line for line in reported("test", "quick").splitlines() if "/pytest " in line]
    assert len(lines) == 3
    assert all(line.startswith("PYTHONDONTWRITEBYTECODE= ") for line in lines)
