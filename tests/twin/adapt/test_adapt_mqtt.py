"""Fixed sensors at a real broker, in the state of a twin that knows no MQTT."""

import json
import socket
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import yaml
from paho.mqtt.client import Client
from paho.mqtt.enums import CallbackAPIVersion

from lupin_twin.adapt.check import report
from lupin_twin.adapt.config import config_of
from lupin_twin.adapt.node import AdaptNode
from tests.support.mosquitto import Broker
from tests.support.proc_stat import peak_mb
from tests.support.processes import Process, twin_node
from tests.support.ros import Peer
from tests.support.waiting import wait_for
from tests.twin.adapt.test_adapt import Watched, adapt, listening

CONFIG = """
tags: {{bench: [1.0, 2.0]}}
window_s: 0.2
mqtt:
  url: {url}
  topics:
    - {{topic: "zigbee2mqtt/{{tag}}", preset: zigbee2mqtt}}
    - {{topic: "plain/{{tag}}/{{sensor}}", max: 2000, availability: "plain/{{tag}}"}}
    - {{topic: "homeassistant/sensor/{{tag}}_{{sensor}}/state", preset: homeassistant}}
"""


@contextmanager
def adapted(domain: int, broker: Broker) -> Iterator[Process]:
    path = broker.folder / "adapt.yaml"
    path.write_text(CONFIG.format(url=broker.url))
    with adapt(domain, "--config", str(path)) as process:
        yield process


@contextmanager
def all_of(domain: int, broker: Broker) -> Iterator[tuple[Process, Watched]]:
    """The adapter, a twin, and a peer that receives what both publish."""
    with twin_node(domain), adapted(domain, broker) as process, Peer(domain) as peer:
        peer.listen()
        yield process, Watched(peer)


@contextmanager
def device(broker: Broker) -> Iterator[Client]:
    client = Client(CallbackAPIVersion.VERSION2)
    client.connect("127.0.0.1", broker.port)
    client.loop_start()
    try:
        yield client
    finally:
        client.disconnect()
        client.loop_stop()


def readings(peer: Peer, tag_id: str) -> dict[str, float]:
    tags = {tag.tag_id: tag for tag in peer.states[-1].tags} if peer.states else {}
    tag: Any = tags.get(tag_id)
    return {} if tag is None else {each.name: each.value for each in tag.readings}


def test_messages_of_zigbee_sensors_are_in_the_state_and_so_is_a_lost_sensor(
    domain: int, tmp_path: Path
) -> None:
    broker = Broker(tmp_path)
    payload = json.dumps({"temperature": 21.5, "humidity": 60, "battery": 90})
    with broker.running(), device(broker) as client, all_of(domain, broker) as (process, robot):
        peer = robot.peer

        def is_known() -> bool:
            client.publish("zigbee2mqtt/bench", payload)
            client.publish("plain/other/co2", "800")
            return bool(readings(peer, "bench")) and bool(readings(peer, "other"))

        peer.until(is_known, "both sensors on the state")
        assert readings(peer, "bench") == {"temperature": 21.5, "humidity": 60.0}
        assert readings(peer, "other") == {"co2": 800.0}
        placed = {tag.tag_id: tag.pose.orientation.w for tag in peer.states[-1].tags}
        assert placed == {"bench": 1.0, "other": 0.0}  # the other one has no configured position

        client.publish("zigbee2mqtt/bench/availability", '{"state": "offline"}')

        def has_failed() -> bool:
            return any(it.status_detail == "its sensor is offline" for it in robot.observations)

        peer.until(has_failed, "the failed attempt")
        assert process.exit_code is None


def test_a_retained_message_counts_by_its_own_time_or_not(domain: int, tmp_path: Path) -> None:
    broker = Broker(tmp_path)
    then_s = time.time() - 3600.0
    with broker.running(), device(broker) as client:
        for topic, payload in (
            ("zigbee2mqtt/bench", {"temperature": 21.5, "last_seen": then_s * 1000}),
            ("zigbee2mqtt/undated", {"temperature": 21.5}),
            ("plain/hot/temperature", 3000),
        ):
            client.publish(topic, json.dumps(payload), qos=1, retain=True).wait_for_publish(60.0)
        with all_of(domain, broker) as (_, robot):
            peer = robot.peer
            tag = peer.tag("bench", lambda tag: tag.readings)
            assert abs(tag.last_observed.sec - then_s) < 2.0
            peer.until(lambda: robot.reported("it is retained and has no time"), "the complaint")
            peer.until(lambda: robot.reported("must be from -inf to 2000"), "the other")
            assert readings(peer, "undated") == readings(peer, "hot") == {}


