"""The hub's rules, with connections whose buffers the test controls."""

import json
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import pytest

from lupin_bridge.alarms.board import board_of
from lupin_bridge.stream.frames import FrameWriter, Reason, Status, alarms_message
from lupin_bridge.stream.hub import CLOSE_POLICY, KINDS, LARGE_BYTES, Client, Hub
from lupin_twin.core.state import Reading, Snapshot, TagState
from tests.bridge.stream.test_frames import received
from tests.support.seen import alarm

TIMEOUT_S = 30.0
NO_STATUS = KINDS[1:]
AIR = (Reading("temperature", 25.0), Reading("humidity", 60.0))


class Socket:
    """A connection that takes as many frames as it has room for."""

    def __init__(self, room: int = 1_000_000) -> None:
        self.room = room
        self.wires: list[bytes] = []
        self.dismissed: tuple[int, str] | None = None

    @property
    def can_take(self) -> bool:
        return self.room > 0

    def write(self, wire: bytes) -> None:
        assert self.can_take, "written to a connection that cannot take it"
        self.room -= 1
        self.wires.append(wire)

    def dismiss(self, code: int, reason: str) -> None:
        self.dismissed = (code, reason)

    @property
    def got(self) -> list[Any]:
        """The received frames, in short: a status's reason, a state's number, a delta's two."""
        return [in_short(json.loads(received(wire))) for wire in self.wires]


def in_short(frame: dict[str, Any]) -> Any:
    if frame["type"] == "status":
        return frame["reason"]
    if frame["type"] == "alarms":
        return {alarm["tag_id"] for alarm in frame["alarms"]}
    return frame["seq"] if frame["type"] == "state" else (frame["base"], frame["seq"])


class Stage:
    """A hub, and frames for it."""

    def __init__(self, max_clients: int = 10) -> None:
        self.hub = Hub(max_clients, TIMEOUT_S, self.status_at)
        self.reason: Reason = "live"
        self.since_s = 0.0
        self.writer = FrameWriter(["vpd"])

    def publish(self, now_s: float = 0.0) -> int:
        """Publish the next frame; returns its number."""
        frame = self.writer.state(Snapshot(0, "map", (TagState("7", readings=AIR),)), "r")
        self.hub.publish(frame, now_s)
        return frame.seq

    def status_at(self, now_s: float) -> Status:
        return Status(self.reason, now_s - self.since_s)

    def announce(self, reason: Reason, now_s: float = 0.0) -> None:
        self.reason = reason
        self.hub.announce(now_s)

    def alarms(self, *tag_ids: str, now_s: float = 0.0) -> None:
        board = replace(board_of(alarm(tag_id) for tag_id in tag_ids), source="journal", since_ns=0)
        self.hub.publish_beside("alarms", alarms_message(board, None, (), 0), now_s)

    def join(self, socket: Socket, now_s: float = 0.0, **requested: Any) -> Client:
        client = Client(socket, **requested)
        self.hub.join(client, now_s)
        return client


@pytest.fixture
def stage() -> Stage:
    return Stage()


def test_the_age_in_a_status_is_that_at_the_time_of_sending(stage: Stage) -> None:
    stage.announce("stale", 3.0)
    sockets = [Socket(), Socket(), Socket(room=0)]
    clients = [stage.join(socket, 3_600.0) for socket in sockets]
    sockets[2].room = 1
    stage.hub.serve(clients[2], 3_700.0)
    ages = [json.loads(received(socket.wires[0]))["state_age_seconds"] for socket in sockets]
    assert ages == [3_600.0, 3_600.0, 3_700.0]
    assert sockets[0].wires[0] is sockets[1].wires[0], "one serialisation serves all"


def test_after_a_second_without_a_frame_the_status_is_sent_again(stage: Stage) -> None:
    often, seldom, full, rosbridge = (Socket(), Socket(), Socket(room=1), Socket())
    stage.join(often, 10.0)
    stage.join(seldom, 10.0, min_interval_s=5.0)
    stage.join(full, 10.0)
    stage.join(rosbridge, 10.0, wants=NO_STATUS)
    for now_s in (10.9, 11.0, 11.9, 12.0, 14.9, 15.0):
        stage.hub.remind(now_s)
        stage.hub.serve_all(now_s)
    assert (often.got, seldom.got) == (["live"] * 4, ["live"] * 2)
    assert (full.got, rosbridge.got) == (["live"], [])


