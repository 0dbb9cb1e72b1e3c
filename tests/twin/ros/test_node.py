"""The node over real DDS, each with its own twin: its state, its times, and what it drops."""

import math
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from lupin_msgs.msg import Observation, TwinTimes
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter

from lupin_twin.core.clock import LATCHED_AFTER_S
from tests.support import journal, messages
from tests.support.domains import own_domain
from tests.support.messages import discovered, inspection, occupancy_grid, scan
from tests.support.processes import OFTEN, Process, twin_node
from tests.support.ros import Peer, clock_at, latched


class Twin:
    """A twin in a process, and a peer that is connected to it."""

    def __init__(self, process: Process, peer: Peer) -> None:
        self.process, self.peer = process, peer

    def warning(self, *words: str) -> str:
        """Wait for a warning that contains all of the words."""

        def find() -> str | None:
            lines = self.process.output.splitlines()
            return next((x for x in lines if "WARN" in x and all(w in x for w in words)), None)

        return str(self.peer.until(find, f"a warning with {words}"))

    def settled(self, tag_id: str = "marker") -> Any:
        """Send one good observation and wait for it: all earlier messages are handled then."""
        self.peer.observe(scan(tag_id, {"temperature": 1.0}))
        return self.peer.tag(tag_id)

    def tags(self) -> dict[str, Any]:
        return {tag.tag_id: tag for tag in self.peer.states[-1].tags}


def running_twin(*ros_args: str) -> Iterator[Twin]:
    with own_domain() as domain, twin_node(domain, *ros_args) as process, Peer(domain) as peer:
        peer.wait_for_twin()
        yield Twin(process, peer)


def test_a_twin_alone_publishes_an_empty_state_at_once(domain: int) -> None:
    with twin_node(domain, "--ros-args", "-p", "state_publish_rate_hz:=0.01"), Peer(domain) as peer:
        state = peer.state(lambda _: True, "a state")
    assert list(state.tags) == []
    assert state.header.frame_id == "map"
    assert state.header.stamp.sec > 0


def test_fifty_observations_latched_before_the_twin_started_are_all_received(domain: int) -> None:
    with Peer(domain) as producer:
        producer.observe(*(scan(f"t{i}", {"co2": 400.0 + i}, at=(i, 0)) for i in range(50)))
        with twin_node(domain, *OFTEN):
            # First the twin, which may take its time to start on a busy machine, then its tags.
            producer.state(lambda _: True, "a state")
            state = producer.state(lambda s: len(s.tags) >= 50, "all 50 tags")
    assert [tag.tag_id for tag in state.tags] == [f"t{i}" for i in range(50)]
    assert [tag.readings[0].value for tag in state.tags] == [400.0 + i for i in range(50)]


def test_stamps_and_staleness_follow_the_simulated_clock(domain: int) -> None:
    clock = (*OFTEN, "-p", "use_sim_time:=true")
    with twin_node(domain, *clock) as process, Peer(domain) as peer:
        peer.wait_for_twin()
        now_s = 100.0
        # After 3 s without it the clock counts as stopped, and no age is known: on a busy machine a
        # state from in between may arrive, which is skipped.
        peer.node.create_timer(0.1, lambda: peer.publish("/clock", clock_at(now_s), depth=1))

        def ages(accept: Any = lambda _: True) -> dict[str, float]:
            def check(state: Any) -> bool:
                known = not any(math.isnan(tag.stale_seconds) for tag in state.tags)
                return state.header.stamp == clock_at(now_s).clock and known and accept(state)

            state = peer.state(check, f"a state at {now_s} s with ages")
            return {tag.tag_id: tag.stale_seconds for tag in state.tags}

        peer.set_clock(now_s)
        peer.observe(scan("now", {"co2": 1.0}), scan("before", {"co2": 1.0}, stamp_s=60.0))
        assert peer.tag("now").last_observed.sec == 100
        assert ages(lambda state: len(state.tags) == 2) == {"before": 40.0, "now": 0.0}
        now_s = 130.5
        assert ages() == {"before": 70.5, "now": 30.5}
        now_s = 50.0
        assert ages() == {"before": 0.0, "now": 0.0}
        process.wait_for_output("ROS time has gone back")
        # Both age from the jump on, and a new observation is the latest.
        now_s = 60.0
        assert ages() == {"before": 10.0, "now": 10.0}
        peer.observe(scan("now", {"co2": 2.0}, stamp_s=55.0))
        peer.tag("now", lambda tag: tag.readings[0].value == 2.0)
        assert ages() == {"before": 10.0, "now": 5.0}


