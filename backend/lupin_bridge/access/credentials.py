"""Who makes a request and what they may; the shared token, its sessions, and our cookies. Pure.

A session of the shared token is a signed cookie (`itsdangerous`), not a row of a table. So it
survives a restart, and is valid at every replica with the same token. A new token ends them all.
"""

from __future__ import annotations

import hashlib
import hmac
import re
import secrets
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Final, Literal

from itsdangerous import BadSignature, Signer

from lupin_bridge.settings import SettingError

Role = Literal["viewer", "operator", "admin", "writer"]
# Each may also do what the ones before it may.
ROLES: Final[tuple[Role, ...]] = ("viewer", "operator", "admin")
# A sensor's token may only post observations: its role has no rank among the others.
WRITER: Final = "writer"
TOKEN_ROLES: Final[tuple[Role, ...]] = (*ROLES, WRITER)
Kind = Literal["account", "token"]

MIN_PASSWORD: Final = 10
MAX_PASSWORD: Final = 512
_NAME: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9._@+-]{0,63}")


class AccountError(Exception):
    """An operation on accounts failed; the message is one line that says why."""


@dataclass(frozen=True, slots=True)
class Person:
    """Who makes a request, what they may do, and how they are known.

    `session` is their session's id, `ends_at_s` its end, s since the epoch. `secret` is a password
    or token as it is stored. `name` is empty for the shared token. `sites` are those whose data
    they may read; empty: all.
    """

    name: str
    role: Role
    by: Literal["account", "token", "proxy", "shared token"] = "account"
    session: str = ""
    ends_at_s: int = 0
    secret: str = field(default="", compare=False, repr=False)
    sites: tuple[str, ...] = ()

    def may(self, role: Role) -> bool:
        """Whether that role's rights are among theirs."""
        return self.role in ROLES and ROLES.index(self.role) >= ROLES.index(role)

    def reads(self, site: str) -> bool:
        """Whether they may read the data of a site; "": a bridge without a site's name."""
        return not self.sites or site in self.sites


def is_name(text: str) -> bool:
    """Whether it can be the name of a person or token."""
    return _NAME.fullmatch(text) is not None


def check_name(name: str) -> None:
    """Refuse an invalid name.

    Raises:
        AccountError: it is invalid.

    """
    if not is_name(name):
        raise AccountError(
            f"the name is {name[:80]!r}, must be 1 to 64 letters, digits and ._@+-, and begin with "
            "a letter or digit"
        )


def check_password(password: str) -> None:
    """Refuse a password that is too short or too long.

    Raises:
        AccountError: it is.

    """
    if not MIN_PASSWORD <= len(password) <= MAX_PASSWORD:
        raise AccountError(
            f"the password has {len(password)} characters, must have {MIN_PASSWORD} to "
            f"{MAX_PASSWORD}"
        )


# --- the shared token -----------------------------------------------------------------------------

MIN_TOKEN_LENGTH: Final = 16
# RFC 6750, section 2.1: what may stand behind "Bearer" in a header.
_TOKEN: Final = re.compile(r"[A-Za-z0-9._~+/-]+=*")
# Long enough for a shift's screen not to ask daily, short enough for a lost tablet to forget.
SHARED_SESSION_S: Final = 7 * 24 * 3600
# Signed-out sessions that are remembered; only who has the token can make more.
MAX_SIGNED_OUT: Final = 10_000
# Anybody with the shared token, without a name.
SHARED: Final = Person("", "viewer", by="shared token")


class Credentials:
    """Checks the shared token and its sessions, in constant time.

    `called` names, in messages, where the token was given.
    """

    def __init__(self, token: str, called: str = "LUPIN_TOKEN") -> None:
        if len(token) < MIN_TOKEN_LENGTH:
            raise SettingError(
                f"{called} has {len(token)} characters, must have at least {MIN_TOKEN_LENGTH}: "
                "make one with `openssl rand -hex 32`, or unset it"
            )
        if _TOKEN.fullmatch(token) is None:
            raise SettingError(
                f"{called} holds a character that no bearer token may: use letters, digits and "
                "-._~+/ (RFC 6750)"
            )
        self._digest = digest(token)
        # Slow on purpose: a stolen cookie must not reveal a weak token.
        key = hashlib.scrypt(token.encode(), salt=b"lupin-twin session", n=2**14, r=8, p=1)
        self._signer = Signer(key, salt=b"session", digest_method=hashlib.sha256)
        self._signed_out: dict[str, int] = {}
        # Browsers keep one jar for all ports of a host: bridges with different tokens must not
        # overwrite each other's session.
        self.cookie_name: Final = f"lupin_session_{hashlib.sha256(b'name' + key).hexdigest()[:8]}"

    def accepts(self, token: str) -> bool:
        """Whether this is the token."""
        # Digests, so that not even the token's length shows in the time taken.
        return hmac.compare_digest(digest(token), self._digest)

    def cookie(self, now_s: float) -> str:
        """The cookie of a new session from `now_s` on, s since the epoch."""
        session = f"{int(now_s) + SHARED_SESSION_S}.{secrets.token_hex(16)}"
        return self._signer.sign(session).decode()

    def session_of(self, cookie: str, now_s: float) -> Person | None:
        """The person of a cookie's session; None: it is none of ours, or has ended."""
        try:
            session = self._signer.unsign(cookie).decode()
        except BadSignature:
            return None
        ends_s = int(session.partition(".")[0])
        person = replace(SHARED, session=session, ends_at_s=ends_s)
        return person if self.still(person, now_s) else None

    def still(self, person: Person, now_s: float) -> bool:
        """Whether a session that was found has not ended since."""
        return not person.session or (
            person.ends_at_s > now_s and person.session not in self._signed_out
        )

    def sign_out(self, person: Person) -> None:
        """End a session, in this process."""
        if len(self._signed_out) >= MAX_SIGNED_OUT:
            del self._signed_out[min(self._signed_out, key=self._signed_out.__getitem__)]
        self._signed_out[person.session] = person.ends_at_s


def digest(secret: str) -> str:
    """The form in which a token or a session's cookie is stored."""
    return hashlib.sha256(secret.encode()).hexdigest()


# --- our own cookie, out of a request's headers ---------------------------------------------------

# Not by the standard library's parser, which undoes quotes and escapes. Before Python 3.11.10 and
# 3.12.6, its time grows with the square of the length (CVE-2024-7592): 40 kB of backslashes held up
# everybody for two seconds. Our cookie is never quoted, and no other is parsed.


def cookies_of(name: str, headers: Iterable[tuple[bytes, bytes]]) -> list[str]:
    """The values of all cookies of this name: a browser may keep one for each of several paths.

    `headers` as in an ASGI scope: names in lower case. A value that is not ASCII is none of ours.
    """
    lines = [value for header, value in headers if header == b"cookie"]
    own = f"{name}=".encode()
    pairs = (pair.strip() for line in lines for pair in line.split(b";"))
    return [pair[len(own) :].decode("latin-1") for pair in pairs if pair.startswith(own)]
