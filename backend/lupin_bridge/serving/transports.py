"""What asyncio leaves to the socket: how much the kernel hoards for a reader, and a real end."""

from __future__ import annotations

import asyncio
import socket
import struct
from typing import Final

import orjson

# What is said to who does not get as far as the application: an HTTP answer, whole. Pure.


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


# What the kernel may hold that the network has not taken; what is under way does not count. On its
# own it would hold 4 MB (tcp_wmem): for a slow reader, minutes of old states.
UNSENT_BYTES: Final = 128 * 1024

# How long a client that is told to go has to read the reason before its socket is torn down. Closed
# at once, with more of the client's still on its way, it would be reset, and the reason lost.
CLOSE_GRACE_S: Final = 1.0


def bound_unsent(transport: asyncio.BaseTransport) -> None:
    """Let a connection's socket take no more than `UNSENT_BYTES` ahead of the network."""
    connection: socket.socket = transport.get_extra_info("socket")
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NOTSENT_LOWAT, UNSENT_BYTES)


def tear_down(transport: asyncio.WriteTransport) -> None:
    """End a connection now; one whose other side does not read is reset.

    Closed, its socket would go on offering what nobody reads for another four minutes.
    """
    if _has_let_go(transport):
        return
    if transport.get_write_buffer_size() > 0:
        reset(transport)
    else:
        transport.abort()


def reset(transport: asyncio.WriteTransport) -> None:
    """End a connection now, and so that its other side takes it for no proper end."""
    if _has_let_go(transport):
        return
    no_lingering = struct.pack("ii", 1, 0)
    connection: socket.socket = transport.get_extra_info("socket")
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, no_lingering)
    transport.abort()


def _has_let_go(transport: asyncio.WriteTransport) -> bool:
    """Whether it is one of asyncio's for TLS that was closed when its connection had ended.

    All that it can be asked then, even how much is unsent, is an AttributeError.
    """
    return getattr(transport, "_ssl_protocol", transport) is None
