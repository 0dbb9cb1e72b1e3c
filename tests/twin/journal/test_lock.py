from __future__ import annotations

import os
from pathlib import Path

import pytest

from lupin_twin.journal.beside import InUse, Lock, holder_of


def test_a_second_holder_is_refused_by_name(tmp_path: Path) -> None:
    journal = tmp_path / "j.sqlite"
    with (
        Lock(journal, "/house/lupin_twin"),
        pytest.raises(InUse, match=rf"{journal} is in use by /house/lupin_twin.*{os.getpid()}"),
    ):
        Lock(journal, "/other/lupin_twin")


def test_who_holds_it_can_be_asked_without_holding_it(tmp_path: Path) -> None:
    journal = tmp_path / "j.sqlite"
    assert holder_of(journal) is None
    assert list(tmp_path.iterdir()) == []
    with Lock(journal, "/lupin_twin"):
        assert holder_of(journal) == f"/lupin_twin (process {os.getpid()})"
    assert holder_of(journal) is None
