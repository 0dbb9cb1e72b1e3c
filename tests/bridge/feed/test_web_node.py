"""The ROS side of the role `web`: a real node, and a peer in place of the twin."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor

from lupin_bridge.feed.web_node import WebNode
from lupin_twin.core.parameters import ParameterError
from lupin_twin.core.state import NANOSECONDS_PER_SECOND as S
from lupin_twin.core.state import Attempt, Flower, Pose, Reading, Snapshot, TagState
from lupin_twin.field.explored import OccupancyMap
from lupin_twin.ros import convert
from tests.support.messages import occupancy_grid
from tests.support.ros import Peer
from tests.support.waiting import wait_for


class Stage:
    """A node that the test spins, the updates that it reports, and the peer."""

    def __init__(self, domain: int, *ros_args: str) -> None:
        self._context = Context()
        rclpy.init(args=list(ros_args), context=self._context, domain_id=domain)
        self.reported: list[Snapshot] = []
        self.node = WebNode(
            lambda update: self.reported.append(update.snapshot), context=self._context
        )
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self.stamp_s = 0

    def close(self) -> None:
        self._executor.shutdown(timeout_sec=2)
        self.node.destroy_node()
        rclpy.try_shutdown(context=self._context)

    def until(self, check: Callable[[], Any], what: str) -> Any:
        """Spin the node until `check` returns something true, and return that."""
        return wait_for(check, what, meanwhile=self._executor.spin_once)

    def first_map(self) -> OccupancyMap:
        found: OccupancyMap = self.until(lambda: self.node.occupancy_map, "a map")
        return found

    def take(self, peer: Peer, *tags: TagState) -> Snapshot:
        """Publish a state and its times as the twin does, and return the node's update."""
        self.stamp_s += 1
        snapshot = Snapshot(self.stamp_s * S, "map", tags)
        peer.publish("/twin/times", convert.StateMessages().times(snapshot), depth=1)
        peer.publish("/twin/state", convert.StateMessages().build(snapshot), depth=1)
        if not has_times(self.reported_of(self.stamp_s * S)):  # it arrived before its times
            self.until(lambda: has_times(self.reported[-1]), "its times")
        return self.reported[-1]

    def reported_of(self, stamp_ns: int) -> Snapshot:
        self.until(lambda: self.reported and self.reported[-1].stamp_ns == stamp_ns, "the state")
        return self.reported[-1]


@contextmanager
def stage_in(domain: int, *ros_args: str) -> Iterator[Stage]:
    stage = Stage(domain, *ros_args)
    try:
        yield stage
    finally:
        stage.close()


@pytest.fixture
def peer(domain: int) -> Iterator[Peer]:
    with Peer(domain) as twin:
        yield twin


@pytest.fixture
def stage(domain: int) -> Iterator[Stage]:
    with stage_in(domain) as made:
        yield made


def has_times(snapshot: Snapshot) -> bool:
    return snapshot.tags[0].readings[0].observed_at_ns is not None


