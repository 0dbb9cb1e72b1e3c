"""The application: its routes, its page, the guide, and what is said where a part is not built."""

import asyncio
from pathlib import Path
from typing import Any

import httpx
import pytest
from fastapi import FastAPI, Request

from lupin_bridge.app import create_app
from lupin_bridge.routes import pages
from lupin_bridge.routes.pages import HOW_TO_BUILD, language_of
from lupin_bridge.stream import schema
from lupin_bridge.stream.schema import ErrorMessage

PAGE = '<!doctype html><title>HMI</title><script type="module" src="/assets/a.js"></script>'


@pytest.fixture
def static(tmp_path: Path) -> Path:
    """A built page, and a file beside it that must not be served."""
    folder = tmp_path / "static"
    (folder / "assets").mkdir(parents=True)
    (folder / "index.html").write_text(PAGE)
    (folder / "assets" / "a.js").write_text("export {}\n")
    (tmp_path / "secret.txt").write_text("secret")
    return folder


def request(app: FastAPI, method: str, path: str, prefix: str = "") -> httpx.Response:
    """One request to an application, answered in this process."""

    async def answer() -> httpx.Response:
        transport = httpx.ASGITransport(app, root_path=prefix)
        async with httpx.AsyncClient(transport=transport, base_url="http://localhost") as client:
            return await client.request(method, path)

    return asyncio.run(answer())


def query(static_folder: Path, method: str, path: str) -> httpx.Response:
    """A request to an application without a twin."""
    return request(create_app(None, static_folder), method, path)


def test_it_describes_itself_without_a_twin_and_the_page_hides_no_route(static: Path) -> None:
    (static / "docs").write_text("a file of that name")
    assert query(static, "GET", "/docs").is_redirect
    assert query(static, "GET", "/openapi.json").status_code == 200
    for path in ("/redoc", "/docs/oauth2-redirect"):  # the framework's own
        assert query(static, "GET", path).status_code == 404


def test_the_page_and_its_files_are_served_from_the_same_origin(static: Path) -> None:
    page = query(static, "GET", "/")
    assert (page.status_code, page.text) == (200, PAGE)
    assert page.headers["content-type"].startswith("text/html")
    assert "default-src 'self'" in page.headers["content-security-policy"]
    script = query(static, "GET", "/assets/a.js")
    assert script.headers["content-type"].startswith("text/javascript")
    assert script.headers["x-content-type-options"] == "nosniff"
    assert query(static, "HEAD", "/").text == ""


@pytest.mark.parametrize(
    "path",
    [
        "/../secret.txt",
        "/%2e%2e%2fsecret.txt",
        "/%252e%252e%252fsecret.txt",
        "/assets/..%2f..%2fsecret.txt",
        "/link.txt",
        "/folder/secret.txt",
        "//etc/passwd",
        "/%2fetc%2fpasswd",
        "/assets/a.js%00.txt",
        "/" + "x/" * 60,
    ],
)
def test_nothing_outside_the_folder_is_served(static: Path, path: str) -> None:
    (static / "link.txt").symlink_to(static.parent / "secret.txt")
    (static / "folder").symlink_to(static.parent)
    answer = query(static, "GET", path)
    assert answer.status_code == 404
    assert "root:" not in answer.text
    assert "secret" not in answer.text.replace("secret.txt", "")


@pytest.mark.parametrize("built", [True, False])
@pytest.mark.parametrize("path", ["/nowhere", "/api/nowhere", "/api/field.gif", "/API/state"])
def test_a_missing_path_is_reported_in_json(static: Path, path: str, built: bool) -> None:
    answer = query(static if built else static / "nonexistent", "GET", path)
    assert answer.status_code == 404
    message = schema.ErrorMessage.model_validate_json(answer.content)
    assert message.detail == f"there is nothing at {path!r}; see /docs"
    assert answer.headers["cache-control"] == "no-store"


@pytest.mark.parametrize("built", [True, False])
def test_a_missing_websocket_is_refused_in_json(static: Path, built: bool) -> None:
    sent: list[dict[str, Any]] = []

    async def receive() -> dict[str, str]:
        return {"type": "websocket.connect"}

    async def send(message: Any) -> None:
        sent.append(message)

    scope = {
        "type": "websocket",
        "scheme": "ws",
        "path": "/ws/nope",
        "query_string": b"",
        "headers": [(b"host", b"localhost")],
        "extensions": {"websocket.http.response": {}},
    }
    asyncio.run(create_app(None, static if built else static / "none")(scope, receive, send))
    start, body = sent
    assert start["status"] == 404
    message = schema.ErrorMessage.model_validate_json(body["body"])
    assert message.detail == "there is nothing at '/ws/nope'; see /docs"


def test_a_long_path_is_shortened_in_the_answer(tmp_path: Path) -> None:
    assert len(query(tmp_path, "GET", "/" + "x" * 4_000).text) < 300


