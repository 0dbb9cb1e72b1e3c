"""Chunks that unpack into more than they say, or than anybody has memory for."""

from __future__ import annotations

import struct
import tracemalloc

import lz4.frame  # type: ignore[import-untyped]
import pytest
import zstandard
from mcap.records import Chunk

from lupin_bridge.bags.chunks import DAMAGE, MAX_CHUNK, begin_of, records_in, unpacked

DATA = b"some bytes" * 100
PACKED = {"zstd": zstandard.compress(DATA), "lz4": lz4.frame.compress(DATA), "": DATA}
# A block of 128 kB of zeros in four bytes; and the last one.
ZEROS = struct.pack("<I", 131072 << 3 | 2)[:3] + b"\0"
LAST = struct.pack("<I", 131072 << 3 | 3)[:3] + b"\0"


def zstd_bomb(size: int) -> bytes:
    """A frame that says its size, and keeps it."""
    head = struct.pack("<IBQ", 0xFD2FB528, 0xE0, size)
    return head + ZEROS * (size // 131072 - 1) + LAST


def chunk(data: bytes, compression: str = "zstd", size: int = len(DATA), check: int = 0) -> Chunk:
    return Chunk(
        compression=compression,
        data=data,
        message_start_time=0,
        message_end_time=0,
        uncompressed_size=size,
        uncompressed_crc=check,
    )


@pytest.mark.parametrize("compression", PACKED)
def test_it_is_unpacked_whole_and_no_further_than_it_says(compression: str) -> None:
    packed = PACKED[compression]
    assert unpacked(chunk(packed, compression)) == DATA
    assert begin_of(compression, packed, 7) == DATA[:7]
    with pytest.raises(ValueError, match="more than the 999 bytes that it says"):
        unpacked(chunk(packed, compression, len(DATA) - 1))
    with pytest.raises(ValueError, match="fewer than the 1,001 bytes that it says"):
        unpacked(chunk(packed, compression, len(DATA) + 1))
    with pytest.raises(ValueError, match="check of a chunk does not fit"):
        unpacked(chunk(packed, compression, check=1))


def test_a_bomb_costs_what_it_says_at_most() -> None:
    lz4_bomb = lz4.frame.compress(bytes(1 << 28))
    tracemalloc.start()
    try:
        for bomb in (
            chunk(zstd_bomb(1 << 32)),
            chunk(zstd_bomb(1 << 32), size=MAX_CHUNK + 1),
            chunk(lz4_bomb, "lz4"),
            chunk(DATA, "bz2"),
        ):
            with pytest.raises(DAMAGE):
                unpacked(bomb)
        assert tracemalloc.get_traced_memory()[1] < 10_000_000
    finally:
        tracemalloc.stop()


def test_a_length_that_lies_ends_the_records() -> None:
    record = b"\x05" + struct.pack("<Q", 3) + b"abc"
    assert list(records_in(record * 2)) == [(5, b"abc")] * 2
    for rest in (b"\x05" + struct.pack("<Q", 2**63) + b"abc", record[:4], record[:-1]):
        records = records_in(record + rest)
        assert next(records) == (5, b"abc")
        with pytest.raises(ValueError, match="cut off"):
            next(records)