def test_a_flood_a_huge_message_and_a_topic_for_each_message_do_no_harm(
    domain: int, tmp_path: Path
) -> None:
    broker = Broker(tmp_path)
    with broker.running(), device(broker) as client, all_of(domain, broker) as (process, robot):
        peer = robot.peer
        peer.until(lambda: robot.reported("connected"), "the broker")
        before_mb = peak_mb(process.pid)
        client.publish("zigbee2mqtt/large", b"1" * 100_000_000, qos=1).wait_for_publish(60.0)
        for number in range(3_000):
            client.publish(f"zigbee2mqtt/{number}", b"no number")

        def is_known() -> bool:
            client.publish("plain/bench/co2", "800")
            return bool(readings(peer, "bench"))

        peer.until(is_known, "a good reading behind all that")
        peer.until(lambda: robot.reported("it is not JSON"), "the complaint")
        assert process.output.count("it is not JSON") < 10
        assert peak_mb(process.pid) < before_mb + 50
        assert process.exit_code is None


def test_a_topic_that_is_not_utf8_costs_no_other(domain: int, tmp_path: Path) -> None:
    """Mosquitto would not forward it; EMQX does."""

    def serve(listener: socket.socket) -> None:
        client, _ = listener.accept()
        with client:
            client.recv(4_096)
            client.sendall(b"\x20\x03\x00\x00\x00")  # CONNACK
            client.recv(4_096)  # SUBSCRIBE
            for topic in (b"plain/Gew\xe4chs/co2", b"plain/bench/co2"):
                body = len(topic).to_bytes(2, "big") + topic + b"\x00800"
                client.sendall(bytes((0x30, len(body))) + body)  # PUBLISH
            while client.recv(4_096):
                pass

    with socket.create_server(("127.0.0.1", 0)) as listener, ThreadPoolExecutor(1) as pool:
        serving = pool.submit(serve, listener)
        with (
            adapted(domain, Broker(tmp_path, listener.getsockname()[1])) as process,
            Peer(domain) as peer,
        ):
            robot = Watched(peer)
            peer.until(lambda: robot.reported("topic is not UTF-8"), "the complaint")
            peer.until(lambda: robot.observations, "the good one behind it")
            assert "Traceback" not in process.output
        serving.result()


def test_check_reports_what_comes_from_the_broker(domain: int, tmp_path: Path) -> None:
    broker = Broker(tmp_path)
    config = config_of(yaml.safe_load(CONFIG.format(url=broker.url)))
    with (
        listening(domain, partial(AdaptNode, config, is_check=True)) as (node, spin),
        broker.running(),
        device(broker) as client,
    ):

        def is_right() -> bool:
            client.publish("plain/bench/co2", "800")
            spin()
            line = next(line for _, line in report(node, 0.0))
            is_there = "zigbee2mqtt/{tag} nothing yet, plain/{tag}/{sensor} bench co2 800" in line
            return line.startswith("ok    MQTT: connected; received ") and is_there

        wait_for(is_right, "what the broker says")
        node.destroy_node()


def test_a_broker_that_comes_late_or_goes_is_reported_and_found_again(
    domain: int, tmp_path: Path
) -> None:
    broker = Broker(tmp_path)
    with adapted(domain, broker) as process, Peer(domain) as peer:
        robot = Watched(peer)
        peer.until(lambda: robot.reported("nothing answers at 127.0.0.1"), "no broker")
        with broker.running():
            peer.until(lambda: robot.reported("connected"), "the broker")
        robot.reports.clear()
        peer.until(lambda: robot.reported("127.0.0.1"), "the report of its end")
        with broker.running(), device(broker) as client:

            def is_received() -> bool:
                client.publish("plain/a/co2", "5")
                return bool(robot.observations)

            peer.until(is_received, "what it says after that")
        assert process.exit_code is None
