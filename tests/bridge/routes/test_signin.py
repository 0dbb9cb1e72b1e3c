"""Signing in: the page, the exchange, and the cookie's bounds."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from http.cookies import Morsel, SimpleCookie

import httpx
import pytest

from lupin_bridge.access.credentials import SESSION_S
from tests.support.access import BEARER, TOKEN, Served, served


@pytest.fixture(scope="module")
def closed() -> Iterator[Served]:
    with served(LUPIN_TOKEN=TOKEN) as running:
        yield running


def cookie_of(answer: httpx.Response) -> Morsel[str]:
    (cookie,) = SimpleCookie(answer.headers["set-cookie"]).values()
    return cookie


# --- the page -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("path", "media_type"),
    [("/signin", "text/html"), ("/signin.js", "text/javascript"), ("/signin.css", "text/css")],
)
def test_the_page_and_its_parts_need_no_token(closed: Served, path: str, media_type: str) -> None:
    answer = closed.get(path)
    assert answer.status_code == 200
    assert answer.headers["content-type"] == f"{media_type}; charset=utf-8"
    assert "default-src 'self'" in answer.headers["content-security-policy"]
    assert "unsafe" not in answer.headers["content-security-policy"]
    assert closed.get(path, method="HEAD").status_code == 200
    assert closed.get(path, method="POST").status_code == 405


def test_the_page_has_nothing_inline_and_nothing_from_elsewhere(closed: Served) -> None:
    page = closed.get("/signin").text
    assert not re.search(r"<script(?![^>]*\ssrc=)|<style|\sstyle=|\son\w+=", page)
    assert "//" not in re.sub(r"<!--.*?-->", "", page, flags=re.DOTALL)


def test_without_its_script_the_page_sends_the_token_nowhere(closed: Served) -> None:
    """A field without a name is not part of what a browser submits."""
    fields = re.findall(r"<(?:input|button|select|textarea)[^>]*>", closed.get("/signin").text)
    assert fields
    assert not [field for field in fields if re.search(r"\sname=", field)]


# --- the exchange -------------------------------------------------------------------------------


def test_the_token_is_traded_for_a_strict_cookie(closed: Served) -> None:
    answer = closed.get("/api/signin", BEARER)
    assert (answer.status_code, answer.content) == (204, b"")
    assert answer.headers["cache-control"] == "no-store"
    cookie = cookie_of(answer)
    assert cookie["httponly"]
    assert cookie["samesite"].lower() == "strict"
    assert (cookie["path"], cookie["domain"]) == ("/", "")
    assert int(cookie["max-age"]) == SESSION_S
    assert not cookie["secure"], "a browser would not send it back over plain http"
    assert TOKEN not in answer.headers["set-cookie"]


def test_the_cookie_ends_on_the_bridges_clock_too(closed: Served) -> None:
    expires = int(cookie_of(closed.get("/api/signin", BEARER)).value.partition(".")[0])
    assert abs(expires - time.time() - SESSION_S) < 600


def test_the_cookie_opens_everything(closed: Served) -> None:
    with closed.client() as browser:
        assert browser.get("/api/state").status_code == 401
        browser.get("/api/signin", headers=BEARER)
        for path in ("/api/state", "/docs", "/api/field.png?sensor_type=co2", "/readyz"):
            assert browser.get(path).status_code == 200
        assert browser.get("/", headers={"Accept": "text/html"}).status_code != 303


def test_a_session_does_not_renew_itself(closed: Served) -> None:
    with closed.client() as browser:
        browser.get("/api/signin", headers=BEARER)
        answer = browser.get("/api/signin")
        assert answer.status_code == 401
        assert "set-cookie" not in answer.headers


@pytest.mark.parametrize("header", [{}, {"Authorization": "Bearer wrong"}])
def test_no_cookie_without_the_token(closed: Served, header: dict[str, str]) -> None:
    answer = closed.get("/api/signin", header)
    assert answer.status_code == 401
    assert "set-cookie" not in answer.headers


def test_a_good_cookie_does_not_excuse_a_wrong_token(closed: Served) -> None:
    with closed.client() as browser:
        browser.get("/api/signin", headers=BEARER)
        wrong = browser.get("/api/state", headers={"Authorization": "Bearer wrong"})
        assert wrong.status_code == 401


def test_without_a_token_there_is_nothing_to_sign_in_to() -> None:
    with served() as live:
        page = live.get("/signin")
        assert (page.status_code, page.headers["location"]) == (303, "./")
        exchange = live.get("/api/signin", BEARER)
        assert exchange.status_code == 404
        assert "asks for no token" in exchange.json()["detail"]
        assert "set-cookie" not in exchange.headers
