"""Readings become scans: which tag they belong to, and the mean over a stop."""

import statistics
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lupin_twin.adapt.config import Config, Robot
from lupin_twin.adapt.scans import FIXED_SOURCE, SCAN_FAILED, VISIT_SOURCE, Scans
from lupin_twin.adapt.table import number_of
from lupin_twin.core.drops import MAX_SENSORS_PER_TAG, MAX_TAGS, Rejected
from lupin_twin.core.state import Observation, Pose

S = 1_000_000_000
ROBOT = Robot("/pose", "geometry_msgs/msg/PoseStamped", max_age_s=30.0)
TAGS = {"A": Pose.at(0.0, 0.0), "B": Pose.at(3.0, 0.0, 0.5)}


def scans_of(**changes: object) -> Scans:
    given: dict[str, object] = {"robot": ROBOT, "tags": TAGS, "reach_m": 0.8, "window_s": 10.0}
    return Scans(Config((), **(given | changes)))  # type: ignore[arg-type]


def read(scans: Scans, at_s: float, value: float = 20.0) -> bool:
    return scans.take("temperature", "", value, int(at_s * S), int(at_s * S))


def move(scans: Scans, at_s: float, x: float, y: float = 0.0) -> list[Observation]:
    return list(scans.move(x, y, int(at_s * S)))


def test_a_stop_is_one_scan_of_the_mean_when_the_robot_leaves() -> None:
    scans = scans_of()
    assert move(scans, 1, 0.3) == []
    assert read(scans, 3, 20.0)
    assert read(scans, 2, 22.0)  # the scan has the latest stamp, whatever arrived last
    (scan,) = move(scans, 4, 1.5)
    assert scan == Observation(
        "A",
        3 * S,
        {"temperature": 21.0},
        TAGS["A"],
        status_detail="temperature ±1.4 of 2",
        source=VISIT_SOURCE,
    )
    assert scans.tag is None


def test_a_long_stop_is_one_scan_per_window() -> None:
    scans = scans_of()
    move(scans, 0, 0.0)
    read(scans, 1)
    assert list(scans.due(9 * S)) == []
    assert [scan.stamp_ns for scan in scans.due(10 * S)] == [S]
    read(scans, 11, 30.0)
    (scan,) = move(scans, 12, 9.0)
    assert scan.readings == {"temperature": 30.0}


def test_a_stop_without_readings_is_a_failed_scan_and_passing_by_is_none() -> None:
    scans = scans_of()
    move(scans, 0, 0.0)
    assert move(scans, 1, 1.5) == []
    move(scans, 2, 0.0)
    (scan,) = move(scans, 5, 1.5)
    assert (scan.tag_id, scan.readings, scan.status) == ("A", {}, SCAN_FAILED)
    assert scan.status_detail == "no reading in 3 s here"


def test_jitter_at_the_edge_of_reach_makes_one_scan() -> None:
    scans = scans_of()
    move(scans, 0, 0.79)
    read(scans, 0)
    for at in range(1, 9):
        assert move(scans, at, 0.79 + 0.05 * (at % 2)) == []
    assert len(move(scans, 9, 0.9)) == 1


def test_of_two_tags_in_reach_the_nearer_counts_once_it_is_clearly_nearer() -> None:
    scans = scans_of(tags={"A": Pose.at(0, 0), "B": Pose.at(1, 0)})
    move(scans, 0, 0.4)
    assert scans.tag == "A"
    move(scans, 1, 0.52)
    assert scans.tag == "A"
    move(scans, 2, 0.6)
    assert scans.tag == "B"


def test_a_pose_holds_no_longer_than_its_age() -> None:
    scans = scans_of()
    move(scans, 0, 0.0)
    read(scans, 1)
    (scan,) = scans.due(10 * S)
    assert scan.tag_id == "A"
    list(scans.due(31 * S))
    assert scans.tag is None
    assert not read(scans, 31)