@pytest.mark.parametrize("method", ["GET", "HEAD"])
def test_the_root_says_how_to_build_the_page(tmp_path: Path, method: str) -> None:
    for folder in (tmp_path / "nowhere", tmp_path):  # an empty one is no page either
        answer = query(folder, method, "/")
        assert answer.status_code == 503
        assert answer.headers["cache-control"] == "no-store"
        assert "default-src 'self'" in answer.headers["content-security-policy"]
        assert (HOW_TO_BUILD in answer.text) == (method == "GET")


def test_the_font_is_that_of_the_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pages, "ASSETS", tmp_path)
    assert query(tmp_path, "GET", "/font.woff2").status_code == 404
    (tmp_path / "inter-1.woff2").write_bytes(b"wOF2")
    answer = query(tmp_path, "GET", "/font.woff2")
    assert (answer.status_code, answer.content) == (200, b"wOF2")
    assert answer.headers["content-type"] == "font/woff2"
    assert answer.headers["cache-control"] == "max-age=604800"


GUIDE = "<!doctype html><title>Guide</title><style>b {}</style>"


@pytest.fixture
def built(tmp_path: Path) -> Path:
    folder = tmp_path / "guide"
    (folder / "how-to").mkdir(parents=True)
    (folder / "index.html").write_text(GUIDE)
    (folder / "how-to" / "server.html").write_text(GUIDE)
    (tmp_path / "secret.txt").write_text("secret")
    return folder


def query_guide(
    guide_folder: Path, path: str, method: str = "GET", prefix: str = ""
) -> httpx.Response:
    return request(create_app(None, guide_folder=guide_folder), method, path, prefix)


@pytest.mark.parametrize("path", ["/docs/guide/", "/docs/guide/how-to/server.html"])
def test_a_page_may_have_its_own_styles_and_no_script(built: Path, path: str) -> None:
    answer = query_guide(built, path)
    assert (answer.status_code, answer.text) == (200, GUIDE)
    policy = answer.headers["content-security-policy"].split("; ")
    rules = dict(rule.split(" ", 1) for rule in policy)
    assert rules["style-src"] == "'self' 'unsafe-inline'"
    assert rules["default-src"] == "'self'"
    assert "script-src" not in rules
    assert answer.headers["x-content-type-options"] == "nosniff"


def test_only_the_guide_may_have_its_own_styles_and_it_can_only_be_read(built: Path) -> None:
    for path in ("/docs", "/", "/docs/nowhere"):
        policy = query_guide(built, path).headers["content-security-policy"]
        assert "unsafe-inline" not in policy
    assert query_guide(built, "/docs/guide/", "POST").status_code == 405
    assert query_guide(built, "/docs/guide/", "HEAD").text == ""


@pytest.mark.parametrize("prefix", ["", "/gh1"])
@pytest.mark.parametrize(("path", "to"), [("/docs/guide", ""), ("/docs", "reference/http.html")])
def test_shorter_addresses_redirect(built: Path, prefix: str, path: str, to: str) -> None:
    answer = query_guide(built, f"{prefix}{path}", prefix=prefix)
    assert answer.is_redirect
    assert answer.headers["location"] == f"{prefix}/docs/guide/{to}"


@pytest.mark.parametrize("prefix", ["", "/gh1"])
@pytest.mark.parametrize("path", ["/docs/guide/nowhere.html", "/docs/guide/..%2fsecret.txt"])
def test_nothing_else_is_served_and_the_answer_says_where_to_look(
    built: Path, path: str, prefix: str
) -> None:
    answer = query_guide(built, f"{prefix}{path}", prefix=prefix)
    assert answer.status_code == 404
    assert answer.json()["detail"].endswith(f"; see {prefix}/docs")


@pytest.mark.parametrize("path", ["/docs/guide/", "/docs/guide/how-to/server.html"])
def test_a_guide_that_is_not_built_says_how_to_build_it(tmp_path: Path, path: str) -> None:
    answer = query_guide(tmp_path, path)
    assert answer.status_code == 404
    assert "make docs" in ErrorMessage.model_validate_json(answer.content).detail


SPOKEN = ("en", "de", "nl", "es")


@pytest.mark.parametrize(
    ("requested", "accepted", "language"),
    [
        ("", "", "en"),
        ("", "de-AT,de;q=0.9,en;q=0.8", "de"),
        ("", "fr-FR, nl;q=0.7, en;q=0.6", "nl"),
        ("", "es , de", "es"),
        ("", "*", "en"),
        ("", "fr,pl;q=0.9", "en"),
        ("", ";q=1,,de;q=0.1", "de"),
        ("lang=nl", "de", "nl"),
        ("lang=DE-ch", "", "de"),
        # No variant of the browser's language either.
        ("lang=xx", "de", "en"),
        ("lang=", "de", "en"),
    ],
)
def test_the_language_is_chosen_from_accept_language(
    requested: str, accepted: str, language: str
) -> None:
    headers = [(b"accept-language", accepted.encode())]
    requested_by = Request({"type": "http", "query_string": requested.encode(), "headers": headers})
    assert language_of(requested_by, SPOKEN) == language
