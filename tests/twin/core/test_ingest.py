"""The rules of ingestion, one by one: plain values in, a write or a drop out."""

import math
from dataclasses import replace
from functools import partial
from typing import Any

import pytest

from lupin_twin.core import ingest
from lupin_twin.core.drops import MAX_TEXT_LENGTH, Drop, Reason
from lupin_twin.core.history import Repeats
from lupin_twin.core.state import Flower, Observation, Pin, Pose, TwinStore
from lupin_twin.ros.convert import pose_message, pose_of
from tests.support.store import S, at

NOW_NS = 100 * S
SKIPPED = 3
READINGS = {"co2": 1.0}


SENT: dict[str, Any] = {"pose": at(1.0, 2.0), "source": "robot", "own_stamp_ns": 4 * S}


Received = tuple[str, Observation]


def received_reading(frame_id: str = "map", **changes: Any) -> Received:
    return frame_id, Observation("1", 3 * S, READINGS, **(SENT | changes))


def received_inspection(**changes: Any) -> Received:
    sent = Observation("1", 0, kind=1, flower=Flower("rose", 0.9), **(SENT | changes))
    return "map", sent


def reason_of(received: Received) -> Reason | None:
    write = ingest.observation(*received, "map", NOW_NS)
    return write.reason if isinstance(write, Drop) else None


@pytest.mark.parametrize(("own_s", "at_s"), [(0, 3), (101, 100)])
def test_a_scan_without_a_stamp_has_the_time_of_its_sensors(own_s: int, at_s: int) -> None:
    write = ingest.observation(*received_reading(own_stamp_ns=own_s * S), "map", NOW_NS)
    assert isinstance(write, Observation)
    assert (write.stamp_ns, write.own_stamp_ns) == (at_s * S, (own_s or 3) * S)


def test_a_failed_scan_keeps_its_readings_and_reason_and_loses_its_pose() -> None:
    received = received_reading(status=SKIPPED, status_detail="no time")
    assert ingest.observation(*received, "map", NOW_NS) == Observation(
        "1", 4 * S, READINGS, None, SKIPPED, "no time", "robot", 4 * S
    )


def test_an_inspection_has_the_result_of_the_camera() -> None:
    assert ingest.observation(*received_inspection(), "map", NOW_NS) == Observation(
        "1", 4 * S, {}, at(1.0, 2.0), 0, "", "robot", 4 * S, kind=1, flower=Flower("rose", 0.9)
    )


def test_a_failed_inspection_is_a_failed_attempt_without_its_payload() -> None:
    received = received_inspection(status=SKIPPED, status_detail="dark")
    assert ingest.observation(*received, "map", NOW_NS) == Observation(
        "1", 4 * S, {}, None, SKIPPED, "dark", "robot", 4 * S, kind=1
    )


@pytest.mark.parametrize(("length", "stored"), [(256, 256), (257, 256), (10_000, 256)])
def test_a_long_text_of_a_producer_is_cut_and_drops_nothing(length: int, stored: int) -> None:
    received = received_reading(source="s" * length, status_detail="d" * length)
    write = ingest.observation(*received, "map", NOW_NS)
    assert isinstance(write, Observation)
    assert (len(write.source), len(write.status_detail)) == (stored, stored)
    assert write.source.endswith("…") == (length > stored)


@pytest.mark.parametrize(("kind", "name"), [(2, "KIND_ANOMALY"), (77, "an unknown kind")])
def test_other_kinds_are_dropped_with_their_name(kind: int, name: str) -> None:
    drop = ingest.observation("map", Observation("", 0, kind=kind), "map", NOW_NS)
    assert isinstance(drop, Drop)
    assert drop.reason is Reason.KIND
    assert drop.on("/t") == f"dropped an observation on /t: kind {kind} ({name}) is not a tag's"


def test_a_frame_is_the_expected_one_or_empty() -> None:
    assert reason_of(received_reading(frame_id="")) is None
    assert reason_of(received_reading(frame_id="odom")) is Reason.FRAME


