"""Accounts and tokens for tests, and people who have signed in."""

import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import httpx
from argon2 import PasswordHasher

from lupin_bridge.access.accounts import Accounts, digest, make_file
from lupin_bridge.access.credentials import Kind, Role
from tests.support.waiting import PATIENCE_S

OWN = {"X-Lupin-Twin": "1"}
PASSWORD = "correct horse battery staple"
TOKEN = "a-token-of-43-characters-0123456789-abcdefg"
# As cheap as argon2id can be: what a hash costs to verify is written in it.
_HASH = PasswordHasher(time_cost=1, memory_cost=8, parallelism=1).hash(PASSWORD)


@contextmanager
def changing(path: Path) -> Iterator[Accounts]:
    """The file of accounts, made where there is none, as the command changes it."""
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
    """Remove an account, or revoke a token."""
    with changing(path) as accounts:
        accounts.remove(name, kind, by="a test", now_s=int(time.time()))


def sign_in(client: httpx.Client, name: str, password: str = PASSWORD) -> httpx.Response:
    """As the page does it."""
    return client.post("/api/signin", json={"name": name, "password": password}, headers=OWN)


@contextmanager
def signed_in(url: str, name: str) -> Iterator[httpx.Client]:
    """A browser of somebody who has signed in; it sends the bridge's own header."""
    with httpx.Client(base_url=url, timeout=PATIENCE_S, trust_env=False, headers=OWN) as browser:
        answer = sign_in(browser, name)
        assert answer.status_code == 204, answer.text
        yield browser


def write(browser: httpx.Client, **note: Any) -> httpx.Response:
    """A note."""
    return browser.post("/api/notes", json=note)
