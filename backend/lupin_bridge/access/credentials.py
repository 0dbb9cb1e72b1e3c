"""The bearer token, the browser sessions that it opens, and their cookies. Pure.

A session's cookie is stateless, so that it survives a restart and holds at every replica that has
the same token: its end, its name, and an HMAC (RFC 2104) of both under a key derived from the
token. A new token ends every session.
"""

from __future__ import annotations

import hashlib
import hmac
import re
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Final

from lupin_bridge.settings import SettingError

# An entry is two hundred bytes, and takes the token to be made.
MAX_SIGNED_OUT: Final = 10_000


class Sessions:
    """Belongs to the event loop."""

    def __init__(self, max_signed_out: int = MAX_SIGNED_OUT) -> None:
        self._max_signed_out = max_signed_out
        self._signed_out: dict[str, int] = {}
        self._held: dict[str, set[Callable[[], None]]] = {}

    def __len__(self) -> int:
        """How many are remembered as signed out."""
        return len(self._signed_out)

    def has_ended(self, session: BrowserSession) -> bool:
        """Whether it was signed out."""
        return session.name in self._signed_out

    def sign_out(self, session: BrowserSession, now_s: float) -> None:
        """End a session and close what it holds; `now_s` is in s since the epoch."""
        if len(self._signed_out) >= self._max_signed_out:
            self._forget(now_s)
        self._signed_out[session.name] = session.ends_s
        for close in list(self._held.get(session.name, ())):
            close()

    @contextmanager
    def holds(self, session: BrowserSession, close: Callable[[], None]) -> Iterator[None]:
        """Have `close` called if the session is signed out meanwhile."""
        held = self._held.setdefault(session.name, set())
        held.add(close)
        try:
            yield
        finally:
            held.discard(close)
            if not held:
                self._held.pop(session.name, None)

    def _forget(self, now_s: float) -> None:
        """Forget the ended ones; were there none, the one that ends first."""
        open_ = {name: ends_s for name, ends_s in self._signed_out.items() if ends_s > now_s}
        if len(open_) >= self._max_signed_out:
            del open_[min(open_, key=open_.__getitem__)]
        self._signed_out = open_


# Our own cookie out of a request's headers, by one look along them. Pure.
#
# The standard library's parser undoes quotes and escapes, before Python 3.11.10 and 3.12.6 in a
# time that grows with the square of the length (CVE-2024-7592): 40 kB of backslashes held up
# everybody for two seconds. Ours is never quoted, and nobody else's is looked at.


# What a browser keeps for one host may be more, but no WebSocket handshake with a longer line gets
# through: without this limit, the page would come and its data would not.
MAX_COOKIE_BYTES: Final = 8_000


class CookieTooLong(ValueError):
    """More than is looked at; the message says how long it is, and the limit."""


def cookies_of(name: str, headers: Iterable[tuple[bytes, bytes]]) -> list[str]:
    """The values of all cookies of this name: a browser may keep one for each of several paths.

    `headers` as in an ASGI scope: names in lower case. What is not ASCII is nobody's of ours.

    Raises:
        CookieTooLong: the Cookie headers are longer than `MAX_COOKIE_BYTES` together.

    """
    lines = [value for header, value in headers if header == b"cookie"]
    length = sum(map(len, lines))
    if length > MAX_COOKIE_BYTES:
        raise CookieTooLong(
            f"Cookie has {length} bytes, the limit is {MAX_COOKIE_BYTES}: delete the cookies of "
            "this host"
        )
    own = f"{name}=".encode()
    pairs = (pair.strip() for line in lines for pair in line.split(b";"))
    return [pair[len(own) :].decode("latin-1") for pair in pairs if pair.startswith(own)]


MIN_TOKEN_LENGTH: Final = 16
# RFC 6750, section 2.1: what may stand behind "Bearer" in a header.
_TOKEN: Final = re.compile(r"[A-Za-z0-9._~+/-]+=*")

# Long enough for a shift's screen not to ask daily, short enough for a lost tablet to forget.
SESSION_S: Final = 7 * 24 * 3600

_COOKIE: Final = re.compile(
    r"(?P<session>(?P<ends>[0-9]{1,12})\.(?P<name>[0-9a-f]{32}))\.(?P<mac>[0-9a-f]{64})"
)


@dataclass(frozen=True, slots=True)
class BrowserSession:
    """A browser that has signed in; `ends_s` is in s since the epoch."""

    name: str
    ends_s: int


class TokenError(SettingError):
    """A token that cannot be one; the message has its length, never the token."""


class Credentials:
    """Tells the right token and its sessions from all others, in constant time.

    `called` is what messages call the place that the token was given in.
    """

    def __init__(self, token: str, called: str = "LUPIN_TOKEN") -> None:
        if len(token) < MIN_TOKEN_LENGTH:
            raise TokenError(
                f"{called} has {len(token)} characters, must have at least {MIN_TOKEN_LENGTH}: "
                "make one with `openssl rand -hex 32`, or unset it"
            )
        if _TOKEN.fullmatch(token) is None:
            raise TokenError(
                f"{called} holds a character that no bearer token may: use letters, digits and "
                "-._~+/ (RFC 6750)"
            )
        self._digest = _digest(token.encode())
        # Slow on purpose: a stolen cookie must not reveal a weak token.
        self._key = hashlib.scrypt(token.encode(), salt=b"lupin-twin session", n=2**14, r=8, p=1)
        # Browsers keep one jar for all ports of a host: bridges with different tokens must not
        # overwrite each other's session.
        self.cookie_name: Final = f"lupin_session_{self._mac('name')[:8]}"

    def accepts_header(self, authorization: str) -> bool:
        """Whether an Authorization header carries the token."""
        scheme, _, given = authorization.partition(" ")
        # Digests, so that not even the token's length shows in the time taken.
        right = hmac.compare_digest(_digest(given.strip().encode()), self._digest)
        return right and scheme.lower() == "bearer"

    def cookie(self, name: str, now_s: float) -> str:
        """The cookie of a session from `now_s` on, s since the epoch.

        `name` is 32 hexadecimal digits that no other session has.
        """
        session = f"{int(now_s) + SESSION_S}.{name}"
        return f"{session}.{self._mac(session)}"

    def session_of(self, cookie: str, now_s: float) -> BrowserSession | None:
        """The session that a cookie stands for; None: it is none of ours, or has ended."""
        match = _COOKIE.fullmatch(cookie)
        if match is None or int(match["ends"]) <= now_s:
            return None
        if not hmac.compare_digest(match["mac"].encode(), self._mac(match["session"]).encode()):
            return None
        return BrowserSession(match["name"], int(match["ends"]))

    def _mac(self, text: str) -> str:
        return hmac.new(self._key, text.encode(), hashlib.sha256).hexdigest()


def _digest(secret: bytes) -> bytes:
    return hashlib.sha256(secret).digest()
