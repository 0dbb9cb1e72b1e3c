from __future__ import annotations

import contextlib
import os

import pytest

from lupin_bridge.bags.bag_file import Spool


def test_what_the_file_does_not_take_waits_and_goes_on_where_it_stopped() -> None:
    reader, file = os.pipe()
    os.set_blocking(file, False)
    os.set_blocking(reader, False)
    spool = Spool(file)
    whole = os.urandom(300_000)  # more than a pipe holds
    assert spool.write(whole) == spool.tell() == spool.waiting == len(whole)
    read = b""
    with pytest.raises(BlockingIOError):
        spool.drain()
    assert 0 < spool.waiting < len(whole)
    while spool.waiting:
        read += os.read(reader, 50_000)
        with contextlib.suppress(BlockingIOError):
            spool.drain()
        assert spool.tell() == len(whole)
    os.close(file)
    while more := os.read(reader, 50_000):
        read += more
    os.close(reader)
    assert read == whole


def test_a_full_disk_takes_nothing() -> None:
    file = os.open("/dev/full", os.O_WRONLY)
    spool = Spool(file)
    spool.write(b"abc")
    with pytest.raises(OSError, match="No space left"):
        spool.drain()
    assert (spool.waiting, spool.tell()) == (3, 3)
    os.close(file)
