"""The ROS side of the role `web`: a real node, and a peer that plays the twin."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from lupin_msgs.msg import SensorReading, TwinState, TwinTagState
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter

from lupin_bridge.feed.ros_thread import forward
from lupin_bridge.feed.web_node import WebNode
from lupin_twin.core.diagnostics import Finding
from lupin_twin.core.drops import Counts, Recent
from lupin_twin.core.parameters import ParameterError
from lupin_twin.core.state import NANOSECONDS_PER_SECOND as S
from lupin_twin.core.state import Attempt, Reading, Snapshot, TagState
from lupin_twin.field.explored import OccupancyMap
from lupin_twin.ros import convert
from lupin_twin.ros.convert import diagnostics
from tests.support.messages import INFO, NO_POSE, occupancy_grid, pose
from tests.support.ros import Peer
from tests.support.waiting import wait_for


class Stage:
    """A node that is spun by hand, what it has told, and the peer."""

    def __init__(self, domain: int, *ros_args: str) -> None:
        self._context = Context()
        rclpy.init(args=list(ros_args), context=self._context, domain_id=domain)
        self.told: list[Snapshot] = []
        self.node = WebNode(self.told.append, context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self.stamp_s = 0

    def close(self) -> None:
        self._executor.shutdown(timeout_sec=2)
        self.node.destroy_node()
        rclpy.try_shutdown(context=self._context)

    def until(self, look: Callable[[], Any], what: str) -> Any:
        """Spin the node until `look` gives something true, and return that."""
        return wait_for(look, what, meanwhile=self._executor.spin_once)

    def first_map(self) -> OccupancyMap:
        """The first map that comes."""
        found: OccupancyMap = self.until(lambda: self.node.occupancy_map, "a map")
        return found

    def take(self, peer: Peer, *tags: Any) -> Snapshot:
        """Let a twin that tells no times publish a state, and return what the node makes of it."""
        self.stamp_s += 1
        message = TwinState(tags=list(tags))
        message.header.stamp.sec = self.stamp_s
        message.header.frame_id = "map"
        peer.publish("/twin/state", message, depth=1)
        return self.told_of(self.stamp_s * S)

    def take_with_times(self, peer: Peer, *tags: TagState, at_s: int | None = None) -> Snapshot:
        """Let a twin publish a state and its times, and return what the node makes of them."""
        self.stamp_s = self.stamp_s + 1 if at_s is None else at_s
        snapshot = Snapshot(self.stamp_s * S, "map", tags)
        times = convert.StateMessages().times(snapshot)
        peer.publish("/twin/times", times, depth=1)
        peer.publish("/twin/state", convert.StateMessages().build(snapshot), depth=1)
        told = self.told_of(self.stamp_s * S)
        if not told.has_times:  # it came before its own
            self.until(lambda: self.told[-1].has_times, "its times")
        return self.told[-1]

    def told_of(self, stamp_ns: int) -> Snapshot:
        """The snapshot of that stamp."""
        self.until(lambda: self.told and self.told[-1].stamp_ns == stamp_ns, "the state")
        return self.told[-1]


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


def tag(
    tag_id: str, value: float = 1.0, at: tuple[float, float] | None = (1, 2), **more: Any
) -> Any:
    message = TwinTagState(
        tag_id=tag_id,
        pose=NO_POSE if at is None else pose(*at),
        readings=[SensorReading(name="co2", value=value)],
        **more,
    )
    message.last_observed.sec = 5
    return message


# --- states -------------------------------------------------------------------------------------


def test_a_tag_that_did_not_change_is_the_very_same_value(stage: Stage, peer: Peer) -> None:
    first = stage.take(peer, tag("same"), tag("other", 1.0))
    second = stage.take(peer, tag("same", stale_seconds=9.0), tag("other", 2.0))
    assert second.tags[0] is first.tags[0]
    assert second.tags[1] is not first.tags[1]
    assert second.tags[1].readings[0].value == 2.0


def test_the_revision_changes_with_poses_and_readings_and_with_nothing_else(
    stage: Stage, peer: Peer
) -> None:
    revisions = []
    for state in (
        [tag("1", 1.0)],
        [tag("1", 2.0)],
        [tag("1", 2.0, at=(1, 3))],
        [tag("1", 2.0, at=None)],
        [tag("1", 2.0), tag("2", 1.0)],
    ):
        stage.take(peer, *state)
        revisions.append(stage.node.revision)
    assert len(set(revisions)) == len(revisions)
    stage.take(peer, tag("1", 2.0, stale_seconds=7.0, species="rose"), tag("2", 1.0, anomaly=True))
    assert stage.node.revision == revisions[-1]


def test_readings_that_are_not_of_one_scan_any_more_are_another_revision(
    stage: Stage, peer: Peer
) -> None:
    revisions = []
    for temperature_s, humidity_s in ((1, 1), (2, 2), (3, 2)):
        readings = (
            Reading("temperature", 20.0, temperature_s * S),
            Reading("humidity", 50.0, humidity_s * S),
        )
        tag = TagState("1", readings=readings, last_observed_ns=temperature_s * S)
        stage.take_with_times(peer, tag)
        revisions.append(stage.node.revision)
    assert revisions[0] == revisions[1] != revisions[2]


def test_a_twin_that_was_started_anew_is_another_revision_for_all_replicas(domain: int) -> None:
    with stage_in(domain) as one, stage_in(domain) as two:
        replicas, revisions = (one, two), set[str]()
        for _ in range(2):
            with Peer(domain) as twin:

                def revision(twin: Peer = twin) -> str | None:
                    for replica in replicas:
                        replica.take(twin, tag("1"))
                    ours, theirs = (replica.node.revision for replica in replicas)
                    return ours if ours == theirs and ours not in revisions else None

                revisions.add(wait_for(revision, "one new revision of both", meanwhile=spare) or "")
        assert len(revisions) == 2


def spare(_: float) -> None:
    """What has been waited for comes with the next state."""


def scanned(at_s: int, value: float = 1.0, tag_id: str = "1") -> TagState:
    """A tag as it is after one scan."""
    at_ns = at_s * S
    readings = (Reading("co2", value, at_ns),)
    return TagState(tag_id, None, readings, at_ns, last_try=Attempt(at_ns))


# --- times --------------------------------------------------------------------------------------


def test_a_state_waits_for_its_times_and_for_no_others(stage: Stage, peer: Peer) -> None:
    told = stage.take_with_times(peer, scanned(5))
    assert told.tags[0].readings[0].observed_at_ns == 5 * S
    count = len(stage.told)
    # A state whose times are not there: it comes without them, since the twin must not seem dead.
    late = Snapshot(90 * S, "map", (scanned(80, 7.0),))
    peer.publish("/twin/state", convert.StateMessages().build(late), depth=1)
    alone = stage.told_of(90 * S)
    assert not alone.has_times
    assert alone.tags[0].readings[0] == Reading("co2", 7.0)
    assert len(stage.told) == count + 1
    # And with them as soon as they come.
    times = convert.StateMessages().times(late)
    peer.publish("/twin/times", times, depth=1)
    stage.until(lambda: stage.told[-1].has_times, "the times")
    assert stage.told[-1].tags[0].readings[0].observed_at_ns == 80 * S


# --- maps ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "bad",
    [occupancy_grid([[0]], frame_id="odom"), occupancy_grid([[0]], resolution=float("nan"))],
    ids=["frame", "resolution"],
)
def test_a_map_that_cannot_be_used_leaves_the_last_one(
    stage: Stage, peer: Peer, monkeypatch: pytest.MonkeyPatch, bad: Any
) -> None:
    peer.publish_map(occupancy_grid([[0, 100]]))
    good = stage.first_map()
    said: list[str] = []
    monkeypatch.setattr(stage.node.utilities, "warn", lambda _key, text: said.append(text))
    peer.publish_map(bad)
    stage.until(lambda: said, "the refusal")
    assert " on /map: " in said[0]
    assert stage.node.occupancy_map is good
    peer.publish_map(occupancy_grid([[0, 0, 0]]))
    stage.until(lambda: stage.node.occupancy_map is not good, "the next good map")
    assert stage.node.occupancy_map is not None
    assert stage.node.occupancy_map.width == 3
    assert stage.node.utilities.callback_errors == 0


def test_the_same_map_has_the_same_revision_in_every_replica(domain: int, peer: Peer) -> None:
    revisions = set()
    for stamp_s in range(2):
        # A replica that starts later hears a later copy.
        peer.publish_map(occupancy_grid([[0, 100]], stamp_s=stamp_s))
        with stage_in(domain) as stage:
            stage.first_map()
            revisions.add(stage.node.revision)
    assert len(revisions) == 1


def test_a_map_that_is_told_again_changes_nothing(
    stage: Stage, peer: Peer, monkeypatch: pytest.MonkeyPatch
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
    peer.publish_map(occupancy_grid([[100, 0]], stamp_s=6))
    stage.until(lambda: stage.node.occupancy_map is not first, "another map")
    assert stage.node.revision != revision


# --- what the twin says of itself ---------------------------------------------------------------


def of_state(topic: str) -> Finding:
    return Finding("twins", 0, "", {"state topic": topic})


def test_only_the_twin_that_is_followed_is_heard_on_diagnostics(stage: Stage, peer: Peer) -> None:
    drops = Finding("drops", 0, "", {"frame": "7", "lately: frame": "2", "last: frame": "odom"})
    publish = peer.node.create_publisher(DiagnosticArray, "/diagnostics", 10).publish

    stage.take(peer, tag("1"))
    assert stage.node.self_report.journal.state == "unknown"
    assert stage.node.self_report.counts is None, "a twin that says nothing has not dropped nothing"
    # Another greenhouse's is in the same message, before it and behind it, and in one of its own.
    others = [Finding("drops", 0, "", {"kind": "100"}), of_state("/gh2/twin/state")]
    theirs = diagnostics(others, "/gh2/peer", 0)
    journal = Finding("journal", 2, "no room", {"state": "failing"})
    origin = Finding("origin", 0, "", {"origin": "simulated"})
    ours = diagnostics([drops, journal, origin, of_state("/twin/state")], "/the_twin", 0)
    ours.status = [*theirs.status, *ours.status, *theirs.status]

    def heard() -> Counts | None:
        stage.take(peer, tag("1"))
        publish(ours)
        publish(theirs)
        return stage.node.self_report.counts

    counts = stage.until(heard, "what the twin says")
    assert counts == Counts({"frame": 7}, 0, (Recent("frame", "odom", 2),))
    assert stage.node.utilities.counts().dropped == {}
    assert (stage.node.self_report.journal.state, stage.node.self_report.journal.detail) == (
        "failing",
        "no room",
    )
    assert stage.node.self_report.origin == "simulated"


# --- the rest -----------------------------------------------------------------------------------


@pytest.mark.parametrize(("topic", "limit"), [("/twin/state", 64_000_000), ("/map", 64_000_000)])
def test_a_message_past_the_limit_is_dropped_before_it_is_read(
    stage: Stage, caplog: pytest.LogCaptureFixture, topic: str, limit: int
) -> None:
    forward()
    (subscription,) = [s for s in stage.node.subscriptions if s.topic_name == topic]
    for size in (limit, limit + 1):
        subscription.callback(bytes(size), INFO)
    dropped = [record.message for record in caplog.records if "dropped a message" in record.message]
    assert dropped == [f"dropped a message on {topic}: {limit + 1} bytes, the limit is {limit}"]


@pytest.mark.parametrize(
    ("override", "complaint"),
    [
        ("buffer_len:=0", "parameter buffer_len is 0"),
        ("state_topic:='a b'", "parameter state_topic is 'a b'"),
        ("map_topic:='a b'", "parameter map_topic is 'a b'"),
        ("field_service_name:='a b'", "parameter field_service_name is 'a b'"),
        ("use_sim_time:=5", "parameter use_sim_time is no bool"),
    ],
)
def test_a_parameter_that_cannot_be_is_named(domain: int, override: str, complaint: str) -> None:
    with pytest.raises(ParameterError, match=complaint):
        Stage(domain, "--ros-args", "-p", override)


def test_twins_are_counted_by_the_name_that_the_topic_really_has(
    domain: int, peer: Peer, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[str] = []

    def count(topic: str) -> int:
        asked.append(topic)
        return 1

    remapped = ("-r", "/twin/state:=/r1/state", "-r", "/twin/times:=/r1/times")
    with stage_in(domain, "--ros-args", *remapped) as stage:
        monkeypatch.setattr(stage.node, "count_publishers", count)
        peer.publish("/r1/state", TwinState(), depth=1)
        stage.until(lambda: "/r1/state" in asked, "a state")
    assert set(asked) == {"/r1/state", "/r1/times"}


def test_parameters_are_read_as_the_twin_reads_them(domain: int) -> None:
    with stage_in(domain, "--ros-args", "-p", "idw_power:=3") as stage:
        assert stage.node.rules.idw_power == 3.0
        assert isinstance(stage.node.rules.idw_power, float)


def test_its_own_rules_may_be_changed_as_the_twins(stage: Stage) -> None:
    revision = stage.node.revision
    assert stage.node.set_parameters([Parameter("idw_max_distance_m", value=4.0)])[0].successful
    assert stage.node.rules.max_distance_m == 4.0
    assert stage.node.revision != revision
    [result] = stage.node.set_parameters([Parameter("map_topic", value="other")])
    assert "cannot become 'other' while the twin runs" in result.reason
