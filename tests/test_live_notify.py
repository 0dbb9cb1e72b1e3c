"""Real processes notify: a broker, a webhook, and shift reports."""

import re
import shutil
import signal
from pathlib import Path
from typing import Any

from lupin_bridge.stream.routes_schema import ShiftReport
from tests.support.domains import own_domain
from tests.support.http_answers import HOUR, OPTIONS, T0
from tests.support.journal_answers import JOURNALS
from tests.support.messages import inspection, scan
from tests.support.mosquitto import PASSWORD, USER, Broker, Subscriber
from tests.support.proc_stat import peak_mb, reset_peak, resident_mb
from tests.support.processes import OFTEN, lupin_twin, twin_node
from tests.support.receiver import receiver, status
from tests.support.ros import Peer
from tests.support.waiting import wait_for
from tests.support.web import Bridge, bridge, filled

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
        alone = {**alarm, "also": []}
        assert posted["alarm"] == alone
        topic = "farm/gh1/tags/a_2Fb/alarms"
        wait_for(
            lambda: (received.last(topic) or {}).get("state") == "ON", "the same at the broker"
        )
        assert received.last(topic)["alarms"] == [alone]
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


DAY = f"from={T0 - HOUR}&to={T0 + 15 * HOUR}"
STORED = ("--ros-args", "-p", "journal_days:=36500")


def test_a_report_covers_its_period_and_an_invalid_one_is_refused(tmp_path: Path) -> None:
    """`test_live_same_answers` compares `serve`, `web` and a fleet."""
    journal = Path(shutil.copy(JOURNALS / "day.sqlite", tmp_path / "j.sqlite"))
    with bridge(*OPTIONS, *STORED, "-p", f"journal:={journal}") as live:
        wait_for(lambda: live.json("/api/alarms")["source"] == "journal", "the alarms")
        check(live)
        check_refusals(live)


def check(live: Bridge) -> None:
    answer = live.http.get(f"/api/report?{DAY}")
    report = ShiftReport.model_validate_json(answer.content)
    found = live.json(f"/api/timeline?{DAY}")
    for name, mine in (("scans", "scans"), ("failures", "failed"), ("looks", "inspections")):
        counted = sum(bucket[name] for bucket in found["buckets"])
        assert counted == getattr(report.counts, mine) > 0
    assert report.complete_to == report.to
    assert answer.headers["x-complete-to"] == f"{report.to.sec}.000000000"
    # As of then; the current alarms have gone on since.
    then = {it["id"]: it for it in live.json(f"/api/alarms?{DAY}")["alarms"]}
    reported = {it.id: it for it in report.alarms}
    assert reported.keys() == then.keys()
    for alarm_id, alarm in reported.items():
        assert alarm.raised_at.model_dump() == then[alarm_id]["raised_at"]

    def is_known() -> bool:
        etag = live.get(f"/api/report?{DAY}").headers["etag"]
        return live.get(f"/api/report?{DAY}", {"If-None-Match": etag}).status_code == 304

    wait_for(is_known, "an answer that is not sent twice")
    page = live.http.get(f"/api/report.html?{DAY}&lang=de")
    assert page.headers["content-security-policy"].startswith("default-src 'none'; style-src")
    assert "<script" not in page.text
    assert 'lang="de"' in page.text
    assert "(UTC+00:00)" in page.text
    assert "\u00a0°C" in page.text
    assert re.search(r"\d,\d\u00a0°C", page.text)
    assert not re.search(r"\d[.,]\d\d+\u00a0°C|\d\.\d\u00a0°C", page.text)


def check_refusals(live: Bridge) -> None:
    for query, message in (
        (f"from={T0}&to={T0 - 1}", "must be before to"),
        (f"from={T0}&to={T0}", "must be before to"),
        (f"from={T0 - 31 * 24 * HOUR - 1}&to={T0}", "31.0 days apart, the limit is 31"),
        (f"from={T0 - 3652 * 24 * HOUR}&to={T0}", "3652.0 days apart, the limit is 31"),
        ("from=yesterday", "from is 'yesterday'"),
        ("from=1&from=2", "from"),
        (f"to={T0}&lang=de", "lang"),
    ):
        answer = live.http.get(f"/api/report?{query}")
        assert (answer.status_code, message in answer.text) == (400, True), answer.text
    answer = live.http.get(f"/api/report.html?to={T0}&lang=fr")
    assert (answer.status_code, "lang" in answer.json()["detail"]) == (400, True)
    for zone in ("Mars", "Europe", "../zone.tab", "/etc/localtime", "a" * 300):
        answer = live.http.get(f"/api/report.html?to={T0}&time_zone={zone}")
        assert (answer.status_code, "Times: UTC" in answer.text) == (200, True), zone
    # The future is left out, and a shift is eight hours.
    report = live.json(f"/api/report?to={2**31 - 1}")
    assert report["to"]["sec"] - report["from"]["sec"] == 8 * HOUR
    assert report["to"]["sec"] < 2**31 - 1


def test_the_report_of_the_last_day_is_posted(tmp_path: Path) -> None:
    secret: Any = {"LUPIN_WEBHOOK_SECRET": "s" * 16}
    with receiver(status(200)) as hook:
        options = (
            *("--report-at", "00:00", "--time-zone", "UTC"),
            *("--webhook-url", f"http://127.0.0.1:{hook.port}/"),
            *("--ros-args", "-p", f"journal:={tmp_path / 'j.sqlite'}"),
        )
        with bridge(*options, **secret) as live:
            wait_for(lambda: hook.posted, "the report")
            posted = hook.posted[0].json
            assert posted["change"] == "report"
            midnight_s = posted["report"]["to"]["sec"]
            assert midnight_s % 86_400 == 0
            period = f"from={midnight_s - 86_400}&to={midnight_s}"
            assert posted["report"] == live.json(f"/api/report?{period}")
