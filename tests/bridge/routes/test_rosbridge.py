"""`/rosbridge`: names, and the limits of a client; the rest is in `test_roslib`."""

import asyncio
from collections.abc import Callable
from typing import Any

import pytest

from lupin_bridge.feed.source import TwinUnavailableError
from lupin_bridge.routes import sockets
from lupin_bridge.routes.answers import newest_field
from lupin_bridge.routes.sockets import MAX_OPEN_CALLS
from lupin_bridge.serving.admission import Limits
from lupin_bridge.stream.frames import StateFrame
from lupin_bridge.viewers.rosbridge_session import Reaction, Session
from tests.support import inprocess
from tests.support.processes import limits
from tests.support.raw_ws import deaf
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
from tests.support.web import bridge


def test_names_are_those_of_ros() -> None:
    remapping = ("--ros-args", "-r", "/twin/state:=/house/state", "-p", "field_service_name:=field")
    with bridge(*remapping) as greenhouse, ros_at(greenhouse.url) as ros:
        topics = ros.call("/rosapi/topics")["values"]
        assert (topics["topics"][0], topics["types"][0]) == (
            "/house/state",
            "lupin_msgs/msg/TwinState",
        )
        assert ros.call("/rosapi/services")["values"]["services"][0] == "/field"
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
