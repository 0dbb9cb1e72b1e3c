"""`/rosbridge` of a real `lupin-twin serve`: by hand over a WebSocket, ROS on the other side."""

from __future__ import annotations

import asyncio
import json
import random
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any
from urllib.parse import urlsplit

import pytest
from websockets.exceptions import ConnectionClosed
from websockets.frames import Frame, Opcode
from websockets.sync.client import ClientConnection, connect

from lupin_bridge.rosbridge_session import MAX_BURST
from lupin_bridge.routes_rosbridge import MAX_OPEN_CALLS
from lupin_bridge.settings import Settings
from lupin_twin.fields import FieldRequest
from tests.support import inprocess, messages
from tests.support.proc_stat import resident_mb
from tests.support.waiting import PATIENCE_S, wait_for
from tests.support.web import Bridge, bridge

TOPIC = "/twin/state"
FIELD = "/twin/get_field"
FIELD_ARGS: dict[str, Any] = {
    "sensor_type": "temperature",
    "resolution": 0.5,
    "bbox_min_x": -3.0,
    "bbox_min_y": -3.0,
    "bbox_max_x": 3.0,
    "bbox_max_y": 3.0,
}

Message = dict[str, Any]


class Ros:
    """A rosbridge client that sees every message."""

    def __init__(self, connection: ClientConnection) -> None:
        self.connection = connection

    def send(self, **members: Any) -> None:
        self.connection.send(json.dumps(members))

    def next(self) -> Message:
        message: Message = json.loads(self.connection.recv(timeout=PATIENCE_S))
        return message

    def subscribe(self, message_id: object = None, **options: Any) -> None:
        self.send(**{"op": "subscribe", "topic": TOPIC, "id": message_id, **options})

    def call(self, service: str, message_id: str = "call", **members: Any) -> Message:
        """Call a service and return the very next message, whatever it is."""
        self.send(op="call_service", service=service, id=message_id, **members)
        return self.next()

    def is_quiet(self) -> bool:
        """Whether nothing came before the answer to a question asked now."""
        return self.call("/rosapi/topics", "quiet?").get("id") == "quiet?"

    def until_tag(self, tag_id: str) -> Message:
        """Read on to the first state that has the tag."""

        def look() -> Message | None:
            message = self.next()
            return message if message["op"] == "publish" and tag_id in tags(message) else None

        found = wait_for(look, f"a state with tag {tag_id}", meanwhile=lambda: None)
        assert found is not None
        return found


def tags(message: Message) -> list[str]:
    return [tag["tag_id"] for tag in message["msg"]["tags"]]


@contextmanager
def ros_at(url: str) -> Iterator[Ros]:
    with connect(f"{url.replace('http', 'ws', 1)}/rosbridge", proxy=None, max_size=None) as opened:
        yield Ros(opened)


@pytest.fixture(scope="module")
def house() -> Iterator[Bridge]:
    """A twin with two tags, 1 and 2."""
    with bridge() as running:
        running.peer.wait_for_twin()
        running.peer.observe(
            messages.scan("1", {"temperature": 20.0}, at=(0.0, 0.0)),
            messages.scan("2", {"temperature": 30.0, "co2": 400.0}, at=(1.0, 0.0)),
        )
        running.peer.spin_briefly()
        with running.listen() as listener:
            listener.until_tag("2")
        yield running


@pytest.fixture
def ros(house: Bridge) -> Iterator[Ros]:
    with ros_at(house.url) as client:
        yield client


def observed(house: Bridge, tag_id: str) -> None:
    """Let the robot see one more tag, and wait until the bridge has shown it to everybody."""
    with house.listen() as listener:
        house.peer.observe(messages.scan(tag_id, {"temperature": 20.0}))
        house.peer.spin_briefly()
        listener.until_tag(tag_id)


# --- the state --------------------------------------------------------------------------------


