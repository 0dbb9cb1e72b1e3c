"""Which tests need neither ROS nor a browser: `pytest --quick` runs them, and lets nothing else in.

Read off the imports, each test file's and those of whatever it imports: nobody keeps a list.
Imports inside of functions are not followed. Should a test get there, it fails: what the quick
tests must not need is not to be had while they run.
"""

from __future__ import annotations

import ast
import importlib.abc
import sys
from collections.abc import Iterator, Sequence
from functools import cache
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType

from tests.support.structure import PACKAGES, ROOT, ROS

TESTS = ROOT / "tests"
# A browser's driver; what starts processes of the product, which import ROS, or other programs.
OUTSIDE = ROS | {"playwright", "tests.support.processes", "tests.support.programs"}


def is_quick(file: Path) -> bool:
    """Whether a test file, or a folder of them, needs nothing from outside."""
    if file.suffix != ".py":
        return _is_inside(file / "conftest.py")
    folders = [parent for parent in file.parents if parent.is_relative_to(TESTS)]
    return all(_is_inside(path) for path in (file, *(it / "conftest.py" for it in folders)))


@cache
def _is_inside(file: Path) -> bool:
    if not file.is_file():
        return True
    seen: set[Path] = set()
    waiting = [file]
    while waiting:
        path = waiting.pop()
        if path in seen:
            continue
        seen.add(path)
        for name in _imports(path):
            if name in OUTSIDE or name.partition(".")[0] in OUTSIDE:
                return False
            waiting += _files_of(name)
    return True


@cache
def _imports(file: Path) -> tuple[str, ...]:
    """The modules that importing a file imports."""
    return tuple(_names(ast.parse(file.read_text(encoding="utf-8")).body))


def _names(body: Sequence[ast.stmt]) -> Iterator[str]:
    for node in body:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
            # Each name may be a module of the package.
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            pass
        elif isinstance(node, ast.If | ast.Try | ast.With | ast.ClassDef):
            yield from _names([it for it in ast.iter_child_nodes(node) if isinstance(it, ast.stmt)])


@cache
def _files_of(name: str) -> tuple[Path, ...]:
    """A module of ours, and the packages that it is in; none where it is not ours."""
    top, *parts = name.split(".")
    folder = TESTS if top == "tests" else PACKAGES.get(top)
    if folder is None:
        return ()
    module = folder.joinpath(*parts)
    packages = [it / "__init__.py" for it in (module, *module.parents) if it.is_relative_to(folder)]
    return tuple(file for file in (*packages, module.with_suffix(".py")) if file.is_file())


class _NothingFromOutside(importlib.abc.MetaPathFinder):
    def find_spec(
        self, name: str, path: object = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if name in OUTSIDE or name.partition(".")[0] in OUTSIDE:
            raise ImportError(f"{name} is not for the quick tests (tests/support/needs.py)")
        return None


def let_nothing_in() -> None:
    """From now on nothing of that can be imported in this process."""
    sys.meta_path.insert(0, _NothingFromOutside())
