from __future__ import annotations

from collections.abc import Iterable

from hypothesis import given
from hypothesis import strategies as st

from lupin_twin.numbering import MAX_WRITERS, Gaps


def lost(numbers: Iterable[int], writers: int = 1) -> list[int]:
    gaps = Gaps()
    return [gaps.see(number, lambda: writers) for number in numbers]


def test_numbers_one_behind_the_other_have_lost_nothing_wherever_they_begin() -> None:
    assert lost([151, 152, 153]) == [0, 0, 0]


def test_what_is_left_out_is_lost() -> None:
    assert lost([1, 151, 152, 154]) == [0, 149, 0, 1]


def test_two_writers_are_told_apart_by_where_each_left_off() -> None:
    assert lost([1, 100, 2, 101, 3, 105, 6], writers=2) == [0, 0, 0, 0, 0, 3, 2]


def test_a_number_that_may_be_a_new_writers_first_is_no_gap() -> None:
    assert lost([1, 2, 40, 41], writers=2) == [0, 0, 0, 0]


def test_a_writer_that_starts_anew_is_no_gap() -> None:
    assert lost([700, 701, 1, 2]) == [0, 0, 0, 0]


def test_only_so_many_writers_are_followed() -> None:
    gaps = Gaps()
    for start in range(0, 1000 * (MAX_WRITERS + 1), 1000):
        gaps.see(start, lambda: MAX_WRITERS + 1)
    assert gaps.see(1, lambda: 1) == 0, "the first is forgotten"
    assert len(gaps._next) == MAX_WRITERS


@given(st.lists(st.integers(0, 3), min_size=1), st.integers(1, 10**6))
def test_of_one_writer_every_lost_message_is_counted(skips: list[int], start: int) -> None:
    gaps, number = Gaps(), start
    gaps.see(number, lambda: 1)
    for skip in skips:
        number += 1 + skip
        assert gaps.see(number, lambda: 1) == skip
    assert gaps.lost == sum(skips)


def test_who_has_said_nothing_for_long_begins_with_1() -> None:
    gaps = Gaps()
    assert gaps.see(7, lambda: 3) == 0
    gaps.settle(3)
    gaps.settle(3)
    # Whose 951 is, is not told: the rest is counted as the other's number comes.
    assert [gaps.see(number, lambda: 3) for number in (951, 8, 1, 952)] == [943, 7, 0, 0]
    assert gaps.lost == 950


def test_who_comes_behind_those_who_have_said_nothing_may_begin_anywhere() -> None:
    gaps = Gaps()
    gaps.settle(1)
    gaps.unsettle()
    assert gaps.see(951, lambda: 1) == 0