def test_who_subscribes_gets_the_current_state_at_once_and_then_every_change(
    house: Bridge, ros: Ros
) -> None:
    ros.subscribe()
    first = ros.next()
    assert (first["op"], first["topic"]) == ("publish", TOPIC)
    assert {"1", "2"} <= set(tags(first))
    served = house.json("/api/state")["tags"]
    told = {tag["tag_id"]: tag for tag in first["msg"]["tags"]}
    for tag in served:
        assert told[tag["tag_id"]] | {"stale_seconds": 0} == tag | {"stale_seconds": 0}
    observed(house, "next")
    ros.until_tag("next")


def test_before_a_subscription_and_after_its_end_no_state_comes(house: Bridge, ros: Ros) -> None:
    observed(house, "before")
    assert ros.is_quiet()
    ros.subscribe("a")
    ros.until_tag("before")
    ros.send(op="unsubscribe", topic=TOPIC, id="a")
    drain(ros)
    observed(house, "after")
    assert ros.is_quiet()
    ros.subscribe("a")
    assert "after" in tags(ros.next())


def drain(ros: Ros) -> None:
    """Read on to the answer to a question asked now."""
    message = ros.call("/rosapi/topics", "drained")
    while message.get("id") != "drained":
        message = ros.next()


def test_a_throttled_subscription_gets_the_latched_state_and_waits(house: Bridge, ros: Ros) -> None:
    ros.subscribe("slow", throttle_rate=3_600_000)
    assert ros.next()["op"] == "publish"
    observed(house, "unseen")
    assert ros.is_quiet()
    ros.subscribe("quick")
    assert "unseen" in tags(ros.next()), "each subscription begins with the current state"
    observed(house, "seen")
    ros.until_tag("seen")


def test_a_relative_name_is_answered_as_it_was_asked(ros: Ros) -> None:
    ros.subscribe(topic="twin/state")
    assert ros.next()["topic"] == "twin/state"


def test_no_status_of_the_bridge_comes_between(ros: Ros) -> None:
    """They are `/ws/state`'s own; roslib could not read them."""
    ros.subscribe()
    assert {ros.next()["op"] for _ in range(2)} == {"publish"}


# --- the field --------------------------------------------------------------------------------


def test_a_call_gets_what_the_ros_service_answers_and_nan_as_null(house: Bridge, ros: Ros) -> None:
    response = ros.call(FIELD, args=FIELD_ARGS)
    assert (response["op"], response["id"], response["result"]) == (
        "service_response",
        "call",
        True,
    )
    assert response["service"] == FIELD
    over_ros = house.peer.get_field(**FIELD_ARGS)
    values = response["values"]
    assert values["ok"] is True
    assert (values["width"], values["height"]) == (over_ros.width, over_ros.height) == (12, 12)
    assert values["sample_count"] == over_ros.sample_count
    known = [None if value != value else value for value in over_ros.values]  # noqa: PLR0124
    assert None in values["values"]
    assert values["values"] == pytest.approx(known)
    assert values == house.json("/api/field", **FIELD_ARGS)


def test_a_refused_field_is_an_answer_of_the_service(house: Bridge, ros: Ros) -> None:
    """As over ROS: the call succeeds, and `ok` is false."""
    args = {"sensor_type": "temperature"}
    response = ros.call(FIELD, args=args)
    assert response["result"] is True
    assert response["values"]["ok"] is False
    assert response["values"]["error_message"] == house.peer.get_field(**args).error_message
    assert response["values"]["values"] == []


def test_a_call_that_cannot_be_made_fails_with_the_reason(ros: Ros) -> None:
    response = ros.call(FIELD, args={**FIELD_ARGS, "color": "red"})
    assert response["result"] is False
    assert response["values"].startswith("args.color is unknown, expected sensor_type, ")
    response = ros.call("/twin/reset")
    assert response["result"] is False
    assert response["values"].startswith("service '/twin/reset' is not served")


