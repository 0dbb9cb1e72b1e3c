"""Publishers over DDS: other QoS, losses, other users, and two greenhouses in one domain."""

from __future__ import annotations

import base64
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import httpx
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from lupin_msgs.msg import Observation
from rclpy.qos import QoSProfile, ReliabilityPolicy

from lupin_twin.core.interfaces import SERVICES
from tests.bridge.routes.test_foxglove import play
from tests.support.domains import ros_env
from tests.support.foxglove import reader_of
from tests.support.messages import inspection, occupancy_grid, scan
from tests.support.processes import OFTEN, Process, constants, lupin_twin, twin_node, url_of
from tests.support.ros import Peer
from tests.support.waiting import PATIENCE_S, wait_for
from tests.support.web import Bridge, bridge, listener, tag_ids

TOPIC = "/floranova/observations"
SETTLED_S = 1.0
SETTLES_SOON = constants(**{"lupin_twin.ros.inputs:SETTLED_S": SETTLED_S})


@pytest.fixture
def running() -> Iterator[Bridge]:
    with bridge(*OFTEN) as live:
        yield live


@pytest.mark.parametrize(
    ("qos", "remedy"),
    [
        (QoSProfile(depth=10), "use TRANSIENT_LOCAL"),
        (
            QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT),
            "use TRANSIENT_LOCAL and RELIABLE",
        ),
    ],
    ids=["default", "best effort"],
)
def test_a_publisher_with_other_qos_is_received_and_reported(
    running: Bridge, qos: QoSProfile, remedy: str
) -> None:
    peer = running.peer
    publisher = peer.node.create_publisher(Observation, TOPIC, qos)

    def is_received() -> bool:
        publisher.publish(scan("foreign", {"co2": 1.0}))
        return running.get("/api/tags/foreign").status_code == 200

    wait_for(is_received, "what it says")
    (text,) = wait_for(lambda: running.json("/readyz")["input_problems"], "the problem")
    assert text.startswith(f"/peer publishes {TOPIC} with another QoS")
    assert text.endswith(remedy)
    assert running.process.output.count(text) == 1
    assert diagnosed(peer, lambda values: text in values.get("inputs", {}).values())
    # A matching publisher reaches both subscriptions, and counts once; it gives no stamp.
    for value in range(20):
        peer.observe(scan("ours", {"co2": float(value)}))
    running.tag("ours", lambda tag: tag["readings"][0]["value"] == 19.0)
    publisher.publish(scan("last", {"co2": 1.0}))
    # The log is behind the state by up to a batch.
    of_last = "/api/history?tag_id=last&sensor_type=co2"
    wait_for(lambda: running.json(of_last)["readings"], "the last in the log")
    # The two subscriptions take turns: the last may come before one that the other has dropped.
    of_ours = "/api/tags/ours/history"
    wait_for(lambda: len(running.json(of_ours)["tries"]) == 20, "all of a matching publisher")
    assert running.json("/readyz")["drops"] == []
    peer.node.destroy_publisher(publisher)
    wait_for(lambda: not running.json("/readyz")["input_problems"], "nothing to be wrong")


def test_every_loss_of_a_new_publisher_is_counted(domain: int) -> None:
    count = 1_000
    with lupin_twin(domain, "serve", *SETTLES_SOON) as twin, Peer(domain) as peer:
        publisher = peer.publisher(TOPIC, Observation)
        peer.until(publisher.get_subscription_count, "the twin")
        # It checks each second, and a check that is a hair early is a second late.
        settled_s = time.monotonic() + SETTLED_S + 4.0
        peer.until(lambda: time.monotonic() > settled_s, "the twin to have seen its silence")
        twin.freeze()
        for number in range(count):
            message = scan(f"tag {number % 30}", {"co2": float(number)})
            message.header.stamp.sec = 1 + number
            publisher.publish(message)
        twin.thaw()

        def is_all(values: dict[str, dict[str, str]]) -> bool:
            lost = int(values["drops"].get("lost", 0))
            return lost > 0 and lost + int(values["journal"]["written"]) == count

        assert diagnosed(peer, is_all)
        assert f"on {TOPIC}: they arrived too fast" in twin.output


NOBODY = 65534
# Everything is imported while the files can be read.
AS_NOBODY = f"""
import os, time, rclpy, rclpy.executors, rclpy.node
from lupin_msgs.msg import Observation
from rclpy.qos import DurabilityPolicy, QoSProfile
Observation.__class__.__import_type_support__()
os.setgid({NOBODY}), os.setuid({NOBODY})
rclpy.init()
node = rclpy.create_node("somebody_else")
qos = QoSProfile(depth=50, durability=DurabilityPolicy.TRANSIENT_LOCAL)
publisher = node.create_publisher(Observation, "{TOPIC}", qos)
while True:
    publisher.publish(Observation())
    rclpy.spin_once(node, timeout_sec=0.1)
"""


@contextmanager
def home_for_all() -> Iterator[str]:
    """A folder that every user may write to, in one that every user may enter."""
    with TemporaryDirectory() as home:
        Path(home).chmod(0o777)
        yield home


if os.geteuid() == 0:  # only root can run a process as another user; see test_inputs too

    def test_a_silent_publisher_of_another_user_is_reported(domain: int) -> None:
        with (
            home_for_all() as home,
            bridge(*SETTLES_SOON, *OFTEN, domain=domain) as live,
            Process(
                [sys.executable, "-c", AS_NOBODY], ros_env(domain, HOME=home, ROS_LOG_DIR=home)
            ),
        ):
            (text,) = wait_for(lambda: live.json("/readyz")["input_problems"], "the hint")
        assert text.startswith(f"nothing has come yet from the publisher of {TOPIC}")
        assert f"uid {NOBODY}" in text
        assert "FASTDDS_BUILTIN_TRANSPORTS=UDPv4" in text


