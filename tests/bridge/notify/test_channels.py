"""All channels together, and the daily report."""

import asyncio
import threading
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime, time, timedelta
from functools import partial
from pathlib import Path
from typing import Any
from zoneinfo import ZoneInfo

import orjson
import pytest

from lupin_bridge.judge.judging import Criteria
from lupin_bridge.notify import channels, mqtt, webhook
from lupin_bridge.notify.channels import Channels, DailyReport, ended_ns
from lupin_bridge.notify.destinations import Targets
from lupin_bridge.notify.messages import GreenhouseState
from lupin_bridge.notify.mqtt import Mirror, Mqtt
from lupin_bridge.notify.webhook import MAX_REFUSALS, Webhook
from lupin_bridge.past.plans import Answered
from lupin_bridge.serving.admission import Answer
from lupin_bridge.settings import Secrets, SettingError, Settings
from lupin_twin.core.diagnostics import Condition, JournalState
from lupin_twin.core.past import NotRemembered, PastRefused
from tests.support.mosquitto import Broker, Subscriber
from tests.support.processes import free_port
from tests.support.receiver import Answer as Reply
from tests.support.receiver import Receiver, receiver, status
from tests.support.seen import NOW_NS, SENSORS, Alarms, alarm, seen, tag
from tests.support.waiting import PATIENCE_S, until


def with_an_alarm() -> Any:
    """A simulated greenhouse with an alarm, and no past that is queried."""
    found = Greenhouse(NOW_NS, origin="simulated")
    found.alarms.show([alarm("a")])
    return found


async def test_without_a_configured_channel_nothing_is_started() -> None:
    channels = Channels()
    before = len(asyncio.all_tasks())
    channels.start(with_an_alarm(), SENSORS)
    assert len(asyncio.all_tasks()) == before
    assert channels.status() == {}
    assert {name: dict(counts) for name, counts in channels.counts()} == {
        f"lupin_outward_{what}": {}
        for what in ("connected", "waiting", "sent", "failed", "dropped")
    }
    await channels.stop()


async def test_a_failing_channel_is_reported_and_the_other_goes_on(tmp_path: Path) -> None:
    broker = Broker(tmp_path)
    with receiver(status(200)) as server:
        hook = f"http://127.0.0.1:{server.port}/hook"
        settings = Settings(mqtt_url=broker.url, webhook_url=hook)
        channels = Channels(Targets.of(settings, Secrets(webhook_secret="s" * 16)))
        channels.start(with_an_alarm(), SENSORS)
        # A slow name lookup does not delay the shutdown.
        loop, name_server = asyncio.get_running_loop(), threading.Event()
        looking = loop.run_in_executor(None, name_server.wait, PATIENCE_S)
        await until(lambda: channels.status()["mqtt"], "the broker's absence")
        await until(lambda: dict(channels.counts())["lupin_outward_sent"]["webhook"], "a post")
        assert channels.status() == {
            "mqtt": f"[Errno 111] Connection refused ({broker.url})",
            "webhook": "",
        }
        counts = dict(channels.counts())
        assert counts["lupin_outward_connected"] == {"mqtt": 0, "webhook": 1}
        assert counts["lupin_outward_failed"]["mqtt"] >= 1
        assert counts["lupin_outward_waiting"]["mqtt"] == 1
        await channels.stop()
        await loop.shutdown_default_executor()
        assert not looking.done()
        name_server.set()
        await looking
    assert server.posted[0].json["origin"] == "simulated"


SIX = time(6)
SECRETS = Secrets(webhook_secret="s" * 16)


def ns(text: str) -> int:
    return int(datetime.fromisoformat(text).timestamp()) * 10**9


@dataclass
class Greenhouse:
    """A bridge as a report needs it: a clock, and a log that records the queried period."""

    ros_time_ns: int
    criteria: Criteria = field(default_factory=lambda: Criteria.of(Settings(time_zone="UTC")))
    lag_ns: int = 0
    error: Exception | None = None
    checks: int = 0
    origin: str = "robot"
    alarms: Alarms = field(default_factory=Alarms)
    notes: Any = None

    @property
    def source(self) -> Any:
        return self

    def seen(self) -> GreenhouseState:
        return seen(tag("a", temperature=20.0))

    def journal(self) -> Condition:
        self.checks += 1
        complete_ns = self.ros_time_ns - self.lag_ns
        return Condition(JournalState.RECORDING, complete_ns=complete_ns, journal_id="j1")

    async def ask(self, query: Any, _cost_s: float) -> Answered:
        if self.error is not None:
            raise self.error
        of = query.args[0]
        return Answered('"x"', Answer(orjson.dumps([of.start_ns, of.end_ns]), "", {}))