def test_a_parameter_that_does_not_exist_causes_a_warning_with_its_name(domain: int) -> None:
    with twin_node(domain, "--ros-args", "-p", "idw_pwoer:=3.0") as process:
        line = process.wait_for_output("idw_pwoer")
    assert "WARN" in line
    assert "unknown" in line


def test_a_damaged_journal_is_named_in_the_log(domain: int, tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    journal.append(path, [journal.scan()])
    path.write_bytes(path.read_bytes()[:-4096])
    with twin_node(domain, "--ros-args", "-p", f"journal:={path}") as process:
        line = process.wait_for_output("a damaged journal was quarantined as")
    assert "WARN" in line


def stamp_of(msg: Any) -> tuple[int, int]:
    return msg.header.stamp.sec, msg.header.stamp.nanosec


def paired(states: list[Any], times: list[Any]) -> tuple[Any, Any] | None:
    """A state and the times of the same stamp."""
    by_stamp = {stamp_of(each): each for each in times}
    return next(((s, by_stamp[stamp_of(s)]) for s in states if stamp_of(s) in by_stamp), None)


def test_a_robot_whose_clock_stepped_back_causes_a_warning_with_its_name(domain: int) -> None:
    """It is not ignored silently, and its messages are in the history at their time."""
    with twin_node(domain, *OFTEN) as twin, Peer(domain) as robot:
        robot.wait_for_twin()
        robot.observe(
            scan("1", {"co2": 1.0}, stamp_s=2000.0), scan("1", {"co2": 1.0}, stamp_s=1990)
        )
        robot.tag("1")
        assert "late stamps" not in twin.output
        robot.observe(*(scan("1", {"co2": 2.0}, stamp_s=1400.0 + i) for i in range(10)))
        robot.until(lambda: "late stamps" in twin.output, "a warning")
        robot.observe(scan("marker"))
        robot.tag("marker")
        [stored] = [tag for tag in robot.states[-1].tags if tag.tag_id == "1"]
        [line] = [line for line in twin.output.splitlines() if "late stamps" in line]
    assert "WARN" in line
    assert "late stamps on /floranova/observations: 6 observations in a row from source" in line
    assert "'test'" in line
    assert "by 596 s" in line
    assert stored.readings[0].value == 1.0


def test_latched_messages_of_two_robots_with_one_name_cause_no_warning(domain: int) -> None:
    """Both have latched the same hour; to the starting twin, the second repeats that time."""
    with Peer(domain, "one") as one, Peer(domain, "two") as two:
        for robot, tag_id in ((one, "a"), (two, "b")):
            robot.observe(*(scan(tag_id, {"co2": 1.0}, stamp_s=1000.0 + i) for i in range(40)))
        latched_at_s = time.monotonic()
        one.until(lambda: time.monotonic() > latched_at_s + 2 * LATCHED_AFTER_S, "an old latch")
        with twin_node(domain, *OFTEN) as twin:
            one.state(lambda state: len(state.tags) == 2, "both tags")
            for robot in (one, two):
                robot.observe(scan(f"marker {robot.node.get_name()}"))
            one.state(lambda state: len(state.tags) == 4, "both markers")
            assert "late stamps" not in twin.output


def test_the_times_come_with_the_state_latched_and_with_its_stamp(domain: int) -> None:
    failed = scan("1", status=Observation.STATUS_SCAN_FAILED, stamp_s=7300.0)
    failed.status_detail = "not decoded"
    with twin_node(domain, *OFTEN), Peer(domain) as robot:
        robot.wait_for_twin()
        robot.observe(
            scan("1", {"co2": 400.0, "light": 1.0}, stamp_s=10.0),
            inspection("1", stamp_s=3610.0),
            scan("1", {"light": 2.0}, stamp_s=7210.0),
            failed,
            scan("marker"),
        )
        robot.tag("marker")
        with Peer(domain, "late") as late:
            times: list[Any] = []
            late.node.create_subscription(TwinTimes, "/twin/times", times.append, latched(1))
            late.listen()
            pair = late.until(lambda: paired(late.states, times), "a state and its times")
    assert pair is not None
    state, of_state = pair
    assert of_state.header.frame_id == state.header.frame_id == "map"
    assert [tag.tag_id for tag in of_state.tags] == [tag.tag_id for tag in state.tags]
    tag = of_state.tags[0]
    assert list(tag.sensors) == [reading.name for reading in state.tags[0].readings]
    assert [time.sec for time in tag.observed_at] == [10, 7210]
    assert (tag.looked_at.sec, tag.last_try.sec) == (3610, 7300)
    assert (tag.last_try_status, tag.last_try_detail) == (2, "not decoded")
    assert state.tags[0].last_observed.sec == 7210, "the failed try is apart from it"


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
