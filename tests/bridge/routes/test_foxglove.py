"""`/foxglove`: Foxglove's own client from npm, raw frames, slow clients, and simulated time."""

import asyncio
import base64
import json
import shutil
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any, NoReturn

import pytest
from websockets.exceptions import InvalidStatus

from lupin_bridge.feed import ros_source
from lupin_bridge.serving.ws_protocol import PIECE_BYTES
from tests.support import inprocess, messages
from tests.support.domains import ros_env
from tests.support.foxglove import SDK, WEBSOCKET, Viewer, reader_of, viewer
from tests.support.processes import Process
from tests.support.raw_ws import TEXT, deaf, masked
from tests.support.ros import Peer, clock_at
from tests.support.waiting import PATIENCE_S, until
from tests.support.web import Bridge, bridge

SCRIPT = Path(__file__).parents[2] / "foxglove_client.mjs"
INPUT, STATE, DIAGNOSTICS = "/floranova/observations", "/twin/state", "/diagnostics"

LAYERS = ("/twin/field/temperature", "/twin/tags")


def play(url: str, scenario: str, *topics: str) -> Any:
    """What a scenario of `foxglove_client.mjs` has printed at its end."""
    node = shutil.which("node")
    assert node is not None, "node is not installed"
    address = url.replace("http", "ws", 1) + "/foxglove"
    with Process([node, str(SCRIPT), address, scenario, *topics], ros_env(0)) as process:
        assert process.wait() == 0, process.output
        reported = json.loads(process.output.splitlines()[-1])
    assert reported["errors"] == []
    return reported


@pytest.fixture(scope="module")
def greenhouse() -> Iterator[Bridge]:
    with bridge("--ros-args", "-p", "layers:=[temperature]") as running:
        running.peer.wait_for_twin()
        running.peer.observe(messages.scan("1", {"temperature": 20.5}, at=(1.0, 2.0), stamp_s=9.0))
        running.peer.publish_map(messages.occupancy_grid([[0, 100], [-1, 0]]))
        running.peer.tag("1")  # announced over ROS, which is later than over HTTP
        yield running


@pytest.fixture
def client(greenhouse: Bridge) -> Iterator[Viewer]:
    with viewer(greenhouse.url) as opened:
        yield opened


def test_foxgloves_client_finds_and_decodes_the_channels(greenhouse: Bridge) -> None:
    reported = play(greenhouse.url, "look", STATE, INPUT, "/map", DIAGNOSTICS, *LAYERS)
    assert reported["chosen"] == [WEBSOCKET, SDK]
    info = reported["info"]
    assert (info["name"], info["capabilities"], info["supportedEncodings"]) == (
        "lupin-twin",
        [],
        [],
    )
    channels = {channel["topic"]: channel for channel in reported["channels"]}
    others = {"/perception/discovered_tags", "/twin/planters"}
    assert set(channels) == {STATE, INPUT, "/map", DIAGNOSTICS, *LAYERS, *others}
    assert {channel["encoding"] for channel in channels.values()} == {"cdr"}
    # With nothing but the advertised schema.
    read = {
        topic: reader_of(channels[topic])(base64.b64decode(message["data"]))
        for topic, message in reported["first"].items()
    }
    [tag] = read[STATE].tags
    served = greenhouse.json("/api/state")["tags"][0]
    assert (tag.tag_id, tag.pose.position.x, tag.pose.position.y) == ("1", 1.0, 2.0)
    assert [(r.name, r.value) for r in tag.readings] == [("temperature", 20.5)]
    assert tag.tag_id == served["tag_id"]
    seen = read[INPUT]
    assert (seen.tag_reading.tag_id, seen.header.stamp.sec, seen.source) == ("1", 9, "test")
    assert list(read["/map"].data) == [0, 100, -1, 0]
    assert "lupin_twin" in str(read[DIAGNOSTICS].status[0].name)
    points = read["/twin/field/temperature"]
    assert [field.name for field in points.fields] == ["x", "y", "z", "value", "error"]
    assert points.width * points.height > 0
    assert [marker.text for marker in read["/twin/tags"].markers if marker.text] == ["1"]
    stamps = [int(message["timestamp"]) for message in reported["first"].values()]
    stamp = read[STATE].header.stamp
    assert all(abs(ns - stamp.sec * 10**9) < 120e9 for ns in stamps)


