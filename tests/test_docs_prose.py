"""The style of the docs: short sentences, the words of the glossary, pages of limited length."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.docs import DOCS, ROOT, name_of, pages, without_blocks

# Beside those of the guide: the files at the root, and the maps of the folders.
MORE = (
    "SECURITY.md",
    "CONTRIBUTING.md",
    "backend/README.md",
    "frontend/README.md",
    "ros_node/README.md",
    "tests/README.md",
)
EVERY_PAGE = pytest.mark.parametrize(
    "page", [*pages(), *(ROOT / name for name in MORE)], ids=name_of
)
MAX_WORDS = 25
# By folder of `docs/`, and the README.
MAX_LINES = {"how-to": 100, "explanation": 150, "README.md": 150}
# Words that are never right in these pages, with the right ones. Code may contain any of them.
INSTEAD = {
    r"houses?": "greenhouse",
    r"foretold|foretells?|foretelling": "predict, forecast",
    r"put(?:s|ting)? aside": "shelve",
    r"set(?:s|ting)? aside": "quarantine",
    r"rhythms?": "scan interval",
    r"thin(?:s|ned)? out": "delete",
    r"half[- ]made": "stale",
    r"goodbye": "shutdown, close",
    r"doorman|guests|crowd|turn(?:s|ed)? out": "connections, evict",
    r"(?:is|are|was|were|be|been) told": "reported, notified",
    r"(?:is|are|was|were|be|been|has|have|had) heard|heard (?:of|from)": "received",
    r"lately": "recently",
    r"who(?:ever)? asks|what is told|what is asked": "the client, the request",
}
SENTENCE_END = re.compile(r"(?<=[.!?])(?<!e\.g\.)(?<!i\.e\.)[\"')]*\s+")


def texts(page: Path) -> Iterator[tuple[int, str]]:
    """(Line, text) of each heading, paragraph, item of a list and cell of a table."""
    begun, waiting = 0, ""
    for number, line in enumerate([*without_blocks(page).splitlines(), ""], 1):
        text = line.strip()
        is_new = not text or re.match(r"[-*+|#:>]|\d+\. |\(.*\)=$|<", text)
        if is_new and waiting:
            yield begun, waiting
            waiting = ""
        if text.startswith("|"):
            yield from ((number, cell) for cell in re.split(r"(?<!\\)\|", text) if cell.strip())
        elif text and not re.fullmatch(r"<!--.*-->|\(.*\)=|:.*:", text):
            begun = number if not waiting else begun
            waiting = f"{waiting} {text}".strip()


def plain(text: str) -> str:
    """The text that is read: no markup, a piece of code or an address as one word."""
    text = re.sub(r"!\[[^\]]*\]\([^)]*\)|<[^>]*>", " ", text)
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", text)
    text = re.sub(r"`[^`]*`|https?://\S+", "code", text)
    return re.sub(r"^[-*+#>\s]+|^\d+\.\s|[*_]{1,2}(?=\w)|(?<=\w)[*_]{1,2}", "", text).strip()


@EVERY_PAGE
def test_a_sentence_has_at_most_25_words(page: Path) -> None:
    long = [
        f"{page.name}:{line}: {len(sentence.split())} words: {sentence}"
        for line, text in texts(page)
        for sentence in SENTENCE_END.split(plain(text))
        if len(sentence.split()) > MAX_WORDS
    ]
    assert not long, "\n".join(long)


@EVERY_PAGE
def test_the_words_are_those_of_the_field(page: Path) -> None:
    wrong = [
        f"{page.name}:{line}: {found.group()!r}, must be {better}"
        for line, text in texts(page)
        for word, better in INSTEAD.items()
        if (found := re.search(rf"\b(?:{word})\b", plain(text), re.IGNORECASE))
    ]
    assert not wrong, "\n".join(wrong)


@EVERY_PAGE
def test_a_page_has_a_limited_length(page: Path) -> None:
    inside = page.relative_to(DOCS if page.is_relative_to(DOCS) else ROOT)
    limit = MAX_LINES.get(inside.parts[0], 400)
    assert len(page.read_text(encoding="utf-8").splitlines()) <= limit


def test_the_rules_find_their_violations(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(
        "# A page\n\n- An item\n  of two lines. And `one two` more.\n\n"
        "```sh\nno text\n```\n\n| a cell | [a link](https://example.org) |\n",
        encoding="utf-8",
    )
    found = [plain(text) for _, text in texts(page)]
    assert found == ["A page", "An item of two lines. And code more.", "a cell", "a link"]
    assert len(SENTENCE_END.split("One. Two? (Three, e.g. four.) code is five.")) == 4
