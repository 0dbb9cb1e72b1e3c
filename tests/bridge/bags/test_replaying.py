"""Replays into real twins: what comes of them, and into which they do not go."""

from __future__ import annotations

import errno
import io
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from lupin_msgs.msg import Observation, TwinState
from rclpy.serialization import serialize_message
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import StoragePlugin, Writer

from lupin_bridge.bags import player, replaying
from lupin_bridge.bags.live_twins import LiveTwins
from lupin_bridge.bags.recording import RecordingError
from lupin_bridge.bags.recordings import Recordings
from lupin_bridge.bags.replay_node import DELIVERY_S
from lupin_bridge.bags.replaying import Refused, replay
from lupin_bridge.message_schemas import schema_text
from tests.support.domains import own_domain
from tests.support.messages import discovered, look, occupancy_grid, pose, scan
from tests.support.processes import OFTEN, twin_node
from tests.support.recordings import (
    OBSERVATIONS,
    STATE,
    TAGS,
    Sent,
    replay_options,
    type_of,
    write_bag,
)
from tests.support.ros import Peer
from tests.support.waiting import PATIENCE_S

OFF = ("-p", "journal:=off", "-p", "use_sim_time:=true")
# The twin that is shared follows one clock: each test is later than the one before.
LATER_S = 1_900_000_000.0
LATEST_S = 2_000_000_000.0
QOS = Qos(
    QosHistory.KEEP_LAST,
    50,
    QosReliability.RELIABLE,
    QosDurability.TRANSIENT_LOCAL,
    QosTime(0, 0),
    QosTime(0, 0),
    QosLiveliness.AUTOMATIC,
    QosTime(0, 0),
    avoid_ros_namespace_conventions=False,
)


class Place(NamedTuple):
    """A ROS domain with a twin, and who looks at it."""

    domain: int
    peer: Peer

    def replay(self, accept: Callable[[Any], bool], *words: object) -> Any:
        """Replay until the twin's state is as expected; returns that."""

        def is_there() -> bool:
            self.peer.spin_briefly()
            return bool(self.peer.states) and accept(self.peer.states[-1])

        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("ROS_DOMAIN_ID", str(self.domain))
            # There is a twin: on a busy machine it is found, and speaks, later than elsewhere.
            for name in ("DISCOVERY_S", "SAYS_WITHIN_S"):
                patch.setattr(replaying, name, PATIENCE_S)
            replay(replay_options(*words), [], is_there)
        return self.peer.states[-1]


class Twins(NamedTuple):
    """One that keeps no journal and follows `/clock`, and one as on a robot."""

    fed: Place
    live: Place


@pytest.fixture(scope="module")
def twins() -> Iterator[Twins]:
    """Started at once."""
    with (
        own_domain() as fed,
        own_domain() as live,
        twin_node(fed, *OFTEN, *OFF),
        twin_node(live, *OFTEN),
        Peer(fed) as fed_peer,
        Peer(live) as live_peer,
    ):
        for peer in (fed_peer, live_peer):
            peer.listen()
            peer.wait_for_twin()
        yield Twins(Place(fed, fed_peer), Place(live, live_peer))


def stamp_ns(state: Any) -> int:
    return int(state.header.stamp.sec) * 10**9 + int(state.header.stamp.nanosec)


def ids(state: Any) -> set[str]:
    return {tag.tag_id for tag in state.tags}


