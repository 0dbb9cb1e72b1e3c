import os
from pathlib import Path

import pytest

from lupin_twin.journal.paths import Syncing
from lupin_twin.journal.schema import open_writer
from tests.support.waiting import wait_for


def test_a_failed_sync_is_reported_with_the_next_write(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(descriptor: int) -> None:
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(os, "fdatasync", fail)
    path = tmp_path / "j.sqlite"
    connection = open_writer(path)
    connection.execute("INSERT INTO site VALUES ('7', '')")
    syncing = Syncing(path, period_s=0.0)

    def write() -> str:
        try:
            syncing.has_written()
        except OSError as error:
            return str(error)
        return ""

    assert "Input/output error" in wait_for(write, "the error")
    with pytest.raises(OSError, match="Input/output"):
        syncing.has_written()
    syncing.close()
    connection.close()