def test_foxgloves_client_gets_latched_messages_and_every_change_by_it_is_refused(
    greenhouse: Bridge,
) -> None:
    reported = play(greenhouse.url, "again", "/map")
    assert reported["before"]["data"] == reported["after"]["data"]
    assert (reported["late"], reported["statuses"]) == (0, [])
    statuses = play(greenhouse.url, "write")["statuses"]
    assert {status["level"] for status in statuses} == {2}
    assert [status["message"].partition(":")[0] for status in statuses] == [
        "op 'advertise' is refused",
        "a binary message is refused",
        "op 'unadvertise' is refused",
        "op 'getParameters' is refused",
        "op 'setParameters' is refused",
        "op 'subscribeParameterUpdates' is refused",
        "op 'unsubscribeParameterUpdates' is refused",
        "a binary message is refused",
        "op 'subscribeConnectionGraph' is refused",
        "op 'unsubscribeConnectionGraph' is refused",
        "op 'fetchAsset' is refused",
        "there is no channel 4000000",
    ]
    assert greenhouse.peer.node.count_publishers("/cmd_vel") == 0


def test_the_first_known_subprotocol_is_chosen_and_one_has_to_be_known(greenhouse: Bridge) -> None:
    for known, chosen in (((WEBSOCKET, SDK), WEBSOCKET), (("other", SDK, WEBSOCKET), SDK)):
        with viewer(greenhouse.url, known) as client:
            assert client.connection.subprotocol == chosen
    for offered in ((), ("foxglove.sdk.v2",), ("cbor", "ros")):
        with pytest.raises(InvalidStatus) as refused, viewer(greenhouse.url, offered):
            pass
        assert refused.value.response.status_code == 400
        assert b"must offer one of foxglove.sdk.v1" in (refused.value.response.body or b"")


def test_invalid_messages_are_answered_and_the_connection_stays(client: Viewer) -> None:
    for message, wording in (
        ("{", "the message is not JSON"),
        ("[]", "the message is an array"),
        ('{"op":"subscribe"}', "subscriptions: field required"),
        ('{"op":"dance"}', "op 'dance' is refused"),
        (b"", "a binary message is refused"),
        (b"\x01\xff", "a binary message is refused"),
    ):
        client.connection.send(message)
        assert client.status().startswith(wording)
    client.subscribe(STATE)
    assert client.data(1)


SIM = ("--ros-args", "-p", "use_sim_time:=true")


def subscribing(offer: Any, *topics: str) -> bytes:
    ids = {channel.topic.name: channel.id for channel in offer.channels.values()}
    entries = [{"id": n, "channelId": ids[topic]} for n, topic in enumerate(topics)]
    return masked(TEXT, json.dumps({"op": "subscribe", "subscriptions": entries}).encode())


def refuse(_: object) -> NoReturn:
    raise ValueError("no subscription to it")


def has_tags(here: Any, count: int) -> bool:
    latest = here.bridge.latest
    return latest is not None and len(latest.snapshot.tags) >= count


async def topics_are_subscribed_while_wanted(here: Any) -> None:
    """Without clients, and then topics end at once."""
    hub, offer, relay = here.bridge.hub, here.bridge.offer, here.bridge.source.relay
    await until(lambda: len(relay.topics) == 0, "no topic without clients")
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
    await until(lambda: len(relay.topics) == 1, "the map's subscription")
    writer.write(masked(TEXT, b'{"op":"unsubscribe","subscriptionIds":[0]}'))
    await until(lambda: len(relay.topics) == 0, "the map's subscription to end")
    writer.transport.abort()
    await until(lambda: len(hub) == 0, "nobody again")


async def test_a_slow_client_gets_the_last_50_observations_and_one_that_never_reads_is_closed(
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
            relay = here.bridge.source.relay
            before = relay.skipped
            for number in range(70):
                peer.observe(messages.scan(f"seen {number}.", {"co2": 1.0}))
                await until(partial(has_tags, here, number + 1), "its arrival")
            await until(lambda: relay.skipped >= before + 2 * 19, "what gave way")
            most_bytes = max(
                connection.transport.get_write_buffer_size()
                for connection in here.server.server_state.connections
            )
            assert 0 < most_bytes <= PIECE_BYTES, "of the map a piece, and nothing behind it"
            got = bytearray()
            while b"seen 69." not in got[-100_000:]:
                got += await slow[0].read(1 << 20)
            assert b"seen 20." in got
            assert b"seen 15." not in got, "and none of those before"
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


async def test_simulated_time_stamps_the_messages(domain: int) -> None:
    async with inprocess.running(ros_args=SIM) as here:
        with Peer(domain) as peer:

            def tick() -> bool:
                peer.publish("/clock", clock_at(5.25), depth=1)
                latest = here.bridge.latest
                return latest is not None and latest.snapshot.stamp_ns == 5_250_000_000

            await until(tick, "a state of that time")

        def state() -> int:
            with viewer(here.url) as client:
                client.subscribe("/twin/state")
                while isinstance(message := client.next(), dict) or message[0] != 1:
                    pass
                return message[1]

        assert await asyncio.to_thread(state) == 5_250_000_000