def test_a_clock_that_goes_back_starts_anew() -> None:
    scans = scans_of()
    move(scans, 100, 0.0)
    read(scans, 101)
    assert list(scans.due(5 * S)) == []
    assert scans.tag is None


def test_a_fixed_sensor_needs_no_robot() -> None:
    scans = scans_of(robot=None)
    for at in range(10):
        assert scans.take("co2", "B", 400.0 + at, at * S, at * S)
    (scan,) = scans.due(10 * S)
    assert (scan.tag_id, scan.pose, scan.stamp_ns) == ("B", TAGS["B"], 9 * S)
    assert scan.source == FIXED_SOURCE
    assert scan.readings == {"co2": 404.5}
    assert list(scans.due(30 * S)) == []


def test_where_no_tag_is_in_reach_a_grid_cell_may_become_one() -> None:
    scans = scans_of(cell_m=2.0)
    move(scans, 0, 7.0, -0.5)
    read(scans, 1)
    (scan,) = move(scans, 2, 0.0)
    assert (scan.tag_id, scan.pose) == ("cell 3 -1", Pose.at(7.0, -1.0))
    assert scans.tag == "A"


def test_tags_are_limited_both_fixed_and_found_ones() -> None:
    scans = scans_of(tags={})
    taken = [scans.take("co2", f"T{n}", 1.0, 0, 0) for n in range(MAX_TAGS + 1)]
    assert taken == [True] * MAX_TAGS + [False]
    taken = [scans.take(f"s{n}", "T0", 1.0, 0, 0) for n in range(MAX_SENSORS_PER_TAG)]
    assert taken == [True] * (MAX_SENSORS_PER_TAG - 1) + [False]  # with co2
    found = [scans.discover(f"T{n}", Pose.at(0, 0), 0.1, 0.1) for n in range(MAX_TAGS + 1)]
    assert found == [True] * MAX_TAGS + [False]


def test_a_found_tag_counts_as_new_and_then_like_a_surveyed_one() -> None:
    scans = scans_of()
    move(scans, 0, 5.0)
    assert not scans.discover("A", Pose.at(5, 0), 5.0, 0.0)
    assert not scans.discover("C", Pose.at(6, 0), 5.0, 0.0)
    assert scans.discover("C", Pose.at(5.5, 0), 5.0, 0.0)
    assert not scans.discover("C", Pose.at(5.2, 0), 5.0, 0.0)
    move(scans, 1, 5.0)
    assert read(scans, 2)
    (scan,) = scans.lose(3 * S)
    assert (scan.tag_id, scan.pose) == ("C", Pose.at(5.5, 0))
    assert scans.tag is None


@given(st.lists(st.floats(-1e6, 1e6), min_size=2, max_size=50))
def test_mean_and_spread_match_their_definitions(values: list[float]) -> None:
    scans = scans_of()
    move(scans, 0, 0.0)
    for value in values:
        read(scans, 1, value)
    (scan,) = move(scans, 2, 9.0)
    assert scan.readings["temperature"] == pytest.approx(statistics.fmean(values), abs=1e-6)
    spread = float(scan.status_detail.split("±")[1].split()[0])
    assert spread == pytest.approx(statistics.stdev(values), rel=0.06, abs=1e-6)


@pytest.mark.parametrize(
    ("path", "number"), [("data", 1.5), ("axes[1].value", 7.0), ("list[0]", 4.0), ("is_on", 1.0)]
)
def test_a_number_is_found_by_its_path(path: str, number: float) -> None:
    axes = [SimpleNamespace(value=6), SimpleNamespace(value=7)]
    message = SimpleNamespace(data=1.5, axes=axes, list=[4], is_on=True, text="8")
    assert number_of(message, path) == number


@pytest.mark.parametrize("path", ["none", "axes[0]", "list[3]", "text", "data.x"])
def test_a_value_that_is_no_number_is_an_error(path: str) -> None:
    message = SimpleNamespace(data=1.5, axes=[SimpleNamespace()], list=[4], text="8")
    with pytest.raises(Rejected, match="field "):
        number_of(message, path)
