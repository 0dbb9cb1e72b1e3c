"""Frames: numbered, made once, and of the contract's types; a snapshot as JSON."""

import json
import math
from collections import Counter
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lupin_bridge.judge.judging import Judge
from lupin_bridge.judge.quantities import DERIVED, dew_point_c, vapour_pressure_deficit_kpa
from lupin_bridge.stream import schema
from lupin_bridge.stream.frames import FrameWriter, StateFrame
from lupin_bridge.stream.state_json import StateJson
from lupin_twin.core.state import (
    Attempt,
    Bloom,
    ClockState,
    Flower,
    Pose,
    Reading,
    Snapshot,
    TagState,
)
from tests.support.raw_ws import TEXT as TEXT_FRAME
from tests.support.raw_ws import frames_of
from tests.support.seen import BY_LIGHT
from tests.support.web import filled


def received(wire: bytes) -> bytes:
    """A client's view of the bytes: the text of one whole frame."""
    [(opcode, data)] = frames_of(wire)
    assert (opcode, wire[0] >> 7) == (TEXT_FRAME, 1)
    return data


def content(wire: bytes) -> dict[str, Any]:
    decoded: dict[str, Any] = json.loads(received(wire))
    return decoded


def tag(tag_id: str, value: float = 1.0, age_s: float = 1.0) -> TagState:
    return TagState(
        tag_id, readings=(Reading("co2", value),), last_observed_ns=10**10 - int(age_s * 1e9)
    )


def snapshot(*tags: TagState, stamp_ns: int = 10**10) -> Snapshot:
    return Snapshot(stamp_ns, "map", tags)


def test_no_more_than_two_frames_are_cached() -> None:
    writer = FrameWriter()
    frames: list[StateFrame] = []
    for number in range(4):
        frames.append(writer.state(snapshot(tag("7", number)), "r"))
        frames[-1].full()
    assert frames[3].base is frames[2]
    assert frames[2].base is None, "or every frame ever made would stay in memory"


STEPS = st.lists(
    st.dictionaries(st.sampled_from("abcdef"), st.integers(0, 2), max_size=6),
    min_size=2,
    max_size=6,
)


def apply(state: dict[str, Any], delta: dict[str, Any]) -> dict[str, Any]:
    """What a client does with a delta, as `schema.DeltaFrame` describes it."""
    tags = {tag["tag_id"]: tag for tag in state["tags"] if tag["tag_id"] not in delta["removed"]}
    tags.update((tag["tag_id"], tag) for tag in delta["changed"])
    return {"header": delta["header"], "tags": list(tags.values())}


def ageless(state: dict[str, Any]) -> dict[str, Any]:
    """A state without ages: the client computes those of unchanged tags."""
    tags = sorted(state["tags"], key=lambda tag: str(tag["tag_id"]))
    return {**state, "tags": [{**tag, "stale_seconds": None} for tag in tags]}


@given(STEPS)
@settings(max_examples=100)
def test_applying_the_deltas_gives_the_state(steps: list[dict[str, int]]) -> None:
    writer, known = FrameWriter(), dict[str, TagState]()
    mine: dict[str, Any] = {}
    for number, step in enumerate(steps):
        # As in the store: an unchanged tag is the same object.
        known = {
            tag_id: known[tag_id]
            if tag_id in known and known[tag_id].readings[0].value == value
            else tag(tag_id, value)
            for tag_id, value in step.items()
        }
        frame = writer.state(snapshot(*known.values(), stamp_ns=number), "r")
        whole = content(frame.full())["state"]
        if frame.base is None:
            mine = whole
            continue
        delta = content(frame.delta())
        assert len(delta["changed"]) <= len(step)
        mine = apply(mine, delta)
        assert ageless(mine) == ageless(whole)


# What every browser gets ten times a second, for thirty tags with five sensors each.
MAX_GREENHOUSE_BYTES = 16_000


