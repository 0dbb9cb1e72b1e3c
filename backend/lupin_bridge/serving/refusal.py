"""What is said to who does not get as far as the application: an HTTP answer, whole. Pure."""

from __future__ import annotations

from typing import Final

import orjson

# Not `http.HTTPStatus`: its names for 414 and 431 depend on the version of Python.
_PHRASES: Final = {
    400: "Bad Request",
    413: "Content Too Large",
    414: "URI Too Long",
    431: "Request Header Fields Too Large",
}


def refusal(status: int, detail: str) -> bytes:
    """An answer (`schema.ErrorMessage`) after which the connection ends."""
    body = orjson.dumps({"detail": detail})
    head = (
        f"HTTP/1.1 {status} {_PHRASES[status]}\r\n"
        "Content-Type: application/json\r\n"
        f"Content-Length: {len(body)}\r\n"
        "Cache-Control: no-store\r\n"
        "X-Content-Type-Options: nosniff\r\n"
        "Connection: close\r\n\r\n"
    )
    return head.encode() + body
