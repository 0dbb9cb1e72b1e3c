"""What a node drops, and how it is logged; over real DDS, each with its own twin."""

from collections.abc import Iterator

import pytest
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter

from tests.support import messages
from tests.support.messages import discovered, inspection, occupancy_grid, scan
from tests.support.processes import OFTEN
from tests.twin.ros.test_node import Twin, running_twin


@pytest.fixture
def twin() -> Iterator[Twin]:
    yield from running_twin(*OFTEN)


def test_a_wrong_frame_is_dropped_on_each_path_with_both_frames_named(twin: Twin) -> None:
    twin.peer.observe(
        scan("scan", {"co2": 1.0}, at=(1, 1), frame_id="odom"),
        inspection("flower-own", frame_id="map", pose_frame_id="camera"),
        inspection("flower-header", frame_id="base_link"),
    )
    twin.peer.discover(discovered({"discovery": messages.pose(1, 1)}, frame_id="laser"))
    twin.peer.publish_map(occupancy_grid([[0]], frame_id="other_map"))
    twin.warning("/floranova/observations", "'odom'", "'map'")
    twin.warning("/perception/discovered_tags", "'laser'", "'map'")
    twin.warning("/map", "'other_map'", "'map'")
    twin.settled()
    assert set(twin.tags()) == {"marker"}


def test_a_pose_too_far_off_is_dropped_on_each_path_and_the_readings_stay(twin: Twin) -> None:
    peer = twin.peer
    peer.observe(
        scan("lost", {"temperature": 21.0}, at=(3.0, -5000.0)),
        inspection("flower", "lupin", at=(1e30, 0.0)),
    )
    peer.discover(
        discovered({"high": messages.pose(1, 1, 1001), "limit": messages.pose(-1000, 1000)})
    )
    peer.tag("limit")
    twin.warning("/floranova/observations", "'lost'", "its y is -5000 m", "1000 m (max_pose_m)")
    twin.warning("/perception/discovered_tags", "'high'", "its z is 1001 m")
    twin.settled()
    tags = twin.tags()
    assert {name: tag.pose.orientation.w for name, tag in tags.items()} == {
        "lost": 0.0,
        "flower": 0.0,
        "limit": 1.0,
        "marker": 0.0,
    }
    assert [reading.value for reading in tags["lost"].readings] == [21.0]
    assert tags["flower"].species == "lupin"
    # The first possible pose is the tag's.
    peer.observe(scan("lost", {"temperature": 22.0}, at=(3.0, 5.0)))
    peer.tag("lost", lambda tag: tag.pose.position.y == 5.0)


def test_the_limit_of_a_pose_can_be_changed_while_the_twin_runs(twin: Twin) -> None:
    twin.peer.observe(scan("far", {"co2": 1.0}, at=(1500.0, 0.0)))
    twin.warning("'far'", "its x is 1500 m")
    limit = Parameter("max_pose_m", value=2000.0).to_parameter_msg()
    answer = twin.peer.call(SetParameters, "/lupin_twin/set_parameters", parameters=[limit])
    assert answer.results[0].successful, answer.results[0].reason
    twin.peer.observe(scan("far", {"co2": 2.0}, at=(1500.0, 0.0)))
    twin.peer.tag("far", lambda tag: tag.pose.position.x == 1500.0)
