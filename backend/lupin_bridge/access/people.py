"""Authentication by the shared token and the accounts file. Belongs to the event loop.

Reads of the file take some 20 µs, on the loop. Writes and password checks run on one thread: argon2
takes 64 MB and a tenth of a second on purpose, so one runs at a time, and few may wait.
"""

from __future__ import annotations

import asyncio
import logging
import math
import secrets
import time
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Final, TypeVar

from lupin_bridge.access.accounts import SESSION_S, Accounts
from lupin_bridge.access.credentials import (
    SHARED,
    SHARED_SESSION_S,
    AccountError,
    Credentials,
    Person,
    cookies_of,
    digest,
    is_name,
)
from lupin_bridge.serving.admission import ClientLimitError, RateLimit

log = logging.getLogger(__name__)

ResultT = TypeVar("ResultT")

# Passwords that may wait for the thread. Writes may wait even behind twice as many, so that a flood
# of sign-ins keeps no note out of the audit trail.
MAX_WAITING: Final = 8


# Failed sign-ins of an address at once, and per minute after that; and successful ones of a name:
# each is in the audit trail, which would soon hold nothing else.
ATTEMPT_BURST: Final = 10
ATTEMPTS_PER_MINUTE: Final = 10
_MOST: Final = f"more than {ATTEMPT_BURST} times and {ATTEMPTS_PER_MINUTE} a minute"


