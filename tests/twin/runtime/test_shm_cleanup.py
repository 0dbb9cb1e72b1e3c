"""Stale Fast DDS shared memory of a killed process, and that nothing hangs on it."""

import logging
import os
import struct
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from lupin_twin.runtime.process import FOLDER, ports, remove_stale_shared_memory
from tests.support.domains import own_domain
from tests.support.processes import twin_node

DOMAIN = 7
PORT = 7400 + 250 * DOMAIN + 11
BEING_MADE = struct.pack("=I", 1) + bytes(52_396)
MADE = struct.pack("=I", 2) + bytes(52_396)


def leave(folder: Path, content: bytes, port: int = PORT, old_s: float = 60.0) -> Path:
    path = folder / f"fastrtps_port{port}"
    path.write_bytes(content)
    then = time.time() - old_s
    os.utime(path, (then, then))
    return path


@pytest.mark.parametrize("content", [b"", b"\0\0", bytes(52_400), BEING_MADE])
def test_stale_segments_are_removed_and_logged(
    tmp_path: Path, content: bytes, caplog: pytest.LogCaptureFixture
) -> None:
    path = leave(tmp_path, content)
    assert remove_stale_shared_memory(DOMAIN, tmp_path) == [path.name]
    assert not path.exists()
    assert caplog.messages == [f"removed {path}, left unfinished by a killed process"]


def test_complete_new_foreign_and_other_files_stay(tmp_path: Path) -> None:
    stored = [
        leave(tmp_path, MADE),
        leave(tmp_path, BEING_MADE, PORT + 1, old_s=0.0),
        leave(tmp_path, BEING_MADE, 9_149),
        leave(tmp_path, BEING_MADE, 9_400),
        tmp_path / f"fastrtps_port{PORT + 2}",
        tmp_path / f"fastrtps_port{PORT + 3}",
        tmp_path / f"fastrtps_port{PORT + 4}",
    ]
    stored[4].mkdir()
    stored[5].symlink_to(stored[2])
    os.mkfifo(stored[6])
    open_files = len(list(Path("/proc/self/fd").iterdir()))
    assert remove_stale_shared_memory(DOMAIN, tmp_path) == []
    assert len(list(Path("/proc/self/fd").iterdir())) == open_files
    assert all(path.exists() for path in stored)
    assert remove_stale_shared_memory(DOMAIN, tmp_path / "none") == []


def test_a_segment_that_cannot_be_removed_is_an_error_with_a_remedy(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = leave(tmp_path, BEING_MADE)

    def refuse(_: Path) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(Path, "unlink", refuse)
    assert remove_stale_shared_memory(DOMAIN, tmp_path) == []
    [record] = caplog.records
    assert record.levelno == logging.ERROR
    assert str(path) in record.message
    assert "FASTDDS_BUILTIN_TRANSPORTS=UDPv4" in record.message


@pytest.fixture
def strewn() -> Iterator[int]:
    """A domain in which the first process's ports are left incomplete."""
    with own_domain() as domain:
        left = [leave(FOLDER, BEING_MADE, port) for port in ports(domain)[10:16]]
        try:
            yield domain
        finally:
            for path in left:
                path.unlink(missing_ok=True)


def test_a_twin_starts_where_one_was_killed_during_its_start(strewn: int) -> None:
    with twin_node(strewn) as twin:
        twin.wait_for_output("left unfinished by a killed process")
        twin.wait_for_output(f"in ROS domain {strewn} subscribes")