def test_a_call_ends_when_its_own_time_is_up(ros: Ros) -> None:
    response = ros.call(FIELD, args=FIELD_ARGS, timeout=1e-9)
    assert response["result"] is False
    assert response["values"] == f"{FIELD} did not answer within 1e-09 s"


# --- refusals ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "message",
    [
        {"op": "advertise", "topic": "/cmd_vel", "type": "geometry_msgs/msg/Twist"},
        {"op": "publish", "topic": "/cmd_vel", "msg": {"linear": {"x": 1}}},
        {"op": "publish", "topic": TOPIC, "msg": {}},
        {"op": "advertise_service", "service": "/s", "type": "std_srvs/srv/Trigger"},
        {"op": "auth", "mac": "m"},
        {"op": "drive"},
    ],
)
def test_what_is_not_served_is_refused_and_changes_nothing(
    house: Bridge, ros: Ros, message: Message
) -> None:
    before = house.json("/api/state")["tags"]
    ros.send(**message, id="w")
    status = ros.next()
    assert (status["op"], status["level"], status["id"]) == ("status", "error", "w")
    assert message["op"] in status["msg"]
    house.peer.spin_briefly()
    assert house.peer.node.count_publishers("/cmd_vel") == 0
    assert house.peer.node.count_publishers(TOPIC) == 1
    after = house.json("/api/state")["tags"]
    assert [t["tag_id"] for t in after] == [t["tag_id"] for t in before]
    assert ros.is_quiet()


def test_a_binary_frame_is_refused_and_the_connection_stays(ros: Ros) -> None:
    ros.connection.send(b"\x00\xff")
    assert ros.next()["msg"] == "a binary frame is refused, expected JSON text"
    assert ros.is_quiet()


def test_a_message_past_the_servers_limit_ends_the_connection_alone(house: Bridge) -> None:
    with ros_at(house.url) as big, ros_at(house.url) as other:
        big.connection.send('{"op":"' + "x" * 70_000 + '"}')
        with pytest.raises(ConnectionClosed) as closed:
            big.next()
        assert closed.value.rcvd is not None
        assert closed.value.rcvd.code == 1009
        assert other.is_quiet()


def test_who_floods_is_closed_with_the_reason(house: Bridge) -> None:
    with ros_at(house.url) as flood, ros_at(house.url) as other:
        flood.send(op="set_level", level="none")
        with pytest.raises(ConnectionClosed) as closed:
            send_often(flood, "{}", 100 * MAX_BURST)
        assert closed.value.rcvd is not None
        assert closed.value.rcvd.code == 1008
        assert closed.value.rcvd.reason == "more than 100 messages a second after 500 at once"
        assert other.is_quiet()


def send_often(ros: Ros, message: str, times: int) -> None:
    for _ in range(times):
        ros.connection.send(message)


def garbage(chance: random.Random) -> str | bytes:
    """A frame that is none of the protocol's: bytes, text, JSON of the wrong kind, half an op."""
    whole = json.dumps(
        {
            "op": chance.choice(["subscribe", "call_service", "unsubscribe", "publish", "x", 5]),
            "id": chance.choice([None, {}, [], "i" * 300, True, 1.5]),
            "topic": chance.choice(["/x", 7, None, {"a": []}]),
            "service": chance.choice([FIELD, "/x", [], None]),
            "args": chance.choice([{"resolution": "x"}, [[]], "x", {"x": 1}]),
        }
    )
    frames: list[str | bytes] = [
        chance.randbytes(chance.randrange(40)),
        whole[: chance.randrange(len(whole))],
        "[" * chance.randrange(15_000),
        "\x00\ud7ff\u202e" * chance.randrange(9),
        chance.choice(["null", "[]", "{}", '"x"', "1e999", "NaN", '{"op":{}}']),
        '{"a":' * 3000,
        whole,
    ]
    return chance.choice(frames)


