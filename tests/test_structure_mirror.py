"""Every module has its test file, every test file its module, and no file grows past a sitting."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
TESTS = ROOT / "tests"

# Where a package is, and the folder of its tests; folders in the one are folders in the other.
PACKAGES = {
    "ros_node/lupin_twin/lupin_twin": "twin",
    "ros_node/lupin_patrol/lupin_patrol": "patrol",
    "backend/lupin_bridge": "bridge",
}
# These test what no single module does.
ACROSS = (
    "test_deploy",
    "test_docs",
    "test_fuzz_",
    "test_install",
    "test_live_",
    "test_makefile",
    "test_quick",
    "test_roslib",
    "test_structure_",
    "test_support_",
)

MAX_LINES = 450
HAND_WRITTEN = {
    "backend": ("*.py", "*.html", "*.css", "*.js"),
    "ros_node": ("*.py",),
    "tests": ("*.py", "*.mjs"),
    "frontend/src": ("*.ts", "*.tsx", "*.css"),
    "frontend/scripts": ("*.mjs",),
}
# Generated, or built.
NOT_BY_HAND = ("frontend/src/contract/openapi.gen.ts", "backend/lupin_bridge/static/")


def modules() -> Iterator[tuple[str, str]]:
    """(module, its test file below `tests` without the suffix) of all modules."""
    for folder, tests in PACKAGES.items():
        for file in sorted((ROOT / folder).rglob("*.py")):
            if file.stem not in ("__init__", "__main__"):
                inside = file.parent.relative_to(ROOT / folder)
                mirror = Path(tests) / inside / f"test_{file.stem}"
                yield file.relative_to(ROOT).as_posix(), mirror.as_posix()


MIRRORS = dict(modules())


@pytest.mark.parametrize("module", MIRRORS)
def test_a_module_has_its_test_file(module: str) -> None:
    assert (TESTS / f"{MIRRORS[module]}.py").is_file(), f"{module} has no {MIRRORS[module]}.py"


def test_a_test_file_has_its_module() -> None:
    expected = set(MIRRORS.values())

    def has_module(name: str) -> bool:
        # A long test file may have a second part: test_<module>_<of what>.
        return name in expected or any(name.startswith(f"{mirror}_") for mirror in expected)

    found = [
        file.relative_to(TESTS).with_suffix("").as_posix()
        for tests in PACKAGES.values()
        for file in sorted((TESTS / tests).rglob("test_*.py"))
    ]
    assert [name for name in found if not has_module(name)] == []
    across = [file.stem for file in sorted(TESTS.glob("test_*.py"))]
    assert [name for name in across if not name.startswith(ACROSS)] == []


def test_no_file_written_by_hand_is_too_long_to_read_at_one_sitting() -> None:
    long = {}
    for folder, patterns in HAND_WRITTEN.items():
        for pattern in patterns:
            for file in (ROOT / folder).rglob(pattern):
                path = file.relative_to(ROOT).as_posix()
                lines = len(file.read_text(encoding="utf-8").splitlines())
                if lines > MAX_LINES and not path.startswith(NOT_BY_HAND):
                    long[path] = lines
    assert long == {}, f"more than {MAX_LINES} lines"
