"""Feeds over a scripted relay: shared serialisation, what is dropped, and how one ends."""

import asyncio
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import orjson
import pytest

from lupin_bridge.feed.relay import NotRelayedError, Sample
from lupin_bridge.stream.frames import text_frame
from lupin_bridge.viewers.rosbridge_session import Feed, Feeds, Writer
from lupin_twin.core.interfaces import Topic
from lupin_twin.runtime.workers import Workers
from tests.support.waiting import until

INPUT = Topic("a/msg/B", "", "/in", depth=3)


class Relay:
    """Receives what the test says, and counts reads."""

    def __init__(self) -> None:
        self.ears: list[Callable[[Sample], None]] = []
        self.read_count = 0
        self.refuses = False

    async def listen(self, topic: Topic, take: Callable[[Sample], None]) -> Any:
        if self.refuses:
            raise NotRelayedError("no such type")
        self.ears.append(take)
        return lambda: self.ears.remove(take)

    def read(self, topic: Topic, sample: Sample) -> Any:
        self.read_count += 1
        if sample.data == b"bad":
            raise ValueError("not a message")
        if sample.data == b"odd":
            raise ZeroDivisionError
        return SimpleMessage("\ud800" if sample.data == b"half" else sample.data.decode())

    def publish(self, *texts: str) -> None:
        for text in texts:
            sample = Sample(text.encode(), 5_000_000_006)
            for ear in list(self.ears):
                ear(sample)


class SimpleMessage:
    def __init__(self, text: str) -> None:
        self.text = text

    @staticmethod
    def get_fields_and_field_types() -> dict[str, str]:
        return {"text": "string"}


class Client:
    """What a client has received; it reads only while its gate is open."""

    def __init__(self, writer: Writer) -> None:
        self.frames: list[bytes] = []
        self.gate = asyncio.Event()
        self.gate.set()
        self.feeding = Feeds(writer, self._send)

    async def _send(self, frame: bytes) -> None:
        self.frames.append(frame)
        await self.gate.wait()


def json_frame(text: str) -> bytes:
    return text_frame(orjson.dumps({"op": "publish", "topic": "in", "msg": {"text": text}}))


def feed(**options: Any) -> Feed:
    return replace(Feed(INPUT, "in", 0.0), **options)


@pytest.fixture
def relay() -> Relay:
    return Relay()


@pytest.fixture
def writer(relay: Relay) -> Iterator[Writer]:
    workers = Workers("work")
    yield Writer(relay, workers)  # type: ignore[arg-type]
    workers.close()


async def test_a_message_is_serialised_once_for_all_clients_with_equal_options(
    relay: Relay, writer: Writer
) -> None:
    clients = [Client(writer) for _ in range(3)]
    for client in clients:
        client.feeding.follow({"in": feed()}, "in")
    await until(lambda: len(relay.ears) == 3, "the clients to listen")
    relay.publish("a")
    await until(lambda: all(client.frames for client in clients), "the message")
    assert [client.frames for client in clients] == [[json_frame("a")]] * 3
    assert relay.read_count == 1
    for client in clients:
        client.feeding.close()
    await until(lambda: not relay.ears, "nobody to listen")


async def test_what_waits_for_a_slow_client_is_limited_by_the_topics_depth(
    relay: Relay, writer: Writer
) -> None:
    slow = Client(writer)
    slow.gate.clear()
    slow.feeding.follow({"in": feed()}, "in")
    await until(lambda: bool(relay.ears), "it to listen")
    relay.publish("0")
    await until(lambda: bool(slow.frames), "the first")
    relay.publish("1", "2", "3", "4")
    slow.gate.set()
    await until(lambda: len(slow.frames) == 4, "the rest")
    assert slow.frames == [json_frame(text) for text in "0234"]


async def test_a_throttled_client_gets_the_latest_message_and_not_before_its_time(
    relay: Relay, writer: Writer
) -> None:
    quick, often, rare = (Client(writer) for _ in range(3))
    quick.feeding.follow({"in": feed()}, "in")
    often.feeding.follow({"in": feed(min_interval_s=0.001)}, "in")
    rare.feeding.follow({"in": feed(min_interval_s=3600.0)}, "in")
    await until(lambda: len(relay.ears) == 3, "them to listen")
    often.gate.clear()
    relay.publish("0")
    await until(lambda: all(c.frames for c in (quick, often, rare)), "the first")
    relay.publish("1", "2", "3")
    await until(lambda: len(quick.frames) == 4, "the rest")
    often.gate.set()
    await until(lambda: len(often.frames) == 2, "the latest")
    assert often.frames == [json_frame("0"), json_frame("3")]
    assert rare.frames == [json_frame("0")]


async def test_an_unserialisable_message_is_an_error_for_the_client(
    relay: Relay, writer: Writer, caplog: pytest.LogCaptureFixture
) -> None:
    client = Client(writer)
    client.feeding.follow({"in": feed()}, "in")
    await until(lambda: bool(relay.ears), "it to listen")
    relay.publish("odd", "odd", "bad")
    await until(lambda: len(client.frames) == 3, "all of them")
    relay.publish("half", "good")
    await until(lambda: len(client.frames) == 5, "the next ones")
    odd, _, bad, half, good = client.frames
    assert b"an internal error" in odd
    assert b"a message of topic 'in' is left out: not a message" in bad
    assert b"a message of topic 'in' is left out: " in half
    assert good == json_frame("good")
    assert caplog.text.count("Traceback") == 1, "what persists is logged once"
    relay.refuses = True
    client.feeding.follow({"in": feed()}, "in")
    await until(lambda: len(client.frames) == 6, "the refusal")
    assert b"no such type" in client.frames[-1]
