"""The hand-written pages: README.md and `docs/`; their links, words and blocks of code.

docs/contribute/docs.md describes how blocks are marked.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
GENERATED = DOCS / "reference"
_FENCE = re.compile(
    r"^(?P<indent> *)(?P<fence>```+|~~~+)(?P<info>[^\n`]*)\n(?P<text>.*?)^(?P=indent)(?P=fence) *$",
    re.MULTILINE | re.DOTALL,
)


def pages() -> list[Path]:
    """README.md and every page of `docs/` that is not generated."""
    written = (file for file in DOCS.rglob("*.md") if not file.is_relative_to(GENERATED))
    return [ROOT / "README.md", *sorted(written)]


def name_of(page: Path) -> str:
    """A page's path from the root: for the ids of tests."""
    return page.relative_to(ROOT).as_posix()


@dataclass(frozen=True, slots=True)
class Block:
    """A block of code: its place, its language, its marks (`run`, `name=…`) and its text."""

    page: Path
    line: int
    language: str
    marks: frozenset[str]
    text: str

    def __str__(self) -> str:
        return f"{name_of(self.page)}:{self.line}"


def blocks(page: Path) -> Iterator[Block]:
    """The blocks of code of a page."""
    text = page.read_text(encoding="utf-8")
    for found in _FENCE.finditer(text):
        language, *marks = found["info"].split() or [""]
        line = text.count("\n", 0, found.start()) + 1
        body = re.sub(rf"^{found['indent']}", "", found["text"], flags=re.MULTILINE)
        yield Block(page, line, language, frozenset(marks), body)


def block_named(name: str) -> Block:
    """The only block of all pages with this name."""
    [block] = [it for page in pages() for it in blocks(page) if f"name={name}" in it.marks]
    return block


def without_blocks(page: Path) -> str:
    """A page's text, with an empty line for each line of a block."""
    text = page.read_text(encoding="utf-8")
    return _FENCE.sub(lambda found: "\n" * found.group().count("\n"), text)
