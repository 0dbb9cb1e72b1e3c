"""`/foxglove` of a real `lupin-twin serve`: Foxglove's own client from npm, and raw frames."""

import base64
import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from websockets.exceptions import InvalidStatus

from tests.support import messages
from tests.support.domains import ros_env
from tests.support.foxglove import SDK, WEBSOCKET, Viewer, reader_of, viewer
from tests.support.processes import Process
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
    """A twin with one tag, a map and a layer."""
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


# --- Foxglove's own client ----------------------------------------------------------------------


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


def test_foxgloves_client_gets_latched_messages_until_it_unsubscribes(greenhouse: Bridge) -> None:
    reported = play(greenhouse.url, "again", "/map")
    assert reported["before"]["data"] == reported["after"]["data"]
    assert (reported["late"], reported["statuses"]) == (0, [])


def test_every_change_by_foxgloves_client_is_refused(greenhouse: Bridge) -> None:
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


# --- raw frames ---------------------------------------------------------------------------------


@pytest.mark.parametrize("offered", [(), ("foxglove.sdk.v2",), ("cbor", "ros")])
def test_without_a_known_subprotocol_it_is_refused(
    greenhouse: Bridge, offered: tuple[str, ...]
) -> None:
    with pytest.raises(InvalidStatus) as refused, viewer(greenhouse.url, offered):
        pass
    assert refused.value.response.status_code == 400
    assert b"must offer one of foxglove.sdk.v1" in (refused.value.response.body or b"")


@pytest.mark.parametrize(
    ("offered", "chosen"),
    [((SDK,), SDK), ((WEBSOCKET, SDK), WEBSOCKET), (("other", SDK, WEBSOCKET), SDK)],
)
def test_the_first_known_subprotocol_is_chosen(
    greenhouse: Bridge, offered: tuple[str, ...], chosen: str
) -> None:
    with viewer(greenhouse.url, offered) as client:
        assert client.connection.subprotocol == chosen


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
