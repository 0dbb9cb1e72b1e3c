from __future__ import annotations

import pytest

from lupin_twin.core.journal_condition import Condition, JournalState

WELL = {JournalState.UNKNOWN, JournalState.OFF, JournalState.STARTING, JournalState.RECORDING}


@pytest.mark.parametrize("state", JournalState)
def test_what_does_not_keep_its_promise_has_to_be_told(state: JournalState) -> None:
    assert Condition(state).is_well == (state in WELL)