def fill(**parties: int) -> tuple[Stage, dict[str, list[Socket]]]:
    """A full hub, with connections by address, one address after the other."""
    stage = Stage(max_clients=sum(parties.values()))
    sockets = {address: [Socket() for _ in range(size)] for address, size in parties.items()}
    for address, party in sockets.items():
        for socket in party:
            stage.join(socket, address=address)
    return stage, sockets


def test_a_full_hub_evicts_the_latest_connection_of_the_largest_address() -> None:
    stage, sockets = fill(one=1, many=4, two=2)
    assert stage.hub.make_place("another")
    assert sockets["many"][-1].dismissed == (
        1013,
        "7 clients are connected, the limit, 4 of them from here",
    )
    assert [s.dismissed for party in sockets.values() for s in party].count(None) == 6
    assert (len(stage.hub), stage.hub.clients_dismissed) == (6, 1)


@pytest.mark.parametrize(("mine", "gets_a_place"), [(0, True), (1, True), (2, False), (3, False)])
def test_eviction_needs_an_address_with_two_fewer(mine: int, gets_a_place: bool) -> None:
    stage, _ = fill(mine=mine, many=3)
    assert stage.hub.make_place("mine") == gets_a_place
    assert len(stage.hub) == mine + 3 - gets_a_place


def test_a_slow_client_is_never_queued_for_and_gets_the_latest_frame(stage: Stage) -> None:
    slow, quick = Socket(room=1), Socket()
    client = stage.join(slow, wants=NO_STATUS)
    stage.join(quick, wants=NO_STATUS)
    for number in range(8):
        stage.publish(number / 10)
    assert slow.got == [1]
    assert quick.got == [1, 2, 3, 4, 5, 6, 7, 8]
    assert stage.hub.blocked == 1
    slow.room = 1_000
    stage.hub.serve(client, 1.0)
    assert slow.got == [1, 8]
    stage.hub.serve(client, 1.1)
    assert slow.got == [1, 8], "the same frame twice"
    assert (stage.hub.blocked, stage.hub.frames_sent, stage.hub.frames_skipped) == (0, 10, 6)


def test_of_waiting_large_messages_the_longest_waiting_client_is_dismissed(stage: Stage) -> None:
    stage.hub.unsent.max_bytes = 2 * LARGE_BYTES
    sockets = [Socket() for _ in range(4)]
    free, slowest, *others = (stage.join(socket) for socket in sockets)
    stage.hub.hold(free, bytes(LARGE_BYTES))
    stage.hub.serve(free, 0.0)
    stage.hub.hold(Client(Socket()), bytes(LARGE_BYTES))  # which has disconnected already
    assert stage.hub.unsent.bytes == 0
    stage.hub.hold(slowest, bytes(LARGE_BYTES))
    shared = bytes(LARGE_BYTES)
    for client in others:
        stage.hub.hold(client, shared)
    gone = [socket.dismissed is not None for socket in sockets]
    stage.hub.hold(others[0], bytes(LARGE_BYTES))
    assert gone == [False] * 4, "what many wait for counts once"
    assert [socket.dismissed is not None for socket in sockets] == [False, True, False, False]


def test_a_client_that_takes_nothing_for_too_long_is_closed_and_removed(stage: Stage) -> None:
    stuck, quick = Socket(room=0), Socket()
    stage.join(stuck, 10.0, wants=NO_STATUS)
    stage.join(quick)
    stage.publish(15.0)
    stage.publish(20.0)
    assert stage.hub.dismiss_stuck(10.0 + TIMEOUT_S - 0.1) == 0
    assert stage.hub.dismiss_stuck(10.0 + TIMEOUT_S) == 1
    assert stuck.dismissed == (CLOSE_POLICY, "accepted no frame for 30 s")
    assert (quick.dismissed, len(stage.hub)) == (None, 1)
    assert stage.hub.dismiss_stuck(1_000.0) == 0
    assert stage.hub.clients_dismissed == 1


def test_deltas_go_to_clients_that_chose_them_and_have_the_frame_before(stage: Stage) -> None:
    socket, whole = Socket(), Socket()
    stage.publish()
    client = stage.join(socket, delta=True, wants=NO_STATUS)
    stage.join(whole, wants=NO_STATUS)
    stage.publish()
    stage.publish()
    assert socket.got == [1, (1, 2), (2, 3)]
    first, full = (it.wires[0] for it in (socket, whole))
    assert (b'"derived"' in first, b'"derived"' in full) == (True, False)
    assert whole.got == [1, 2, 3]
    socket.room = 0
    stage.publish()
    stage.publish()
    socket.room = 2
    stage.hub.serve(client, 1.0)
    stage.publish(1.0)
    assert socket.got[3:] == [5, (5, 6)], "whole after a gap"


