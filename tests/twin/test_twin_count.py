"""A second twin counts once it was heard, which the shadow of a dead one never is."""

from __future__ import annotations

from collections.abc import Iterable

from hypothesis import given
from hypothesis import strategies as st

from lupin_twin.numbering import MAX_ROWS, TwinCount


def heard(*numbers: Iterable[int]) -> TwinCount:
    """A count that has heard these states, from two publishers in the graph."""
    count = TwinCount()
    for number in (number for some in numbers for number in some):
        count.hear(number)
    count.see(2)
    return count


def test_one_twin_is_one_and_none_is_no_mistake() -> None:
    count = TwinCount()
    for number in range(1, 9):
        count.hear(number)
        assert not count.see(1)
    assert not count.see(0)
    assert count.value == 1


@given(st.integers(1, 50), st.integers(0, 60))
def test_a_restarted_twin_is_not_taken_for_two(first: int, second: int) -> None:
    """Nor when it passes the number at which the dead one has ended."""
    assert heard(range(first, 51), range(1, second)).value == 1


@given(st.lists(st.integers(1, 30), unique=True).map(sorted))
def test_states_that_were_lost_are_no_second_twin(numbers: list[int]) -> None:
    assert heard(numbers).value == 1


@given(st.integers(1, 40), st.integers(1, 40))
def test_two_that_speak_by_turns_are_two_after_two_states_of_each(first: int, second: int) -> None:
    pairs = ((first + step, second + step) for step in range(2))
    # One right behind the other looks like one publisher, for a state.
    assert heard(*pairs).value == 2 or abs(first - second) == 1
    assert heard(*((first + step, second + step) for step in range(3))).value == 2


def test_two_are_two_until_one_has_left_the_graph() -> None:
    count = heard([5, 1, 6])
    assert count.see(3)
    assert count.value == 3
    assert not count.see(1)
    assert count.value == 1
    count.hear(7)
    assert not count.see(2)


def test_what_is_kept_of_many_is_bounded() -> None:
    count = heard(range(0, 1_000, 10))
    assert len(count._rows) == MAX_ROWS
    count.hear(991)
    assert not count.see(2)
    count.hear(10 * (100 - MAX_ROWS) + 1)  # the oldest that is kept
    assert count.see(2)
