"""Tests of the built messages: every file is listed, generated and usable from Python."""

from __future__ import annotations

import importlib
import re
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1]
LISTED = re.findall(
    r"^  ((?:msg|srv)/\w+\.(?:msg|srv))$",
    (PACKAGE / "CMakeLists.txt").read_text(encoding="utf-8"),
    re.MULTILINE,
)


def test_every_definition_is_listed() -> None:
    files = [*PACKAGE.glob("msg/*.msg"), *PACKAGE.glob("srv/*.srv")]
    assert sorted(LISTED) == sorted(file.relative_to(PACKAGE).as_posix() for file in files)


@pytest.mark.parametrize("definition", LISTED)
def test_it_can_be_made_and_has_the_fields_of_its_definition_in_their_order(
    definition: str,
) -> None:
    folder, name = Path(definition).parent.name, Path(definition).stem
    made = getattr(importlib.import_module(f"lupin_msgs.{folder}"), name)
    parts = (PACKAGE / definition).read_text(encoding="utf-8").split("\n---\n")
    kinds = [made] if folder == "msg" else [made.Request, made.Response]
    for text, kind in zip(parts, kinds, strict=True):
        fields = re.findall(r"^[\w/<>=\[\]]+ +([a-z]\w*)\s*(?:#.*)?$", text, re.MULTILINE)
        assert [slot.lstrip("_") for slot in kind().get_fields_and_field_types()] == fields
