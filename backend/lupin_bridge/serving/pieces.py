"""A large WebSocket message as a row of small frames, whose payloads are views of it. Pure.

asyncio copies what a socket does not take. Of a map for a hundred clients that do not read, that
would be a hundred copies; so each gets the next piece when it has taken the one before, and all of
them share the message. A ping, its answer and a close may come between two pieces (RFC 6455,
section 5.4).
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import Final

PIECE_BYTES: Final = 131_072

# A frame's head, perhaps with the beginning of its payload, and what follows it.
Piece = tuple[bytes, bytes | memoryview]

_FIN: Final = 0x80
_OPCODE: Final = 0x0F
_CONTINUATION: Final = 0


def pieces(frame: bytes, rest: bytes = b"") -> Iterator[Piece]:
    """A whole message as frames of `PIECE_BYTES` at most; one that is small stays as it is.

    `frame` is unmasked and its head tells the length of all, `rest` what is not yet in it.
    """
    if len(frame) + len(rest) <= PIECE_BYTES:
        yield frame, rest
        return
    parts = [part for part in (memoryview(frame)[_head_bytes(frame) :], memoryview(rest)) if part]
    opcode = frame[0] & _OPCODE
    for part in parts:
        for start in range(0, len(part), PIECE_BYTES):
            payload = part[start : start + PIECE_BYTES]
            is_last = part is parts[-1] and start + PIECE_BYTES >= len(part)
            yield _head(opcode | (_FIN if is_last else 0), len(payload)), payload
            opcode = _CONTINUATION


def _head_bytes(frame: bytes) -> int:
    return {126: 4, 127: 10}.get(frame[1], 2)


def _head(first: int, length: int) -> bytes:
    if length < 126:
        return bytes((first, length))
    if length < 1 << 16:
        return struct.pack("!BBH", first, 126, length)
    return struct.pack("!BBQ", first, 127, length)
