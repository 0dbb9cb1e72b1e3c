"""`/rosbridge`: the real roslib, from npm, connects unchanged; names, and a client's limits."""

import asyncio
import json
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from lupin_bridge.feed.source import TwinUnavailableError
from lupin_bridge.routes import sockets
from lupin_bridge.routes.field import newest_field
from lupin_bridge.routes.sockets import MAX_OPEN_CALLS
from lupin_bridge.serving.admission import Limits
from lupin_bridge.stream.frames import StateFrame
from lupin_bridge.viewers.rosbridge_session import Reaction, Session
from tests.support import inprocess, messages
from tests.support.domains import own_domain, ros_env
from tests.support.processes import Process, limits, lupin_twin, url_of
from tests.support.raw_ws import deaf
from tests.support.ros import Peer
from tests.support.rosbridge import (
    FIELD,
    FIELD_ARGS,
    LARGE_CALL,
    TOPIC,
    Message,
    Ros,
    masked,
    ros_at,
)
from tests.support.waiting import until
from tests.support.web import Bridge, bridge, listener


def test_names_are_those_of_ros() -> None:
    remapping = ("--ros-args", "-r", "/twin/state:=/house/state", "-p", "field_service_name:=field")
    with bridge(*remapping) as greenhouse, ros_at(greenhouse.url) as ros:
        topics = ros.call("/rosapi/topics")["values"]
        assert (topics["topics"][0], topics["types"][0]) == (
            "/house/state",
            "lupin_msgs/msg/TwinState",
        )
        assert ros.call("/field", args=FIELD_ARGS)["result"] is True
        ros.subscribe(topic="/house/state")
        assert ros.next()["topic"] == "/house/state"
        ros.subscribe()
        assert "expected one of /house/state, /flor" in ros.first("status")["msg"]


def test_the_limits_of_fields_hold_here_too() -> None:
    with bridge(*limits(answers_per_s=0.01)) as greenhouse, ros_at(greenhouse.url) as ros:
        assert ros.call(FIELD, args=FIELD_ARGS)["result"] is True
        assert ros.call(FIELD, args=FIELD_ARGS)["result"] is True, "a cached answer costs nothing"
        other = {**FIELD_ARGS, "resolution": 0.125}
        response = ros.call(FIELD, args=other)
        assert response["result"] is False
        assert response["values"] == (
            "127.0.0.1 requests more than 0.01 computed answers a second, the limit"
        )
        assert greenhouse.get("/api/field", **other).status_code == 429, "of one client, together"


def calls(count: int) -> list[Message]:
    """Calls for different fields: equal ones would share one computation."""
    return [
        {
            "op": "call_service",
            "service": FIELD,
            "id": f"{n}",
            "args": {**FIELD_ARGS, "sensor_type": f"sensor {n}"},
        }
        for n in range(count)
    ]


async def in_thread(url: str, talk: Callable[[Ros], Any]) -> Any:
    def connected() -> Any:
        with ros_at(url) as ros:
            return talk(ros)

    return await asyncio.to_thread(connected)