@pytest.mark.parametrize(
    ("stamp_s", "now_s", "expected_s"),
    [
        (60.0, 100.0, 60.0),  # latched earlier: as old as its stamp
        (100.0, 100.0, 100.0),
        (130.0, 100.0, 100.0),  # from the future: no younger than now
        (0.0, 100.0, 100.0),  # no stamp: now
        (60.0, 0.0, 60.0),  # simulated time has not started
        (0.0, 0.0, 1e-9),  # neither is known: not 0, which stands for never
    ],
)
def test_the_time_of_an_observation(stamp_s: float, now_s: float, expected_s: float) -> None:
    assert ingest.observed_at(round(stamp_s * S), round(now_s * S)) == round(expected_s * S)


def test_a_scans_pose_with_w_zero_or_a_broken_number_is_ignored() -> None:
    assert ingest.scanned_pose(replace(at(0.0), qw=0.0)) is None
    assert ingest.scanned_pose(replace(at(0.0), qw=-0.0)) is None
    for broken in (math.nan, math.inf):
        assert ingest.scanned_pose(at(broken)) is None
        assert ingest.scanned_pose(replace(at(0.0), qw=broken)) is None
        assert ingest.discovered_pose(at(0.0, broken)) is None
        assert ingest.discovered_pose(replace(at(0.0), qw=broken)) is None


def test_a_discoverys_w_zero_is_read_as_one() -> None:
    for w, expected in ((0.0, 1.0), (-0.0, 1.0), (0.5, 0.5)):
        pose = ingest.discovered_pose(replace(at(0.0), qw=w))
        assert pose is not None
        assert pose.qw == expected


@pytest.mark.parametrize("length", [1.0, 2.5])
def test_a_discoverys_half_turn_is_preserved_and_is_not_an_absent_pose(length: float) -> None:
    pose = ingest.discovered_pose(replace(at(1.0), qx=0.6 * length, qz=-0.8 * length, qw=0.0))
    assert pose is not None
    assert (pose.qx, pose.qy, pose.qz) == pytest.approx((0.6, 0.0, -0.8), abs=1e-15)
    assert 0.0 < pose.qw < 1e-8
    assert ingest.scanned_pose(pose_of(pose_message(pose))) == pose


def test_a_discovery_pins_a_tag_without_a_pose_and_changes_no_other() -> None:
    requested = []

    def pose(index: int) -> Pose:
        requested.append(index)
        return at(math.nan if index == 3 else index)

    received = [(name, partial(pose, n)) for n, name in enumerate(["a", "b", "", "broken"])]
    made = list(ingest.discoveries(received, "map", "map", is_pinned=lambda tag_id: tag_id == "a"))
    assert made[0] == Pin("b", at(1.0))
    assert [drop.reason for drop in made[1:] if isinstance(drop, Drop)] == [
        Reason.TAG_ID,
        Reason.POSE,
    ]
    assert requested == [1, 3]


def test_a_discovery_in_another_frame_is_dropped_once_whatever_it_holds() -> None:
    received = [("a", partial(at, 0.0)), ("", partial(at, 0.0))]
    [drop] = ingest.discoveries(received, "odom", "map", is_pinned=lambda _: False)
    assert isinstance(drop, Drop)
    assert drop.on("/t") == "dropped a message on /t: its frame is 'odom', expected 'map'"


def test_an_accepted_write_is_stored_and_known_and_a_refused_one_is_neither() -> None:
    store, repeats = TwinStore(), Repeats()
    assert ingest.apply(Observation("1", S, READINGS), store, repeats) is None
    seen = Observation("1", 2 * S, kind=1, flower=Flower("rose"))
    assert ingest.apply(seen, store, repeats) is None
    assert ingest.apply(Pin("1", at(1.0)), store, repeats) is None
    [tag] = store.snapshot(S, "map").tags
    assert ([r.value for r in tag.readings], tag.flower.species) == ([1.0], "rose")
    assert tag.pose == at(1.0)
    assert repeats.news(Observation("1", S, READINGS)) is None
    too_long = "x" * (MAX_TEXT_LENGTH + 1)
    for write in (Pin(too_long, at(1.0)), Observation(too_long, S)):
        drop = ingest.apply(write, store, repeats)
        assert drop is not None
        assert drop.reason is Reason.REJECTED
        assert drop.why.startswith("tag_id 'x")
        assert f"the limit is {MAX_TEXT_LENGTH}" in drop.why
    assert repeats.news(Observation(too_long, S)) is not None
