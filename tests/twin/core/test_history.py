"""Repeated observations are no news; and the order of a tag's observations."""

from dataclasses import replace

import pytest

from lupin_twin.core.history import KNOWN_PER_TAG, Repeats
from tests.support.store import S, inspection, scan


def test_a_received_observation_is_known_by_kind_stamp_and_source() -> None:
    repeats = Repeats()
    repeats.add(scan("1", at_s=5.0, source="a", co2=1.0))
    assert repeats.news(scan("1", at_s=5.0, source="a", co2=9.0)) is None
    for other in (
        scan("2", at_s=5.0, source="a"),
        scan("1", at_s=6.0, source="a"),
        scan("1", at_s=5.0, source="b"),
        replace(inspection("1", at_s=5.0), source="a"),
    ):
        assert repeats.news(other) == other


def test_the_number_of_known_observations_per_tag_is_limited_and_the_oldest_go() -> None:
    repeats = Repeats()
    every = [scan("1", at_s=float(n), co2=1.0) for n in range(1, KNOWN_PER_TAG + 2)]
    for one in every:
        repeats.add(one)
    assert [repeats.news(one) is None for one in every] == [False, *[True] * KNOWN_PER_TAG]


@pytest.mark.parametrize("retains_keys", [False, True])
def test_in_a_simulation_what_was_later_than_a_reset_clock_is_news(retains_keys: bool) -> None:
    repeats = Repeats()
    for at_s in (40.0, 3600.0):
        repeats.add(scan("1", at_s=at_s, co2=at_s))
    repeats.clamp_to(50 * S, retains_keys=retains_keys)
    assert repeats.news(scan("1", at_s=40.0, co2=1.0)) is None
    assert (repeats.news(scan("1", at_s=3600.0, co2=1.0)) is None) is retains_keys
