"""Publishers of an input: each message once, what is lost, and a second twin on the same topic."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from types import SimpleNamespace

from hypothesis import given
from hypothesis import strategies as st
from lupin_msgs.msg import TwinState
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup

from lupin_twin.ros.inputs import (
    Gaps,
    Input,
    OtherTwins,
    TwinCount,
    other_users,
)
from tests.support.ros import Peer


def test_other_users_are_those_who_own_ports_of_the_domain(tmp_path: Path) -> None:
    own = os.geteuid()
    (tmp_path / "fastrtps_port7650").touch()  # 7400 + 250 * 1
    assert other_users(1, tmp_path, own) == []
    assert other_users(1, tmp_path, own + 1) == [f"uid {own}"]
    assert other_users(2, tmp_path, own + 1) == [], "of another domain"
    assert other_users(1, tmp_path / "none", own + 1) == []


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


def test_what_two_subscriptions_receive_is_taken_once() -> None:
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


def test_two_writers_are_told_apart_by_where_each_left_off() -> None:
    assert lost([1, 100, 2, 101, 3, 105, 6], writers=2) == [0, 0, 0, 0, 0, 3, 2]


def test_a_number_that_may_be_a_new_writers_first_is_no_gap() -> None:
    assert lost([1, 2, 40, 41], writers=2) == [0, 0, 0, 0]


@given(st.lists(st.integers(0, 3), min_size=1), st.integers(1, 10**6))
def test_of_one_writer_every_lost_message_is_counted(skips: list[int], start: int) -> None:
    gaps, number = Gaps(), start
    gaps.see(number, lambda: 1)
    for skip in skips:
        number += 1 + skip
        assert gaps.see(number, lambda: 1) == skip
    assert gaps.lost == sum(skips)


def received(*numbers: Iterable[int]) -> TwinCount:
    """A count that has received these states, from two publishers in the graph."""
    count = TwinCount()
    for number in (number for some in numbers for number in some):
        count.add(number)
    count.see(2)
    return count


@given(st.integers(1, 50), st.integers(0, 60))
def test_a_restarted_twin_is_not_taken_for_two(first: int, second: int) -> None:
    """Nor when it passes the number at which the dead one has ended."""
    assert received(range(first, 51), range(1, second)).value == 1


@given(st.integers(1, 40), st.integers(1, 40))
def test_two_that_speak_by_turns_are_two_after_two_states_of_each(first: int, second: int) -> None:
    pairs = ((first + step, second + step) for step in range(2))
    # One right behind the other looks like one publisher, for a state.
    assert received(*pairs).value == 2 or abs(first - second) == 1
    assert received(*((first + step, second + step) for step in range(3))).value == 2


def test_two_are_two_until_one_has_left_the_graph() -> None:
    count = received([5, 1, 6])
    assert count.see(3)
    assert count.value == 3
    assert not count.see(1)
    assert count.value == 1
    count.add(7)
    assert not count.see(2)


def test_it_subscribes_only_while_there_are_several(domain: int) -> None:
    texts: list[str] = []
    utilities = SimpleNamespace(warn=lambda _, text: texts.append(text))
    count = TwinCount()
    with Peer(domain) as peer:
        group = MutuallyExclusiveCallbackGroup()
        others = OtherTwins(peer.node, utilities, count, "s", group=group)
        publishers = [peer.node.create_publisher(TwinState, "/s", 1) for _ in range(2)]
        peer.until(lambda: peer.node.count_publishers("/s") == 2, "both publishers")
        others.check("/s")
        assert peer.node.count_subscribers("/s") == 1
        assert texts == []
        for number in (1, 7, 2):
            count.add(number)
        others.check("/s")
        assert texts[0].startswith("2 nodes publish /s: consumers get a mixture")
        peer.node.destroy_publisher(publishers[0])
        peer.until(lambda: peer.node.count_publishers("/s") == 1, "one publisher")
        others.check("/s")
        assert peer.node.count_subscribers("/s") == 0
