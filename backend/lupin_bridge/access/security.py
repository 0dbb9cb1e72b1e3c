"""Headers and methods: what holds for every answer, whichever route gave it."""

from __future__ import annotations

from typing import Final

import orjson
from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from lupin_bridge.access.entrance import path_of

_READS: Final = ("GET", "HEAD")
# Where a session begins and ends. A form, a link or a picture of a foreign page can ask for these
# too, with the browser's cookie, but none of them can send a header of its own: for that, a script
# has to ask first (CORS preflight), and is not given leave.
POSTED: Final = frozenset({"/api/signin", "/api/signout"})
OWN_HEADER: Final = "X-Lupin-Twin"

# The page loads nothing from elsewhere, is framed by nobody, and runs no inline script. No other
# page gets at an answer unless by CORS, which CORP does not touch. No HSTS: it would take the way
# past a self-signed certificate, and it binds all ports of a host, other people's services too.
CONTENT_POLICY: Final = (
    "default-src 'self'; img-src 'self' blob: data:; connect-src 'self'; object-src 'none'; "
    "base-uri 'none'; form-action 'self'; frame-ancestors 'none'"
)
_HEADERS: Final = {
    "Cache-Control": "no-cache",
    "Content-Security-Policy": CONTENT_POLICY,
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}


class ReadOnly:
    """ASGI middleware: reads only, but for sign-in and sign-out, and the headers on everything."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on what a path is there for, refuse anything else."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return

        send = with_security_headers(send)
        method = scope["method"]
        methods = ("POST",) if path_of(scope) in POSTED else _READS
        if method not in methods:
            detail = f"method {method[:16]} is not allowed here, use {' or '.join(methods)}"
            await _refuse(405, detail, send, (b"allow", ", ".join(methods).encode()))
        elif method == "POST" and OWN_HEADER not in Headers(scope=scope):
            await _refuse(
                403, f"{method} without the header {OWN_HEADER}, expected any value", send
            )
        else:
            await self._app(scope, receive, send)


def with_security_headers(send: Send) -> Send:
    """`send`, with the headers above on every answer that does not have its own."""

    async def send_with_headers(message: Message) -> None:
        if message["type"] in ("http.response.start", "websocket.http.response.start"):
            headers = MutableHeaders(scope=message)
            for name, value in _HEADERS.items():
                headers.setdefault(name, value)
        await send(message)

    return send_with_headers


async def _refuse(status: int, detail: str, send: Send, *headers: tuple[bytes, bytes]) -> None:
    body = orjson.dumps({"detail": detail})
    await send(
        {
            "type": "http.response.start",
            "status": status,
            "headers": [
                *headers,
                (b"content-type", b"application/json"),
                (b"content-length", str(len(body)).encode()),
            ],
        }
    )
    await send({"type": "http.response.body", "body": body})
