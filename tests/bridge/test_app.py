"""The application: its routes, and the page."""

import asyncio
from pathlib import Path
from typing import Any

import httpx
import pytest
from fastapi import FastAPI

from lupin_bridge.app import create_app
from lupin_bridge.stream import schema

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


def test_it_describes_itself_without_a_twin_and_the_frameworks_own_pages_are_off(
    tmp_path: Path,
) -> None:
    for path in ("/docs", "/openapi.json"):
        assert query(tmp_path, "GET", path).status_code == 200
    for path in ("/redoc", "/docs/oauth2-redirect"):
        assert query(tmp_path, "GET", path).status_code == 404


def test_the_page_and_its_files_are_served_from_the_same_origin(static: Path) -> None:
    page = query(static, "GET", "/")
    assert (page.status_code, page.text) == (200, PAGE)
    assert page.headers["content-type"].startswith("text/html")
    assert "default-src 'self'" in page.headers["content-security-policy"]
    script = query(static, "GET", "/assets/a.js")
    assert script.headers["content-type"].startswith("text/javascript")
    assert script.headers["x-content-type-options"] == "nosniff"
    assert query(static, "HEAD", "/").text == ""


def test_the_page_hides_no_route(static: Path) -> None:
    (static / "docs").write_text("a file of that name")
    page = query(static, "GET", "/docs").text
    assert "Only <code>POST /api/observations</code> writes to ROS" in page
    assert "`" not in page


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
        "/" + "x/" * 2_000,
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
