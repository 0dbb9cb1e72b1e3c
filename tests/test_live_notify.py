"""`lupin-twin serve` and a real broker: its messages, its will, and a shutdown in time."""

import signal
from pathlib import Path
from typing import Any

from tests.support.domains import own_domain
from tests.support.messages import inspection, scan
from tests.support.mosquitto import PASSWORD, USER, Broker, Subscriber
from tests.support.proc_stat import peak_mb, reset_peak, resident_mb
from tests.support.processes import OFTEN, lupin_twin, twin_node
from tests.support.receiver import receiver, status
from tests.support.ros import Peer
from tests.support.waiting import wait_for
from tests.support.web import bridge, filled

READING = "farm/gh1/tags/a_2Fb/readings/temperature"


def test_an_observation_reaches_the_broker_and_a_killed_bridge_is_offline(tmp_path: Path) -> None:
    broker = Broker(tmp_path, wants_password=True)
    options = ("--mqtt-url", broker.url, "--mqtt-user", USER, "--mqtt-prefix", "farm/gh1")
    secrets: Any = {"LUPIN_MQTT_PASSWORD": PASSWORD, "LUPIN_WEBHOOK_SECRET": "s" * 16}
    with (
        broker.running(),
        Subscriber(broker) as received,
        receiver(status(200)) as hook,
        bridge(*options, "--webhook-url", f"http://127.0.0.1:{hook.port}/", **secrets) as live,
    ):
        live.peer.observe(scan("a/b", {"temperature": 6.5}, at=(1, 1)))
        reading = wait_for(lambda: received.last(READING), "the reading")
        reported = filled(live.tag("a/b"))["readings"][0]
        assert (reading["value"], reading["stamp"]) == (6.5, reported["observed_at"])
        health = wait_for(lambda: received.last("farm/gh1/tags/a_2Fb/health"), "the verdict")
        assert health["verdict"] == "critical"
        # A pest is an alarm at once.
        live.peer.observe(inspection("a/b", anomaly=True))
        wait_for(lambda: hook.posted, "the alarm")
        posted = hook.posted[0].json
        assert (posted["change"], posted["alarm"]["tag_id"]) == ("raised", "a/b")
        assert posted["origin"] == reading["origin"] == "robot"
        (alarm,) = live.json("/api/alarms")["alarms"]
        assert posted["alarm"] == alarm
        topic = "farm/gh1/tags/a_2Fb/alarms"
        wait_for(
            lambda: (received.last(topic) or {}).get("state") == "ON", "the same at the broker"
        )
        assert received.last(topic)["alarms"] == [alarm]
        assert live.json("/readyz")["outward"] == [
            {"channel": channel, "is_failing": False, "detail": ""}
            for channel in ("mqtt", "webhook")
        ]
        assert 'lupin_outward_connected{channel="mqtt"} 1.0' in live.get("/metrics").text
        assert set(received.of("farm/gh1/status")) == {b"online"}
        assert "--mqtt-url is without TLS" in live.process.output
        assert PASSWORD not in live.process.output
        live.process.send(signal.SIGKILL)
        wait_for(lambda: received.of("farm/gh1/status")[-1:] == [b"offline"], "the will")


def test_a_flood_at_home_assistants_topic_costs_no_memory(tmp_path: Path) -> None:
    broker = Broker(tmp_path)
    with (
        broker.running() as process,
        Subscriber(broker, "lupin-twin/#") as received,
        bridge("--mqtt-url", broker.url, afresh=True) as live,
    ):
        reading = "lupin-twin/tags/a/readings/co2"
        live.peer.observe(scan("a", {"co2": 400.0}, at=(1, 1)))
        wait_for(lambda: received.last(reading), "the reading")
        before_mb = resident_mb(live.process.pid)
        reset_peak(live.process.pid)
        for retain in (False, True):
            received.publish("homeassistant/status", "x" * 64_000_000, retain=retain)
        live.peer.observe(scan("a", {"co2": 500.0}, at=(1, 1)))
        wait_for(lambda: received.last(reading)["value"] == 500.0, "the next one")
        assert peak_mb(live.process.pid) - before_mb < 32
        assert 'lupin_outward_failed_total{channel="mqtt"} 0.0' in live.get("/metrics").text
        # A failing channel is reported to clients.
        with live.listen() as page:
            process.kill()
            page.until("status", lambda reported: bool(reported["outward"][0]["is_failing"]))


def test_the_first_webhook_of_web_names_the_source(tmp_path: Path) -> None:
    """A twin elsewhere publishes its source on a topic of its own, once a second."""
    secrets: Any = {"LUPIN_WEBHOOK_SECRET": "s" * 16}
    with (
        own_domain() as domain,
        Peer(domain) as robot,
        twin_node(domain, *OFTEN) as _,
        receiver(status(200)) as hook,
    ):
        robot.wait_for_twin()
        robot.observe(inspection("a", anomaly=True))
        robot.tag("a")
        to = ("--webhook-url", f"http://127.0.0.1:{hook.port}/")
        with lupin_twin(domain, "web", *to, **secrets):
            wait_for(lambda: hook.posted, "the alarm")
    assert hook.posted[0].json["origin"] == "robot"
