"""Signing in: the page, the exchange, and the limits of the cookie."""

import json
import re
import time
from collections.abc import Iterator
from contextlib import contextmanager
from http.cookies import Morsel, SimpleCookie
from importlib.resources import files

import httpx
import pytest
from websockets.sync.client import ClientConnection, connect

from lupin_bridge.access.credentials import SHARED_SESSION_S, Credentials
from tests.support.access import BEARER, TOKEN, Served, served
from tests.support.people import OWN
from tests.support.waiting import PATIENCE_S
from tests.support.ws_client import last_word


@pytest.fixture(scope="module")
def closed() -> Iterator[Served]:
    with served(LUPIN_TOKEN=TOKEN) as running:
        yield running


def cookie_of(answer: httpx.Response) -> Morsel[str]:
    (cookie,) = SimpleCookie(answer.headers["set-cookie"]).values()
    return cookie


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


def test_the_page_has_nothing_inline_or_external_and_without_its_script_sends_no_token(
    closed: Served,
) -> None:
    page = closed.get("/signin").text
    assert not re.search(r"<script(?![^>]*\ssrc=)|<style|\sstyle=|\son\w+=", page)
    assert "//" not in re.sub(r"<!--.*?-->", "", page, flags=re.DOTALL)
    # A browser does not submit a field without a name.
    fields = re.findall(r"<(?:input|button|select|textarea)[^>]*>", page)
    assert fields
    assert not [field for field in fields if re.search(r"\sname=", field)]


@pytest.mark.parametrize(
    ("query", "accepts", "language", "says"),
    [
        ("", "fr,de-AT;q=0.9", "de", "Zugangscode (Token)"),
        ("?lang=nl", "de", "nl", "Toegangscode (token)"),
        ("", "es", "es", "Código de acceso (token)"),
        ("?lang=xx", "de", "en", "Access code (token)"),
    ],
)
def test_the_page_is_in_the_language_of_the_browser(
    closed: Served, query: str, accepts: str, language: str, says: str
) -> None:
    answer = closed.get(f"/signin{query}", {"Accept-Language": accepts})
    assert f'<html lang="{language}">' in answer.text
    assert f">{says}</label>" in answer.text
    assert answer.headers["content-language"] == language
    assert answer.headers["vary"] == "Accept-Language"


def test_the_page_has_the_same_texts_in_all_languages() -> None:
    text = files("lupin_bridge.routes").joinpath("signin_page/words.json").read_text("utf-8")
    english, *others = json.loads(text).values()
    assert len(others) == 3
    for words in others:
        assert words.keys() == english.keys()
        assert not {key for key in english if words[key] == english[key]}
        assert [key for key in words if "%" in words[key]] == ["refused"]


def test_the_token_is_exchanged_for_a_strict_cookie(closed: Served) -> None:
    answer = closed.post("/api/signin", BEARER)
    assert (answer.status_code, answer.content) == (204, b"")
    assert answer.headers["cache-control"] == "no-store"
    cookie = cookie_of(answer)
    assert cookie["httponly"]
    assert cookie["samesite"].lower() == "strict"
    assert (cookie["path"], cookie["domain"]) == ("/", "")
    assert int(cookie["max-age"]) == SHARED_SESSION_S
    assert not cookie["secure"], "a browser would not send it back over plain http"
    assert TOKEN not in answer.headers["set-cookie"]


def test_there_is_no_cookie_without_the_token_and_a_valid_one_excuses_no_wrong_token(
    closed: Served,
) -> None:
    wrong = {"Authorization": "Bearer wrong"}
    with closed.client() as browser:
        browser.post("/api/signin", headers={**BEARER, **OWN})
        for answer in (
            browser.post("/api/signin", headers=OWN),  # a session does not renew itself
            closed.post("/api/signin"),
            closed.post("/api/signin", wrong),
        ):
            assert (answer.status_code, "set-cookie" in answer.headers) == (401, False)
        assert browser.get("/api/state", headers=wrong).status_code == 401


SAME_ORIGIN = {"Sec-Fetch-Site": "same-origin", "Sec-Fetch-Mode": "cors", "Sec-Fetch-Dest": "empty"}