def greenhouse() -> Snapshot:
    """As after a patrol: each tag scanned once, half a minute after the one before."""
    now_ns = 1_790_000_123_456_789_012
    values = {"temperature": 21.3, "humidity": 64.0, "co2": 612.0, "light": 742.5, "ph": 6.2}
    tags = []
    for number in range(30):
        at_ns = now_ns - (30 - number) * 31_234_567_891
        wrong = {"co2": 5000.0} if number % 10 == 0 else {}
        tags.append(
            TagState(
                str(number + 1),
                pose=Pose(0.5 * (number % 6), 0.7 * (number // 6), 0.0, 0.0, 0.0, 0.0, 1.0),
                readings=tuple(Reading(*each, at_ns) for each in (values | wrong).items()),
                last_observed_ns=at_ns,
                last_try=Attempt(at_ns),
            )
        )
    return Snapshot(now_ns, "map", tuple(tags))


def test_a_frame_of_a_greenhouse_is_within_its_budget_of_bytes() -> None:
    scanned = greenhouse()
    judged = Judge(replace(BY_LIGHT, recent_s=3600.0)).see(scanned)
    verdicts = Counter(health.verdict for health in judged.tags.values())
    assert verdicts == {"healthy": 27, "critical": 3}
    frame = FrameWriter().state(scanned, "0123456789abcdef-1234-5", judged)
    assert len(frame.full()) <= MAX_GREENHOUSE_BYTES


ANY_NUMBER = st.floats(width=64)
FINITE = st.floats(allow_nan=False, allow_infinity=False)
# A text that looks like the placeholder of the age must not be mistaken for it.
TEXT = st.one_of(
    st.text(st.characters(codec="utf-8"), max_size=12),
    st.sampled_from(['"stale_seconds":null', "%b", "100 %"]),
)
STAMP_NS = st.integers(0, 4_000_000_000_000_000_000)

POSES = st.builds(Pose, *[FINITE] * 6, FINITE.filter(lambda w: w != 0.0))
BLOOMS = st.builds(
    Bloom, ANY_NUMBER, ANY_NUMBER, ANY_NUMBER, ANY_NUMBER, TEXT, ANY_NUMBER, st.booleans()
)
FLOWERS = st.builds(
    Flower,
    species=TEXT,
    confidence=ANY_NUMBER,
    anomaly=st.booleans(),
    flower_count=st.integers(0, 65_535),
    bug_count=st.integers(0, 65_535),
    blooms=st.lists(BLOOMS, max_size=3).map(tuple),
    footprint=st.lists(st.tuples(ANY_NUMBER, ANY_NUMBER, ANY_NUMBER), max_size=3).map(tuple),
)
TAGS = st.builds(
    TagState,
    tag_id=TEXT,
    pose=st.none() | POSES,
    readings=st.lists(st.builds(Reading, TEXT, ANY_NUMBER, st.none() | STAMP_NS), max_size=3).map(
        tuple
    ),
    last_observed_ns=st.none() | STAMP_NS,
    flower=FLOWERS,
    looked_at_ns=st.none() | STAMP_NS,
    last_try=st.none() | st.builds(Attempt, STAMP_NS, st.integers(0, 255), TEXT),
)
SNAPSHOTS = st.builds(
    Snapshot,
    stamp_ns=STAMP_NS,
    frame_id=TEXT,
    tags=st.lists(TAGS, max_size=4, unique_by=lambda tag: tag.tag_id).map(tuple),
)

S = 1_000_000_000
POSE = Pose(1.0, 2.0, 0.5, 0.0, 0.0, 0.0, 1.0)


def number(value: float) -> float | None:
    return value if math.isfinite(value) else None


def stamp(stamp_ns: int) -> dict[str, int]:
    return {"sec": stamp_ns // 10**9, "nanosec": stamp_ns % 10**9}


def xyz(x: float, y: float, z: float) -> dict[str, float | None]:
    return {"x": number(x), "y": number(y), "z": number(z)}


def age(stamp_ns: int | None, now_ns: int) -> Any:
    if stamp_ns is None:
        return None
    return pytest.approx(max(0, now_ns - stamp_ns) / 1e9, abs=0.00051)


def times_of(tag: TagState) -> dict[str, Any]:
    """The times beside the message's own fields."""
    last = tag.last_try
    return {
        "looked_at": None if tag.looked_at_ns is None else stamp(tag.looked_at_ns),
        "last_try": None if last is None else stamp(last.stamp_ns),
        "last_try_status": None if last is None else last.status,
        "last_try_detail": "" if last is None else last.detail,
    }


def reading_of(reading: Reading, has_times: bool) -> dict[str, Any]:
    fields: dict[str, Any] = {"name": reading.name, "value": number(reading.value)}
    if has_times:
        at_ns = reading.observed_at_ns
        fields["observed_at"] = None if at_ns is None else stamp(at_ns)
    return fields


def plainly(snapshot: Snapshot, has_times: bool = True) -> dict[str, Any]:
    """The snapshot in the form of the contract, written in the simplest way."""
    tags = []
    for tag in snapshot.tags:
        pose, flower = tag.pose or Pose(0, 0, 0, 0, 0, 0, 0), tag.flower
        tags.append(
            {
                "tag_id": tag.tag_id,
                "pose": {
                    "position": xyz(pose.x, pose.y, pose.z),
                    "orientation": {**xyz(pose.qx, pose.qy, pose.qz), "w": pose.qw},
                },
                "readings": [reading_of(reading, has_times) for reading in tag.readings],
                "last_observed": stamp(tag.last_observed_ns or 0),
                "stale_seconds": age(tag.last_observed_ns, snapshot.stamp_ns),
                "species": flower.species,
                "species_confidence": number(flower.confidence),
                "anomaly": flower.anomaly,
                "flower_count": flower.flower_count,
                "bug_count": flower.bug_count,
                "flowers": [
                    {
                        "position": xyz(bloom.x, bloom.y, bloom.z),
                        "height_m": number(bloom.height_m),
                        "species": bloom.species,
                        "confidence": number(bloom.confidence),
                        "anomaly": bloom.anomaly,
                    }
                    for bloom in flower.blooms
                ],
                "box_footprint": {"points": [xyz(*point) for point in flower.footprint]},
                **(times_of(tag) if has_times else {}),
            }
        )
    return {
        "header": {"stamp": stamp(snapshot.stamp_ns), "frame_id": snapshot.frame_id},
        "tags": tags,
    }


@given(SNAPSHOTS)
@settings(max_examples=100)
def test_any_snapshot_is_written_as_in_the_contract_and_without_times_as_in_the_message(
    snapshot: Snapshot,
) -> None:
    text = StateJson().state(snapshot, snapshot.now_ns)
    written = json.loads(text, parse_constant=pytest.fail)
    written["tags"] = [filled(tag) for tag in written["tags"]]
    assert written == plainly(snapshot)
    schema.TwinState.model_validate_json(text, strict=True)
    text = StateJson(has_times=False).state(snapshot, snapshot.now_ns)
    assert json.loads(text, parse_constant=pytest.fail) == plainly(snapshot, has_times=False)


@given(SNAPSHOTS, SNAPSHOTS)
@settings(max_examples=50)
def test_earlier_snapshots_leave_no_trace(first: Snapshot, second: Snapshot) -> None:
    writer = StateJson()
    for snapshot in (first, second, first):
        text = writer.state(snapshot, snapshot.now_ns)
        assert text == StateJson().state(snapshot, snapshot.now_ns)


def test_an_unchanged_tag_still_ages() -> None:
    writer = StateJson()
    tag = TagState("7", POSE, last_observed_ns=1_000_000_000)
    ages = [
        json.loads(writer.state(Snapshot(0, "map", (tag,)), now_ns))["tags"][0]["stale_seconds"]
        for now_ns in (1_000_000_000, 3_500_000_000, 0)
    ]
    assert ages == [0.0, 2.5, 0.0]


def test_times_and_attempts_are_written_where_they_differ() -> None:
    times_s = (7210, 10, 10, None, None, 7210)
    readings = tuple(Reading(str(i), 1.0, s and s * S) for i, s in enumerate(times_s))
    tag = TagState("7", POSE, readings, last_observed_ns=7210 * S, looked_at_ns=3610 * S)
    written = json.loads(StateJson().tag(tag, 7300 * S))
    assert [reading.get("observed_at", "absent") for reading in written["readings"]] == [
        "absent",
        {"sec": 10, "nanosec": 0},
        "absent",
        None,
        "absent",
        {"sec": 7210, "nanosec": 0},
    ]
    assert written["looked_at"] == {"sec": 3610, "nanosec": 0}
    tag = TagState("7", POSE, last_observed_ns=5 * S, last_try=Attempt(5 * S))
    assert (
        not {"last_try", "last_try_status", "last_try_detail"}
        & json.loads(StateJson().tag(tag, 5 * S)).keys()
    )
    for attempted in (Attempt(6 * S), Attempt(5 * S, 2), Attempt(5 * S, 0, "late"), None):
        written = json.loads(StateJson().tag(replace(tag, last_try=attempted), 5 * S))
        assert written["last_try"] == (attempted and stamp(attempted.stamp_ns))
        assert written["last_try_status"] == (attempted and attempted.status)


def air(temperature_at_s: int | None, *others: Reading) -> TagState:
    readings = (Reading("humidity", 60.0, 10 * S), *others)
    if temperature_at_s is not None:
        readings = (Reading("temperature", 25.1, temperature_at_s * S), *readings)
    return TagState("7", POSE, readings, last_observed_ns=10 * S)


@pytest.mark.parametrize("other", [air(None), air(9), air(10, Reading("humidity", math.nan, 10))])
def test_nothing_is_derived_of_readings_that_are_missing_invalid_or_of_several_scans(
    other: TagState,
) -> None:
    assert not {"derived", "derived_at"} & json.loads(StateJson(DERIVED).tag(other, None)).keys()


def test_a_tag_has_what_is_derived_of_one_scan_as_far_as_the_sensors_file_names_it() -> None:
    scanned = air(10)
    written = json.loads(StateJson(DERIVED).tag(scanned, None))
    dew_c = dew_point_c(25.1, 60.0)
    expected = {
        "vpd": vapour_pressure_deficit_kpa(25.1, 60.0),
        "dew_point": dew_c,
        "condensation_margin": 25.1 - dew_c,
    }
    assert written["derived"] == pytest.approx(expected, abs=5e-5)
    assert "derived_at" not in written
    schema.TwinTagState.model_validate(written)
    later = air(10, Reading("co2", 600.0, 12 * S))
    assert json.loads(StateJson(DERIVED).tag(later, None))["derived_at"] == stamp(10 * S)
    assert json.loads(StateJson(["vpd"]).tag(scanned, None))["derived"].keys() == {"vpd"}


def test_frames_have_what_is_derived_for_clients_with_deltas_alone() -> None:
    writer = FrameWriter(DERIVED)
    writer.state(snapshot(), "r")
    frame = writer.state(snapshot(air(10)), "r")
    [changed] = content(frame.delta())["changed"]
    assert changed["derived"].keys() == DERIVED.keys()
    assert content(frame.first())["state"]["tags"] == [changed]
    assert "derived" not in content(frame.full())["state"]["tags"][0]


@pytest.mark.parametrize("clock", ["none", "stopped"])
def test_without_a_running_clock_no_age_is_known(clock: ClockState) -> None:
    tag = TagState("1", readings=(Reading("co2", 1.0, S),), last_observed_ns=2 * S)
    snapshot = Snapshot(9 * S, "map", (tag,), clock=clock)
    [reported] = json.loads(StateJson().state(snapshot, snapshot.now_ns))["tags"]
    assert reported["stale_seconds"] is None
    assert reported["readings"][0]["observed_at"] == {"sec": 1, "nanosec": 0}
    snapshot = replace(snapshot, clock="paused")
    paused = json.loads(StateJson().state(snapshot, snapshot.now_ns))
    assert paused["tags"][0]["stale_seconds"] == 7.0
