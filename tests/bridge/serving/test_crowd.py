"""Whom a full house turns out first."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from lupin_bridge.serving.connections import choose_evicted


@dataclass(eq=False)
class Someone:
    address: str
    waiting_since_s: float | None

    def abort(self) -> None:
        raise AssertionError("to choose is not to turn out")


def chosen(number: int, **parties: list[float | None]) -> list[tuple[str, float | None]]:
    """Who is turned out of parties given by their address and since when their members wait."""
    guests = [Someone(address, since) for address, party in parties.items() for since in party]
    return [(guest.address, guest.waiting_since_s) for guest in choose_evicted(guests, number)]


def test_the_longest_waiting_goes_first() -> None:
    assert chosen(2, a=[3.0, 1.0, 2.0]) == [("a", 1.0), ("a", 2.0)]


def test_who_is_served_stays() -> None:
    assert chosen(9, a=[None, 1.0, None]) == [("a", 1.0)]
    assert chosen(9, a=[None]) == chosen(9) == []


def test_the_largest_party_goes_first_however_short_it_waits() -> None:
    assert chosen(2, many=[8.0, 9.0, 7.0], one=[1.0]) == [("many", 7.0), ("many", 8.0)]


def test_who_is_served_counts_for_the_size_of_a_party() -> None:
    assert chosen(1, many=[None, None, 9.0], two=[1.0, 2.0]) == [("many", 9.0)]


def test_of_parties_of_one_size_the_longest_waiting_goes() -> None:
    assert chosen(4, a=[5.0, 2.0], b=[1.0, 3.0]) == [("b", 1.0), ("a", 2.0), ("b", 3.0), ("a", 5.0)]


@pytest.mark.parametrize(("number", "expected"), [(0, 0), (1, 1), (3, 3), (4, 3)])
def test_no_more_than_asked_for(number: int, expected: int) -> None:
    assert len(chosen(number, a=[1.0, 2.0, 3.0])) == expected
