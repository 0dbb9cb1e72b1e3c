"""Accounts and tokens for tests, and people who have signed in."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import httpx
from argon2 import PasswordHasher

from lupin_bridge.access.accounts import Accounts, make_file
from lupin_bridge.access.credentials import Kind, Role, digest
from lupin_bridge.stream.routes_schema import Note, Notes
from tests.support.waiting import PATIENCE_S

if TYPE_CHECKING:
    from tests.support.web import Bridge  # has ROS

OWN = {"X-Lupin-Twin": "1"}
PASSWORD = "correct horse battery staple"
TOKEN = "a-token-of-43-characters-0123456789-abcdefg"
BEARER = {"Authorization": f"Bearer {TOKEN}"}
# As cheap as argon2id can be: the hash contains its own cost.
_HASH = PasswordHasher(time_cost=1, memory_cost=8, parallelism=1).hash(PASSWORD)


@contextmanager
def changing(path: Path) -> Iterator[Accounts]:
    """The accounts file, created if missing, opened as the command does."""
    make_file(path)
    with closing(Accounts(path, is_writer=True)) as accounts:
        yield accounts


def add(path: Path, kind: Kind = "account", secret: str = "", **people: Role) -> None:
    """Accounts with `PASSWORD`, or tokens, by their names, each with its role."""
    secret = secret or (_HASH if kind == "account" else digest(TOKEN))
    with changing(path) as accounts:
        for name, role in people.items():
            accounts.add(name, kind, role, secret, by="a test", now_s=int(time.time()))


def remove(path: Path, name: str, kind: Kind = "account") -> None:
    with changing(path) as accounts:
        accounts.remove(name, kind, by="a test", now_s=int(time.time()))


def begin_session(accounts: Accounts, now_s: int = 1_800_000_000) -> str:
    """Anna's, as signing in begins it; returns its cookie."""
    anna = accounts.of_name("anna")
    assert anna is not None
    cookie = accounts.begin_session(anna, "192.0.2.7", now_s)
    assert cookie is not None
    return cookie


def sign_in(client: httpx.Client, name: str, password: str = PASSWORD) -> httpx.Response:
    return client.post("/api/signin", json={"name": name, "password": password}, headers=OWN)


@contextmanager
def signed_in(url: str, name: str) -> Iterator[httpx.Client]:
    """A browser that is signed in; it sends the bridge's own header."""
    with httpx.Client(base_url=url, timeout=PATIENCE_S, trust_env=False, headers=OWN) as browser:
        answer = sign_in(browser, name)
        assert answer.status_code == 204, answer.text
        yield browser


@cache
def _cookies_of_anna(url: str) -> httpx.Cookies:
    with signed_in(url, "anna") as browser:
        return browser.cookies


def signed_in_once(live: Bridge) -> httpx.Client:
    """Anna, in one session for many tests: an address has few sign-ins a minute."""
    cookies = _cookies_of_anna(live.url)
    return httpx.Client(
        base_url=live.url, cookies=cookies, headers=OWN, timeout=PATIENCE_S, trust_env=False
    )


def write(browser: httpx.Client, **note: Any) -> httpx.Response:
    return browser.post("/api/notes", json=note)


def notes(live: Bridge, **query: str) -> list[Note]:
    """All notes, the latest first."""
    answer = live.get("/api/notes", BEARER, **query)
    return Notes.model_validate_json(answer.content).notes


def in_s(live: Bridge, seconds: float) -> str:
    """A moment of the twin's time."""
    now = live.get("/api/state", BEARER).json()["header"]["stamp"]
    return f"{now['sec'] + seconds:.0f}"
