"""A bridge without its page says how to get it; with one, it does not."""

from pathlib import Path

import pytest

from lupin_bridge.routes import pages
from lupin_bridge.routes.pages import HOW_TO_BUILD
from tests.bridge.test_app import query


@pytest.mark.parametrize("method", ["GET", "HEAD"])
def test_the_root_says_how_to_build_the_page(tmp_path: Path, method: str) -> None:
    for folder in (tmp_path / "nowhere", tmp_path):  # an empty one is no page either
        answer = query(folder, method, "/")
        assert answer.status_code == 503
        assert answer.headers["cache-control"] == "no-store"
        assert "default-src 'self'" in answer.headers["content-security-policy"]
        assert (HOW_TO_BUILD in answer.text) == (method == "GET")


def test_the_font_is_that_of_the_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pages, "_ASSETS", tmp_path)
    assert query(tmp_path, "GET", "/font.woff2").status_code == 404
    (tmp_path / "inter-1.woff2").write_bytes(b"wOF2")
    answer = query(tmp_path, "GET", "/font.woff2")
    assert (answer.status_code, answer.content) == (200, b"wOF2")
    assert answer.headers["content-type"] == "font/woff2"
    assert answer.headers["cache-control"] == "max-age=604800"
