"""What large messages cost while clients do not take them, and who goes."""

from __future__ import annotations

from lupin_bridge.stream.hub import Unsent


def message(size: int) -> bytes:
    return bytes(size)


def test_a_message_that_many_wait_for_counts_once_and_until_the_last_has_it() -> None:
    unsent: Unsent[str] = Unsent(10)
    grid = message(10)
    for holder in ("a", "b", "c", "a"):
        assert unsent.hold(holder, grid) == []
        assert unsent.bytes == 10
    for holder in ("a", "b", "stranger"):
        unsent.let_go(holder)
        assert unsent.bytes == 10
    unsent.let_go("c")
    unsent.let_go("c")
    assert unsent.bytes == 0


def test_past_the_bound_who_has_waited_longest_goes() -> None:
    unsent: Unsent[str] = Unsent(10)
    old, other = message(5), message(5)
    assert unsent.hold("first", old) == []
    assert unsent.hold("second", other) == []
    assert unsent.hold("first", other) == [], "it has waited since its first"
    assert unsent.hold("third", message(1)) == ["first"]
    assert unsent.bytes == 6
    unsent.let_go("second")
    assert unsent.hold("second", message(9)) == [], "it begins anew"
    assert unsent.hold("second", message(1)) == ["third"]


def test_a_message_that_is_too_large_by_itself_is_not_waited_for() -> None:
    unsent: Unsent[str] = Unsent(10)
    assert unsent.hold("a", message(11)) == ["a"]
    assert unsent.bytes == 0
