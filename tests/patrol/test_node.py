"""The patrol as its own process, over real DDS; its options and its messages."""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial
from math import cos, pi, sin
from pathlib import Path
from threading import Event, Thread
from typing import Any

import numpy as np
import pytest
import rclpy
from builtin_interfaces.msg import Time
from greenhouse_sim.simulator import GreenhouseSimulator
from lupin_msgs.msg import DiscoveredTags, Observation
from nav_msgs.msg import OccupancyGrid
from rclpy.serialization import deserialize_message, serialize_message
from rosgraph_msgs.msg import Clock

from lupin_patrol import node
from lupin_patrol.cli import parser
from lupin_patrol.greenhouse import Rect
from lupin_patrol.mission import PassCompleted, ScanStatus, Visited, pose_of
from lupin_patrol.node import PatrolNode
from lupin_twin.core import state
from lupin_twin.core.state import Bloom, Flower
from tests.support.domains import ros_env
from tests.support.inprocess import ros_domain
from tests.support.processes import Process
from tests.support.ros import Peer, latched
from tests.support.waiting import PATIENCE_S, wait_for

OBSERVATIONS = "/floranova/observations"
DISCOVERED_TAGS = "/perception/discovered_tags"
MAP = "/map"


def patrol(domain: int, *arguments: str) -> Process:
    return Process([sys.executable, "-m", "lupin_patrol", *arguments], ros_env(domain))


@dataclass
class Received:
    """All messages of the three topics, subscribed as in the contract."""

    observations: list[Any] = field(default_factory=list)
    discovered_tags: list[Any] = field(default_factory=list)
    maps: list[Any] = field(default_factory=list)

    def listen(
        self,
        peer: Peer,
        observations: str = OBSERVATIONS,
        discovered_tags: str = DISCOVERED_TAGS,
        map_topic: str = MAP,
    ) -> Received:
        for kind, topic, depth, received in (
            (Observation, observations, 50, self.observations),
            (DiscoveredTags, discovered_tags, 50, self.discovered_tags),
            (OccupancyGrid, map_topic, 1, self.maps),
        ):
            peer.node.create_subscription(kind, topic, received.append, latched(depth))
        return self

    @property
    def read_tags(self) -> set[str]:
        return {
            o.tag_reading.tag_id
            for o in self.observations
            if o.kind == Observation.KIND_TAG_READING and o.status == Observation.STATUS_OK
        }

    @property
    def seen_tags(self) -> set[str]:
        return {o.flower.tag_id for o in self.observations if o.kind == Observation.KIND_FLOWER}

    def map_is_complete(self) -> bool:
        return bool(self.maps) and not (np.asarray(self.maps[-1].data) == -1).any()


def test_one_round_shows_the_whole_greenhouse_and_ends(domain: int) -> None:
    tags = GreenhouseSimulator().tag_manager.get_tags()
    with Peer(domain) as peer:
        received = Received().listen(peer)
        with patrol(domain, "--once", "--speed", "10") as process:
            peer.until(received.map_is_complete, "a complete map")
            peer.until(
                lambda: received.discovered_tags and len(received.discovered_tags[-1].tags) == 29,
                "29 discovered tags",
            )
            peer.until(lambda: received.read_tags == set(tags), "a reading of every tag")
            peer.until(lambda: received.seen_tags == set(tags), "an inspection of every tag")
            peer.until(lambda: process.exit_code is not None, "the end of the process")
            peer.until(lambda: len(received.observations) >= 2 * 29 + 2, "what came last")
            assert process.exit_code == 0
            assert "Traceback" not in process.output

    # Nothing was lost: two observations a tag, and the two that failed at first.
    assert len(received.observations) == 2 * 29 + 2
    for observation in received.observations:
        assert observation.header.frame_id == "map"
        assert observation.header.stamp.sec > 0
        reading = observation.tag_reading
        if reading.tag_id and observation.status == Observation.STATUS_OK:
            assert [r.name for r in reading.readings] == tags[reading.tag_id]["sensors"]
            place = observation.tag_pose_in_map.position
            tag = tags[reading.tag_id]
            assert (place.x, place.y) == (tag["x"], tag["y"])
            assert reading.stamp == observation.header.stamp


