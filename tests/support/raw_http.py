"""An HTTP client that can send what no proper client would: bytes in, bytes out."""

import socket
from contextlib import suppress
from urllib.parse import urlsplit

from tests.support.waiting import PATIENCE_S

UPGRADE = (
    b"Host: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    b"Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n"
)


def handshake(path: str) -> bytes:
    """The request for a WebSocket; only Foxglove's route reads the subprotocol."""
    return b"GET %b HTTP/1.1\r\n%bSec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n" % (
        path.encode(),
        UPGRADE,
    )


def connect(url: str, source: str = "", *, room: int | None = None) -> socket.socket:
    """A connection to a bridge; `source` is our own address, `room` its receive buffer, bytes."""
    address = urlsplit(url)
    client = socket.socket()
    try:
        if room is not None:
            client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, room)
        client.settimeout(PATIENCE_S)
        client.bind((source, 0))
        client.connect((address.hostname, address.port))
    except BaseException:
        client.close()
        raise
    return client


def received(client: socket.socket) -> bytes:
    """All bytes until the connection ends."""
    blocks = []
    with suppress(ConnectionError):
        while block := client.recv(65_536):
            blocks.append(block)
    return b"".join(blocks)


def answer(url: str, message: bytes) -> bytes:
    """All bytes after this request, until the other side ends the connection."""
    with connect(url) as client:
        client.sendall(message)
        return received(client)


def status(message: bytes) -> int:
    """The status of an answer; 0: there is none."""
    return int(message.split(b" ", 2)[1]) if message.startswith(b"HTTP/1.1 ") else 0


def is_over(client: socket.socket) -> bool:
    """Whether the other side has closed or reset a connection (tcp.h: 1 is ESTABLISHED)."""
    return client.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, 1)[0] != 1
