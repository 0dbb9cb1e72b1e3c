"""Our own cookie out of a request's headers, by one look along them. Pure.

The standard library's parser undoes quotes and escapes, before Python 3.11.10 and 3.12.6 in a time
that grows with the square of the length (CVE-2024-7592): 40 kB of backslashes held up everybody
for two seconds. Ours is never quoted, and nobody else's is looked at.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

# What a browser keeps for one host may be more, but no WebSocket handshake with a longer line gets
# through: without this limit, the page would come and its data would not.
MAX_COOKIE_BYTES: Final = 8_000


class CookieTooLong(ValueError):
    """More than is looked at; the message says how long it is, and the limit."""


def values_of(name: str, headers: Iterable[tuple[bytes, bytes]]) -> list[str]:
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
