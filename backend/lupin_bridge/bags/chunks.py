"""What is in a chunk of a recording, and never more memory than a chunk may have.

A megabyte of zstd or LZ4 unpacks into gigabytes if its writer wants that; and every length in it
may lie. Form: https://mcap.dev/spec
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from typing import Final, NamedTuple

import zstandard
from lz4.frame import LZ4FrameDecompressor  # type: ignore[import-untyped]
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Chunk

# Nobody records so much in one piece, bytes.
MAX_CHUNK: Final = 512 * 1024 * 1024
RECORD: Final = struct.Struct("<BQ")
MESSAGE: Final = struct.Struct("<HIQQ")
# What reading a record that is none, or a damaged one, may end in. lz4 raises RuntimeError.
DAMAGE: Final = (
    McapError, ValueError, LookupError, OverflowError, struct.error, zlib.error, RuntimeError,
    MemoryError, EOFError, zstandard.ZstdError,
)  # fmt: skip


class TooLarge(ValueError):
    """It may be whole, but takes more memory than anybody shall be made to give."""


class Found(NamedTuple):
    """A message by its channel's number; when it was received and when sent, ns; serialised."""

    channel: int
    log_ns: int
    publish_ns: int
    data: bytes


def unpacked(chunk: Chunk) -> bytes:
    """What is in a chunk, checked.

    Raises:
        TooLarge: it has more than `MAX_CHUNK` bytes.
        ValueError, and the rest of `DAMAGE`: it is damaged, or larger than it says.

    """
    size = chunk.uncompressed_size
    if size > MAX_CHUNK:
        raise TooLarge(f"a chunk has {size:,} bytes, must be at most {MAX_CHUNK:,}")
    data = begin_of(chunk.compression, chunk.data, size + 1)
    if len(data) != size:
        which = "more" if len(data) > size else "fewer"
        raise ValueError(f"a chunk has {which} than the {size:,} bytes that it says")
    if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
        raise ValueError("the check of a chunk does not fit")
    return data


def begin_of(compression: str, packed: bytes, most: int = MAX_CHUNK) -> bytes:
    """The first `most` bytes, if there are so many: also of what is cut off."""
    if compression == "zstd":
        unpacker = zstandard.ZstdDecompressor(max_window_size=1 << 30)
        with unpacker.stream_reader(packed) as stream:
            return bytes(stream.read(most))
    if compression == "lz4":
        return bytes(LZ4FrameDecompressor().decompress(packed, max_length=most))
    if compression:
        raise ValueError(f"a chunk is packed as {compression!r}, must be 'zstd' or 'lz4'")
    return packed[:most]


def records_in(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Opcode and body of the records in a chunk.

    Raises:
        ValueError: the last one is cut off.

    """
    at = 0
    while at + RECORD.size <= len(data):
        opcode, length = RECORD.unpack_from(data, at)
        end = at + RECORD.size + length
        if end > len(data):
            break
        yield opcode, data[at + RECORD.size : end]
        at = end
    if at < len(data):
        raise ValueError("a record in a chunk is cut off")


def messages_in(data: bytes) -> Iterator[Found]:
    """The messages in a chunk.

    Raises:
        ValueError, struct.error: it is damaged.

    """
    for opcode, body in records_in(data):
        if opcode == Opcode.MESSAGE:
            channel, _, log_ns, publish_ns = MESSAGE.unpack_from(body)
            yield Found(channel, log_ns, publish_ns, body[MESSAGE.size :])