@pytest.fixture(autouse=True)
def in_a_hurry(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(channels, "POLL_S", 0.005)
    for module in (mqtt, webhook):
        monkeypatch.setattr(module, "FIRST_WAIT_S", 0.001)


@asynccontextmanager
async def sending(greenhouse: Greenhouse, port: int) -> AsyncIterator[Webhook]:
    target = Targets.of(Settings(webhook_url=f"http://127.0.0.1:{port}/"), SECRETS).webhook
    assert target is not None
    hook = Webhook(target)
    of: Any = greenhouse
    hook.start(of)
    report = DailyReport(SIX, hook, of)
    report.start()
    try:
        yield hook
    finally:
        await report.stop()
        await hook.stop()


def periods(at: Receiver) -> list[list[int]]:
    return [it.json["report"] for it in at.posted]


@asynccontextmanager
async def begun(
    *answers: Reply, now: str = "2026-05-01T07:00Z"
) -> AsyncIterator[tuple[Greenhouse, Receiver]]:
    """A bridge that has sent the last day, and sends the next ones."""
    greenhouse = Greenhouse(ns(now))
    with receiver(status(200), *answers) as at:
        async with sending(greenhouse, at.port):
            await until(lambda: at.posted, "the last day")
            await checks(greenhouse)
            yield greenhouse, at


async def checks(greenhouse: Greenhouse, count: int = 5) -> None:
    """Wait until it has checked that often and found nothing to do."""
    before = greenhouse.checks
    await until(lambda: greenhouse.checks >= before + count, "more checks")


async def test_each_day_is_sent_once_and_the_last_one_again_after_a_restart() -> None:
    greenhouse = Greenhouse(ns("2026-05-01T07:00Z"))
    with receiver(status(200)) as at:
        async with sending(greenhouse, at.port):
            await until(lambda: at.posted, "the last day")
            await checks(greenhouse)
            greenhouse.ros_time_ns = ns("2026-05-03T06:30Z")
            await until(lambda: len(at.posted) == 3, "the two days since, in order")
            await checks(greenhouse)
        async with sending(greenhouse, at.port):
            await until(lambda: len(at.posted) == 4, "the last day again")
            await checks(greenhouse)
        days = [ns(f"2026-{day}T06:00Z") for day in ("04-30", "05-01", "05-02", "05-03")]
        assert periods(at)[:3] == [days[:2], days[1:3], days[2:]]
        ids = [f"report.2026050{day}T060000Z" for day in (1, 2, 3, 3)]
        assert [it.json["id"] for it in at.posted] == at.ids == ids, "a receiver knows it"
        assert {it.json["change"] for it in at.posted} == {"report"}


async def test_a_day_with_too_much_data_holds_up_no_other(caplog: pytest.LogCaptureFixture) -> None:
    async with begun(status(200)) as (greenhouse, at):
        greenhouse.error = PastRefused("about 200000 scans, the limit is 100000")
        greenhouse.ros_time_ns = ns("2026-05-02T07:00Z")
        await until(lambda: "20260502T060000Z is skipped" in caplog.text, "the word of it")
        greenhouse.error, greenhouse.ros_time_ns = None, ns("2026-05-03T07:00Z")
        await until(lambda: len(at.posted) == 2, "the next one")
    assert periods(at)[1:] == [[ns("2026-05-02T06:00Z"), ns("2026-05-03T06:00Z")]]


async def test_a_report_that_the_receiver_refuses_is_dropped_and_logged(
    caplog: pytest.LogCaptureFixture,
) -> None:
    async with begun(*[status(413)] * MAX_REFUSALS, status(200)) as (greenhouse, at):
        greenhouse.ros_time_ns = ns("2026-05-02T07:00Z")
        await until(lambda: "was given up by webhook" in caplog.text, "that it is given up")
        greenhouse.ros_time_ns = ns("2026-05-03T07:00Z")
        await until(lambda: len(at.posted) == MAX_REFUSALS + 2, "the next day's")
    assert at.posted[-1].json["lost"] == 1


async def test_it_waits_for_the_log_and_reports_why_there_is_none(
    caplog: pytest.LogCaptureFixture,
) -> None:
    async with begun(status(200)) as (greenhouse, at):
        greenhouse.lag_ns = 10 * 10**9
        greenhouse.ros_time_ns = ns("2026-05-02T06:00:05Z")
        await checks(greenhouse)
        assert len(at.posted) == 1
        greenhouse.error = NotRemembered("the disk is gone")
        greenhouse.ros_time_ns = ns("2026-05-02T06:00:20Z")
        await until(lambda: "not sent by webhook: the disk is gone" in caplog.text, "why")
        greenhouse.error = None
        await until(lambda: len(at.posted) == 2, "the report")


async def test_a_clock_that_was_ahead_stops_no_reports_and_simulated_time_has_none(
    caplog: pytest.LogCaptureFixture,
) -> None:
    async with begun(status(200), now="2036-05-01T07:00Z") as (greenhouse, at):
        greenhouse.ros_time_ns = ns("2026-05-02T07:00Z")
        await until(lambda: len(at.posted) == 2, "the report of the true day")
        greenhouse.ros_time_ns = 5_000 * 10**9
        await until(lambda: "the time is simulated" in caplog.text, "why there is none")


@pytest.mark.parametrize(
    ("now", "start", "end"),
    [
        # Clocks go forward on 29 March 2026, and back on 25 October.
        ("2026-03-29T12:00Z", "2026-03-28T05:00Z", "2026-03-29T04:00Z"),
        ("2026-10-25T12:00Z", "2026-10-24T04:00Z", "2026-10-25T05:00Z"),
    ],
)
def test_a_day_is_one_of_the_greenhouses_clock(now: str, start: str, end: str) -> None:
    ended = partial(ended_ns, SIX, ZoneInfo("Europe/Amsterdam"))
    assert ended(ns(now)) == ns(end)
    assert ended(ns(end)) == ns(end)
    assert ended(ns(end) - 1) == ns(start) == ended(ns(end), -1)
    assert ended(ns(start), 1) == ns(end)


def test_days_follow_each_other_without_a_gap_for_a_year() -> None:
    for zone in (ZoneInfo("Europe/Amsterdam"), ZoneInfo("Asia/Kathmandu"), UTC):
        for at in (time(0), time(2, 30), time(23, 59)):
            ended = partial(ended_ns, at, zone)
            end_ns = ended(ns("2026-01-01T12:00Z"))
            for _ in range(370):
                next_ns = ended(end_ns, 1)
                hours = timedelta(seconds=(next_ns - end_ns) / 1e9) / timedelta(hours=1)
                assert 22 < hours < 26
                assert ended(next_ns, -1) == end_ns
                assert ended(next_ns) == next_ns
                end_ns = next_ns


async def test_a_broker_gets_it_once_reachable_and_retains_it(tmp_path: Path) -> None:
    broker = Broker(tmp_path)
    target = Targets.of(Settings(mqtt_url=broker.url, mqtt_prefix="lt"), Secrets()).mqtt
    assert target is not None
    greenhouse = Greenhouse(ns("2026-05-01T07:00Z"))
    channel = Mqtt(target, Mirror(target.topics, SENSORS))
    of: Any = greenhouse
    channel.start(of)
    report = DailyReport(SIX, channel, of)
    report.start()
    try:
        await checks(greenhouse, 1)
        with broker.running():
            with Subscriber(broker) as received:
                await until(lambda: received.last("lt/house/report"), "the report")
            with Subscriber(broker, "lt/house/report") as later:
                await until(lambda: later.last("lt/house/report"), "that it is retained")
                found = later.last("lt/house/report")
        assert found["id"] == "report.20260501T060000Z"
        assert found["report"] == [ns("2026-04-30T06:00Z"), ns("2026-05-01T06:00Z")]
    finally:
        await asyncio.gather(report.stop(), channel.stop())


@pytest.mark.parametrize("text", ["6:00", "24:00", "06:60", "06:00:00", "six"])
def test_an_invalid_hour_is_refused(text: str) -> None:
    settings = Settings(report_at=text, webhook_url=f"http://127.0.0.1:{free_port()}/")
    with pytest.raises(SettingError, match="must be from 00:00 to 23:59"):
        Targets.of(settings, SECRETS)
    with pytest.raises(SettingError, match="has no use"):
        Targets.of(Settings(report_at="06:00"), Secrets())
