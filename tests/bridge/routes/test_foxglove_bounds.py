"""`/foxglove` in the test's own process: slow clients and simulated time."""

import asyncio
import json
from typing import Any, NoReturn

import pytest

from lupin_bridge.feed import ros_source
from lupin_bridge.serving.ws_protocol import PIECE_BYTES
from tests.bridge.routes.test_foxglove import INPUT, play
from tests.support import inprocess, messages
from tests.support.foxglove import viewer
from tests.support.raw_ws import TEXT, deaf, masked
from tests.support.ros import Peer, clock_at
from tests.support.waiting import PATIENCE_S, until

SIM = ("--ros-args", "-p", "use_sim_time:=true")


def subscribing(offer: Any, *topics: str) -> bytes:
    """The frame that subscribes to these topics."""
    ids = {channel.topic.name: channel.id for channel in offer.channels.values()}
    entries = [{"id": n, "channelId": ids[topic]} for n, topic in enumerate(topics)]
    return masked(TEXT, json.dumps({"op": "subscribe", "subscriptions": entries}).encode())


def refuse(_: object) -> NoReturn:
    raise ValueError("no subscription to it")


async def topics_are_subscribed_while_wanted(here: Any) -> None:
    """Without clients, and then topics end at once."""
    hub, offer, relay = here.bridge.hub, here.bridge.offer, here.bridge.source.relay
    await until(lambda: len(relay) == 0, "no topic without clients")
    reader, writer = await deaf(here.url, "/foxglove")
    await until(lambda: len(hub) == 1, "one more")
    got = b""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ros_source, "qos_of", refuse)
        writer.write(subscribing(offer, "/map"))
        while b"cannot be served now" not in got:
            got += await reader.read(1 << 20)
    # The id is free: a failed subscription is not open.
    writer.write(subscribing(offer, "/map"))
    await until(lambda: len(relay) == 1, "the map's subscription")
    writer.write(masked(TEXT, b'{"op":"unsubscribe","subscriptionIds":[0]}'))
    await until(lambda: len(relay) == 0, "the map's subscription to end")
    writer.transport.abort()
    await until(lambda: len(hub) == 0, "nobody again")


async def test_a_slow_client_gets_the_latest_messages_and_one_that_never_reads_is_closed(
    domain: int,
) -> None:
    async with inprocess.running() as here:
        hub, offer = here.bridge.hub, here.bridge.offer
        slow, never = await deaf(here.url, "/foxglove"), await deaf(here.url, "/foxglove")
        await until(lambda: len(hub) == 2 and offer.channels, "both, and the channels")
        for _, writer in (slow, never):
            writer.write(subscribing(offer, "/map", INPUT))
        with Peer(domain) as peer:
            peer.publish_map(messages.occupancy_grid([[0] * 3000] * 3000))
            await until(lambda: hub.blocked == 2, "two full sockets")
            before = offer.counts.skipped
            for number in range(20):
                peer.observe(messages.scan(f"seen {number}.", {"co2": 1.0}))
            await until(lambda: offer.counts.skipped >= before + 38, "what gave way")
            most_bytes = max(
                connection.transport.get_write_buffer_size()
                for connection in here.server.server_state.connections
            )
            assert 0 < most_bytes <= PIECE_BYTES, "of the map a piece, and nothing behind it"
            got = bytearray()
            while b"seen 19." not in got[-100_000:]:
                got += await slow[0].read(1 << 20)
            assert b"seen 18." not in got, "and none of those before"
            await until(lambda: hub.blocked == 1, "the one that reads")
            hub.client_timeout_s = 0.1
            await until(lambda: hub.clients_dismissed == 1, "the other's end")
            await until(lambda: len(here.server.server_state.connections) == 1, "its going")
            hub.client_timeout_s = PATIENCE_S
            peer.observe(messages.scan("after.", {"co2": 1.0}))
            while b"after." not in got[-100_000:]:
                got += await slow[0].read(1 << 20)
            # Together they hold less than two maps: one that holds the older one is closed.
            unsent = hub.unsent
            await until(lambda: unsent.bytes == 0, "nothing to wait for")
            unsent.max_bytes = 15_000_000
            stuck = await deaf(here.url, "/foxglove")
            await until(lambda: len(hub) == 2, "a third")
            stuck[1].write(subscribing(offer, "/map"))
            await until(lambda: hub.blocked == 1, "its full socket")
            assert 9_000_000 < unsent.bytes < 9_001_000
            peer.publish_map(messages.occupancy_grid([[1] * 3000] * 3000))
            await until(lambda: hub.clients_dismissed == 2, "its end")
            await until(lambda: hub.blocked == 1, "the one that comes to hold the newer")
            assert 9_000_000 < unsent.bytes < 9_001_000
        here.bridge.source.relay.linger_s = 0.0
        for _, writer in (slow, never, stuck):
            writer.transport.abort()
        await until(lambda: len(hub) == 0, "nobody")
        assert here.bridge.hub.unsent.bytes == 0
        await topics_are_subscribed_while_wanted(here)


async def test_simulated_time_is_sent_and_stamps_the_messages(domain: int) -> None:
    async with inprocess.running(ros_args=SIM) as here:
        with Peer(domain) as peer:

            def tick() -> bool:
                peer.publish("/clock", clock_at(5.25), depth=1)
                latest = here.bridge.latest
                return latest is not None and latest.snapshot.stamp_ns == 5_250_000_000

            await until(tick, "a state of that time")
        reported = await asyncio.to_thread(play, here.url, "time")
        assert reported["info"]["capabilities"] == ["time"]
        assert reported["timestamp"] == "5250000000"

        def state() -> int:
            with viewer(here.url) as client:
                client.subscribe("/twin/state")
                while isinstance(message := client.next(), dict) or message[0] != 1:
                    pass
                return message[1]

        assert await asyncio.to_thread(state) == 5_250_000_000
