"""Which value is the latest, in any order of arrival, and when the clock goes back."""

from __future__ import annotations

import math
from dataclasses import replace

from hypothesis import given
from hypothesis import strategies as st

from lupin_twin.core.state import (
    STATUS_OK,
    Attempt,
    Flower,
    Inspection,
    Reading,
    Scan,
    TagState,
    TwinStore,
)
from tests.support.store import S, at, scan


def tag(store: TwinStore, tag_id: str) -> TagState:
    return next(t for t in store.snapshot(0, "map").tags if t.tag_id == tag_id)


def test_only_a_clock_that_goes_back_moves_times_and_is_no_revision() -> None:
    store = TwinStore()
    store.record(scan("1", at_s=3600.0, co2=2.0))
    store.record(scan("before", at_s=40.0, co2=1.0))
    store.record(scan("tried", at_s=3600.0, succeeded=False))
    store.pin("never", at(1.0))
    count = store.observation_count
    assert not store.clamp_to(3600 * S)
    assert not store.clamp_to(0), (
        "a simulated clock that has not started is no clock that went back"
    )
    assert store.clamp_to(50 * S)
    assert not store.clamp_to(50 * S)
    ages = {t.tag_id: t.stale_seconds(60 * S) for t in store.snapshot(60 * S, "map").tags}
    assert ages == {"1": 10.0, "before": 20.0, "tried": 10.0, "never": math.inf}
    assert store.observation_count == count


def plainest(writes: list[Write]) -> dict[str, TagState]:
    """The state of each tag, from the list of all writes: the only rule is their order.

    What has a time is ordered by it (equal times by arrival); poses and names by arrival alone.
    """
    tags: dict[str, TagState] = {}
    for tag_id in dict.fromkeys(write.tag_id for write in writes):
        own = [write for write in writes if write.tag_id == tag_id]
        names = dict.fromkeys(r.name for w in own if isinstance(w, Scan) for r in w.readings)
        attempted = sorted(own, key=lambda write: write.stamp_ns)
        seen = [write for write in attempted if brings(write)]
        values = {
            reading.name: Reading(reading.name, reading.value, write.stamp_ns)
            for write in attempted
            if isinstance(write, Scan)
            for reading in write.readings
        }
        looks = [w for w in attempted if isinstance(w, Inspection) and w.flower is not None]
        last_observed = seen[-1] if seen else attempted[0]
        tags[tag_id] = TagState(
            tag_id,
            next((write.pose for write in own if write.pose is not None), None),
            tuple(values[name] for name in names),
            last_observed.stamp_ns,
            looks[-1].flower or Flower() if looks else Flower(),
            looks[-1].stamp_ns if looks else None,
            Attempt(attempted[-1].stamp_ns, attempted[-1].status, attempted[-1].status_detail),
        )
    return tags


def brings(write: Write) -> bool:
    if isinstance(write, Scan):
        return write.status == STATUS_OK or bool(write.readings)
    return bool(write.flower)


Write = Scan | Inspection
TAG_IDS = st.sampled_from(["a", "b"])
STAMPS = st.integers(1, 30).map(lambda at_s: at_s * S)
POSES = st.one_of(st.none(), st.integers(-5, 5).map(float).map(at))
STATUS = st.sampled_from([0, 2])
SENSORS = st.sets(st.sampled_from(["co2", "light"])).map(sorted)
SCANS = st.builds(
    lambda tag_id, stamp_ns, names, pose, status: Scan(
        tag_id, stamp_ns, tuple(Reading(name, 0.0) for name in names), pose, status
    ),
    TAG_IDS, STAMPS, SENSORS, POSES, STATUS,
)  # fmt: skip
INSPECTIONS = st.builds(
    lambda tag_id, stamp_ns, pose, status: Inspection(
        tag_id, stamp_ns, None if status else Flower(), pose, status
    ),
    TAG_IDS, STAMPS, POSES, STATUS,
)  # fmt: skip
STEPS = st.lists(SCANS | INSPECTIONS | st.integers(1, 30), max_size=25)


def numbered(write: Write, number: int) -> Write:
    """The write with a value of its own, so that it differs from all others."""
    if isinstance(write, Scan):
        readings = tuple(replace(reading, value=float(number)) for reading in write.readings)
        return replace(write, readings=readings, status_detail=str(number))
    flower = None if write.flower is None else Flower(flower_count=number)
    return replace(write, flower=flower, status_detail=str(number))


@given(STEPS)
def test_the_store_equals_the_simplest_one(steps: list[Write | int]) -> None:
    """Any sequence of writes in any order of time, and of clocks that go back (the numbers)."""
    store = TwinStore()
    written: list[Write] = []
    for number, step in enumerate(steps):
        if isinstance(step, int):
            store.clamp_to(step * S)
            # By time first: among equal ones, the last in the list is the latest.
            written = [
                replace(it, stamp_ns=min(it.stamp_ns, step * S))
                for it in sorted(written, key=lambda it: it.stamp_ns)
            ]
            continue
        write = numbered(step, number)
        written.append(write)
        before = {t.tag_id: t for t in store.snapshot(0, "map").tags}
        count = store.observation_count
        store.record(write) if isinstance(write, Scan) else store.record_inspection(write)
        after = tag(store, write.tag_id)
        shown = [as_shown(each) for each in (before.get(write.tag_id), after)]
        assert store.observation_count == count + (shown[0] != shown[1])
    stored = {t.tag_id: t for t in store.snapshot(0, "map").tags}
    for tag_id, expected in plainest(written).items():
        assert by_name(stored[tag_id]) == by_name(expected)


def by_name(state_of_tag: TagState) -> TagState:
    """Without the order of the readings and the pose, which a clock that goes back leaves alone."""
    readings = sorted(state_of_tag.readings, key=lambda reading: reading.name)
    return replace(state_of_tag, readings=tuple(readings), pose=None)


def as_shown(state_of_tag: TagState | None) -> object:
    """The tag as it is in the state message."""
    if state_of_tag is None:
        return None
    readings = tuple(replace(reading, observed_at_ns=None) for reading in state_of_tag.readings)
    return replace(state_of_tag, readings=readings, looked_at_ns=None, last_try=None)