def test_it_waits_for_a_subscriber_before_it_begins(
    domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Otherwise a fast patrol would push its first observations out of the latch during discovery.
    monkeypatch.setattr(node, "SUBSCRIBERS_S", PATIENCE_S)
    monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
    has_begun = Event()

    def events() -> Iterator[PassCompleted]:
        has_begun.set()
        yield PassCompleted(1_000.0, 0, ())

    patrol_thread = Thread(
        target=partial(node.play, events(), begin_s=1_000.0, speed=1.0, once=True, ros_arguments=[])
    )
    with Peer(domain) as peer:
        patrol_thread.start()
        peer.until(lambda: peer.node.count_publishers(OBSERVATIONS), "the patrol")
        assert not has_begun.is_set()
        Received().listen(peer)
        peer.until(has_begun.is_set, "the first event")
        peer.until(lambda: not patrol_thread.is_alive(), "the end of the patrol")


def test_a_late_subscriber_gets_the_latched_map_and_list(domain: int) -> None:
    with Peer(domain) as early, patrol(domain, "--speed", "30"):
        first = Received().listen(early)
        # The map is published when it grows: once it is complete, never again.
        early.until(first.map_is_complete, "a complete map")
        with Peer(domain, "late") as late:
            second = Received().listen(late)
            late.until(second.map_is_complete, "the latched map")
            assert len(second.maps) == 1
            late.until(
                lambda: second.discovered_tags and len(second.discovered_tags[-1].tags) == 29,
                "the latched list of tags",
            )
            # It missed the oldest observations of this round (the latch holds 50). The next ones
            # bring every tag.
            late.until(lambda: len(second.read_tags) == 29, "a reading of every tag")


def test_topics_and_frame_are_parameters_and_stamps_follow_simulated_time(domain: int) -> None:
    parameters = {
        "observations_topic": "robot/observations",
        "discovered_tags_topic": "/elsewhere/tags",
        "map_topic": "/elsewhere/map",
        "frame_id": "greenhouse",
        "use_sim_time": "true",
    }
    arguments = [part for name, value in parameters.items() for part in ("-p", f"{name}:={value}")]
    with Peer(domain) as peer:
        received = Received().listen(
            peer, "/robot/observations", "/elsewhere/tags", "/elsewhere/map"
        )

        def received_simulated_time() -> bool:
            # Repeated: a subscriber of /clock does not request a latched one.
            peer.publish("/clock", Clock(clock=Time(sec=1234, nanosec=500_000_000)), depth=1)
            return bool(
                received.discovered_tags
                and received.maps
                and received.observations
                and received.observations[-1].header.stamp == Time(sec=1234, nanosec=500_000_000)
            )

        with patrol(domain, "--speed", "20", "--ros-args", *arguments):
            peer.until(received_simulated_time, "every topic, and a stamp in simulated time")
    for message in (received.observations[0], received.discovered_tags[0], received.maps[0]):
        assert message.header.frame_id == "greenhouse"


def test_a_signal_ends_it_without_errors_even_while_it_waits_for_long(domain: int) -> None:
    with Peer(domain) as peer, patrol(domain, "--speed", "0.1") as process:
        received = Received().listen(peer)
        peer.until(lambda: received.maps, "the first map")
        assert process.stop(signal.SIGINT) == 0
        assert "Traceback" not in process.output


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["--ros-args", "-p", "frame_id:=''"], "parameter frame_id is empty"),
        (["--ros-args", "-p", "use_sim_time:=5"], "parameter use_sim_time is not a bool"),
        (["--ros-args", "-p", "map_topic:=a//b"], "parameter map_topic is 'a//b'"),
        (["--ros-args", "--bogus"], "--bogus"),
    ],
)
def test_a_bad_argument_is_refused_in_one_line(
    domain: int, arguments: list[str], named: str
) -> None:
    with patrol(domain, *arguments) as process:
        assert process.wait() == 2
        [line] = process.output.splitlines()
        assert line.startswith("patrol_node: error: ")
        assert named in line


def test_without_the_simulator_it_says_what_to_install(domain: int) -> None:
    command = "import sys; sys.modules['greenhouse_sim'] = None; from lupin_patrol.cli import main;"
    with Process([sys.executable, "-c", f"{command} sys.exit(main())"], ros_env(domain)) as process:
        assert process.wait() == 2
        [line] = process.output.splitlines()
    assert line.startswith("patrol_node: error: the simulator is missing")
    assert "pip install mdp-greenhouse" in line


def test_its_latch_is_as_deep_as_in_the_contract(domain: int) -> None:
    with ros_domain(domain):
        rclpy.init(args=[])
        try:
            node = PatrolNode()
            depths = {
                publisher.topic_name: publisher.qos_profile.depth
                for publisher in node.publishers
                if publisher.topic_name in (OBSERVATIONS, DISCOVERED_TAGS, MAP)
            }
            node.destroy_node()
        finally:
            rclpy.try_shutdown()
    assert depths == {OBSERVATIONS: 50, DISCOVERED_TAGS: 1, MAP: 1}


STAMP_NS = 12_000_000_034
POSE = pose_of((1.5, 2.5), pi / 2)
# Numbers that a float32 holds exactly: sent and received values are equal.
BLOOM = Bloom(1.5, 2.2, 0.6, 0.25, "lupin", 0.875, anomaly=True)
BOX = Rect(1.0, 2.0, 2.0, 2.25)
CORNERS = tuple((x, y, 0.0) for x, y in BOX.corners)
FLOWER = Flower("lupin", 0.75, True, 12, 3, (BLOOM,), CORNERS)
FLOWERS = Visited(3.2, 4, 0.0, state.Observation("7", 0, pose=POSE, kind=1, flower=FLOWER))