def diagnosed(peer: Peer, accept: Callable[[dict[str, dict[str, str]]], bool]) -> bool:
    """Wait until the twin's `/diagnostics`, by finding and key, are as expected."""
    text: list[Any] = []
    subscription = peer.node.create_subscription(DiagnosticArray, "/diagnostics", text.append, 10)

    def check() -> bool:
        return bool(text) and accept(
            {
                status.name.rpartition(": ")[2]: {it.key: it.value for it in status.values}
                for status in text[-1].status
            }
        )

    peer.until(check, "the diagnosis")
    peer.node.destroy_subscription(subscription)
    return True


FIELD = {"sensor_type": "co2", "resolution": "0.5"}


def below(namespace: str) -> tuple[str, ...]:
    return ("--ros-args", "-r", f"__ns:={namespace}")


def fill(robot: Peer, namespace: str, tag_id: str, co2: float) -> None:
    """What one greenhouse's robot publishes, on its own topics."""
    robot.publish(f"{namespace}/floranova/observations", scan(tag_id, {"co2": co2}, (0, 0)))
    robot.publish(f"{namespace}/floranova/observations", inspection(tag_id, "lupin"))
    robot.publish(f"{namespace}/map", occupancy_grid([[0, 0], [0, 0]]), depth=1)


def answers(process: Process, tag_id: str) -> tuple[list[str], dict[str, object]]:
    """The tags and the field of a bridge, once it has this tag and finds the twin's service."""
    with (
        listener(url_of(process)) as client,
        httpx.Client(base_url=url_of(process), timeout=PATIENCE_S) as http,
    ):
        client.until_tag(tag_id)
        field = wait_for(
            lambda: (
                answer
                if (answer := http.get("/api/field.json", params=FIELD)).status_code == 200
                and answer.json()["sample_count"]
                else None
            ),
            "a field",
        )
        assert field is not None
        wait_for(lambda: http.get("/api/map").status_code == 200, "the map")
        return tag_ids(http.get("/api/state").json()), field.json()


def viewed(process: Process, namespace: str) -> tuple[str, list[int]]:
    """A greenhouse in Foxglove's own client: the tag last observed, and the map."""
    topics = [f"{namespace}/{name}" for name in ("floranova/observations", "map", "twin/state")]
    reported = play(url_of(process), "look", *topics)
    channels = {channel["topic"]: channel for channel in reported["channels"]}
    observation, grid, _state = (
        reader_of(channels[topic])(base64.b64decode(reported["first"][topic]["data"]))
        for topic in topics
    )
    return observation.tag_reading.tag_id or observation.flower.tag_id, list(grid.data)


def test_two_greenhouses_in_one_domain_do_not_mix(domain: int) -> None:
    with (
        twin_node(domain, *below("/gh1")) as first,
        lupin_twin(domain, "serve", *below("/gh2")) as second,
        lupin_twin(domain, "web", *below("/gh1")) as web,
        Peer(domain) as robot,
    ):
        fill(robot, "/gh1", "one", 400.0)
        fill(robot, "/gh2", "two", 900.0)
        fill(robot, "", "root", 100.0)
        ours, field = answers(web, "one")
        assert (ours, field["value_max"]) == (["one"], 400.0)
        theirs, field = answers(second, "two")
        assert (theirs, field["value_max"]) == (["two"], 900.0)
        assert viewed(web, "/gh1") == ("one", [0, 0, 0, 0])
        # The drops of a twin reach its own `web`, from `/diagnostics`.
        robot.publish("/gh1/floranova/observations", scan("nowhere", frame_id="odom"))
        with httpx.Client(base_url=url_of(web), timeout=PATIENCE_S) as http:
            drops = wait_for(lambda: http.get("/readyz").json()["drops"], "what was dropped")
            assert [(drop["reason"], drop["count"]) for drop in drops] == [("frame", 1)]
            metrics = http.get("/metrics").text
        assert '\nlupin_dropped_total{reason="frame"} 1.0' in metrics
        assert '\nlupin_web_dropped_total{reason="frame"} 0.0' in metrics
        # A twin's first line names what it receives and publishes.
        first.wait_for_output("/gh1/lupin_twin in ROS domain")
        for name in ("/gh1/floranova/observations", "/gh1/perception/discovered_tags", "/gh1/map"):
            assert name in first.output
        assert "nodes publish" not in first.output + second.output + web.output
        # The root's names are neither received nor published.
        graph = dict(robot.node.get_topic_names_and_types())
        assert {"/gh1/twin/state", "/gh1/twin/times", "/gh2/twin/state"} <= graph.keys()
        assert "/twin/state" not in graph
        services = dict(robot.node.get_service_names_and_types())
        assert {f"/gh1/{service.name}" for service in SERVICES} <= services.keys()


def test_the_demo_in_a_namespace_includes_its_patrol(domain: int) -> None:
    with (
        # Without the past that it begins with: the data come from the patrol.
        lupin_twin(domain, "demo", "--speed", "20", *below("/gh1"), "-p", "journal:=off") as demo,
        listener(url_of(demo)) as screen,
    ):
        screen.until("state", lambda frame: len(tag_ids(frame["state"])) > 3)