class People:
    """Finds out who makes a request.

    `path` is the accounts file: until it exists, there are no accounts; then it must stay. `shared`
    is the shared token. `is_proxied`: a trusted proxy names the person. Every method raises
    `AccountError` if the file cannot be read or written, and `ClientLimitError` if it would wait
    for the thread, and too many wait.
    """

    def __init__(
        self, path: Path, shared: Credentials | None = None, *, is_proxied: bool = False
    ) -> None:
        self._path = path
        self.shared = shared
        self._is_proxied = is_proxied
        self._accounts: Accounts | None = None
        self._inode = 0
        self._has_file = _may_be_there(path)
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="accounts")
        self._waiting = 0
        self._attempts = RateLimit(ATTEMPTS_PER_MINUTE / 60.0, ATTEMPT_BURST)
        self._sign_ins = RateLimit(ATTEMPTS_PER_MINUTE / 60.0, ATTEMPT_BURST)

    @property
    def is_on(self) -> bool:
        """Whether readers need credentials."""
        return bool(self.shared or self._is_proxied or self.has_file)

    @property
    def has_file(self) -> bool:
        """Whether there is an accounts file, so that people can sign in."""
        self._has_file = self._has_file or _may_be_there(self._path)
        return self._has_file

    def by_cookies(self, headers: Iterable[tuple[bytes, bytes]]) -> Person | None:
        """The person of a session, by the cookies of a request; None: none is valid."""
        headers, now_s = tuple(headers), time.time()
        if self.shared is not None:
            for cookie in cookies_of(self.shared.cookie_name, headers):
                if (person := self.shared.session_of(cookie, now_s)) is not None:
                    return person
        if not self.has_file:
            return None
        sessions = map(digest, cookies_of(self._cookie_name(), headers))
        found = (self._file().of_session(session, now_s) for session in sessions)
        return next((person for person in found if person is not None), None)

    def by_token(self, token: str) -> Person | None:
        """The person of a token; None: it is unknown."""
        if self.shared is not None and self.shared.accepts(token):
            return SHARED
        return self._file().of_token(digest(token)) if self.has_file else None

    def by_proxy(self, name: str) -> Person | None:
        """The person whom a trusted proxy names; without such an account, they are a viewer."""
        if not is_name(name):
            return None
        found = self._file().of_name(name) if self.has_file else None
        return replace(found or Person(name, "viewer"), by="proxy")

    def may_stay(self, person: Person | None) -> bool:
        """Whether a connection may stay: its session or token is as it was when it began.

        None: it needed no credentials then.
        """
        if person is None:
            return not self.is_on
        if person.by == "shared token":
            return self.shared is not None and self.shared.still(person, time.time())
        if person.by == "proxy":
            return self.by_proxy(person.name) == person
        if person.session:
            return self._file().of_session(person.session, time.time()) == person
        # By its digest: a new token of the same name does not count for a revoked one.
        return self._file().of_token(person.secret) == person

    def has_account(self, person: Person) -> bool:
        """Whether it is somebody with an account, however they signed in."""
        return self.has_file and self._file().of_name(person.name) is not None

    async def check(self, name: str, password: str, address: str) -> Person | None:
        """The person who signs in; None: there is no such account, or the password is wrong.

        Both take the same time.

        Raises:
            ClientLimitError: too many were wrong from that address.

        """
        # Concurrent attempts are bounded by the few that may wait for the thread.
        wait_s = self._attempts.wait_s(address, time.monotonic())
        if wait_s > 0.0:
            raise ClientLimitError(
                f"{address} has failed to sign in {_MOST}: try again in {math.ceil(wait_s)} s",
                wait_s,
            )
        try:
            person = await self._check(name, password)
        except asyncio.CancelledError:
            # The thread may check it all the same: a cancelled attempt counts.
            self._attempts.take(address, time.monotonic())
            raise
        if person is None:
            self._attempts.take(address, time.monotonic())
            log.warning("a sign-in as %r from %s was refused", name[:64], address)
        return person

    async def _check(self, name: str, password: str) -> Person | None:
        if not is_name(name):
            return None
        known = self._file().of_name(name)
        kept = known.secret if known else ""
        return known if await self._on_thread(lambda: verify(kept, password)) else None

    async def sign_in(self, person: Person, address: str) -> tuple[str, str, int] | None:
        """Begin a session; returns its cookie's name and value, and how long it lasts, s.

        None: the account was removed while its password was checked, or has another one now.

        Raises:
            ClientLimitError: the name signs in too often.

        """
        if self.shared is not None and person.by == "shared token":
            return self.shared.cookie_name, self.shared.cookie(time.time()), SHARED_SESSION_S
        self._sign_ins.charge(person.name, time.monotonic(), f"signed in {_MOST}")
        cookie = await self.write(lambda it, now_s: it.begin_session(person, address, now_s))
        return None if cookie is None else (self._cookie_name(), cookie, SESSION_S)

    async def sign_out(self, person: Person, address: str) -> str:
        """End the session that a request came with; returns its cookie's name."""
        if self.shared is not None and person.by == "shared token":
            self.shared.sign_out(person)
            return self.shared.cookie_name
        await self.write(lambda it, now_s: it.end_session(person, address, now_s))
        return self._cookie_name()

    async def write(self, work: Callable[[Accounts, int], ResultT]) -> ResultT:
        """The result of `work(accounts, now_s)`, on the thread."""

        def do() -> ResultT:
            with closing(Accounts(self._path, is_writer=True)) as accounts:
                return work(accounts, int(time.time()))

        try:
            return await self._on_thread(do, 2 * MAX_WAITING)
        except AccountError:
            # A process has one WAL index for a file, read-only if the first reader found it so:
            # let the next reader open the file again.
            self._inode = 0
            raise

    async def _on_thread(self, work: Callable[[], ResultT], most: int = MAX_WAITING) -> ResultT:
        if self._waiting >= most:
            raise ClientLimitError(
                f"{self._waiting} sign-ins and changes are waiting: try again in a moment", 2.0
            )
        self._waiting += 1
        try:
            return await asyncio.wrap_future(self._thread.submit(work))
        finally:
            self._waiting -= 1

    def _cookie_name(self) -> str:
        """Browsers keep one jar for all ports of a host, so each file has a cookie of its own."""
        return f"lupin_person_{self._file().id[:8]}"

    def _file(self) -> Accounts:
        try:
            inode = self._path.stat().st_ino
        except OSError as error:
            raise AccountError(f"the file of accounts cannot be read: {error}") from error
        if self._accounts is None or inode != self._inode:
            if self._accounts is not None:
                self._accounts.close()
            self._accounts = None
            self._accounts, self._inode = Accounts(self._path), inode
        return self._accounts


def _may_be_there(path: Path) -> bool:
    """Whether there may be a file; if that cannot be seen, nobody is let in without a right."""
    try:
        path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return False
    except OSError:
        return True
    return True


def hashed(password: str) -> str:
    """The hash of a password, as it is stored."""
    from argon2 import PasswordHasher  # noqa: PLC0415  # few ever sign in

    return PasswordHasher().hash(password)


_nobodys: list[str] = []


def verify(kept: str, password: str) -> bool:
    """Whether a password matches its hash; an empty hash never matches, in the same time."""
    from argon2 import PasswordHasher  # noqa: PLC0415  # as above
    from argon2.exceptions import InvalidHashError, VerificationError  # noqa: PLC0415

    if not _nobodys:
        _nobodys.append(hashed(secrets.token_hex()))
    try:
        PasswordHasher().verify(kept or _nobodys[0], password)
    except (VerificationError, InvalidHashError):
        return False
    return bool(kept)
