"""The history of a tag, from the log and from its state."""

from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from lupin_bridge.stream.state_json import history, stamp
from lupin_twin.core import ingest
from lupin_twin.core.history import Repeats
from lupin_twin.core.state import Observation, TwinStore
from tests.support.store import S, inspection, scan

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
def test_the_history_equals_the_simplest_one(writes: list[Observation], count: int) -> None:
    """All observations, sorted by stamp, each once, and of these the latest."""
    scans: dict[tuple[int, str], dict[str, float]] = {}
    keys: dict[tuple[int, int, str], None] = {}
    for write in writes:
        keys.setdefault((write.stamp_ns, write.kind, write.source))
        if write.values:
            scans.setdefault((write.stamp_ns, write.source), {}).update(write.values)
    past = history("1", writes, None, count)
    latest = sorted(keys, key=lambda key: key[0])[-count:]
    assert [(it["stamp"], it["kind"]) for it in past["tries"]] == [
        (stamp(stamp_ns), kind) for stamp_ns, kind, _ in latest
    ]
    expected: dict[str, list[dict[str, Any]]] = {}
    for (stamp_ns, _), readings in sorted(scans.items(), key=lambda item: item[0][0])[-count:]:
        for name, value in readings.items():
            expected.setdefault(name, []).append({"stamp": stamp(stamp_ns), "value": value})
    assert {it["name"]: it["values"] for it in past["sensors"]} == expected
    sources = [(it.stamp_ns, number, it.source) for number, it in enumerate(writes) if it.source]
    assert past["source"] == (max(sources)[2] if sources else None)


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
    store, repeats, every = TwinStore(), Repeats(), list[Observation]()
    at_s = 0
    for number, (wait_s, sensors, is_inspection) in enumerate(steps, 1):
        at_s += wait_s
        values = dict.fromkeys(sorted(sensors), float(number))
        every.append(inspection("1", at_s) if is_inspection else Observation("1", at_s * S, values))
        assert ingest.apply(every[-1], store, repeats) is None
    for tag in store.snapshot(0, "map").tags:
        found, expected = history("1", every[:-1], tag, 32), history("1", every, None, 32)
        assert found["sensors"] == expected["sensors"]
        assert [it | {"kind": 0} for it in found["tries"]] == [
            it | {"kind": 0} for it in expected["tries"]
        ]