def test_a_replayed_run_ends_in_the_very_state_that_was_recorded(
    twins: Twins, tmp_path: Path
) -> None:
    live = twins.live.peer
    sent: list[Sent] = []

    def publish(topic: str, message: Any, before_s: float = 0.0) -> None:
        sent.append(Sent(topic, time.time() - before_s, message))
        live.publish(topic, message)

    now_s = time.time()
    # Who is heard first on two topics is DDS's affair: they are told one after the other, and
    # replayed so far apart that a twin that stands still meanwhile does not take them together.
    publish("/map", occupancy_grid([[0, 100], [-1, 0]]), 1.0)
    publish(TAGS, discovered({"found": pose(1, 2), "both": pose(3, 4)}), 1.0)
    live.state(lambda it: {"found", "both"} <= ids(it), "the discovered tags")
    for number in range(4):
        at = (number, 1.5)
        publish(OBSERVATIONS, scan("both", {"co2": 400.0 + number}, at=at, stamp_s=now_s - number))
        publish(
            OBSERVATIONS, look("seen", bug_count=number, at=at, blooms=[at], stamp_s=now_s + 1e-4)
        )
    publish(OBSERVATIONS, scan("failed", status=Observation.STATUS_UNREACHABLE, stamp_s=now_s))
    publish(OBSERVATIONS, scan("last", {"light": 1.0, "co2": 7.0}, stamp_s=time.time()))
    recorded = live.state(lambda it: "last" in ids(it) and len(it.tags) == 5, "all tags")
    sent.append(Sent(STATE, stamp_ns(recorded) / 1e9, recorded))
    path = write_bag(tmp_path / "run.mcap", sent)

    def is_at_the_end(state: Any) -> bool:
        return abs(stamp_ns(state) - stamp_ns(recorded)) < 1000 and ids(state) == ids(recorded)

    replayed = twins.fed.replay(is_at_the_end, path, "--hold", "--state-as", "/recorded")
    for tag, expected in zip(replayed.tags, recorded.tags, strict=True):
        # The time in the file is a float of the test's own: its last digits are not the stamp's.
        assert abs(tag.stale_seconds - expected.stale_seconds) < 1e-4 or tag.tag_id == "found"
        tag.stale_seconds = expected.stale_seconds
        assert tag == expected
    assert len(replayed.tags) == 5


def test_what_rosbags_wrote_is_replayed(twins: Twins, tmp_path: Path) -> None:
    message = scan("of rosbags", {"co2": 1.0}, at=(1, 2), stamp_s=LATER_S - 1.0)
    bag = tmp_path / "bag"
    with Writer(bag, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection(
            OBSERVATIONS,
            type_of(message),
            msgdef=schema_text(type_of(message)),
            rihs01="RIHS01_0",
            offered_qos_profiles=[QOS],
        )
        writer.write(connection, round(LATER_S * 1e9), serialize_message(message))
    state = twins.fed.replay(
        lambda it: "of rosbags" in ids(it) and stamp_ns(it) == LATER_S * 1e9,
        *(bag, "--hold", "--speed", "10"),
    )
    (tag,) = (it for it in state.tags if it.tag_id == "of rosbags")
    assert (tag.last_observed.sec, tag.readings[0].value, tag.pose.position.y) == (
        LATER_S - 1,
        1,
        2,
    )
    assert tag.stale_seconds == 1.0


def test_from_a_start_on_the_twin_knows_all_that_was_observed_before(
    twins: Twins, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """More than a publisher keeps for who comes late; and nothing of what is still to come."""
    # Whatever keeps this twin busy for half a second, no more waits for it than it keeps.
    monkeypatch.setattr(player, "MAX_A_BEAT", 2)
    names = {f"early {number}" for number in range(70)}
    sent = [
        Sent(OBSERVATIONS, LATEST_S + it, scan(name, {"co2": 1.0}, stamp_s=LATEST_S + it))
        for it, name in enumerate(sorted(names))
    ]
    sent.append(Sent(OBSERVATIONS, LATEST_S + 200, scan("still to come", stamp_s=LATEST_S + 200)))
    path = write_bag(tmp_path / "a.mcap", sent)
    state = twins.fed.replay(
        lambda it: names <= ids(it) and stamp_ns(it) == round((LATEST_S + 100) * 1e9),
        *(path, "--start", 100, "--pause"),
    )
    assert "still to come" not in ids(state)


def test_a_twin_with_a_journal_is_not_fed_unless_one_insists(twins: Twins, tmp_path: Path) -> None:
    path = write_bag(tmp_path / "a.mcap", [Sent(OBSERVATIONS, 1.0, scan("not yours"))])
    with pytest.raises(Refused) as refused:
        twins.live.replay(lambda _: False, path)
    named = f"the twin /lupin_twin in ROS domain {twins.live.domain} keeps a journal (/"
    assert named in str(refused.value)
    assert "--into-live" in str(refused.value)
    twins.live.replay(lambda it: "not yours" in ids(it), path, "--into-live", "--hold")


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("/clock", "no lupin_msgs/msg/TwinState can be published there, name another topic"),
        (OBSERVATIONS, "no lupin_msgs/msg/TwinState can be published there, name another topic"),
        ("/a/", "Invalid topic name"),
    ],
)
def test_a_topic_that_states_cannot_be_published_on_is_named(
    domain: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, why: str
) -> None:
    """ROS has one type a topic and process."""
    monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
    sent = [Sent(OBSERVATIONS, 1.0, scan("1")), Sent(STATE, 2.0, TwinState())]
    path = write_bag(tmp_path / "a.mcap", sent)
    with pytest.raises(Refused, match=f"^--state-as '{name}': {why}"):
        replay(replay_options(path, "--state-as", name), [], lambda: True)
    remapped = ["--ros-args", "-r", f"{OBSERVATIONS}:=/clock"]
    with pytest.raises(Refused, match=f"^'{OBSERVATIONS}': no lupin_msgs/msg/Observation can"):
        replay(replay_options(path, "--state-as", "/recorded"), remapped, lambda: True)


