"""The imports as they are, read off the modules' text."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from typing import NamedTuple

from tests.support.structure import PACKAGES


class Arrow(NamedTuple):
    """One import: the module (`package.module`), what it imports, and in which line."""

    source: str
    target: str
    line: int

    @property
    def package(self) -> str:
        return self.source.partition(".")[0]

    @property
    def module(self) -> str:
        return self.source.partition(".")[2]

    @property
    def top(self) -> str:
        """The package that is imported from."""
        return self.target.partition(".")[0]

    def __str__(self) -> str:
        return f"{self.source} -> {self.target} (line {self.line})"


def arrows_in(source: str, text: str) -> Iterator[Arrow]:
    """Every import in a module's text, those in functions and for type checkers included."""
    package = source.rpartition(".")[0]
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield Arrow(source, alias.name, node.lineno)
        elif isinstance(node, ast.ImportFrom):
            module = node.module or ""
            if node.level:
                module = ".".join(filter(None, [package, module]))
            for alias in node.names:
                # `from package import module` and `from package.module import name` alike.
                yield Arrow(source, f"{module}.{alias.name}", node.lineno)


def modules(package: str) -> dict[str, str]:
    """The text of a package's modules, by `package.folder.module`; a folder's own is its name."""
    found = {}
    for file in sorted(PACKAGES[package].rglob("*.py")):
        parts = file.relative_to(PACKAGES[package]).with_suffix("").parts
        if parts != ("__init__",):
            name = ".".join((package, *(part for part in parts if part != "__init__")))
            found[name] = file.read_text(encoding="utf-8")
    return found


MODULES = {name: text for package in PACKAGES for name, text in modules(package).items()}


def project_module(target: str) -> str | None:
    """The project's module that an import names, None where it is of no module of ours."""
    parts = target.split(".")
    names = (".".join(parts[:length]) for length in range(len(parts), 1, -1))
    return next((name for name in names if name in MODULES), None)


def room(name: str) -> str:
    """The room of the bridge that a module (`lupin_bridge.room.module`) stands in."""
    return name.split(".")[1]


@cache
def all_arrows() -> tuple[Arrow, ...]:
    """Every import of every module of ours."""
    return tuple(arrow for name, text in MODULES.items() for arrow in arrows_in(name, text))


@cache
def to_ours() -> dict[str, dict[str, Arrow]]:
    """By module: the modules of ours that it imports, each with an import that does."""
    found: dict[str, dict[str, Arrow]] = {name: {} for name in MODULES}
    for arrow in all_arrows():
        if module := project_module(arrow.target):
            found[arrow.source][module] = arrow
    return found
