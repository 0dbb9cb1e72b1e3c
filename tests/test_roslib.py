"""The real roslib, from npm, against the real bridge: existing clients connect unchanged."""

import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.support import messages
from tests.support.domains import own_domain, ros_env
from tests.support.processes import Process, lupin_twin, url_of
from tests.support.ros import Peer
from tests.support.web import Bridge, bridge, listener

SCRIPT = Path(__file__).with_name("roslib_client.mjs")


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


def test_roslibs_queries_about_names_are_answered(greenhouse: Bridge) -> None:
    reported = play(greenhouse.url, "names")
    assert dict(zip(*reported["topics"].values(), strict=True)) == {
        "/twin/state": "lupin_msgs/msg/TwinState",
        "/floranova/observations": "lupin_msgs/msg/Observation",
        "/perception/discovered_tags": "lupin_msgs/msg/DiscoveredTags",
        "/map": "nav_msgs/msg/OccupancyGrid",
        "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
    }
    assert reported["topicType"] == "lupin_msgs/msg/TwinState"
    assert "/twin/get_field" in reported["services"]
    assert reported["serviceType"] == "lupin_msgs/srv/GetField"
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