class Nobody:
    """A node that no twin hears, and what was asked of it."""

    twin_names: frozenset[str] = frozenset()
    awaits = has_listeners = False

    def __init__(self, refusal: Callable[[int, bool], str | None] = lambda *_: None) -> None:
        self.published = self.listened = 0
        self.delivered_s: list[float] = []
        self.twins = LiveTwins()
        self.others: list[str] = []
        self._refusal = refusal

    def refusal(self, *, is_patient: bool) -> str | None:
        return self._refusal(self.published, is_patient)

    def publish(self, topic: str, data: bytes) -> None:
        self.published += 1

    def tell_time(self, now_ns: int) -> None: ...

    def listen(self, for_s: float) -> None:
        self.listened += 1

    def without_sim_time(self) -> list[str]:
        return []

    def rivals(self) -> list[str]:
        return self.others

    def deliver(self, most_s: float) -> None:
        self.delivered_s.append(most_s)


@pytest.fixture
def played(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Callable[[Nobody, str, Callable[[], bool]], None]:
    """Plays two messages to a node, with an option, until a stop is asked for.

    Never both in one beat, however busy the machine: when the second is read, the first is due.
    """
    moments = (1.0, 1.0 + player.MAX_STEP_S + 1.5 * player.LAG_S)
    path = write_bag(tmp_path / "a.mcap", [Sent(OBSERVATIONS, at, scan("1")) for at in moments])
    monkeypatch.setattr(replaying, "DISCOVERY_S", 0.0)

    def play(node: Any, option: str, stop_asked: Callable[[], bool]) -> None:
        words = [option] if option else []
        with Recordings([path]) as recording:
            playing = player.Playing({OBSERVATIONS: 50})
            replaying.play(recording, node, playing, replay_options(path, *words), stop_asked)

    return play


def test_at_its_end_everybody_gets_the_last_words_unless_it_is_held(played: Any) -> None:
    node = Nobody()
    played(node, "", lambda: False)
    assert (node.published, node.delivered_s) == (2, [DELIVERY_S])
    held = Nobody()
    ended_at: list[int] = []

    def stop_asked() -> bool:
        if held.published == 2 and not ended_at:
            ended_at.append(held.listened)
        return bool(ended_at) and held.listened > ended_at[0] + 5

    played(held, "--hold", stop_asked)
    assert (held.published, held.delivered_s) == (2, [])


@pytest.mark.parametrize("option", ["", "--into-live"])
def test_where_nobody_hears_it_a_twin_that_comes_later_is_warned_of(
    played: Any, capsys: pytest.CaptureFixture[str], option: str
) -> None:
    played(Nobody(), option, lambda: False)
    warning = "; a twin that is started now and keeps a journal would keep the newest 50 observ"
    (line,) = [it for it in capsys.readouterr().err.splitlines() if "replaying from" in it]
    assert line.startswith("lupin-twin: replaying from second 0, to nobody so far")
    assert (warning in line) == (option == ""), "who insists knows"


class Full(io.StringIO):
    """A terminal that takes nothing any more."""

    def isatty(self) -> bool:
        return True

    def write(self, text: str) -> int:
        raise OSError(errno.ENOSPC, text)


def test_it_goes_on_although_nothing_can_be_said(
    played: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(replaying, "_TELL_EVERY_S", 0.0)
    monkeypatch.setattr(sys, "stderr", Full())
    node = Nobody()
    node.others = ["/gazebo"]
    played(node, "", lambda: False)
    assert node.published == 2


def test_who_else_tells_the_time_is_told_once_also_who_comes_later(
    played: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(replaying, "LOOK_S", 0.0)
    node = Nobody()
    node.others = ["/gazebo"]
    came_at: list[int] = []

    def stop_asked() -> bool:
        if node.published and not came_at:
            node.others = ["/gazebo", "/lupin_replay"]
            came_at.append(node.listened)
        return bool(came_at) and node.listened > came_at[0] + 1

    played(node, "--hold", stop_asked)
    said = capsys.readouterr().err
    for who in ("/gazebo", "another replay"):
        assert said.count(f"lupin-twin: {who} publishes /clock in this ROS domain too: time") == 1


def test_a_journal_that_comes_later_ends_it_and_so_does_silence_before_it(played: Any) -> None:
    late = Nobody(lambda published, _: "it keeps a journal" if published else None)
    with pytest.raises(Refused, match="it keeps a journal"):
        played(late, "", lambda: False)
    assert late.published, "it had begun"
    silent = Nobody(lambda _, is_patient: None if is_patient else "it does not say")
    with pytest.raises(Refused, match="it does not say"):
        played(silent, "", lambda: False)
    assert silent.published == 0
    for node in (late, silent):
        node.published = 0
        played(node, "--into-live", lambda: False)
        assert node.published == 2


def test_a_start_behind_the_end_is_refused_and_the_end_is_none(tmp_path: Path) -> None:
    path = write_bag(
        tmp_path / "a.mcap",
        [Sent(OBSERVATIONS, 5.0, scan("1")), Sent(OBSERVATIONS, 9.5, scan("1"))],
    )
    with pytest.raises(RecordingError, match=r"--start is 4\.6, must be at most 4\.500, the s"):
        replay(replay_options(path, "--start", 4.6), [], lambda: True)
    with own_domain() as domain, pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROS_DOMAIN_ID", str(domain))
        replay(replay_options(path, "--start", 4.5), [], lambda: True)


def test_the_end_is_told_and_where_it_holds_only_once(
    twins: Twins, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sent = [Sent(OBSERVATIONS, LATEST_S + at_s, scan("1")) for at_s in (100, 500)]
    path = write_bag(tmp_path / "a.mcap", sent)
    skip = ("--skip-gaps", "399.9")
    twins.fed.replay(lambda _: False, path, *skip)
    end = "lupin-twin: the end: 2 messages were published\n"
    said = capsys.readouterr().err
    assert "skipped 6 min 40 s in which nothing is to be published, until 2033-05-18 03:41:" in said
    assert said.endswith(end)
    told = ""
    beats = 0

    def is_told(_: Any) -> bool:
        nonlocal told, beats
        told += capsys.readouterr().err
        beats += end in told
        return beats > 5

    twins.fed.replay(is_told, path, "--hold", *skip)
    assert told.count(end) == 1