def test_a_rate_holds_on_average_and_a_status_does_not_wait_for_it(stage: Stage) -> None:
    socket = Socket()
    stage.join(socket, min_interval_s=1.0)
    socket.wires.clear()
    for tenth in range(55):
        stage.publish(tenth / 10)
    # The first of each second: 0.0, 1.0, 2.0 …
    assert socket.got == [1, 11, 21, 31, 41, 51]
    stage.announce("stale", 5.45)
    assert socket.got[-1] == "stale"
    stage.hub.serve_all(5.9)
    assert socket.got[-1] == "stale"
    stage.hub.serve_all(6.0)
    assert socket.got[-1] == 55, "the latest, when its time has come"


@pytest.mark.parametrize(
    ("times_s", "got"),
    [
        # A late frame does not delay those after it.
        ((0.0, 1.05, 2.0, 2.05, 3.0, 3.05), [1, 2, 3, 5]),
        # After a pause there is no burst: one as soon as something changes, the next an interval
        # later, with a tenth of tolerance.
        ((0.0, 100.0, 100.1, 100.85, 100.95, 101.85, 101.95), [1, 2, 5, 7]),
    ],
)
def test_a_rate_is_a_mean(stage: Stage, times_s: Sequence[float], got: list[int]) -> None:
    on_average = Socket()
    stage.join(on_average, min_interval_s=1.0, wants=NO_STATUS)
    for now_s in times_s:
        stage.publish(now_s)
    assert on_average.got == got


def test_every_change_of_alarms_goes_to_everyone_whole_and_after_the_first_state() -> None:
    stage, sockets = Stage(), [Socket(), Socket()]
    stage.publish()
    for socket in sockets:
        stage.join(socket, delta=True, wants=NO_STATUS)
    stage.alarms("a")
    stage.publish()
    stage.alarms("a", "b")
    stage.alarms()
    for socket in sockets:
        assert socket.got == [1, {"a"}, (1, 2), {"a", "b"}, set()]
    assert sockets[0].wires[1] is sockets[1].wires[1], "one serialisation serves all"
    stage, early, late = Stage(), Socket(), Socket()
    stage.announce("live")
    stage.alarms("a")
    stage.join(early)
    assert early.got == ["live"]
    stage.publish()
    assert early.got == ["live", 1, {"a"}]
    stage.alarms("b")
    stage.join(late, 1.0)
    assert late.got == ["live", 1, {"b"}]


def test_the_robot_comes_after_a_state_once_and_no_more_often_than_states(stage: Stage) -> None:
    usual, seldom = Socket(), Socket()
    stage.join(usual, wants=NO_STATUS)
    stage.join(seldom, wants=NO_STATUS, min_interval_s=10.0)
    none = Socket()
    stage.join(none, wants=("state",))
    stage.hub.publish_beside("robot", b"robot 1", 0.0)
    assert (usual.wires, seldom.wires) == ([], [])
    stage.publish()
    robots = [[it for it in each.wires if b"robot" in it] for each in (usual, seldom)]
    assert robots == [[b"robot 1"], [b"robot 1"]]
    stage.hub.publish_beside("robot", b"robot 2", 1.0)
    stage.hub.publish_beside("robot", b"robot 3", 2.0)
    stage.hub.serve_all(3.0)
    robots = [[it for it in each.wires if b"robot" in it] for each in (usual, seldom)]
    assert robots == [[b"robot 1", b"robot 2", b"robot 3"], [b"robot 1"]]
    stage.hub.serve_all(10.0)
    assert seldom.wires[-1] == b"robot 3"
    assert not any(b"robot" in it for it in none.wires)


def test_a_client_that_wants_states_again_has_skipped_none_meanwhile(stage: Stage) -> None:
    socket = Socket()
    client = stage.join(socket, wants=("state",))
    numbers = [stage.publish()]
    stage.hub.want(client, (), 0.0)
    numbers += [stage.publish(), stage.publish()]
    stage.hub.want(client, KINDS[1:2], 0.0)
    assert (socket.got, stage.hub.frames_skipped) == ([numbers[0], numbers[2]], 0)