def tag(
    tag_id: str = "1", value: float = 1.0, x: float | None = 1.0, at_s: int = 5, **more: Any
) -> TagState:
    pose = None if x is None else Pose(x, 2.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    readings = (Reading("co2", value, at_s * S),)
    return TagState(tag_id, pose, readings, at_s * S, last_try=Attempt(at_s * S), **more)


def test_the_revision_changes_with_poses_and_readings_and_with_nothing_else(
    stage: Stage, peer: Peer
) -> None:
    revisions, reported = [], []
    for state in (
        [tag("1", 1.0)],
        [tag("1", 2.0)],
        [tag("1", 2.0, x=3.0)],
        [tag("1", 2.0, x=None)],
        [tag("1", 2.0), tag("2", 1.0)],
        [tag("1", 2.0), tag("2", 2.0)],
    ):
        reported.append(stage.take(peer, *state))
        revisions.append(stage.node.revision)
    assert len(set(revisions)) == len(revisions)
    assert reported[1].tags[0] is not reported[0].tags[0]
    # Unchanged values are the same objects.
    assert reported[-1].tags[0] is reported[-2].tags[0]
    stage.take(peer, tag("1", 2.0, at_s=6), tag("2", 2.0, flower=Flower(species="rose")))
    assert stage.node.revision == revisions[-1]


def test_readings_no_longer_from_one_scan_are_another_revision(stage: Stage, peer: Peer) -> None:
    revisions = []
    for temperature_s, humidity_s in ((1, 1), (2, 2), (3, 2)):
        readings = (
            Reading("temperature", 20.0, temperature_s * S),
            Reading("humidity", 50.0, humidity_s * S),
        )
        stage.take(peer, TagState("1", readings=readings, last_observed_ns=temperature_s * S))
        revisions.append(stage.node.revision)
    assert revisions[0] == revisions[1] != revisions[2]


def test_a_restarted_twin_is_another_revision_for_all_replicas(domain: int) -> None:
    with stage_in(domain) as one, stage_in(domain) as two:
        replicas, revisions = (one, two), set[str]()
        for _ in range(2):
            with Peer(domain) as twin:

                def revision(twin: Peer = twin) -> str | None:
                    for replica in replicas:
                        replica.take(twin, tag())
                    ours, theirs = (replica.node.revision for replica in replicas)
                    return ours if ours == theirs and ours not in revisions else None

                revisions.add(wait_for(revision, "one new revision of both", meanwhile=spare) or "")
        assert len(revisions) == 2


def spare(_: float) -> None:
    """The condition of an earlier wait holds with the next state."""


def test_a_state_waits_for_its_own_times_but_not_past_the_next_one(
    stage: Stage, peer: Peer
) -> None:
    reported = stage.take(peer, tag())
    assert reported.tags[0].readings[0].observed_at_ns == 5 * S
    late: list[Snapshot] = []

    def is_shown_alone() -> bool:
        late.append(Snapshot((90 + len(late)) * S, "map", (tag(value=7.0, at_s=80),)))
        peer.publish("/twin/state", convert.StateMessages().build(late[-1]), depth=1)
        return not has_times(stage.reported[-1])

    stage.until(is_shown_alone, "a state without times: the twin must not seem dead")
    assert stage.reported[-1].tags[0].readings[0] == Reading("co2", 7.0)
    peer.publish("/twin/times", convert.StateMessages().times(late[-1]), depth=1)
    stage.until(lambda: has_times(stage.reported[-1]), "the last one, with its times")
    assert stage.reported[-1].tags[0].readings[0].observed_at_ns == 80 * S


def test_a_repeated_map_changes_nothing_and_all_replicas_have_the_same_one(
    domain: int, stage: Stage, peer: Peer, monkeypatch: pytest.MonkeyPatch
) -> None:
    peer.publish_map(occupancy_grid([[0, 100]]))
    first, revision = stage.first_map(), stage.node.revision
    stamps: list[int] = []
    take = convert.map_of

    def map_of(msg: Any, revision: int) -> OccupancyMap:
        stamps.append(msg.header.stamp.sec)
        return take(msg, revision)

    monkeypatch.setattr(convert, "map_of", map_of)
    peer.publish_map(occupancy_grid([[0, 100]], stamp_s=5))
    stage.until(lambda: stamps == [5], "the copy")
    assert stage.node.occupancy_map is first
    assert stage.node.revision == revision
    assert stage.node.utilities.callback_errors == 0
    with stage_in(domain) as later:  # which receives only the repeated one
        later.first_map()
        assert later.node.revision == revision
    peer.publish_map(occupancy_grid([[100, 0]], stamp_s=6))
    stage.until(lambda: stage.node.occupancy_map is not first, "another map")
    assert stage.node.revision != revision


@pytest.mark.parametrize(
    ("override", "complaint"),
    [
        ("state_topic:='a b'", "parameter state_topic is 'a b'"),
        ("field_service_name:='a b'", "parameter field_service_name is 'a b'"),
    ],
)
def test_an_invalid_parameter_is_named(domain: int, override: str, complaint: str) -> None:
    with pytest.raises(ParameterError, match=complaint):
        Stage(domain, "--ros-args", "-p", override)
