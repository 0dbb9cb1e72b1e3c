"""States and their times, which come over two topics in any order."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from lupin_bridge.feed.pairing import KEPT, Pairing


def test_what_comes_second_gets_what_came_first() -> None:
    pairing = Pairing()
    assert pairing.take_state(1, "state 1") is None
    assert pairing.take_times(1, "times 1") == "state 1"
    assert pairing.take_times(2, "times 2") is None
    assert pairing.take_state(2, "state 2") == "times 2"


def test_times_of_another_state_are_nobodys() -> None:
    pairing = Pairing()
    pairing.take_times(1, "times 1")
    assert pairing.take_state(2, "state 2") is None
    assert pairing.take_times(3, "times 3") is None
    assert pairing.take_times(2, "times 2") == "state 2"


def test_a_clock_that_stands_still_pairs_each_once() -> None:
    pairing = Pairing()
    for number in range(3):
        assert pairing.take_state(7, f"state {number}") is None
        assert pairing.take_times(7, f"times {number}") == f"state {number}"


def test_who_gives_up_waiting_takes_the_newest_and_nothing_older_comes_after_it() -> None:
    pairing = Pairing()
    assert pairing.give_up_waiting() is None
    for stamp_ns in (1, 2, 3):
        pairing.take_state(stamp_ns, f"state {stamp_ns}")
    assert pairing.give_up_waiting() == "state 3"
    assert pairing.take_times(2, "times 2") is None
    assert pairing.take_times(3, "times 3") == "state 3"


def test_it_keeps_a_few_of_each_and_the_newest() -> None:
    pairing = Pairing()
    for stamp_ns in range(KEPT + 1):
        pairing.take_state(stamp_ns, f"state {stamp_ns}")
    assert pairing.take_times(0, "times 0") is None
    assert pairing.take_times(1, "times 1") == "state 1"


@given(st.lists(st.tuples(st.booleans(), st.integers(0, 5)), max_size=30))
def test_only_what_has_one_stamp_is_ever_paired(steps: list[tuple[bool, int]]) -> None:
    pairing = Pairing()
    for is_state, stamp_ns in steps:
        take = pairing.take_state if is_state else pairing.take_times
        assert take(stamp_ns, stamp_ns) in (None, stamp_ns)