def over_the_wire(message: Any) -> Any:
    """The received message; a value of the wrong type does not survive this."""
    received = deserialize_message(serialize_message(message), type(message))
    assert received == message
    return received


@pytest.mark.parametrize(
    ("status", "expected"),
    [
        (ScanStatus.UNREACHABLE, Observation.STATUS_UNREACHABLE),
        (ScanStatus.SCAN_FAILED, Observation.STATUS_SCAN_FAILED),
    ],
)
def test_a_failed_scan_has_a_reason_and_no_pose(status: ScanStatus, expected: int) -> None:
    failed = Visited(3.0, 0, 0.0, state.Observation("7", 0, {}, None, status, "the way is blocked"))
    message = over_the_wire(node.observation(failed, STAMP_NS, "map"))
    assert message.status == expected
    assert message.status_detail == "the way is blocked"
    assert message.tag_reading.tag_id == "7"
    assert len(message.tag_reading.readings) == 0
    # Quaternion.w is 1 by default, which would put the tag at the origin.
    assert message.tag_pose_in_map.orientation.w == 0.0


def test_a_flower_observation() -> None:
    message = over_the_wire(node.observation(FLOWERS, STAMP_NS, "map"))
    assert message.kind == Observation.KIND_FLOWER
    assert message.status == Observation.STATUS_OK
    assert message.mission_id == "patrol-0005"
    flower = message.flower
    assert (flower.tag_id, flower.species) == ("7", "lupin")
    assert flower.confidence == 0.75
    assert (flower.anomaly, flower.flower_count, flower.bug_count) == (True, 12, 3)
    assert (flower.pose.header, flower.pose.pose) == (message.header, message.tag_pose_in_map)
    # The tag's x axis turns into the aisle.
    turned = message.tag_pose_in_map.orientation
    assert (turned.z, turned.w) == pytest.approx((sin(pi / 4), cos(pi / 4)))
    assert [(p.x, p.y, p.z) for p in flower.box_footprint.points] == [
        (1.0, 2.0, 0.0),
        (2.0, 2.0, 0.0),
        (2.0, 2.25, 0.0),
        (1.0, 2.25, 0.0),
    ]
    [bloom] = flower.flowers
    assert (bloom.position.x, bloom.position.y) == (BLOOM.x, BLOOM.y)
    assert bloom.position.z == BLOOM.z
    assert bloom.height_m == 0.25
    assert (bloom.species, bloom.anomaly) == ("lupin", True)
    assert bloom.confidence == 0.875


@pytest.mark.parametrize(
    ("option", "value", "limits"),
    [
        ("--speed", "0", "a number from 0.1 to 50"),
        ("--speed", "nan", "a number from 0.1 to 50"),
        ("--day-speed", "-0.1", "a number from 0 to 3600"),
        ("--day-speed", "inf", "a number from 0 to 3600"),
        ("--since-morning", "86401", "a number from 0 to 86400"),
        ("--seed", "1.5", "a whole number from 0 to 4294967295"),
        ("--seed", "-1", "a whole number from 0 to 4294967295"),
        ("--seed", "4294967296", "a whole number from 0 to 4294967295"),
    ],
)
def test_a_bad_value_is_refused_with_option_value_and_limits(
    capsys: pytest.CaptureFixture[str], option: str, value: str, limits: str
) -> None:
    with pytest.raises(SystemExit) as refusal:
        parser().parse_args([option, value])
    assert refusal.value.code == 2
    line = capsys.readouterr().err.splitlines()[-1]
    assert line.startswith(f"patrol_node: error: argument {option}: {value!r} is ")
    assert line.endswith(f"expected {limits}")


@pytest.mark.parametrize("arguments", [["--spee", "2"], ["--twice"], ["stray"]])
def test_an_unknown_option_is_refused_by_name(
    capsys: pytest.CaptureFixture[str], arguments: list[str]
) -> None:
    with pytest.raises(SystemExit) as refusal:
        parser().parse_args(arguments)
    assert refusal.value.code == 2
    line = capsys.readouterr().err.splitlines()[-1]
    assert arguments[0] in line


def test_it_ends_with_its_parent_even_when_that_is_killed(domain: int) -> None:
    parent = [
        sys.executable,
        "-c",
        (
            "import subprocess, sys; "
            "patrol = [sys.executable, '-m', 'lupin_patrol', '--end-with-parent']; "
            "child = subprocess.Popen(patrol); "
            "print('child', child.pid, flush=True); child.wait()"
        ),
    ]
    with Process(parent, ros_env(domain)) as process:
        child = Path("/proc", process.wait_for_output("child").split()[1])
        process.wait_for_output("patrol starts")
        process.send(signal.SIGKILL)
        process.wait()
        wait_for(lambda: not child.exists(), "the end of the patrol")
