"""What counts as the latest, in whatever order it comes, and when the clock goes back."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lupin_twin import state
from lupin_twin.state import Flower, Observation, Reading, Rejected, TagState, TwinStore
from tests.support.store import S, at, look, scan


def tag(store: TwinStore, tag_id: str) -> TagState:
    return next(t for t in store.snapshot(0, "map").tags if t.tag_id == tag_id)


def test_an_older_scan_replaces_nothing_newer_and_adds_what_was_not_known() -> None:
    store = TwinStore()
    store.record(scan("1", at_s=20.0, co2=2.0))
    store.record(scan("1", at_s=10.0, pose=at(5.0), co2=1.0, light=1.0))
    kept = tag(store, "1")
    assert [(r.name, r.value) for r in kept.readings] == [("co2", 2.0), ("light", 1.0)]
    assert (kept.pose, kept.last_observed_ns) == (at(5.0), 20 * S)
    assert store.observation_count == 2
    # Of each sensor its own time counts: light is known from 10 s only.
    store.record(scan("1", at_s=15.0, co2=3.0, light=3.0))
    assert [r.value for r in tag(store, "1").readings] == [2.0, 3.0]


def test_an_older_look_replaces_no_newer_one_but_may_pin() -> None:
    store = TwinStore()
    store.record_flower(look("1", at_s=20.0, species="rose", anomaly=True))
    store.record_flower(look("1", at_s=10.0, pose=at(5.0), species="lupin"))
    kept = tag(store, "1")
    assert kept.flower == Flower(species="rose", anomaly=True)
    assert (kept.pose, kept.last_observed_ns) == (at(5.0), 20 * S)
    # A newer scan is no look: the flowers' own time counts.
    store.record(scan("1", at_s=40.0, co2=1.0))
    store.record_flower(look("1", at_s=30.0, species="lupin"))
    assert tag(store, "1").flower == Flower(species="lupin")
    assert tag(store, "1").last_observed_ns == 40 * S


def test_of_equal_stamps_the_later_arrival_counts() -> None:
    store = TwinStore()
    for value, species in ((1.0, "rose"), (2.0, "lupin")):
        store.record(scan("1", at_s=5.0, co2=value))
        store.record_flower(look("1", at_s=5.0, species=species))
    assert tag(store, "1").readings[0].value == 2.0
    assert tag(store, "1").flower.species == "lupin"


def test_the_time_of_a_failed_scan_gives_way_to_any_observation() -> None:
    store = TwinStore()
    store.record(scan("1", at_s=20.0, succeeded=False))
    store.record(scan("1", at_s=10.0, co2=1.0))
    assert tag(store, "1").last_observed_ns == 10 * S


def test_the_history_is_in_the_order_of_time_and_keeps_the_newest() -> None:
    store = TwinStore(buffer_len=3)
    scans = {at_s: scan("1", at_s=at_s, co2=at_s) for at_s in (1.0, 2.0, 3.0, 4.0)}
    for at_s in (2.0, 4.0, 3.0):
        store.record(scans[at_s])
    assert store.history("1") == (scans[2.0], scans[3.0], scans[4.0])
    store.record(scans[1.0])
    assert store.history("1") == (scans[2.0], scans[3.0], scans[4.0])


def test_scans_of_equal_stamps_stay_in_the_order_of_their_arrival() -> None:
    store = TwinStore()
    for number in range(4):
        store.record(scan("1", at_s=5.0, co2=float(number)))
    history = store.history("1")
    assert history is not None
    assert [kept.readings[0].value for kept in history] == [0.0, 1.0, 2.0, 3.0]


def test_after_a_clock_that_went_back_all_ages_from_there_and_news_is_news() -> None:
    store = TwinStore()
    store.record(scan("1", at_s=40.0, co2=1.0))
    store.record(scan("1", at_s=3600.0, co2=2.0))
    store.record_flower(look("1", at_s=3600.0, species="rose"))
    store.record(scan("before", at_s=40.0, co2=1.0))
    store.record(scan("tried", at_s=3600.0, succeeded=False))
    store.pin("never", at(1.0))
    count = store.observation_count
    assert not store.hold_to(3600 * S)
    assert not store.hold_to(0), "a simulated clock that has not started is no clock that went back"
    assert store.hold_to(50 * S)
    assert not store.hold_to(50 * S)
    ages = {t.tag_id: t.stale_seconds(60 * S) for t in store.snapshot(60 * S, "map").tags}
    assert ages == {"1": 10.0, "before": 20.0, "tried": 10.0, "never": math.inf}
    assert [scan.stamp_ns for scan in store.history("1") or ()] == [40 * S, 50 * S]
    assert store.observation_count == count
    store.record(scan("1", at_s=55.0, co2=3.0))
    store.record_flower(look("1", at_s=55.0, species="lupin"))
    kept = tag(store, "1")
    assert (kept.readings[0].value, kept.flower.species) == (3.0, "lupin")
    assert kept.last_observed_ns == 55 * S


def test_a_refused_write_leaves_no_stamp_behind(monkeypatch: pytest.MonkeyPatch) -> None:
    store = TwinStore()
    store.record(scan("1", at_s=1.0, co2=1.0))
    with monkeypatch.context() as full:
        full.setattr(state, "MAX_ITEMS", 1)
        with pytest.raises(Rejected):
            store.record(scan("1", at_s=9.0, co2=9.0, light=9.0))
    store.record(scan("1", at_s=2.0, co2=2.0))
    assert tag(store, "1").readings == (Reading("co2", 2.0),)
    assert not store.hold_to(5 * S)


# --- against a model ----------------------------------------------------------------------------

writes = st.lists(
    st.tuples(
        st.sampled_from(["record", "fail", "flower", "pin", "clock"]),
        st.sampled_from(["a", "b", "c"]),
        st.integers(1, 100),
        st.one_of(st.none(), st.floats(-5, 5)),
        st.sets(st.sampled_from(["co2", "light"])),
    ),
    max_size=30,
)


class PlainTag:
    """A tag as the list of all that was ever written, each with its time."""

    def __init__(self) -> None:
        self.pose: float | None = None
        self.tried: int | None = None
        self.seen: list[tuple[int, str, object]] = []

    def latest(self, kind: str) -> object:
        # max() gives the first of equals, so the list is turned: the last one that came.
        of_kind = [(at_s, value) for at_s, what, value in reversed(self.seen) if what == kind]
        return max(of_kind, key=lambda pair: pair[0], default=(0, None))[1]

    @property
    def last_observed(self) -> int | None:
        return max((at_s for at_s, _, _ in self.seen), default=self.tried)

    def hold_to(self, now_s: int) -> None:
        # By time first: of what is equal from now on, the last in the list is the latest.
        self.seen.sort(key=lambda entry: entry[0])
        self.seen = [(min(at_s, now_s), kind, value) for at_s, kind, value in self.seen]
        self.tried = None if self.tried is None else min(self.tried, now_s)


Step = tuple[str, str, int, float | None, set[str]]


def write(step: Step, number: int, store: TwinStore, plain: PlainTag) -> None:
    """One step, to the store and to the model; `number` is the value that it writes."""
    kind, tag_id, at_s, x, sensors = step
    pose = None if x is None else at(x)
    if kind == "record":
        readings = tuple(Reading(name, float(number)) for name in sorted(sensors))
        store.record(Observation(tag_id, at_s * S, readings, pose))
        plain.seen += [(at_s, what, float(number)) for what in ("scan", *sensors)]
    elif kind == "fail":
        store.record(scan(tag_id, at_s, succeeded=False))
        plain.tried = at_s if plain.last_observed is None else plain.tried
    elif kind == "flower":
        store.record_flower(look(tag_id, at_s, pose, flower_count=number))
        plain.seen.append((at_s, "flower", number))
    elif pose is not None:
        store.pin(tag_id, pose)
    if plain.pose is None and kind != "fail":
        plain.pose = x


def assert_same(kept: TagState, plain: PlainTag) -> None:
    assert (None if kept.pose is None else kept.pose.x) == plain.pose
    known = {sensor: plain.latest(sensor) for sensor in ("co2", "light")}
    assert {r.name: r.value for r in kept.readings} == {
        name: value for name, value in known.items() if value is not None
    }
    assert kept.flower.flower_count == (plain.latest("flower") or 0)
    last_s = plain.last_observed
    assert kept.last_observed_ns == (None if last_s is None else last_s * S)


@given(writes)
def test_against_the_plainest_store(steps: list[Step]) -> None:
    """Any sequence of writes in any order of time, and of clocks that go back."""
    store = TwinStore()
    model: dict[str, PlainTag] = {}
    for number, step in enumerate(steps):
        kind, tag_id, at_s, x, _ = step
        if kind == "clock":
            store.hold_to(at_s * S)
            for plain in model.values():
                plain.hold_to(at_s)
        elif kind != "pin" or x is not None:
            write(step, number, store, model.setdefault(tag_id, PlainTag()))
    tags = store.snapshot(0, "map").tags
    assert [kept.tag_id for kept in tags] == list(model)
    for kept, plain in zip(tags, model.values(), strict=True):
        assert_same(kept, plain)
        stamps = [past.stamp_ns for past in store.history(kept.tag_id) or ()]
        assert stamps == sorted(stamps)
