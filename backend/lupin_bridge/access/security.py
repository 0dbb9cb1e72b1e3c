"""Headers and methods: what holds for every answer, whichever route gave it."""

from __future__ import annotations

from typing import Final

import orjson
from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

_METHODS: Final = ("GET", "HEAD")

# The page loads nothing from elsewhere, is framed by nobody, and runs no inline script. No other
# page gets at an answer unless by CORS, which CORP does not touch. No HSTS: it would take the way
# past a self-signed certificate, and it binds all ports of a host, other people's services too.
_HEADERS: Final = {
    "Cache-Control": "no-cache",
    "Content-Security-Policy": (
        "default-src 'self'; img-src 'self' blob: data:; connect-src 'self'; object-src 'none'; "
        "base-uri 'none'; form-action 'self'; frame-ancestors 'none'"
    ),
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}


class ReadOnly:
    """ASGI middleware: GET and HEAD only, and the security headers on everything."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a read on, refuse anything else."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return

        send = with_security_headers(send)
        if scope["method"] in _METHODS:
            await self._app(scope, receive, send)
        else:
            await _refuse_method(scope["method"], send)


def with_security_headers(send: Send) -> Send:
    """`send`, with the headers above on every answer that does not have its own."""

    async def send_with_headers(message: Message) -> None:
        if message["type"] in ("http.response.start", "websocket.http.response.start"):
            headers = MutableHeaders(scope=message)
            for name, value in _HEADERS.items():
                headers.setdefault(name, value)
        await send(message)

    return send_with_headers


async def _refuse_method(method: str, send: Send) -> None:
    detail = f"method {method[:16]} is not allowed: nothing here writes, use GET or HEAD"
    body = orjson.dumps({"detail": detail})
    await send(
        {
            "type": "http.response.start",
            "status": 405,
            "headers": [
                (b"allow", b"GET, HEAD"),
                (b"content-type", b"application/json"),
                (b"content-length", str(len(body)).encode()),
            ],
        }
    )
    await send({"type": "http.response.body", "body": body})
