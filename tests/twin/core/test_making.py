from __future__ import annotations

from dataclasses import FrozenInstanceError
from itertools import repeat

import pytest

from lupin_twin.core.state import Attempt, Reading
from lupin_twin.journal.fold import make_many


def test_many_are_what_they_would_be_one_by_one() -> None:
    made = make_many(Reading, 3, ["a", "b", "c"], (1.0, 2.0, 3.0), iter((7, 8, 9)))
    assert made == [Reading("a", 1.0, 7), Reading("b", 2.0, 8), Reading("c", 3.0, 9)]
    with pytest.raises(FrozenInstanceError):
        made[0].value = 2.0  # type: ignore[misc]


def test_each_field_has_to_be_given() -> None:
    with pytest.raises(ValueError, match="shorter"):
        make_many(Attempt, 2, repeat(5), repeat(0))