def test_ten_thousand_malformed_frames_change_nothing(house: Bridge) -> None:
    chance = random.Random(7)

    def rubbish(connections: int) -> None:
        for _ in range(connections):
            some_rubbish()

    def some_rubbish() -> None:
        with ros_at(house.url) as ros:
            for _ in range(MAX_BURST - 100):
                ros.connection.send(garbage(chance))
                # Each has its answer: a status, or the response to a call that could not be made.
                reply = ros.next()
                assert reply["op"] in ("status", "service_response")
                assert reply.get("result") is not True
            assert ros.is_quiet()

    with ros_at(house.url) as other, house.listen() as listener:
        other.subscribe()
        other.next()
        rubbish(5)
        before_mb = resident_mb(house.process.pid)
        rubbish(20)
        assert resident_mb(house.process.pid) - before_mb < 5.0
        house.peer.observe(messages.scan("clean", {"temperature": 20.0}))
        house.peer.spin_briefly()
        other.until_tag("clean")
        listener.until_tag("clean")
    health = house.json("/healthz")
    assert (health["ok"], health["callback_errors"]) == (True, 0)
    assert "Traceback" not in house.process.output


# --- set-ups of their own ---------------------------------------------------------------------


def test_names_are_the_ones_that_ros_knows() -> None:
    remapping = ("--ros-args", "-r", "/twin/state:=/house/state", "-p", "field_service_name:=field")
    with bridge(*remapping) as house, ros_at(house.url) as ros:
        topics = ros.call("/rosapi/topics")["values"]
        assert topics == {"topics": ["/house/state"], "types": ["lupin_msgs/msg/TwinState"]}
        assert ros.call("/rosapi/services")["values"]["services"][0] == "/field"
        ros.subscribe(topic="/house/state")
        assert ros.next()["topic"] == "/house/state"
        ros.subscribe()
        assert "expected /house/state" in first(ros, "status")["msg"]


def first(ros: Ros, op: str) -> Message:
    """Read on to the first message of a kind."""
    message = ros.next()
    while message["op"] != op:
        message = ros.next()
    return message


def test_one_client_too_many_is_turned_away_and_told_so() -> None:
    with bridge("--max-clients", "1") as house, ros_at(house.url) as ros:
        assert ros.is_quiet()
        with ros_at(house.url) as late, pytest.raises(ConnectionClosed) as closed:
            late.next()
        assert closed.value.rcvd is not None
        assert closed.value.rcvd.code == 1013
        assert closed.value.rcvd.reason == "1 clients are connected, the limit"


def test_the_limits_of_fields_hold_here_too() -> None:
    with bridge("--field-rate-hz", "0.1") as house, ros_at(house.url) as ros:
        assert ros.call(FIELD, args=FIELD_ARGS)["result"] is True
        response = ros.call(FIELD, args=FIELD_ARGS)
        assert response["result"] is False
        assert response["values"] == (
            "127.0.0.1 asks for more than 0.1 fields a second, the limit (field_rate_hz)"
        )
        assert house.get("/api/field", **FIELD_ARGS).status_code == 429, "of one client, together"


# --- in this process, to hold the twin up ------------------------------------------------------


def calls(count: int) -> list[str]:
    return [
        json.dumps({"op": "call_service", "service": FIELD, "id": f"{n}", "args": FIELD_ARGS})
        for n in range(count)
    ]


async def in_thread(url: str, talk: Callable[[Ros], Any]) -> Any:
    def connected() -> Any:
        with ros_at(url) as ros:
            return talk(ros)

    return await asyncio.to_thread(connected)


