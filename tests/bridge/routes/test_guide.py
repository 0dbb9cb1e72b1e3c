"""`/docs/guide/`: the built guide, or how to build it; its styles have their own rule."""

from pathlib import Path

import httpx
import pytest

from lupin_bridge.app import create_app
from lupin_bridge.stream.schema import ErrorMessage
from tests.bridge.test_app import request

PAGE = "<!doctype html><title>Guide</title><style>b {}</style>"


@pytest.fixture
def built(tmp_path: Path) -> Path:
    folder = tmp_path / "guide"
    (folder / "how-to").mkdir(parents=True)
    (folder / "index.html").write_text(PAGE)
    (folder / "how-to" / "server.html").write_text(PAGE)
    (tmp_path / "secret.txt").write_text("secret")
    return folder


def query(guide_folder: Path, path: str, method: str = "GET", prefix: str = "") -> httpx.Response:
    return request(create_app(None, guide_folder=guide_folder), method, path, prefix)


@pytest.mark.parametrize("path", ["/docs/guide/", "/docs/guide/how-to/server.html"])
def test_a_page_may_have_its_own_styles_and_no_script(built: Path, path: str) -> None:
    answer = query(built, path)
    assert (answer.status_code, answer.text) == (200, PAGE)
    policy = answer.headers["content-security-policy"].split("; ")
    rules = dict(rule.split(" ", 1) for rule in policy)
    assert rules["style-src"] == "'self' 'unsafe-inline'"
    assert rules["default-src"] == "'self'"
    assert "script-src" not in rules
    assert answer.headers["x-content-type-options"] == "nosniff"


def test_only_the_guide_may_have_its_own_styles(built: Path) -> None:
    for path in ("/docs", "/", "/docs/nowhere"):
        assert "unsafe-inline" not in query(built, path).headers["content-security-policy"]


@pytest.mark.parametrize("prefix", ["", "/gh1"])
def test_without_its_slash_it_redirects(built: Path, prefix: str) -> None:
    answer = query(built, f"{prefix}/docs/guide", prefix=prefix)
    assert answer.is_redirect
    assert answer.headers["location"] == f"{prefix}/docs/guide/"


@pytest.mark.parametrize("prefix", ["", "/gh1"])
@pytest.mark.parametrize("path", ["/docs/guide/nowhere.html", "/docs/guide/..%2fsecret.txt"])
def test_nothing_else_is_served_and_the_answer_says_where_to_look(
    built: Path, path: str, prefix: str
) -> None:
    answer = query(built, f"{prefix}{path}", prefix=prefix)
    assert answer.status_code == 404
    assert answer.json()["detail"].endswith(f"; see {prefix}/docs")


def test_it_can_only_be_read(built: Path) -> None:
    assert query(built, "/docs/guide/", "POST").status_code == 405
    assert query(built, "/docs/guide/", "HEAD").text == ""


@pytest.mark.parametrize("path", ["/docs/guide/", "/docs/guide/how-to/server.html"])
def test_a_guide_that_is_not_built_says_how_to_build_it(tmp_path: Path, path: str) -> None:
    answer = query(tmp_path, path)
    assert answer.status_code == 404
    assert "make docs" in ErrorMessage.model_validate_json(answer.content).detail
