"""Messages that DDS delivers late or never: the twin and `web` notice, report, and recover."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from lupin_msgs.msg import Observation
from rclpy.qos import QoSProfile, ReliabilityPolicy

from tests.support.domains import ros_env
from tests.support.messages import scan
from tests.support.processes import OFTEN, Process, constants, lupin_twin
from tests.support.ros import Peer
from tests.support.waiting import wait_for
from tests.support.web import Bridge, bridge

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
    assert len(running.json("/api/tags/ours/history")["tries"]) == 20
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
            lost = int(values["queues"]["lost"])
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
