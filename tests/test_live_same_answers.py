"""The same questions, the same answers: those of the build that wrote journals of version 3."""

from __future__ import annotations

import gzip
import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from tests.support.http_answers import ask, bridges
from tests.support.journal_answers import JOURNALS, same


@pytest.mark.parametrize("name", ["day", "runs", "purged"])
def test_serve_answers_as_the_old_build_did(name: str, tmp_path: Path) -> None:
    journal = Path(shutil.copy(JOURNALS / f"{name}.sqlite", tmp_path / "j.sqlite"))
    old = json.loads(gzip.decompress((JOURNALS / f"{name}.http.json.gz").read_bytes()))
    different = []
    with bridges(journal) as (serve, _):
        for path, right in old["serve"]:
            found = ask(serve, path)
            if not same(known(plain(found), plain(right)), plain(right)):
                different.append(path)
    assert [path for path in different if not is_another(name, path)] == []


def plain(answer: list[Any]) -> list[Any]:
    """An answer with its JSON read; in which order a tag's sensors came is not told."""
    status, kind, body = answer
    if kind != "application/json":
        return answer
    # What goes by this moment stands there as a bare word.
    value = json.loads(body.replace(":now", ':"now"'))
    if isinstance(value, dict):
        tags = value.get("tags", [value])
        for tag in tags if isinstance(tags, list) else [value.get("house"), *tags.values()]:
            if isinstance(tag, dict):
                fill(tag)
    return [status, kind, value]


def fill(tag: dict[str, Any]) -> None:
    """Put back what is left out of a tag, or of its verdict, because it is as usual."""
    if "verdict" in tag:
        tag.setdefault("reasons", [])
    if "readings" not in tag or "last_observed" not in tag:
        return
    last = tag["last_observed"]
    at = last
    for reading in tag["readings"]:
        at = reading.setdefault("observed_at", at)
        reading.pop("stale_seconds", None)  # it follows from the two times
    tag["readings"].sort(key=lambda reading: reading["name"])
    usual = {"looked_at": None, "last_try": last, "last_try_status": 0, "last_try_detail": ""}
    for name, value in usual.items():
        tag.setdefault(name, value)


def known(found: Any, right: Any) -> Any:
    """An answer without the fields that have come since, and what a refusal says besides."""
    if isinstance(found, str) and isinstance(right, str) and right.startswith("no tag "):
        return found[: len(right)]
    if isinstance(found, dict) and isinstance(right, dict):
        return {name: known(found[name], right[name]) for name in right if name in found}
    if isinstance(found, list) and isinstance(right, list) and len(found) == len(right):
        return list(map(known, found, right))
    return found


def is_another(name: str, path: str) -> bool:
    """Whether another answer is right: of deleted attempts counts are kept by the hour now.

    And an estimate is another one on every processor.
    """
    if path.startswith("/api/estimate"):
        return True
    return name == "purged" and (path.startswith("/api/timeline?from") or "tag_id=%2A" in path)