def session(closed: Served) -> dict[str, str]:
    cookie = cookie_of(closed.post("/api/signin", BEARER))
    return {"Cookie": f"{cookie.key}={cookie.value}"}


def ending_in(seconds: float) -> dict[str, str]:
    """The Cookie header of a session that lasts that much longer."""
    ours = Credentials(TOKEN)
    begun_s = time.time() + seconds - SHARED_SESSION_S
    return {"Cookie": f"{ours.cookie_name}={ours.cookie(begun_s)}"}


@contextmanager
def listening(closed: Served, headers: dict[str, str], path: str) -> Iterator[ClientConnection]:
    url = closed.url.replace("http", "ws", 1) + path
    with connect(
        url, additional_headers=headers, proxy=None, ping_interval=None, open_timeout=PATIENCE_S
    ) as connection:
        if path == "/rosbridge":
            connection.send('{"op": "subscribe", "topic": "/twin/state"}')
        connection.recv(timeout=PATIENCE_S)
        yield connection


SIGNED_OUT = (1008, "the session has ended: sign in again")


def test_signing_out_ends_the_session_here_and_in_the_browser(closed: Served) -> None:
    mine, other = session(closed), session(closed)
    assert mine != other, "two sessions, of the same second too"
    answer = closed.post("/api/signout", {**mine, **SAME_ORIGIN, "Origin": closed.url})
    assert (answer.status_code, answer.content) == (204, b"")
    assert answer.headers["cache-control"] == "no-store"
    cookie = cookie_of(answer)
    assert (cookie.key, cookie.value) == (mine["Cookie"].partition("=")[0], "")
    assert int(cookie["max-age"]) == 0
    assert (cookie["path"], bool(cookie["httponly"])) == ("/", True)
    assert closed.get("/api/state", mine).status_code == 401
    assert closed.handshake(headers=mine) == 401
    assert closed.post("/api/signout", mine).status_code == 401, "and that once"
    assert closed.get("/api/state", other).status_code == 200


@pytest.mark.parametrize("path", ["/ws/state", "/rosbridge"])
def test_signing_out_closes_the_connections_of_that_session_alone(
    closed: Served, path: str
) -> None:
    mine, other = session(closed), session(closed)
    with (
        listening(closed, mine, path) as first,
        listening(closed, mine, path) as second,
        listening(closed, other, path) as theirs,
        listening(closed, BEARER, path) as program,
    ):
        assert closed.post("/api/signout", mine).status_code == 204
        assert last_word(first) == last_word(second) == SIGNED_OUT
        for unconcerned in (theirs, program):
            unconcerned.ping().wait(PATIENCE_S)
            unconcerned.recv(timeout=PATIENCE_S)


def test_an_expired_session_closes_its_connections(closed: Served) -> None:
    start_s, mine = time.time(), ending_in(6.0)
    with (
        listening(closed, mine, "/ws/state") as one,
        listening(closed, mine, "/rosbridge") as other,
    ):
        assert last_word(one) == last_word(other) == SIGNED_OUT
    assert time.time() - start_s >= 5.0, "and not before: its end is in whole seconds"


def test_a_page_knows_whether_it_can_sign_out(closed: Served) -> None:
    reported = closed.get("/api/session", session(closed)).json()
    assert (reported["name"], reported["role"], reported["can_write_notes"]) == (
        None,
        "viewer",
        False,
    )
    assert reported["can_sign_out"]
    assert SHARED_SESSION_S - 600 < reported["seconds_left"] <= SHARED_SESSION_S
    nobody = {"name": None, "role": "viewer", "can_write_notes": False}
    program = {"can_sign_out": False, "seconds_left": None, **nobody}
    assert closed.get("/api/session", BEARER).json() == program
    assert closed.get("/api/session").status_code == 401
    with served() as live:
        assert live.get("/api/session").json() == program
        for path in ("/api/signin", "/api/signout"):
            answer = live.post(path, BEARER)
            assert (answer.status_code, "set-cookie" in answer.headers) == (404, False)
            assert "needs no token" in answer.json()["detail"]
        page = live.get("/signin")
        assert (page.status_code, page.headers["location"]) == (303, "./")