async def test_open_calls_are_limited_and_the_others_get_an_error(
    domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    running_at_once = 0
    most_at_once = 0
    held = asyncio.Event()

    async def slow_field(*requested: Any) -> Any:
        nonlocal running_at_once, most_at_once
        running_at_once += 1
        most_at_once = max(most_at_once, running_at_once)
        await held.wait()
        running_at_once -= 1
        return await newest_field(*requested)

    monkeypatch.setattr(sockets, "newest_field", slow_field)
    async with inprocess.running() as here:
        loop = asyncio.get_running_loop()

        def talk(ros: Ros) -> None:
            for call in calls(MAX_OPEN_CALLS + 3):
                ros.send(**call)
            refused = [ros.next() for _ in range(3)]
            assert {reply["id"] for reply in refused} == {"32", "33", "34"}
            for reply in refused:
                assert reply["result"] is False
                assert reply["values"] == "32 calls are under way, the limit for one client"
            loop.call_soon_threadsafe(held.set)
            answered = [ros.next() for _ in range(MAX_OPEN_CALLS)]
            assert all(reply["result"] is True for reply in answered)
            assert ros.call(FIELD, args=FIELD_ARGS)["result"] is True, "there is room again"

        await in_thread(here.url, talk)
    assert most_at_once == 2


@pytest.mark.parametrize(
    ("error", "text"),
    [
        (
            TwinUnavailableError("nothing has been received from a twin yet"),
            "nothing has been received from a twin yet",
        ),
        (RuntimeError("a bug"), "the bridge had an internal error, see its log"),
        (None, f"{FIELD} did not answer within 0.1 s"),
    ],
)
async def test_an_error_during_a_call_ends_it_and_nothing_else(
    domain: int, monkeypatch: pytest.MonkeyPatch, error: Exception | None, text: str
) -> None:
    async with inprocess.running(Limits(answer_timeout_s=0.1)) as here:

        async def no_field(*_: Any) -> Any:
            if error is not None:
                raise error
            await asyncio.Event().wait()

        def talk(ros: Ros) -> None:
            response = ros.call(FIELD, args=FIELD_ARGS)
            assert (response["result"], response["values"]) == (False, text)
            assert ros.is_quiet()

        monkeypatch.setattr(sockets, "newest_field", no_field)
        await in_thread(here.url, talk)


async def test_a_client_without_subscriptions_is_sent_nothing_and_counted_as_such(
    domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with inprocess.running() as here:
        hub = here.bridge.hub
        reader, writer = await deaf(here.url, "/rosbridge")
        await until(lambda: len(hub) == 1, "the client")
        published, plain = 0, hub.publish

        def publish(frame: StateFrame, now_s: float) -> None:
            nonlocal published
            published += 1
            plain(frame, now_s)

        monkeypatch.setattr(hub, "publish", publish)
        await until(lambda: published >= 2, "two states of the twin's heartbeat")
        assert (hub.frames_sent, hub.bytes_sent) == (0, 0)
        writer.write(masked({"op": "subscribe", "topic": TOPIC}))
        assert b'"op":"publish"' in await reader.read(1 << 16)
        await until(lambda: hub.frames_sent >= 1, "a state that counts")
        writer.transport.abort()


async def test_each_subscription_starts_with_the_current_state_even_without_a_change(
    domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with inprocess.running() as here:

        def talk(ros: Ros) -> None:
            ros.subscribe("a")
            assert ros.next()["op"] == "publish"
            monkeypatch.setattr(here.bridge.hub, "publish", lambda _frame, _now_s: None)
            ros.subscribe("b")
            assert ros.call("/rosapi/topics")["op"] == "publish"

        await in_thread(here.url, talk)


async def test_many_messages_at_once_do_not_delay_the_others(
    domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    turns, at_turn = 0, list[int]()
    plain = Session.receive

    def receive(session: Session, message: str | bytes) -> Reaction:
        at_turn.append(turns)
        return plain(session, message)

    async def other_client() -> None:
        nonlocal turns
        while True:
            turns += 1
            await asyncio.sleep(0)  # until the next turn of the loop

    monkeypatch.setattr(Session, "receive", receive)
    async with inprocess.running() as here:
        other = asyncio.create_task(other_client())
        _reader, writer = await deaf(here.url, "/rosbridge")
        writer.write(masked({"op": "x"}) * 100)
        await until(lambda: len(at_turn) == 100, "all of them")
        assert len(set(at_turn)) == 100, "somebody else's turn came after each"
        writer.transport.abort()
        other.cancel()


async def test_a_client_that_disconnects_cancels_its_calls(
    domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    began, ended = 0, 0
    never = asyncio.Event()
    async with inprocess.running() as here:

        async def no_field(*_: Any) -> Any:
            nonlocal began, ended
            began += 1
            try:
                await never.wait()
            finally:
                ended += 1

        monkeypatch.setattr(sockets, "newest_field", no_field)
        _reader, writer = await deaf(here.url, "/rosbridge")
        for call in calls(5):
            writer.write(masked(call))
        await until(lambda: began == 2, "two calls with the twin")
        writer.transport.abort()
        await until(lambda: ended == 2, "the end of both")
        await until(lambda: len(here.bridge.hub) == 0, "a hub without clients")
        assert began == 2, "those that waited were never begun"


@pytest.mark.parametrize("is_subscribed", [False, True])
async def test_a_client_that_reads_no_reply_is_closed_and_meanwhile_holds_little(
    domain: int, monkeypatch: pytest.MonkeyPatch, is_subscribed: bool
) -> None:
    async with inprocess.running(Limits(client_timeout_s=1.0)) as here:
        # asyncio would drain a reader that is released.
        _reader, writer = await deaf(here.url, "/rosbridge")
        hub = here.bridge.hub
        await until(lambda: len(hub) == 1, "the client")
        if is_subscribed:
            writer.write(masked({"op": "subscribe", "topic": TOPIC}))
            await until(lambda: hub.frames_sent >= 1, "its first state")
            # With a silent twin, no state shows that it is stuck.
            monkeypatch.setattr(hub, "publish", lambda _frame, _now_s: None)
        writer.write(masked(LARGE_CALL) * 5)
        most_bytes = 0

        def is_dismissed() -> bool:
            nonlocal most_bytes
            for connection in here.server.server_state.connections:
                waiting = connection.transport.get_write_buffer_size()
                most_bytes = max(most_bytes, waiting)
            return hub.clients_dismissed == 1

        await until(is_dismissed, "its dismissal")
        await until(lambda: not here.server.server_state.connections, "its end")
        assert 0 < most_bytes < 12_000_000, "the replies of the running calls"
        writer.transport.abort()


async def test_a_client_that_reads_a_reply_slowly_stays(domain: int) -> None:
    async with inprocess.running() as here:
        reader, writer = await deaf(here.url, "/rosbridge")
        writer.write(masked(LARGE_CALL) * 3)
        await until(lambda: here.bridge.hub.blocked == 1, "a full socket")
        # Each with its own reply, also to equal calls.
        unsent = here.bridge.hub.unsent
        await until(lambda: unsent.bytes > 8_000_000, "two replies to count for all clients")
        while here.bridge.hub.blocked:
            assert await reader.read(1 << 20), "it was closed"
        assert len(here.bridge.hub) == 1
        writer.transport.abort()


SCRIPT = Path(__file__).parents[2] / "roslib_client.mjs"


def roslib(url: str, scenario: str) -> Process:
    """A process that plays a scenario of `roslib_client.mjs`."""
    node = shutil.which("node")
    assert node is not None, "node is not installed"
    address = url.replace("http", "ws", 1) + "/rosbridge"
    return Process([node, str(SCRIPT), address, scenario], ros_env(0))


def reported_by(process: Process) -> Any:
    """A scenario's result, printed at its end."""
    assert process.wait() == 0, process.output
    return json.loads(process.output.splitlines()[-1])


def play(url: str, scenario: str) -> Any:
    with roslib(url, scenario) as process:
        return reported_by(process)


@pytest.fixture(scope="module")
def greenhouse() -> Iterator[Bridge]:
    with bridge() as running:
        running.peer.observe(messages.scan("1", {"temperature": 20.0}, at=(0.0, 0.0)))
        running.peer.wait_for_twin()
        with running.listen() as frames:
            frames.until_tag("1")
        yield running


def test_a_subscriber_gets_the_state(greenhouse: Bridge) -> None:
    state = play(greenhouse.url, "latch")["state"]
    (tag,) = state["tags"]
    assert (tag["tag_id"], tag["readings"]) == ("1", [{"name": "temperature", "value": 20.0}])
    assert state["header"]["frame_id"] == "map"


def test_fields_have_null_and_a_refused_field_differs_from_a_failed_call(
    greenhouse: Bridge,
) -> None:
    reported = play(greenhouse.url, "field")
    assert reported["known"]["callback"] == "done"
    known = reported["known"]["values"]
    assert (known["ok"], known["width"], known["height"]) == (True, 12, 12)
    assert set(known["values"]) == {20.0, None}
    assert known == greenhouse.json(
        "/api/field",
        sensor_type="temperature",
        resolution=0.5,
        bbox_min_x=-3,
        bbox_min_y=-3,
        bbox_max_x=3,
        bbox_max_y=3,
    )
    assert reported["refused"]["callback"] == "done"
    assert reported["refused"]["values"]["ok"] is False
    assert "resolution" in reported["refused"]["values"]["error_message"]
    assert reported["failed"]["callback"] == "failed"
    assert reported["failed"]["values"].startswith("args.colour is 'red': extra")
    assert reported["late"] == {
        "callback": "failed",
        "values": "/twin/get_field did not answer within 1e-09 s",
    }


def test_roslib_gets_the_list_of_topics(greenhouse: Bridge) -> None:
    reported = play(greenhouse.url, "names")
    assert dict(zip(*reported["topics"].values(), strict=True)) == {
        "/twin/state": "lupin_msgs/msg/TwinState",
        "/floranova/observations": "lupin_msgs/msg/Observation",
        "/perception/discovered_tags": "lupin_msgs/msg/DiscoveredTags",
        "/map": "nav_msgs/msg/OccupancyGrid",
        "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
    }
    assert reported["nodes"]["failed"].startswith("service 'rosapi/nodes' is not served")


def test_map_and_inputs_arrive_as_they_were_published(greenhouse: Bridge) -> None:
    greenhouse.peer.publish_map(messages.occupancy_grid([[0, 100], [-1, 50]]))
    greenhouse.peer.discover(messages.discovered({"1": messages.pose(1.0, 2.0)}))
    reported = play(greenhouse.url, "inputs")
    assert (reported["map"]["info"]["width"], reported["map"]["header"]["frame_id"]) == (2, "map")
    assert reported["map"]["data"] == [0, 100, -1, 50]
    assert reported["observation"]["tag_reading"]["tag_id"] == "1"
    assert reported["tags"]["tags"][0]["tag_id"] == "1"
    # Requested in CBOR, which is not sent: roslib reads them all the same.
    assert reported["compressed"] == {"cbor": "map", "cbor-raw": "map", "png": "map"}
    assert reported["statuses"] == []


def test_a_client_cannot_write(greenhouse: Bridge) -> None:
    reported = play(greenhouse.url, "write")
    assert [status["msg"].partition(":")[0] for status in reported["told"]] == [
        f"op '{name}' is refused"
        for name in ("advertise", "publish", "unadvertise", "advertise_service", "auth")
    ]
    assert {status["level"] for status in reported["told"]} == {"error"}
    assert reported["told"][1]["id"].startswith("publish:/cmd_vel:"), "roslib's own id comes back"
    greenhouse.peer.spin_briefly()
    assert greenhouse.peer.node.count_publishers("/cmd_vel") == 0


def test_two_components_of_a_page_share_a_topic(greenhouse: Bridge) -> None:
    reported = play(greenhouse.url, "two")
    assert reported["statuses"] == []
    assert reported["heardAfterUnsubscribe"] == 0
    assert reported["afterTheEnd"] == 0


def test_a_subscription_survives_a_restart_of_the_bridge() -> None:
    with own_domain() as domain, lupin_twin(domain, "serve") as first, Peer(domain) as peer:
        url = url_of(first)
        peer.wait_for_twin()
        peer.observe(messages.scan("old", {"temperature": 20.0}))
        peer.spin_briefly()
        with listener(url) as frames:
            frames.until_tag("old")
        with roslib(url, "reconnect") as client:
            client.wait_for_output("subscribed")
            first.kill()
            port = url.rpartition(":")[2]
            with lupin_twin(domain, "serve", "--port", port) as second:
                assert url_of(second) == url
                reported = reported_by(client)
    assert [tag["tag_id"] for tag in reported["before"]["tags"]] == ["old"]
    # The robot's topics are latched, too: the new twin may know the tag again by now.
    assert [tag["tag_id"] for tag in reported["after"]["tags"]] in ([], ["old"])
