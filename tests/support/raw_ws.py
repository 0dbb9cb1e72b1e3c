"""A WebSocket client that can send what no proper client would: bytes in, bytes out."""

import asyncio
import random
import socket
import struct
from collections.abc import Iterator
from contextlib import suppress
from typing import Self

from tests.support.raw_http import connect, handshake

CONT, TEXT, BINARY, CLOSE, PING, PONG = 0x0, 0x1, 0x2, 0x8, 0x9, 0xA


def masked(opcode: int, payload: bytes, *, fin: bool = True, rsv: int = 0) -> bytes:
    """A client's frame (RFC 6455, section 5.2), masked with zeros, which changes nothing."""
    length = len(payload)
    if length < 126:
        size = bytes([0x80 | length])
    elif length < 65_536:
        size = b"\xfe" + struct.pack("!H", length)
    else:
        size = b"\xff" + struct.pack("!Q", length)
    return bytes([fin << 7 | rsv << 4 | opcode]) + size + bytes(4) + payload


def frames_of(data: bytes) -> Iterator[tuple[int, bytes]]:
    """(opcode, payload) of a server's frames; an unfinished one at the end is left out."""
    start = 0
    while len(data) - start >= 2:
        length = data[start + 1]
        header = 2 if length < 126 else 4 if length == 126 else 10
        if header > 2:
            length = int.from_bytes(data[start + 2 : start + header])
        end = start + header + length
        if end > len(data):
            return
        yield data[start] & 0x0F, data[start + header : end]
        start = end


class RawClient:
    """A connection after its handshake."""

    def __init__(self, url: str, path: str) -> None:
        self.socket = connect(url)
        self.socket.sendall(handshake(path))
        self.received = b""
        while b"\r\n\r\n" not in self.received:
            self.received += self.socket.recv(65_536)
        head, _, self.received = self.received.partition(b"\r\n\r\n")
        assert head.startswith(b"HTTP/1.1 101 "), head

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.socket.close()

    def exchange(self, data: bytes) -> list[tuple[int, bytes]]:
        """Send only this, and return all frames up to the end of the connection."""
        blocks = [self.received]
        # An error: the server reset the connection before it had read everything.
        with suppress(OSError):
            self.socket.sendall(data)
            self.socket.shutdown(socket.SHUT_WR)
        with suppress(ConnectionError):
            while block := self.socket.recv(1 << 18):
                blocks.append(block)
        return list(frames_of(b"".join(blocks)))


async def deaf(url: str, path: str) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    """A client that reads nothing but the answer to its handshake."""
    raw = connect(url, room=4_096)
    raw.setblocking(False)
    reader, writer = await asyncio.open_connection(sock=raw, limit=1024)
    writer.write(handshake(path))
    assert b" 101 " in await reader.readuntil(b"\r\n\r\n")
    return reader, writer


def random_payload(chance: random.Random, longest: int) -> bytes:
    """Some bytes; short ones more often."""
    return chance.randbytes(int(longest * chance.random() ** 4))
