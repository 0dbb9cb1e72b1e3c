from __future__ import annotations

import os
from pathlib import Path

import pytest

from lupin_bridge.bags.syncing import Syncing
from tests.support.waiting import wait_for


def is_closed(file: int) -> bool:
    try:
        os.fstat(file)
    except OSError:
        return True
    return False


def test_a_descriptor_is_synced_and_closed(tmp_path: Path) -> None:
    syncing = Syncing()
    assert not syncing.is_busy
    file = os.open(tmp_path / "a", os.O_WRONLY | os.O_CREAT)
    syncing.sync(file)
    wait_for(lambda: not syncing.is_busy, "the end of it")
    assert is_closed(file)
    assert syncing.error is None


def test_what_cannot_be_synced_is_told() -> None:
    reader, file = os.pipe()
    syncing = Syncing()
    syncing.sync(file)
    wait_for(lambda: not syncing.is_busy, "the end of it")
    os.close(reader)
    assert is_closed(file)
    with pytest.raises(OSError, match="Invalid argument"):
        raise syncing.error or AssertionError("nothing was told")
