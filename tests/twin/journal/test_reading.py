from __future__ import annotations

import math

import pytest

from lupin_twin.journal.rows import flower_of, numbers_of, sensor_names
from lupin_twin.journal.schema import DamagedFile


def test_lists_of_numbers_are_read_at_once() -> None:
    first, second, nothing = numbers_of(["[1,2.5]", "[null]", "[]"])
    assert (first, nothing) == ([1.0, 2.5], [])
    assert math.isnan(second[0])
    assert all(isinstance(value, float) for value in first)


@pytest.mark.parametrize("text", ["[1,", "[1],[2]", "7", '["x"]', "", "[[1]]"])
def test_what_is_no_list_of_numbers_is_damage(text: str) -> None:
    with pytest.raises(DamagedFile):
        numbers_of(["[1]", text])


@pytest.mark.parametrize("text", ['["t"', "5", "[[1]]"])
def test_what_is_no_list_of_names_is_damage(text: str) -> None:
    with pytest.raises(DamagedFile):
        sensor_names(text)


def test_blooms_that_are_none_are_damage() -> None:
    assert flower_of(["rose", None, 1, 2, 3, "[]", "[]"]).anomaly
    with pytest.raises(DamagedFile):
        flower_of(["rose", 0.5, 1, 2, 3, "[[1]]", "[]"])
