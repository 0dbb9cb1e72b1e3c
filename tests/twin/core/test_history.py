"""Repeated observations are no news; and the order of a tag's observations."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lupin_twin.core import ingest
from lupin_twin.core.history import KNOWN_PER_TAG, Repeats, tag_history
from lupin_twin.core.state import Inspection, Reading, Scan, TwinStore
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


WRITES = st.lists(
    st.builds(
        lambda at_s, sensor, value, source: scan(
            "1", at_s, source=source, **({sensor: value} if sensor else {})
        ),
        st.integers(1, 12),
        st.sampled_from(["", "co2", "light"]),
        st.integers(0, 3).map(float),
        st.sampled_from(["a", "b"]),
    )
    | st.builds(lambda at_s: inspection("1", at_s), st.integers(1, 12)),
    max_size=20,
)


@given(WRITES, st.integers(1, 6))
def test_the_history_equals_the_simplest_one(writes: list[Scan | Inspection], count: int) -> None:
    """All observations, sorted by stamp, each once, and of these the latest."""
    scans: dict[tuple[int, str], dict[str, float]] = {}
    keys: dict[tuple[int, int, str], None] = {}
    for write in writes:
        keys.setdefault((write.stamp_ns, isinstance(write, Inspection), write.source))
        if isinstance(write, Scan) and write.readings:
            readings = {r.name: r.value for r in write.readings}
            scans.setdefault((write.stamp_ns, write.source), {}).update(readings)
    past = tag_history(writes, None, count)
    latest = sorted(keys, key=lambda key: key[0])[-count:]
    assert [(each.stamp_ns, each.kind) for each in past.attempts] == [key[:2] for key in latest]
    expected = sorted(scans.items(), key=lambda item: item[0][0])[-count:]
    assert [(each.stamp_ns, {r.name: r.value for r in each.readings}) for each in past.scans] == [
        (stamp_ns, readings) for (stamp_ns, _), readings in expected
    ]


@given(
    st.lists(
        st.tuples(st.integers(1, 5), st.sets(st.sampled_from(["co2", "light"])), st.booleans()),
        max_size=12,
    )
)
def test_with_a_log_that_lacks_the_last_write_nothing_is_missing(
    steps: list[tuple[int, set[str], bool]],
) -> None:
    """The latest state contains it."""
    store, repeats, every = TwinStore(), Repeats(), list[Scan | Inspection]()
    at_s = 0
    for number, (wait_s, sensors, is_inspection) in enumerate(steps, 1):
        at_s += wait_s
        readings = tuple(Reading(name, float(number)) for name in sorted(sensors))
        every.append(inspection("1", at_s) if is_inspection else Scan("1", at_s * S, readings))
        assert ingest.apply(every[-1], store, repeats) is None
    for tag in store.snapshot(0, "map").tags:
        found, expected = tag_history(every[:-1], tag, 32), tag_history(every, None, 32)
        assert found.scans == expected.scans
        assert [past.what for past in found.attempts] == [past.what for past in expected.attempts]