def test_open_calls_are_bounded_and_the_rest_is_answered(
    domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    running_at_once = 0
    most_at_once = 0

    async def test() -> None:
        held = asyncio.Event()
        async with inprocess.running() as here:
            plain = here.twin.field

            async def slow_field(request: FieldRequest) -> Any:
                nonlocal running_at_once, most_at_once
                running_at_once += 1
                most_at_once = max(most_at_once, running_at_once)
                await held.wait()
                running_at_once -= 1
                return await plain(request)

            monkeypatch.setattr(here.twin, "field", slow_field)
            loop = asyncio.get_running_loop()

            def talk(ros: Ros) -> None:
                for call in calls(MAX_OPEN_CALLS + 3):
                    ros.connection.send(call)
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

    inprocess.run(domain, test())
    assert most_at_once == 2


def test_a_twin_that_does_not_answer_ends_a_call(
    domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def test() -> None:
        async with inprocess.running(Settings(field_timeout_s=0.1)) as here:

            async def no_field(_request: FieldRequest) -> Any:
                await asyncio.Event().wait()

            monkeypatch.setattr(here.twin, "field", no_field)
            response = await in_thread(here.url, lambda ros: ros.call(FIELD, args=FIELD_ARGS))
            assert response["result"] is False
            assert response["values"] == f"{FIELD} did not answer within 0.1 s"

    inprocess.run(domain, test())


def test_a_client_that_leaves_takes_its_calls_along(
    domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def test() -> None:
        began, ended = 0, 0
        async with inprocess.running() as here:

            async def no_field(_request: FieldRequest) -> Any:
                nonlocal began, ended
                began += 1
                try:
                    await asyncio.Event().wait()
                finally:
                    ended += 1

            monkeypatch.setattr(here.twin, "field", no_field)
            gone = asyncio.Event()

            async def leave() -> None:
                def talk(ros: Ros) -> None:
                    for call in calls(5):
                        ros.connection.send(call)
                    asyncio.run_coroutine_threadsafe(
                        inprocess.until(lambda: began == 2, "two calls with the twin"), loop
                    ).result()

                await in_thread(here.url, talk)
                gone.set()

            loop = asyncio.get_running_loop()
            await leave()
            assert gone.is_set()
            await inprocess.until(lambda: ended == 2, "the end of both")
            await inprocess.until(lambda: len(here.bridge.hub) == 0, "a hub without clients")
            assert began == 2, "those that waited were never begun"

    inprocess.run(domain, test())


def test_a_client_that_takes_no_reply_is_closed_and_meanwhile_holds_little(domain: int) -> None:
    async def test() -> None:
        async with inprocess.running(Settings(client_timeout_s=1.0)) as here:
            # A reader that is let go of would be emptied by asyncio.
            _reader, writer = await deaf(here.url)
            large = {**FIELD_ARGS, "resolution": 0.0061}  # 10^6 cells, all null: 5 MB
            call = {"op": "call_service", "service": FIELD, "id": "large", "args": large}
            for _ in range(5):
                writer.write(Frame(Opcode.TEXT, json.dumps(call).encode()).serialize(mask=True))
            most_bytes = 0

            def is_dismissed() -> bool:
                nonlocal most_bytes
                for connection in here.server.server_state.connections:
                    waiting = connection.transport.get_write_buffer_size()
                    most_bytes = max(most_bytes, waiting)
                return here.bridge.hub.clients_dismissed == 1

            await inprocess.until(is_dismissed, "its dismissal")
            await inprocess.until(lambda: not here.server.server_state.connections, "its end")
            assert 0 < most_bytes < 12_000_000, "the replies of the running calls"
            writer.transport.abort()

    inprocess.run(domain, test())


async def deaf(url: str) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    """A rosbridge client that reads no message."""
    address = urlsplit(url)
    raw = socket.socket()
    raw.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    raw.setblocking(False)
    loop = asyncio.get_running_loop()
    await loop.sock_connect(raw, (address.hostname, address.port))
    reader, writer = await asyncio.open_connection(sock=raw, limit=1024)
    writer.write(
        f"GET /rosbridge HTTP/1.1\r\nHost: {address.netloc}\r\nConnection: Upgrade\r\n"
        "Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
        "Sec-WebSocket-Key: MDEyMzQ1Njc4OWFiY2RlZg==\r\n\r\n".encode()
    )
    assert b" 101 " in await reader.readuntil(b"\r\n\r\n")
    return reader, writer
