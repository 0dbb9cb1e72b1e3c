"""The store, rule by rule and against the simplest one, without ROS."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lupin_twin.core import drops, state
from lupin_twin.core.drops import Rejected
from lupin_twin.core.state import (
    STATUS_OK,
    Attempt,
    Bloom,
    Flower,
    Observation,
    Reading,
    TagState,
    TwinStore,
)
from tests.support.store import S, at, inspection, scan


def tag(store: TwinStore, tag_id: str) -> state.TagState:
    return next(t for t in store.snapshot(0, "map").tags if t.tag_id == tag_id)


def test_the_first_pose_wins_whoever_sends_it() -> None:
    for first, second, third in (
        ("scan", "pin", "look"),
        ("pin", "scan", "look"),
        ("look", "scan", "pin"),
    ):
        store = TwinStore()
        writes = {
            "scan": lambda x, s=store: s.record(scan("1", pose=at(x))),
            "look": lambda x, s=store: s.record(inspection("1", pose=at(x))),
            "pin": lambda x, s=store: s.pin("1", at(x)),
        }
        for x, name in enumerate((first, second, third)):
            writes[name](float(x))
        assert tag(store, "1").pose == at(0.0), (first, second, third)


def test_a_write_without_news_is_no_new_revision_even_of_what_is_no_number() -> None:
    store = TwinStore()
    store.record(scan("1", at_s=20.0, co2=1.0, light=math.nan))
    store.record(inspection("1", at_s=20.0, species="rose", confidence=math.nan))
    before = tag(store, "1")
    store.record(scan("1", at_s=20.0, co2=1.0, light=math.nan))
    store.record(inspection("1", at_s=20.0, species="rose", confidence=math.nan))
    assert tag(store, "1") is before, "changes are found by identity"
    store.record(scan("1", at_s=10.0, pose=at(1.0), co2=9.0))
    assert store.observation_count == 3, "it pins the tag"


def test_a_late_scan_with_the_same_value_is_a_new_revision_as_derived_values_may_go() -> None:
    store = TwinStore()
    store.record(scan("1", at_s=10.0, temperature=20.0, humidity=50.0))
    store.record(inspection("1", at_s=30.0, species="rose"))
    store.record(scan("1", at_s=20.0, temperature=20.0))
    assert store.observation_count == 3


def test_age_runs_from_the_last_observation_and_is_never_negative() -> None:
    store = TwinStore()
    store.record(scan("1", at_s=100.0, co2=1.0))
    assert tag(store, "1").stale_seconds(130 * S) == 30.0
    assert tag(store, "1").stale_seconds(50 * S) == 0.0


def test_samples_need_a_pose_and_a_finite_reading_and_keep_the_first_mention_order() -> None:
    store = TwinStore()
    store.record(scan("late", co2=5.0))
    store.record(scan("nan", pose=at(1.0), co2=math.nan))
    store.record(scan("inf", pose=at(2.0), co2=math.inf))
    store.record(scan("past float32", pose=at(2.5), co2=-3.5e38))
    store.record(scan("other", pose=at(3.0), light=1.0))
    store.record(scan("good", pose=at(4.0, 7.0), co2=6.0))
    assert store.samples_for_sensor("co2") == ((4.0, 7.0, 6.0),)
    store.pin("late", at(9.0))
    assert store.samples_for_sensor("co2") == ((9.0, 0.0, 5.0), (4.0, 7.0, 6.0))
    readings = {t.tag_id: t.readings[0].value for t in store.snapshot(0, "map").tags}
    assert math.isnan(readings["nan"])
    assert math.isinf(readings["inf"])


BLOOM = Bloom(0.0, 0.0, 0.0, 0.1, "rose", 0.9, anomaly=False)
# What gives a write its size, and the largest size allowed.
BOUNDED: dict[str, tuple[Callable[[int], Observation], int]] = {
    "readings": (
        lambda n: Observation("1", S, {f"s{i}": 0.0 for i in range(n)}),
        drops.MAX_SENSORS_PER_TAG,
    ),
    "blooms": (lambda n: inspection("1", blooms=(BLOOM,) * n), drops.MAX_BLOOMS_PER_TAG),
    "footprint": (
        lambda n: inspection("1", footprint=((0.0, 0.0, 0.0),) * n),
        drops.MAX_FOOTPRINT_POINTS,
    ),
    "the tag_id of a scan": (lambda n: Observation("t" * n, S), drops.MAX_TEXT_LENGTH),
    "a sensor's name": (lambda n: Observation("1", S, {"s" * n: 0.0}), drops.MAX_TEXT_LENGTH),
    "the tag_id of a look": (lambda n: inspection("t" * n), drops.MAX_TEXT_LENGTH),
    "species": (lambda n: inspection("1", species="r" * n), drops.MAX_TEXT_LENGTH),
    "a bloom's species": (
        lambda n: inspection("1", blooms=(dataclasses.replace(BLOOM, species="r" * n),)),
        drops.MAX_TEXT_LENGTH,
    ),
}


@pytest.mark.parametrize("what", BOUNDED)
def test_exactly_the_limit_is_allowed_and_one_more_is_refused_with_both_numbers(what: str) -> None:
    make, limit = BOUNDED[what]
    store = TwinStore()
    store.record(make(limit))
    before = store.snapshot(0, "map").tags
    assert store.observation_count == len(before) == 1
    with pytest.raises(Rejected, match=rf"{limit + 1}\b.*limit is {limit}$"):
        store.record(make(limit + 1))
    assert store.snapshot(0, "map").tags == before
    assert store.observation_count == 1


def test_one_tag_too_many_is_refused_and_the_known_ones_go_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(state, "MAX_TAGS", 2)
    store = TwinStore()
    store.record(scan("1", co2=1.0))
    store.pin("2", at(1.0))
    with pytest.raises(Rejected, match="tags: 3, the limit is 2"):
        store.record(scan("3", co2=1.0))
    with pytest.raises(Rejected):
        store.pin("4", at(1.0))
    store.record(scan("1", co2=2.0))
    assert tag(store, "1").readings[0].value == 2.0


def test_the_total_of_all_tags_is_limited_and_known_ones_go_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(state, "MAX_ITEMS", 4)
    store = TwinStore()
    store.record(scan("1", co2=1.0))
    store.record(inspection("2", blooms=(BLOOM, BLOOM), footprint=((0.0, 0.0, 0.0),)))
    for one_too_many in (
        scan("1", light=1.0),
        scan("3", co2=1.0),
        inspection("1", blooms=(BLOOM,)),
    ):
        with pytest.raises(Rejected, match="of all tags: 5, the limit is 4"):
            store.record(one_too_many)
    assert [t.tag_id for t in store.snapshot(0, "map").tags] == ["1", "2"]
    store.record(scan("1", co2=2.0))
    assert tag(store, "1").readings[0].value == 2.0
    store.pin("3", at(1.0))
    # An inspection with one flower less makes room for one more reading.
    store.record(inspection("2", blooms=(BLOOM,), footprint=((0.0, 0.0, 0.0),)))
    store.record(scan("3", co2=3.0))
    assert tag(store, "3").readings[0].value == 3.0


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
        names = dict.fromkeys(name for w in own for name in w.readings)
        attempted = sorted(own, key=lambda write: write.stamp_ns)
        seen = [write for write in attempted if brings(write)]
        values = {
            name: Reading(name, value, write.stamp_ns)
            for write in attempted
            for name, value in write.readings.items()
        }
        looks = [w for w in attempted if w.flower is not None]
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
    return write.status == STATUS_OK or bool(write.readings)


Write = Observation
TAG_IDS = st.sampled_from(["a", "b"])
STAMPS = st.integers(1, 30).map(lambda at_s: at_s * S)
POSES = st.one_of(st.none(), st.integers(-5, 5).map(float).map(at))
STATUS = st.sampled_from([0, 2])
SENSORS = st.sets(st.sampled_from(["co2", "light"])).map(sorted)
SCANS = st.builds(
    lambda tag_id, stamp_ns, names, pose, status: Observation(
        tag_id, stamp_ns, dict.fromkeys(names, 0.0), pose, status
    ),
    TAG_IDS, STAMPS, SENSORS, POSES, STATUS,
)  # fmt: skip
INSPECTIONS = st.builds(
    lambda tag_id, stamp_ns, pose, status: Observation(
        tag_id, stamp_ns, {}, pose, status, kind=1, flower=None if status else Flower()
    ),
    TAG_IDS, STAMPS, POSES, STATUS,
)  # fmt: skip
STEPS = st.lists(SCANS | INSPECTIONS | st.integers(1, 30), max_size=25)


def numbered(write: Write, number: int) -> Write:
    """The write with a value of its own, so that it differs from all others."""
    values = dict.fromkeys(write.readings, float(number))
    flower = None if write.flower is None else Flower(flower_count=number)
    return replace(write, readings=values, flower=flower, status_detail=str(number))


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
        store.record(write)
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
