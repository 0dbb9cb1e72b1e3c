"""Publishers of an input: each message once, lost ones, and a second twin on the same topic."""

import os
from collections.abc import Iterable
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from lupin_twin.ros.inputs import Gaps, Input, other_users


def test_other_users_are_those_who_own_ports_of_the_domain(tmp_path: Path) -> None:
    own = os.geteuid()
    (tmp_path / "fastrtps_port7650").touch()  # 7400 + 250 * 1
    assert other_users(1, tmp_path, own) == []
    assert other_users(1, tmp_path, own + 1) == [f"uid {own}"]
    assert other_users(2, tmp_path, own + 1) == [], "of another domain"
    assert other_users(1, tmp_path / "none", own + 1) == []


def test_a_long_silent_publisher_begins_with_1() -> None:
    gaps = Gaps()
    assert gaps.see(7, lambda: 3) == 0
    gaps.settle(3)
    gaps.settle(3)
    # Whose 951 is missing is unknown: the rest is counted when the other's number arrives.
    assert [gaps.see(number, lambda: 3) for number in (951, 8, 1, 952)] == [943, 7, 0, 0]


def test_a_publisher_that_comes_after_silent_ones_may_begin_anywhere() -> None:
    gaps = Gaps()
    gaps.settle(1)
    gaps.unsettle()
    assert gaps.see(951, lambda: 1) == 0


def test_a_message_received_by_two_subscriptions_is_taken_once() -> None:
    source = Input(depth=50)
    source.subscriptions = 2
    one = {"source_timestamp": 5, "publication_sequence_number": 1}
    of_another = {"source_timestamp": 6, "publication_sequence_number": 1}
    assert [source.is_new(info) for info in (one, of_another, one, of_another)] == [
        *(True, True),
        *(False, False),
    ]


def lost(numbers: Iterable[int], writers: int = 1) -> list[int]:
    gaps = Gaps()
    return [gaps.see(number, lambda: writers) for number in numbers]


def test_two_writers_are_distinguished_by_their_last_numbers() -> None:
    assert lost([1, 100, 2, 101, 3, 105, 6], writers=2) == [0, 0, 0, 0, 0, 3, 2]


def test_a_number_that_may_be_a_new_writers_first_is_no_gap() -> None:
    assert lost([1, 2, 40, 41], writers=2) == [0, 0, 0, 0]


@given(st.lists(st.integers(0, 3), min_size=1), st.integers(1, 10**6))
def test_with_one_writer_every_lost_message_is_counted(skips: list[int], start: int) -> None:
    gaps, number = Gaps(), start
    gaps.see(number, lambda: 1)
    for skip in skips:
        number += 1 + skip
        assert gaps.see(number, lambda: 1) == skip
